"""Text of a report: order of its parts, sentences, safe text."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.answers.browser import Page
from tests.answers.conftest import chain
from tests.answers.hostile_names import HOSTILE, Quoted
from tests.answers.page_checks import (
    blocks_of,
    every_picture_has_words_and_names_of_its_own,
    no_words_lie_over_others,
    rows_of,
    says,
    section_of,
    table_under,
    the_command_runs,
    the_page_needs_nothing_else,
    tidy_finds_nothing,
    words_in,
    words_of,
)
from tolstat.answers.report.first_page import first_page
from tolstat.answers.report.full_report import report_of
from tolstat.answers.report.response_figures import figures_of
from tolstat.answers.report.summary_document import responses_table
from tolstat.document.blocks import Figure, Gallery, Section, Table
from tolstat.model.contract import Outcome
from tolstat.render.screen import as_text
from tolstat.store.run_records import Diagnostics


def first_of(found):
    """What the first page says."""
    return words_in(*first_page(found))


def section_words(found, response):
    """What the section of a response says, its pictures among it."""
    return words_in(section_of(found.document(), response))


def test_the_page_has_its_parts_in_order(report):
    heads = re.findall(r"<h2[^>]*>(.*?)</h2>", report.text)
    heads = [each.replace("<wbr>", "") for each in heads]
    focus = list(report.answer.focus)
    assert focus == list(report.answer.limits) and len(focus) == 5
    assert heads == [
        "Limits", "What to do next", "Contents", "All limits",
        "Tolerances and assumptions", "Summary", "Numbers of the study", *focus,
        "Provenance",
    ]  # fmt: skip
    picture = "Fraction out of limit against what is permitted"
    assert re.findall(r"<h3>(.*?)</h3>", report.text)[0] == picture
    one = section_of(report.document, "extra_loss")
    assert any(isinstance(each, Gallery) for each in one.blocks)
    assert [each.title for each in one.blocks if isinstance(each, Section)] == [
        "Performance", "Mean and sigma", "Main causes of out-of-limit trials",
        "Variance contributions", "Classical answers", "Integration error",
        "Worst trials",
    ]  # fmt: skip
    words = words_in(one)
    assert "of production err more (95 %)" in words
    assert "is no bound for others" in words
    assert "no probability" in words and "root sum square fails" in words
    for said in ("tolstat trial ", "smooth functions", "normal, +-1.2 mm"):
        assert said in report.page.text
    assert "source digest" in report.page.text and "[deviations]" in report.page.text


def test_the_first_page_states_the_number_of_trials_once(report):
    words = words_in(report.document.blocks[0])
    assert words.count("2200 trials done") == 1 and "2200 of 2200" not in words


def test_a_partial_run_with_new_limits_names_no_missing_part(toy, toy_study):
    run = tolstat.run(toy_study, model=toy)
    status = np.where(np.arange(run.trials) < 600, run.status, 0)
    columns = {**run.columns, "status": status.astype(np.uint8)}
    part = replace(
        run, columns=columns, complete=False, audited=None,
        diagnostics=Diagnostics(missing="the run did not come to its end"),
    )  # fmt: skip
    found = report_of(tolstat.limited(part, {"gap": "-1..1.2 mm"}, toy))
    words = words_in(*found.document().blocks)
    assert "requested limits" in words and "of the study's limits:" not in words
    assert len(found.responses["gap"].worst_trials) == 10 and "Worst trials" in words
    missing = "No slopes, worst cases or halved tolerances: the run did not come"
    assert missing in words
    # stopped in its audit: what is stored is said, and how to finish
    ended = replace(run, complete=False)
    found = tolstat.summary(tolstat.limited(ended, {"gap": "-1..1.2 mm"}, toy))
    words = words_in(*found.document().blocks)
    assert "gap -1..1.2 mm; of the study's limits: worst cases" in words
    assert "Finish the run, whose audit or diagnostics are missing: " in words
    assert "tolstat resume" in words and "tolstat extend" not in words


def test_the_page_is_self_contained(report):
    the_page_needs_nothing_else(report)


def test_every_picture_has_alt_text_and_unique_ids(report):
    every_picture_has_words_and_names_of_its_own(report)
    drawn = [each for each in blocks_of(report.document) if isinstance(each, Figure)]
    for each in blocks_of(report.document):
        drawn += each.figures if isinstance(each, Gallery) else ()
    assert len(drawn) == len(report.figures)


def test_no_texts_overlap(report):
    no_words_lie_over_others(report)


def test_tidy_finds_no_error(report):
    tidy_finds_nothing(report.path)


def test_texts_of_a_study_are_escaped(toy_study, tmp_path):
    title = HOSTILE.replace('"', '\\"')
    text = toy_study.read_text().replace('title = "toy"', f'title = "{title}"')
    toy_study.write_text(text)
    named = tmp_path / "a \"b\" <i>'c'.h5"
    run = tolstat.run(toy_study, model=Quoted(), output=named)
    page = report_of(replace(run, diagnostics=Diagnostics(missing=HOSTILE))).html()
    read = Page(page)
    assert "<script" not in page and not {"script", "i", "b"} & set(read.tags)
    assert "&lt;script&gt;" in page and HOSTILE in read.text and named.name in read.text
    assert 'a <b> in "quotes"' in read.text


@pytest.mark.parametrize("approval", ["", "A. Engineer, 2026-11-22"])
def test_the_title_block_is_that_of_the_study(toy, toy_study, approval):
    drawing = "رسم <b>\\u202e 7"  # from right to left, and not to be obeyed
    document = f'project = "P-1"\nauthor = " "\ndrawing = "{drawing}"\n'
    text = toy_study.read_text().replace(
        "[deviations]", f'[document]\n{document}approval = "{approval}"\n[deviations]'
    )
    toy_study.write_text(text)
    found = report_of(tolstat.run(toy_study, model=toy))
    page = found.html()
    assert found.title_block._asdict() == {
        "project": "P-1", "drawing": "رسم <b>\u202e 7", "revision": "", "author": "",
        "approval": approval,
    }  # fmt: skip
    first = page[page.index('<section class="first">') : page.index("</ul>")]
    said = " ".join(Page(first.replace("</small>", "</small> ")).text.split())
    assert "project P-1 drawing رسم <b>\\u202e 7" in said and "author" not in said
    assert ('class="sign"' in page) == (approval == "")
    assert approval in said and "revision" not in said
    # a foot that a style sheet reads: nothing but letters, figures and their codes
    foot = unescape(re.search(r'style="--sheet: ([^"]*)">', page)[1])
    assert re.fullmatch(r'"(\w|\\[0-9a-f]+ )*"', foot)
    assert '"' not in foot[1:-1] and "\\3c " in foot


@pytest.mark.parametrize(
    ("trials", "deviations"),
    [(1, 'part = "+-0.5 mm"'), (20, 'part = "+-0.5 mm"'), (9, "")],
)
def test_a_few_trials_make_a_page(tmp_path, toy, trials, deviations):
    """What cannot be told with one trial is left out, or says why."""
    study = tmp_path / "few.toml"
    head = f'model = "toy"\ntrials = {trials}\nseed = 1\n'
    study.write_text(f"{head}[deviations]\n{deviations}\n[limits]\ngap = '<= 1 mm'\n")
    found = report_of(tolstat.run(study, model=toy))
    page = found.html()
    assert "needs" in page and "undecided" in page
    assert not found.responses["gap"].quantiles[0.95].sure
    path = tmp_path / "few.html"
    path.write_text(page)
    tidy_finds_nothing(path)


def test_indices_without_estimate_state_the_trials_needed(toy, toy_study):
    text = toy_study.read_text().replace('"+-1 mm"', '"+-0.5 mm"')
    toy_study.write_text(f'sampling = "saltelli"\n{text}')
    words = words_in(*report_of(tolstat.run(toy_study, model=toy)).document().blocks)
    assert "No Sobol' indices: needs 500 groups of 5 trials, 2500 in all" in words
    assert "trials = 2500 or more" in words  # among the notes
    enough = tolstat.run(toy_study, model=toy, trials=2500, force=True)
    assert "No Sobol' indices" not in words_in(*report_of(enough).document().blocks)


def test_summed_first_orders_are_no_joint_share(report):
    """Of kinds with more than four parts: a lower end, and so it is labelled."""
    found, seen = report.answer, 0
    for name in found.focus:
        each = found.responses[name]
        known = each.contributions
        for kind, parts in each.members.items():
            if len(parts) <= 4 or known.linear or known.dominated_by_few:
                continue
            share, summed = each.shares_of_kinds[kind], known.groups[kind]
            assert share[:3] == (*summed[:2], 1.0) and summed.upper < 1
            assert "sum of first orders" in section_words(found, name)
            seen += 1
    assert seen


def test_the_first_page_names_main_causes_and_the_remedy(report):
    """For out-of-limit trials, and for the variance: these need not be the same."""
    found = report.answer
    loss, jam = found.responses["extra_loss"], found.responses["jam_share"]
    assert loss.members["rods"] == ("rod_length_1", "rod_length_2")
    assert loss.causes.main is None and loss.causes.reason.startswith("too few (")
    assert jam.causes.main.members == ("rod_length_1", "rod_length_2")
    rows = {
        as_text(row["response"].main): row
        for row in rows_of(table_under(report.document, "Limits"))
    }
    cause = rows["jam_share"]["main cause"]
    apart = "rod_length_1 and rod_length_2 differ: one high, one low"
    assert as_text(cause.main) == apart
    out = jam.causes.trials_out_of_limit
    assert re.fullmatch(
        rf"\d+ of {out} out-of-limit trials in its outer 5 %", as_text(cause.below)
    )
    assert f"{apart} {as_text(cause.below)}; any of them alone in" in (
        section_words(found, "jam_share")
    )
    first = first_of(found)
    remedy = found.findings.remedy
    assert [change.entry for change in remedy.changes] and remedy.commands
    if not first.count("proved by"):
        assert "predicted from these trials" in first
    before = remedy.steps[0].before
    falls = re.search(r"yield, all limits, from (\S+) % to", first)
    assert says(falls[1], 100 * before.value)
    effect = rows["jam_share"]["what would help"]
    named = as_text(effect.main)
    assert remedy.changes[0].entry in named or named == "see the remedy"
    assert as_text(effect.below).endswith(str(remedy.evidence))
    contributions = loss.contributions
    assert contributions.together["rods"].lower > 0.5
    assert contributions.together["gears"].reason.startswith("needs a run with")
    # where no main cause is named stands what has most of the variance
    below = {name: as_text(row["main cause"].below) for name, row in rows.items()}
    assert re.fullmatch(r"variance: gears at least \S+ %", below["shaft_9_moment"])
    for name in set(rows) - {"shaft_9_moment"}:
        each = found.responses[name]
        told = each.causes.main is None and not each.contributions.dominated_by_few
        assert below[name].startswith("variance: ") == told


def test_clipped_contributions_say_of_which_trials_they_are(report):
    """Wherever one stands: first page, summary, figure, table."""
    found, name = report.answer, "shaft_9_moment"
    each = found.responses[name]
    said, told = " of the central 99 %", []
    for clipped in (False, True):
        shares = each.contributions._replace(clipped=clipped)
        changed = replace(each, contributions=shares)
        found = replace(found, responses={**found.responses, name: changed})
        pages = first_of(found), words_in(responses_table(found, [name]))
        told.append([words.count(said) for words in pages])
        assert (f"% of the variance{said}" in section_words(found, name)) == clipped
        figure = next(f for f in figures_of(found, name) if "largest first" in f.alt)
        assert figure.picture.panels[0][0].label.endswith(said) == clipped
    # on the first page once, below the limits
    assert told[1] == [1, told[0][1] + 1]


def test_noise_is_not_plotted_if_few_trials_dominate(report):
    few = {
        name: report.answer.responses[name].contributions.dominated_by_few
        for name in report.answer.focus
    }
    assert few["extra_loss"] and not few["shaft_9_moment"]
    for name, dominate in few.items():
        words = section_words(report.answer, name)
        assert ("Few trials dominate the variance" in words) == dominate
        assert ("Contributions, the largest first" in words) != dominate
        assert ("Not explained by contributors alone" in words) != dominate
        assert ("alone, % of the variance" in words) != dominate
    section = section_of(report.document, "extra_loss")
    contributions = section_of(section, "Variance contributions")
    (parts,) = (each for each in contributions.blocks if isinstance(each, Table))
    rods = next(row for row in parts.rows if as_text(row[0].main) == "rods")
    assert words_of(rods[1]).startswith("at least ")
    together = report.answer.responses["extra_loss"].contributions.together["rods"]
    assert rods[1].main[1].value == together.lower
    # over the rods, that differ among out-of-limit trials, and over nothing else
    words = [words for words, _ in report.figures]
    over = "extra_loss over its leading contributors: "
    (drawn,) = (each.removeprefix(over) for each in words if each.startswith(over))
    assert {*drawn.split(", ")} == {"rod_length_1", "rod_length_2"}


def test_no_bar_is_negative(report):
    bars = [f for words, f in report.figures if words.startswith("Contributions, the")]
    assert bars
    assert all(plot.panels[0].layers[0].values.min() >= 0 for plot in bars)


def test_indices_dominated_by_few_trials_are_not_plotted(toy, toy_study):
    class Jams(type(toy)):
        def evaluate(self, deviations, settings):
            apart = np.abs(deviations[:, 0] - deviations[:, 1]) / 1e-3
            gap = 1e-3 * np.maximum(apart - 1.4, 0)
            both = np.stack([gap, gap], axis=1)
            return Outcome(both, np.ones(len(gap), dtype=np.int64))

    text = toy_study.read_text().replace("trials = 1000", "trials = 5000")
    toy_study.write_text('sampling = "saltelli"\n' + text)
    found = report_of(tolstat.run(toy_study, model=Jams()))
    assert found.responses["gap"].indices.dominated_by_few
    words = section_words(found, "gap")
    assert "No Sobol' indices: few trials dominate the variance" in words
    assert "Contributions, the largest first" not in words


def test_dependent_trials_name_no_cause(toy, toy_study):
    text = toy_study.read_text().replace("trials = 1000", "trials = 1024")
    toy_study.write_text('sampling = "sobol"\n' + text)
    found = report_of(tolstat.run(toy_study, model=toy))
    causes = found.responses["gap"].causes
    assert causes.reason == "for random trials only"
    assert causes.trials_out_of_limit > 0 and causes.contributors == {}
    (row,) = rows_of(table_under(found.document(), "Limits"))
    assert as_text(row["response"].main) == "gap"
    assert as_text(row["main cause"].main) == "causes are named for random trials only"


def test_no_trial_out_of_limit_is_stated_once_for_each_limit(toy, toy_study):
    study = toy_study.read_text().replace("+-1 mm", "+-0.5 mm")
    toy_study.write_text(
        study[: study.index("[limits]")]
        + '[limits]\ngap = "<= 1 m"\nratio = "<= 1e6"\n'
    )
    found = report_of(tolstat.run(toy_study, model=toy))
    rows = rows_of(table_under(found.document(), "Limits"))
    causes = [as_text(row["main cause"].main) for row in rows]
    assert causes == ["no trial out of limit"] * 2
    first = words_in(found.document().blocks[0])
    assert first.count("no trial out of limit") == 2


def test_commands_on_the_page_run_in_its_folder(tmp_path, monkeypatch):
    """The run is named as it was given, and quoted for a shell."""
    monkeypatch.chdir(tmp_path)
    Path("my runs").mkdir()
    run = tolstat.run(chain("<= 2416.9 mm"), output="my runs/gap.h5")
    the_command_runs(tolstat.report(run))

"""Designs of the same trials: differences computed by hand, and refusals."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.answers.page_checks import blocks_of
from tests.conftest import Toy
from tests.store.tampering import resealed
from tolstat.answers.compare.pairing import pair_of
from tolstat.document.blocks import Bullets, Gallery, Paragraph, Table
from tolstat.errors import QuestionError
from tolstat.render.screen import as_text
from tolstat.store.run_records import Stopped


def tables_of(found, title):
    return [
        b
        for b in blocks_of(found.document())
        if isinstance(b, Table) and b.title == title
    ]


@pytest.fixture(scope="module")
def pair(mill, linked):
    return tolstat.compare(mill, linked)


def test_differences_are_trial_by_trial(pair, mill, linked):
    found = json.loads(pair.json())
    (less,) = found["differences"]
    difference = linked.column("rod_force_1") - mill.column("rod_force_1")
    each = less["responses"]["rod_force_1"]
    known = np.quantile(difference, 0.95, method="median_unbiased")
    quantile = each["trial_by_trial"]["quantiles"]["95 %"]["value"]
    assert quantile == pytest.approx(known)
    mean = each["trial_by_trial"]["mean"]["value"]
    assert mean == pytest.approx(difference.mean())
    smaller = int((difference < 0).sum())
    assert each["smaller"]["value"] == smaller / 2200
    low = stats.beta.ppf(0.025, smaller, 2200 - smaller + 1)
    assert each["smaller"]["lower"] == pytest.approx(low)
    assert less["settings"] == {"variant": ["indeterminate", "equalized"]}
    assert less["pairing"]["done_in_both"] == 2200
    assert less["focus"][0] == "extra_loss"
    # a link that shares the load never lets the carriage jam
    assert less["responses"]["jam_share"]["larger"]["value"] == 0


def test_the_screen_shows_the_difference_of_printed_quantiles(pair):
    """That of the quantiles beside it, as a reader takes it."""
    (table,) = tables_of(pair, "Responses")
    heads = [column.head for column in table.columns]
    row = next(row for row in table.rows if row[0].main[0].text == "rod_force_1")
    a, b, less = (
        row[heads.index(head)].main[0].value.value
        for head in ("A: 95 %", "B: 95 %", "B - A: 95 %")
    )
    assert less == pytest.approx(b - a, abs=20)
    known = pair.differences[0].responses["rod_force_1"]
    assert abs(less - known.trial_by_trial.quantiles[0.95].value) > 100
    promise = pair.differences[0].pairing.promise
    text = " ".join(
        as_text(each.parts)
        for each in blocks_of(pair.document())
        if isinstance(each, Paragraph)
    )
    assert "at every look" not in text + promise
    assert "for a single look" in promise and promise in text


def test_differences_are_in_their_columns(pair):
    (table,) = tables_of(pair, "Differences trial by trial")
    (less,) = pair.differences
    assert [column.head for column in table.columns[2:4]] == ["mean", "least"]
    assert table.columns[-1].head == "largest"
    for (name, each), row in zip(less.responses.items(), table.rows, strict=True):
        of = each.trial_by_trial
        assert row[0].main[0].text == name
        numbers = [cell.main[0].value for cell in row[2:]]
        assert numbers == [of.mean, of.least, *of.quantiles.values(), of.largest]


def test_captions_count_trials_of_each_design_or_both(toy, toy_study, tmp_path):
    """B fails where the second part is long too."""

    class Other(type(toy)):
        def evaluate(self, deviations, settings):
            outcome = super().evaluate(deviations, settings)
            long = deviations[:, 1] > 0.8e-3
            return outcome._replace(status=np.where(long, 4, outcome.status))

    A = tolstat.run(toy_study, model=toy, output=tmp_path / "A.h5")
    B = tolstat.run(toy_study, model=Other(), output=tmp_path / "B.h5")
    found = tolstat.compare(A, B)
    both = np.count_nonzero((A.status == 1) & (B.status == 1))
    assert 0 < A.failed < B.failed == 1000 - both
    each = "; ".join(
        f"{name}: {run.counts['done']} trials done, {run.failed} failed"
        for name, run in (("A", A), ("B", B))
    )
    less = f"{both} trials done in A and in B, {1000 - both} failed in either"
    tables = [
        b for b in blocks_of(found.document()) if isinstance(b, Table) and b.caption
    ]
    captions = [as_text(table.caption) for table in tables]
    of_quantiles = "B - A: of quantiles, their difference"
    assert captions == [
        each, less, f"{each}. Differences: {less}. {of_quantiles}", less, each,
    ]  # fmt: skip
    (gallery,) = (b for b in blocks_of(found.document()) if isinstance(b, Gallery))
    for limit in found.differences[0].limits.values():
        assert [x.value for x in limit.fractions_out_of_limit] == [
            tolstat.summary(run).limits["gap"].yields.fraction_out_of_limit.value
            for run in (A, B)
        ]  # each failed trial is out of limit in its own design alone
        assert limit.worse > 0
    said = f"The {both} that are done in both; {1000 - both} failed in either"
    assert said in as_text(gallery.figures[0].caption)


def test_a_run_has_no_difference_from_itself(mill):
    found = tolstat.compare(mill, mill, responses=["yaw"])
    (less,) = found.differences
    for each in less.responses.values():
        assert each.trial_by_trial.least == each.trial_by_trial.largest == 0
        assert each.smaller.value == each.larger.value == 0
        assert not each.limit or each.limit.significant == 0
    assert less.focus == ("yaw",) and less.settings == {}
    (table,) = tables_of(found, "Responses")
    assert table.rows[0][0].main[0].text == "extra_loss"
    assert len(table.columns) == len(table.rows[0])


@pytest.fixture
def other(toy, toy_study, tmp_path):
    """Run the toy study with something else in it."""

    def run(*changes, name="other.h5"):
        text = toy_study.read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        study = tmp_path / "other.toml"
        study.write_text(text)
        return tolstat.run(study, model=toy, output=tmp_path / name, force=True)

    return run


def test_equal_differences_are_plotted(toy, tmp_path):
    """But for rounding: no sixty bars have room between them."""
    runs = []
    for name, mode in (("a", "plain"), ("b", "odd")):
        study = {
            "model": "toy", "trials": 400, "seed": 1, "title": "$\\foo{ x",
            "settings": {"mode": mode}, "deviations": {"part": "+-0.1 mm"},
        }  # fmt: skip
        runs.append(tolstat.run(study, model=toy, output=tmp_path / f"{name}.h5"))
    table = runs[1].path
    with resealed(table) as file:
        file["gap"][...] = np.nextafter(file["gap"][...] + 1e-3, 1)
    page = tolstat.compare(runs[0].path, table, responses=["gap"]).html()
    assert "mathdefault" not in page


def test_trials_that_failed_in_either_are_omitted_and_counted(other):
    base, twice = (
        other(name="base.h5"),
        other(("[limits]", "[settings]\ngain = 4\n[limits]")),
    )
    (less,) = tolstat.compare(base, twice).differences
    failed = base.counts["not finite"]
    assert less.pairing.failed == failed > 0
    gap = less.responses["gap"].trial_by_trial
    assert gap.mean.value == pytest.approx(np.nanmean(base.column("gap")), rel=1e-9)
    assert less.responses["ratio"].trial_by_trial.largest == 0


def test_grids_and_tables_have_no_statistics(toy, tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm", "1 mm"]\n'
    )
    run = tolstat.run(study, model=toy)
    with pytest.raises(QuestionError, match="are no sample: no statistics"):
        pair_of(run, run)


def kind_of(base, other):
    pair = pair_of(base, other)
    return pair.kind, pair.words


def test_pairing_is_found_from_the_deviations(other):
    base = other(name="base.h5")
    assert kind_of(base, base)[0] == "same trials"
    kind, words = kind_of(base, other(("+-1 mm", "+-0.4 mm")))
    assert kind == "common random numbers" and "widths differ: part_1, part_2" in words
    uniform = '{ tolerance = "0..2 mm", distribution = "uniform" }'
    kind, _ = kind_of(base, other(('"+-1 mm"', uniform)))
    assert kind == "common random numbers"
    assert kind_of(base, other(("seed = 1", "seed = 2"))) == (
        "unpaired", "seeds 1 and 2"
    )  # fmt: skip
    sobol = ("[deviations]", 'sampling = "sobol"\n[deviations]')
    kind, words = kind_of(base, other(sobol))
    assert (kind, words) == ("unpaired", "samplings random and sobol")
    # asked what it was drawn from, and not what it says of itself
    liar = other(("seed = 1", "seed = 2"))
    told = replace(liar, sampled=liar.sampled._replace(seed=1))
    assert kind_of(base, told)[0] == "unpaired"


def test_parts_with_different_correlation_are_named(other):
    base = other(name="base.h5")
    correlated = "[correlation]\npart_1 = { part_2 = 0.6 }\n[limits]"
    kind, words = kind_of(base, other(("[limits]", correlated)))
    assert kind == "common random numbers" and words.endswith(
        "correlated parts: part_2"
    )


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin", "saltelli"])
def test_runs_of_different_length_are_paired_if_extensible(other, sampling):
    drawn = ("[deviations]", f'sampling = "{sampling}"\n[deviations]')
    base = other(drawn, name="base.h5")
    more = other(drawn, ("1000", "2000"), ("+-1 mm", "+-0.5 mm"))
    pair = pair_of(base, more)
    if sampling == "latin":
        assert pair.kind == "unpaired" and pair.sample is None
        return
    assert pair.kind == "common random numbers"
    assert f"of both the first {len(pair.first.trials)} trials" in pair.words
    first, second = pair.done("gap")
    assert second == pytest.approx(first / 2)
    limit = limit_of(base, more)
    for run, share in zip((base, more), limit.fractions_out_of_limit, strict=True):
        yields = tolstat.summary(run).limits["gap"].yields
        assert share.value == yields.fraction_out_of_limit.value
    assert limit.fraction_out_of_limit_difference.upper < 0


def test_a_run_that_chose_its_trials_has_the_interval_of_its_report(other):
    base, half = other(name="base.h5"), other(("+-1 mm", "+-0.5 mm"))
    stopped = replace(half, stopped=Stopped(("decide",), True, (1000,), 1000, 0.0))
    fixed, chosen = limit_of(base, half), limit_of(base, stopped)
    first, second = chosen.fractions_out_of_limit
    assert first == fixed.fractions_out_of_limit[0]
    assert second == tolstat.summary(half).limits["gap"].yields.fraction_out_of_limit
    assert chosen.fraction_out_of_limit_difference.upper < 0


def limit_of(first, second):
    (less,) = tolstat.compare(first, second).differences
    return less.responses["gap"].limit


def test_yields_are_compared_by_the_limit_of_each(other):
    base = other(name="base.h5")
    tight = other(("+-1 mm", "+-0.8 mm"), ("-1..2 mm", "-0.5..0.5 mm"))
    found = limit_of(base, tight)
    assert found.limits == ("-1..2 mm", "-0.5..0.5 mm")
    within = [
        (run.column("gap") >= low) & (run.column("gap") <= high)
        for run, low, high in ((base, -1e-3, 2e-3), (tight, -0.5e-3, 0.5e-3))
    ]
    assert found.worse == np.count_nonzero(within[0] & ~within[1]) > 0
    assert found.better == np.count_nonzero(~within[0] & within[1])
    assert found.fractions_out_of_limit[1].value == 1 - within[1].mean()
    less = found.fraction_out_of_limit_difference.value
    assert less == pytest.approx(within[0].mean() - within[1].mean())
    unlimited = other(('[limits]\ngap = "-1..2 mm"\n', ""))
    found = limit_of(base, unlimited)
    assert found.limits == ("-1..2 mm", "-1..2 mm")
    assert found.worse == found.better == 0
    assert limit_of(unlimited, unlimited) is None


def test_unpaired_runs_are_compared_as_independent(other):
    base = other(name="base.h5")
    new = other(("seed = 1", "seed = 2"), ("1000", "700"))
    (less,) = tolstat.compare(base, new).differences
    assert less.pairing.kind == "unpaired"
    each = less.responses["gap"]
    assert each.trial_by_trial is None and each.smaller.reason == "unpaired"
    means = [np.nanmean(run.column("gap")) for run in (base, new)]
    assert each.mean.value == pytest.approx(means[1] - means[0])
    sigma = np.hypot(
        *(np.nanstd(r.column("gap")) / np.sqrt(r.ended) for r in (base, new))
    )
    half = (each.mean.upper - each.mean.lower) / 2
    assert 1.96 * sigma < half < 4 * 1.96 * sigma
    assert (
        each.limit.worse is None
        and each.limit.fraction_out_of_limit_difference.lower < 0
    )


def test_a_page_of_several_runs_says_how_each_is_paired_with_the_first(other, tmp_path):
    base = other(name="base.h5")
    half = other(("+-1 mm", "+-0.5 mm"), name="half.h5")
    new = other(("seed = 1", "seed = 2"), ("1000", "700"))
    found = tolstat.compare(base.path, half, new, responses=["gap"])
    page = found.save(tmp_path / "several.html")
    text = page.read_text()
    for words in (
        "common random numbers (the order", "unpaired (seeds 1 and 2)", "B less A",
        "C less A", "not trial by trial",
    ):  # fmt: skip
        assert words in text
    assert text.count("Worse: ") == text.count("other way round. The interval") == 1
    assert len(tables_of(found, "Differences trial by trial")) == 1
    assert text.count("<svg") == 3 + 1  # of what is unpaired the distributions alone


@pytest.mark.parametrize("sampling", ["sobol", "latin"])
def test_dependent_trials_are_compared_by_their_replicates(other, sampling):
    drawn = ("[deviations]", f'sampling = "{sampling}"\n[deviations]')
    base, half = other(drawn, name="a.h5"), other(drawn, ("+-1 mm", "+-0.5 mm"))
    (less,) = tolstat.compare(base, half).differences
    found = less.responses["gap"]
    assert (
        found.limit.fraction_out_of_limit_difference.upper < 0
        and found.limit.worse == 0
    )
    ppk = found.limit.equivalent_ppk_difference
    assert ppk.reason == found.quantiles[0.95].reason
    assert "random trials only" in ppk.reason


def test_one_run_is_not_compared(mill):
    with pytest.raises(QuestionError, match="up to 26; given: 1"):
        tolstat.compare(mill)


def test_runs_of_two_models_are_refused(toy, toy_study, tmp_path):
    """Both may have a gap."""

    class Other(Toy):
        name = "other"

    text = toy_study.read_text()
    first = tolstat.run(toy_study, model=toy, trials=30, output=tmp_path / "a.h5")
    toy_study.write_text(text.replace('model = "toy"', 'model = "other"'))
    second = tolstat.run(toy_study, model=Other(), trials=30, output=tmp_path / "b.h5")
    with pytest.raises(QuestionError, match="two models, toy and other"):
        pair_of(first, second)


def test_a_ppk_that_differs_is_said_beside_trials_that_do_not(tmp_path):
    def run_of(tolerance):
        study = {
            "model": "dimension_chain", "trials": 3000, "seed": 1,
            "settings": {"gap": "a - b"}, "limits": {"gap": "0..0.4 mm"},
            "links": {
                "a": {"nominal": "10.2 mm", "tolerance": tolerance},
                "b": {"nominal": "10 mm", "tolerance": "+-0.05 mm"},
            },
        }  # fmt: skip
        name = f"{tolerance[2:-3]}.h5"
        return tolstat.run(study, output=tmp_path / name)

    narrower = tolstat.compare(run_of("+-0.1 mm"), run_of("+-0.07 mm"))
    found = narrower.differences[0].findings
    assert found.neither == found.higher_ppk == ("gap",) and not found.lower_ppk
    (lead, *_) = (b for b in blocks_of(narrower.document()) if isinstance(b, Bullets))
    (said,) = map(as_text, lead.items)
    assert said.endswith("; significantly higher Ppk by moments of gap.")

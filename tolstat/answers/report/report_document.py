"""The statistical tolerance report as a document."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tolstat.answers.report.first_page import (
    first_page,
    ranges_figure,
    reading,
    responses_table,
    title_facts,
    variance_sentences,
)
from tolstat.answers.report.report_answer import Assumptions, Report
from tolstat.answers.report.response_section import response_section
from tolstat.document.blocks import (
    Block,
    Bullets,
    Column,
    Document,
    Facts,
    Given,
    Section,
    Table,
    Verbatim,
    note,
    table,
)
from tolstat.document.inline import Number, Parts, listed, text
from tolstat.statistics.intervals.moments import Reach
from tolstat.units.scale import PER_CENT

LONGEST = 60  # letters of a title at the foot of a sheet


def report_document(found: Report) -> Document:
    """Return first page, assumptions, summary, responses in focus, provenance."""
    block, title = found.title_block, found.title
    title = title[:LONGEST] + "..." * (len(title) > LONGEST)
    return Document(
        found.title,
        (
            _first(found),
            assumptions_section(found),
            _summary(found),
            *_numbers(found),
            *(response_section(found, name) for name in found.focus),
            provenance_section(found.provenance),
        ),
        (block.drawing, block.revision, title, found.run),
    )


def _first(found: Report) -> Section:
    trials = found.trials
    counts = f"{trials.by_status['done']} of {trials.requested} trials done"
    started = str(found.provenance["started_at"])
    header = ["Statistical tolerance report", f"model {found.model}", found.run]
    figure, variances = ranges_figure(found), tuple(variance_sentences(found))
    return Section(
        "",
        (
            title_facts(found.title_block),
            note(" · ".join([*header, counts, started])),
            *first_page(found),
            *([Bullets(variances)] if variances else []),
            *([figure] if figure else []),
            *reading(found),
        ),
        role="first",
    )


def assumptions_section(found: Report) -> Section:
    """Say what the numbers rest on."""
    blocks: list[Block] = []
    if found.assumptions.deviations:
        blocks.append(assumed_table(found.assumptions))
    blocks.append(Bullets(tuple(_assumed(found))))
    return Section("Tolerances and assumptions", tuple(blocks), "assumptions")


def assumed_table(given: Assumptions) -> Table:
    """Return distribution and tolerance of each contributor that deviates."""
    rows: list[list[Given]] = [
        [
            name, each.words,
            text(each.scale.number(each.lower), " to ", Number(each.upper, each.scale)),
            each.sentence,
        ]
        for name, each in given.deviations.items()
    ]  # fmt: skip
    columns: list[Column | str] = [
        "contributor", Column("distribution", words=True), "tolerance",
        Column("", words=True),
    ]  # fmt: skip
    return table(columns, rows)


def _assumed(found: Report) -> list[Parts]:
    given, trials = found.assumptions, found.trials
    said = [
        text("All other contributors have no deviation.")
        if len(given.deviations) < len(found.of.contributors)
        else (),
        text(
            "A normal deviation has three sigma in half its tolerance (Cp 1), unless "
            "the study says otherwise. Yields depend on it."
        ),
        _correlation(found),
        text(f"Sampling: {trials.sampling}; {trials.promise}."),
    ]
    if given.settings:
        chosen = [
            f"{name} {each.words}{'' if each.given else ' (default)'}"
            for name, each in given.settings.items()
        ]
        said.append(text("Settings: ", ", ".join(chosen), "."))
    said += [text(each) for each in given.of_the_model]
    said += _judged(found) if found.limited else [text("Nothing is limited.")]
    if given.missing:
        said.append(text(f"No slopes, worst cases or worst trials: {given.missing}."))
    return said


def _correlation(found: Report) -> Parts:
    pairs = [
        f"{a} with {b} {rank}"
        for a, others in found.assumptions.correlation.items()
        for b, rank in others.items()
    ]
    if pairs:
        return text("Rank correlations (Gaussian copula): ", listed(pairs), ".")
    if found.of.independent:
        return text("Deviations are independent.")
    return text("Deviations are independent, except parts of one batch named above.")


def _judged(found: Report) -> list[Parts]:
    """Say how limits are judged."""
    assert found.all_limits
    exact = found.of.sampled is not None and not found.of.sampled.replicates
    rule = text(
        "A limit is met when the whole interval of its yield lies at or above what is "
        "demanded, and not met when it lies below. Failed trials count as out of limit."
    )
    if exact:
        wrongly = found.all_limits.wrongly_met
        chance = text(
            'Each verdict is wrongly "met" with a chance of at most 2.5 %',
            (", one or more of all with at most ", Number(wrongly, PER_CENT, "at_most"))
            if found.all_limits.limits > 1
            else None,
            ". Verdicts are anytime-valid: trials may be added until they fall.",
        )
    else:
        chance = text(
            "Intervals are approximate, from the scatter between replicates. A verdict "
            "holds for a number of trials chosen beforehand."
        )
    return [
        rule,
        chance,
        text("The trials that decide do so with a chance of 80 %."),
        text(
            "Equivalent Ppk: of a normal response with the same fraction out of limit, "
            "half of it at each end where there are two. 1.00 is 1350 ppm at one end."
        ),
        text(
            "Main cause: it differs significantly among out-of-limit trials. Rarer "
            "kinds of trials than those seen may have other causes."
        ),
    ]  # fmt: skip


def _summary(found: Report) -> Section:
    failed = found.trials.failed
    ranged = [each.name for each in found.of.responses if Reach(each.range).known]
    one_in = math.floor(1 / found.trials.unseen)
    outside = text(
        f"Least and largest are those of the trials: at most 1 in {one_in} units ",
        "of those that do not fail " if failed else None,
        "lies outside (95 %).",
    )
    said = text(
        "Below each number stands its 95 % interval, or why there is none. ",
        outside if one_in > 1 else None,
    )
    star = text(
        "* Assumes that no unseen trial lies more than twice the observed range "
        "outside",
        (f"; of {', '.join(ranged)} for any distribution within the declared range")
        if ranged
        else None,
        ".",
    )
    blocks: list[Block] = [responses_table(found), note(said)]
    if found.trials.done:
        blocks.append(note(star))
    if failed and found.trials.done:
        blocks.append(
            note(
                "Mean and sigma are of the trials that do not fail. Quantiles count "
                "failed trials as out of limit where the limit has one end. With two "
                "ends or none the interval holds wherever they stand."
            )
        )
    return Section("Summary", tuple(blocks), "summary")


def _numbers(found: Report) -> list[Section]:
    if not found.numbers:
        return []
    rows: list[list[Given]] = [
        [
            name, Number(each.value, each.scale), each.scale.mark,
            text(each.sentence, f"; {each.caveat}" if each.caveat else None),
        ]
        for name, each in found.numbers.items()
    ]  # fmt: skip
    blocks = (
        table(["number", "value", "unit", Column("", words=True)], rows),
        note("From settings and tolerances alone: equal for all trials, no interval."),
    )
    return [Section("Numbers of the study", blocks, "numbers")]


def provenance_section(given: Mapping[str, object]) -> Section:
    """Say how a run came to be, and show its study."""
    facts = Facts(
        tuple(
            (str(key).replace("_", " "), text(str(value)))
            for key, value in given.items()
            if key != "study"
        )
    )
    study = Section("The study", (Verbatim(str(given["study"])),), level=3)
    return Section("Provenance", (facts, study), "provenance", page_only=True)

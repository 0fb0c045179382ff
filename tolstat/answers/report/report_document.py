"""The statistical tolerance report as a document."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tolstat.answers.report.first_page import (
    INTERVAL,
    first_page,
    ranges_figure,
    reading,
    responses_table,
    title_facts,
)
from tolstat.answers.report.report_answer import Assumptions, Report
from tolstat.answers.report.response_section import response_section
from tolstat.document.blocks import (
    Bullets,
    Document,
    Facts,
    Given,
    Paragraph,
    Section,
    Table,
    Verbatim,
    note,
    shown,
    table_of,
)
from tolstat.document.inline import Number, Parts, listed, say, text
from tolstat.statistics.intervals.moments import Reach
from tolstat.units.scale import PER_CENT

LONGEST = 60  # letters of a title at the foot of a sheet
MOMENTS = (
    "Mean and sigma are of the trials that do not fail. Quantiles count failed trials "
    "as out of limit where the limit has one end. With two ends or none the interval "
    "holds wherever they stand."
)
JUDGED = (
    "A limit is met when the whole interval of its yield lies at or above what is "
    "demanded, and not met when it lies below. Failed trials count as out of limit.",
    "The trials that decide do so with a chance of 80 %.",
    "Equivalent Ppk: of a normal response with the same fraction out of limit, half of "
    "it at each end where there are two. 1.00 is 1350 ppm at one end.",
    "Main cause: it differs significantly among out-of-limit trials. Rarer kinds of "
    "trials than those seen may have other causes.",
)


def report_document(found: Report) -> Document:
    """Return first page, assumptions, summary, responses in focus, provenance."""
    block, title, trials = found.title_block, found.title, found.trials
    title = title[:LONGEST] + "..." * (len(title) > LONGEST)
    counts = f"{trials.by_status['done']} of {trials.requested} trials done"
    first = shown(
        title_facts(block),
        header("Statistical tolerance report", found.model, found.run, counts,
               found.provenance),
        *first_page(found),
        ranges_figure(found),
        reading(found),
    )  # fmt: skip
    sections = shown(
        Section("", first, role="first"),
        _assumptions(found),
        _summary(found),
        _numbers(found),
        *(response_section(found, name) for name in found.focus),
        provenance_section(found.provenance),
    )
    return Document(
        title=found.title,
        blocks=sections,
        foot=(block.drawing, block.revision, title, found.run),
    )


def header(
    what: str, model: str, run: str, counts: str, given: Mapping[str, object]
) -> Paragraph:
    """Say in a line what a sheet is, and of which run."""
    started = str(given["started_at"])
    return note(" · ".join([what, f"model {model}", run, counts, started]))


def _assumptions(found: Report) -> Section:
    """Say what the numbers rest on."""
    said = Bullets(tuple(_assumed(found)))
    blocks = shown(assumed_table(found.assumptions), said)
    return Section("Tolerances and assumptions", blocks, "assumptions")


def assumed_table(given: Assumptions) -> Table:
    """Return distribution and tolerance of each contributor that deviates."""
    rows: list[dict[str, Given]] = [
        {
            "contributor": name,
            "distribution": each.words,
            "tolerance": say(
                "{} to {}",
                each.scale.number(each.lower),
                Number(each.upper, each.scale),
            ),
            "": each.sentence,
        }
        for name, each in given.deviations.items()
    ]
    return table_of(rows, words=["distribution", ""])


def _assumed(found: Report) -> list[Parts]:
    given, trials = found.assumptions, found.trials
    others = len(given.deviations) < len(found.of.contributors)
    said = [
        text("All other contributors have no deviation." if others else None),
        text("A normal deviation has three sigma in half its tolerance (Cp 1), unless "
             "the study says otherwise. Yields depend on it."),
        _correlation(found),
        text(f"Sampling: {trials.sampling}; {trials.promise}."),
    ]  # fmt: skip
    if given.settings:
        chosen = [
            f"{name} {each.words}{'' if each.given else ' (default)'}"
            for name, each in given.settings.items()
        ]
        said.append(text(f"Settings: {', '.join(chosen)}."))
    said += map(text, given.of_the_model)
    said += _judged(found)
    if given.missing:
        said.append(text(f"No slopes, worst cases or worst trials: {given.missing}."))
    return list(filter(None, said))


def _correlation(found: Report) -> Parts:
    pairs = [
        f"{a} with {b} {rank}"
        for a, others in found.assumptions.correlation.items()
        for b, rank in others.items()
    ]
    if pairs:
        return say("Rank correlations (Gaussian copula): {}.", listed(pairs))
    if found.of.independent:
        return text("Deviations are independent.")
    return text("Deviations are independent, except parts of one batch named above.")


def _judged(found: Report) -> list[Parts]:
    """Say how limits are judged."""
    if found.all_limits is None:
        return [text("Nothing is limited.")]
    rule, *others = map(text, JUDGED)
    if found.of.sampled is None or found.of.sampled.replicates:
        chance = text(
            "Intervals are approximate, from the scatter between replicates. A verdict "
            "holds for a number of trials chosen beforehand."
        )
    else:
        wrongly = Number(found.all_limits.wrongly_met, PER_CENT, "at_most")
        chance = say(
            'Each verdict is wrongly "met" with a chance of at most 2.5 %{}. Verdicts '
            "are anytime-valid: trials may be added until they fall.",
            (", one or more of all with at most ", wrongly)
            if found.all_limits.limits > 1
            else None,
        )
    return [rule, chance, *others]


def _summary(found: Report) -> Section:
    failed, done = found.trials.failed, found.trials.done
    ranged = [each.name for each in found.of.responses if Reach(each.range).known]
    one_in = math.floor(1 / found.trials.unseen)
    of = "of those that do not fail " if failed else ""
    outside = (
        f" Least and largest are those of the trials: at most 1 in {one_in} units {of}"
        "lies outside (95 %)."
    )
    within = f"; of {', '.join(ranged)} for any distribution within the declared range"
    star = (
        "* Assumes that no unseen trial lies more than twice the observed range "
        f"outside{within if ranged else ''}."
    )
    blocks = shown(
        responses_table(found),
        note(f"{INTERVAL}, or why there is none.{outside if one_in > 1 else ''}"),
        note(star) if done else None,
        note(MOMENTS) if failed and done else None,
    )
    return Section("Summary", blocks, "summary")


def _numbers(found: Report) -> Section | None:
    rows: list[dict[str, Given]] = [
        {
            "number": name,
            "value": Number(each.value, each.scale),
            "unit": each.scale.mark,
            "": "; ".join(filter(None, (each.sentence, each.caveat))),
        }
        for name, each in found.numbers.items()
    ]
    said = "From settings and tolerances alone: equal for all trials, no interval."
    blocks = (table_of(rows, words=[""]), note(said))
    return Section("Numbers of the study", blocks, "numbers") if rows else None


def provenance_section(given: Mapping[str, object]) -> Section:
    """Say how a run came to be, and show its study."""
    facts = {
        str(key).replace("_", " "): text(str(value)) for key, value in given.items()
    }
    del facts["study"]
    study = Section("The study", (Verbatim(str(given["study"])),), level=3)
    blocks = (Facts(tuple(facts.items())), study)
    return Section("Provenance", blocks, "provenance", page_only=True)

"""The document about a rare run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.answers.cells import ppm
from tolstat.answers.next_steps import to_replay
from tolstat.answers.report.finer_run import settle
from tolstat.answers.report.first_page import INTERVAL, PICTURE, limit_row
from tolstat.answers.report.report_document import assumptions_section, sheet
from tolstat.answers.report.report_warnings import in_words
from tolstat.document import blocks
from tolstat.document.blocks import Cell
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.statistics.limits.yields import INTEGRATION_ERROR, MET
from tolstat.units.scale import PART, PER_CENT, PPM

if TYPE_CHECKING:
    from tolstat.answers.rare.failure_points import FailurePoint
    from tolstat.answers.rare.rare_answer import RareSummary

STAGES = (
    "The first stage has a greater spread, to find out-of-limit trials of any kind. "
    "The search approaches the limit step by step (subset simulation). It moves "
    "out-of-limit trials towards the median deviations, where they are more probable, "
    "and samples about the points reached. The last stage gives the fraction."
)
FIRST_ORDER = (
    "The out-of-limit trials nearest to the median deviations, in normal scores. A "
    "straight limit at the distance of the first would have {} out of limit at this "
    "end. Nearer trials that were not met, and another end of the limit, would add to "
    "it."
)


def rare_document(found: RareSummary) -> blocks.Document:
    """Return verdict, failure points, stages, assumptions, provenance."""
    trials = found.trials
    sampling = (
        f"Sampling: rare; {trials.promise}. A fraction of 1 ppm depends on the "
        "tails of the distributions as much as on the model."
    )
    given = found.assumptions
    said = [text(sampling), *map(text, given.of_the_model)]
    return sheet(
        f"Rare events, {trials.ran} of {trials.requested} trials have run",
        found,
        _verdict(found),
        _failure_points(found),
        _stages(found),
        assumptions_section(given, said),
    )


def _verdict(found: RareSummary) -> tuple[blocks.Block, ...]:
    row = limit_row(
        Cell((Name(found.response),), text(found.sentence)), found.limit,
        Cell((Word(found.verdict, found.verdict),),
             text(f"({found.reason})" if found.reason else None)),
        Cell((ppm(found.fraction_out_of_limit),)),
        found.equivalent_ppk,
    )  # fmt: skip
    said = [_yield(found), _most_probable(found)]
    if found.trials.counted:
        said.insert(0, unmet_kinds(found))
    if found.reason == INTEGRATION_ERROR:
        said.insert(0, settle(found.stored_run, [found.response]))
    if found.plain_trials == found.plain_trials:
        needed = Number(found.plain_trials)
        plain = "A plain run would need about {} trials for as narrow an interval."
        said.append(say(plain, needed))
    trials = found.trials
    notes = [
        say(
            f"{INTERVAL}. The last stage gives the fraction: {{}} "
            f"({found.trials_out_of_limit} out of limit), each weighted by the ratio "
            "of densities. Failed trials count as out of limit.",
            counted(trials.counted, "independent trial"),
        ),
        *map(text, trials.notes),
    ]  # fmt: skip
    if others := [n for n in found.stored_run.limits if n != found.response]:
        words = f"Not judged: {', '.join(others)}. Each needs a separate run."
        notes.append(text(words))
    share, permitted = found.fraction_out_of_limit, 1 - found.limit.demanded
    lead = say("The limit is {}. Out of limit: {}.",
               Word(found.verdict, found.verdict), ppm(share))  # fmt: skip
    drawn = blocks.Range(found.response, share, permitted, found.verdict)
    words = f"Fraction out of limit of {found.response} in ppm"
    ranges = blocks.Ranges(words, (drawn,), PPM, "permitted")
    return blocks.shown(
        in_words(found.warnings),
        blocks.Paragraph(lead, "lead"),
        blocks.table_of([row], look="verdicts"),
        blocks.Section(PICTURE, (ranges,), level=3, page_only=True),
        *map(blocks.paragraph, said),
        *map(blocks.note, notes),
    )


def unmet_kinds(found: RareSummary) -> Parts:
    """Say what interval and verdict hold for, and what they leave out."""
    return say(
        "Interval and verdict hold for the kinds of out-of-limit trials that the last "
        "stage met. A kind that it never met may make up to {}{}.",
        Number(found.trials.unseen, PPM, "at_most"),
        ", more than the limit permits: another seed or a plain run can find it"
        if found.reason and found.verdict == MET else None,
    )  # fmt: skip


def _yield(found: RareSummary) -> Parts:
    """Return the yield, if its digits are below 100 %."""
    share = found.within
    if not share.sure:
        return ()
    lower, upper = (float(x) for x in PER_CENT.interval(*share[:3])[1:])
    if lower < upper and (upper < 100 or share.upper == 1):
        return say("Yield: {}.", Number(share, PER_CENT))
    return ()


def _most_probable(found: RareSummary) -> Parts:
    """Return a sentence on the most probable failure point."""
    if not found.failure_points or not (point := found.failure_points[0]).leading:
        return ()
    scales = found.stored_run.scales
    parts = [
        say("{} {} ({})", Name(name), Number(point.deviations[name], scales[name]),
            _how_far(point, name))
        for name in point.leading
    ]  # fmt: skip
    rest = ", others less than half as far out"
    return say(
        "Most probable failure point that was met: {}{}: "
        f"trial {point.trial}, {{}} sigmas from the median of all deviations.",
        listed(parts), rest if len(point.leading) < len(point.scores) else None,
        Number(point.distance),
    )  # fmt: skip


def _how_far(point: FailurePoint, name: str) -> Parts:
    """Return how far out a part lies, in sigmas if normal."""
    if point.normal(name):
        sign = "+" * (point.off[name] > 0)
        return text(sign, Number(point.off[name]), " sigmas")
    return say("{} of such parts lie farther out", Number(point.farther[name], PART))


def _failure_points(found: RareSummary) -> blocks.Section | None:
    if not found.failure_points:
        return None
    again, scale, run = "to see it again", found.scale, found.stored_run
    rows: list[dict[str, blocks.Given]] = []
    for each in found.failure_points:
        value = Number(each.value, scale) if each.value == each.value else "failed"
        rows.append({
            "trial": Number(each.trial),
            scale.label(found.response): value,
            "sigmas off": Number(each.distance),
            **{
                run.scales[name].label(name): Number(deviation, run.scales[name])
                for name, deviation in each.deviations.items()
            },
            again: Typed(to_replay(run.path, each.trial, run.machine)),
        })  # fmt: skip
    said = blocks.note(say(FIRST_ORDER, Number(found.first_order, PPM)))
    table = blocks.table_of(rows, words=[again], look="dense")
    return blocks.Section("Most probable failure points", (table, said), page_only=True)


def _stages(found: RareSummary) -> blocks.Section:
    rows: list[dict[str, blocks.Given]] = []
    for stage in found.stages:
        numbers = f"{stage.first} to {stage.last}"
        upto = (" to ", Number(stage.largest)) if stage.least != stage.largest else None
        rows.append({
            "stages": numbers if stage.last > stage.first else f"{stage.first}",
            "for": stage.purpose,
            "times the spread": text(Number(stage.least), upto),
            "trials": Number(stage.trials),
            "out of limit": Number(stage.trials_out_of_limit),
            "of these failed": Number(stage.failed),
        })  # fmt: skip
    changed = blocks.note(
        f"Of {found.precise} trials evaluated again more precisely {found.changed} "
        "change sides of the limit."
    )
    return blocks.Section(
        "Stages",
        blocks.shown(
            blocks.table_of(rows),
            blocks.note(STAGES),
            changed if found.precise else None,
        ),
    )

"""What a rare run says, as a document."""

from __future__ import annotations

import math

from tolstat.answers.cells import limit_cell, ppm
from tolstat.answers.next_steps import to_replay
from tolstat.answers.rare.failure_points import FailurePoint
from tolstat.answers.rare.rare_answer import RareSummary, Stage
from tolstat.answers.report.first_page import demanded_ppk, title_facts
from tolstat.answers.report.report_document import (
    assumed_table,
    provenance_section,
)
from tolstat.document.blocks import (
    Block,
    Bullets,
    Cell,
    Column,
    Document,
    Given,
    Section,
    note,
    paragraph,
    table,
)
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    text,
)
from tolstat.units.scale import PART, PER_CENT, PPM

STAGES = (
    "Stage 0 is wide. Stages at 1 times the spread right after it approach the limit "
    "step by step (subset simulation). Later stages sample where out-of-limit trials "
    "were found, or the nearest ones. The last stage tells the fraction."
)


def rare_document(found: RareSummary) -> Document:
    """Return verdict, failure points, stages, assumptions, provenance."""
    trials = found.trials
    block = found.title_block
    header = ["Rare events", f"model {found.model}", found.run]
    header.append(f"{trials.ran} of {trials.requested} trials have run")
    header.append(str(found.provenance["started_at"]))
    first = Section(
        "",
        (
            Section("", (title_facts(found.title_block),), page_only=True),
            note(" · ".join(header)),
            *_verdict(found),
        ),
        role="first",
    )
    return Document(
        found.title,
        (first, *_failure_points(found), _stages(found), *_assumptions(found)),
        (block.drawing, block.revision, found.title, found.run),
    )


def _verdict(found: RareSummary) -> list[Block]:
    row: list[Given] = [
        Cell((Name(found.response),), text(found.sentence)),
        limit_cell(found.limit),
        Word(found.verdict, found.verdict),
        ppm(found.fraction_out_of_limit),
        Cell((Number(found.equivalent_ppk),), demanded_ppk(found.limit)),
    ]
    heads = ["response", "limit", "verdict", "out of limit, ppm", "equivalent Ppk"]
    said = [_yield(found), _most_probable(found), _plain_run(found)]
    others = [name for name in found.of.limits if name != found.response]
    trials = found.trials
    return [
        table(heads, [row], look="verdicts"),
        *(paragraph(each) for each in said if each),
        note(
            "Below each number stands its 95 % interval. The last stage tells the "
            "fraction: ", counted(trials.counted, "independent trial"),
            f" ({found.met} out of limit), each weighted by the ratio of densities. "
            "Failed trials count as out of limit. ",
            unmet_kinds(found) if trials.counted else None,
        ),
        *(note(each) for each in trials.notes),
        *([note(f"Not judged: {', '.join(others)}. Each needs a run of its own.")]
          if others else []),
    ]  # fmt: skip


def unmet_kinds(found: RareSummary) -> Parts:
    """Say what interval and verdict leave out."""
    most = Number(found.trials.unseen, PPM, "at_most")
    return text(
        "Interval and verdict leave out kinds of out-of-limit trials that the last "
        "stage never met: up to ", most, ".",
    )  # fmt: skip


def _yield(found: RareSummary) -> Parts:
    """Say the yield, where its digits are short of 100 %."""
    share = found.within
    if not share.sure:
        return ()
    lower, upper = (float(x) for x in PER_CENT.interval(*share[:3])[1:])
    if lower < upper and (upper < 100 or share.upper == 1):
        return text("Yield: ", Number(share, PER_CENT), ".")
    return ()


def _most_probable(found: RareSummary) -> Parts:
    """Name the most probable failure point."""
    if not found.failure_points or not (point := found.failure_points[0]).leading:
        return ()
    parts = [
        text(
            Name(name), " ", Number(point.deviations[name], found.scales[name]),
            " (", _how_far(point, name), ")",
        )
        for name in point.leading
    ]  # fmt: skip
    rest = ", others less than half as far out"
    return text(
        "Most probable failure point that was met: ", listed(parts),
        rest if len(point.leading) < len(point.scores) else None,
        f": trial {point.trial}, ", Number(point.distance),
        " sigmas from the median of all deviations.",
    )  # fmt: skip


def _how_far(point: FailurePoint, name: str) -> Parts:
    """Say how far out a part lies: of a normal one in sigmas."""
    if point.normal(name):
        sign = "+" * (point.off[name] > 0)
        return text(sign, Number(point.off[name]), " sigmas")
    return text(Number(point.farther[name], PART), " of such parts lie farther out")


def _plain_run(found: RareSummary) -> Parts:
    if math.isnan(found.plain_trials):
        return ()
    return text(
        "A plain run would need about ", Number(found.plain_trials),
        " trials for as narrow an interval.",
    )  # fmt: skip


def _failure_points(found: RareSummary) -> list[Section]:
    if not found.failure_points:
        return []
    heads: list[Column | str] = [
        "trial",
        found.scale.label(found.response),
        "sigmas off",
    ]
    heads += [scale.label(name) for name, scale in found.scales.items()]
    heads.append(Column("to see it again", words=True))
    rows: list[list[Given]] = [
        [
            Number(each.trial),
            Number(each.value, found.scale) if each.value == each.value else "failed",
            Number(each.distance),
            *(Number(each.deviations[n], scale) for n, scale in found.scales.items()),
            Typed(to_replay(found.of.path, each.trial, found.of.machine)),
        ]
        for each in found.failure_points
    ]
    said = note(
        "The out-of-limit trials nearest to the median deviations, in normal scores. A "
        "straight limit at the distance of the first would have ",
        Number(found.first_order, PPM), " out of limit at this end; a nearer trial "
        "that was not met, and another end of the limit, would add to that.",
    )  # fmt: skip
    blocks = (table(heads, rows, look="dense"), said)
    return [Section("Most probable failure points", blocks, page_only=True)]


def _stages(found: RareSummary) -> Section:
    heads = ["stage", "times the spread", "trials", "out of limit", "of these failed"]
    rows: list[list[Given]] = [
        [str(n), _spread(stage), *map(Number, stage[:3])]
        for n, stage in enumerate(found.stages)
    ]
    blocks: list[Block] = [table(heads, rows), note(STAGES)]
    if found.precise:
        blocks.append(note(
            f"Of {found.precise} trials evaluated again more precisely {found.changed} "
            "change sides of the limit."
        ))  # fmt: skip
    return Section("Stages", tuple(blocks))


def _spread(stage: Stage) -> Parts:
    upto = (" to ", Number(stage.largest)) if stage.least != stage.largest else None
    return text(Number(stage.least), upto)


def _assumptions(found: RareSummary) -> list[Section]:
    given = found.assumptions
    said = [
        text(
            f"Sampling: rare; {found.trials.promise}. A fraction of 1 ppm depends on "
            "the tails of the distributions as much as on the model."
        ),
        *(text(each) for each in given.of_the_model),
    ]
    blocks = (assumed_table(given), Bullets(tuple(said)))
    return [
        Section("Assumptions", blocks, page_only=True),
        provenance_section(found.provenance),
    ]

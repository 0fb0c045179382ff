"""What a what-if says: yields, limits and responses of baseline and scenario."""

from __future__ import annotations

from collections.abc import Iterator

from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm
from tolstat.answers.what_if.what_if_answer import ResponseWhatIf, WhatIf
from tolstat.document.blocks import (
    Block,
    Column,
    Document,
    Given,
    Paragraph,
    Table,
    note,
    paragraph,
    table,
)
from tolstat.document.inline import Name, Number, Word, counted, text
from tolstat.statistics.summary import QUANTILES
from tolstat.units.scale import PER_CENT, share_words

ON_SCREEN = (0.5, 0.95)  # quantiles
BASELINE, SCENARIO = "baseline", "scenario"


def what_if_document(found: WhatIf) -> Document:
    """Return the document of a what-if: what changes first."""
    blocks: list[Block] = [_yield(found), _scenario(found)]
    if found.yield_all_limits:
        blocks += _limits(found)
    blocks += [_responses(found), _trials_left(found), *_notes(found)]
    return Document(f"{found.title}: what if", tuple(blocks), (found.run, found.model))


def _yield(found: WhatIf) -> Paragraph:
    """Lead with the yield of all limits, before and after."""
    both = found.yield_all_limits
    if both is None:
        return Paragraph(text("The study limits no response."), "lead")
    before, after = (Number(each.within, PER_CENT) for each in both)
    whose = "all limits" if both.baseline.limits > 1 else "this limit"
    return Paragraph(text(f"Yield, {whose}: ", before, " -> ", after, "."), "lead")


def _scenario(found: WhatIf) -> Paragraph:
    """Say what changes."""
    both = {name: (of.baseline, of.scenario) for name, of in found.changes.items()}
    return paragraph("Baseline -> scenario: ", changes(both), ".")


def _limits(found: WhatIf) -> Iterator[Table]:
    """Return limits with their verdicts, and other forms of the same."""
    each = [
        (side, of.limited)
        for name, response in found.responses.items()
        for side, of in (
            ((Name(name), BASELINE), response.baseline),
            ((None, SCENARIO), response.scenario),
        )
        if of.limited
    ]
    yield table(
        ["response", "", "limit", "verdict", "out of limit, ppm", "equivalent Ppk"],
        [
            [
                *side,
                limit_cell(limited.limit) if side[0] else None,
                Word(limited.yields.verdict, limited.yields.verdict),
                ppm(limited.yields.out_of_limit),
                ppk_cell(limited.equivalent),
            ]
            for side, limited in each
        ],
        "Limits",
        caption=text(counted(found.trials, "trial"), "; failed ones are out of limit"),
        keys=2,
        look="verdicts",
    )
    yield table(
        ["response", "", "yield, %", "Ppk by percentiles", "Ppk by moments"],
        [
            [
                *side,
                Number(limited.yields.least, PER_CENT),
                ppk_cell(limited.percentiles.ppk),
                ppk_cell(limited.moments.ppk),
            ]
            for side, limited in each
        ],
        "Yields and Ppk",
        keys=2,
        look="dense",
        page_only=True,
    )


def _responses(found: WhatIf) -> Table:
    limited = {n: x for n, x in found.responses.items() if x.scenario.limited}
    shares = [Column(share_words(q), page_only=q not in ON_SCREEN) for q in QUANTILES]
    return table(
        [
            "response", "unit", "", Column("nominal", page_only=True),
            Column("mean", page_only=True), Column("sigma", page_only=True), *shares,
        ],
        [
            row
            for name, each in {**limited, **found.responses}.items()
            for row in _response_rows(name, each)
        ],
        "Responses",
        keys=3,
        look="dense",
    )  # fmt: skip


def _response_rows(name: str, each: ResponseWhatIf) -> Iterator[list[Given]]:
    heads: tuple[list[Given], ...] = (
        [Name(name), each.scale.mark, BASELINE, Number(each.nominal, each.scale)],
        [None, None, SCENARIO, None],
    )
    for head, of in zip(heads, (each.baseline, each.scenario), strict=True):
        numbers = (of.mean, of.sigma, *(of.quantiles[share] for share in QUANTILES))
        yield [*head, *(Number(x, each.scale) for x in numbers)]


def _trials_left(found: WhatIf) -> Table:
    return table(
        ["contributor", "effective sample size, % of trials"],
        [
            [Name(name), Number(each.fraction_left, PER_CENT)]
            for name, each in found.changes.items()
        ],
        "Each change alone",
        caption=text("All other deviations, batches and correlations stay."),
    )


def _notes(found: WhatIf) -> Iterator[Paragraph]:
    """Say what must be known to read the numbers."""
    yield note(
        "Nothing was simulated: ", counted(found.trials, "stored trial"),
        ", reweighted, have an effective sample size of ",
        Number(found.effective_sample_size), ".",
    )  # fmt: skip
    for said in found.notes:
        yield note(said)
    yield note(
        "Below each number stands its 95 % interval: of fractions out of limit from "
        "weighted counts, of all others for any distribution. Fractions and verdicts "
        "of the baseline are anytime-valid, those of the scenario for a single look. "
        "So they may differ where the trials do not."
    )

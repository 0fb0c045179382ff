"""A comparison for the screen: two tables and what must be known to read them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from string import ascii_uppercase
from typing import NamedTuple

from tolstat.answers.compare.comparison import Comparison, Comparisons
from tolstat.answers.compare.pairing import MACHINES, UNPAIRED
from tolstat.answers.report.summary_table import Cell, estimate_in_words
from tolstat.render.plain import share_words
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, PER_CENT, Scale

LABELS = ascii_uppercase


class ComparisonTable(NamedTuple):
    """The tables of a comparison for the screen; cells as of `SummaryTable`."""

    title: str
    heads: list[str]
    rows: list[list[Cell]]
    limit_heads: list[str]
    limit_rows: list[list[Cell]]
    notes: list[str]


def comparison_table(found: Comparisons) -> ComparisonTable:
    """Summarize runs, each compared with the first, in the units of the first study.

    Parameters
    ----------
    found : Comparisons
        What is said of them.
    """
    each, share = found.comparisons, share_words(0.95)
    other = LABELS[1] if len(each) == 1 else "it"
    same = all(one.trials.kind == MACHINES for one in each)
    words = "the same machines" if same else "designs compared"
    return ComparisonTable(
        f"{words}, {'B' if len(each) == 1 else 'each'} less A",
        ["response", "unit", f"A: {share}", f"{other}: {share}",
         f"{other} - A: median", f"{other} - A: {share}", f"% smaller in {other}"],
        list(_rows(each)),
        ["response", "limit", "% beyond", "less A", "worse", "better",
         "as Ppk", "less A"],
        list(_limit_rows(each)),
        list(_notes(each)),
    )  # fmt: skip


def _rows(each: tuple[Comparison, ...]) -> Iterator[list[Cell]]:
    for name in dict.fromkeys(name for one in each for name in one.responses):
        for label, one in zip(LABELS[1:], each, strict=False):
            if name not in one.responses:
                continue
            known = one.responses[name]
            cells = [
                estimate_in_words(estimate, known.scale)
                for estimate in (
                    known.first.quantiles[0.95],
                    known.second.quantiles[0.95],
                    *known.shift.quantiles.values(),
                )
            ]
            smaller = _or_why(known.smaller, PER_CENT)
            row = name if len(each) == 1 else f"{name} {label}"
            yield [row, known.scale.mark, *cells, smaller]


def _limit_rows(each: tuple[Comparison, ...]) -> Iterator[list[Cell]]:
    for name in dict.fromkeys(name for one in each for name in one.responses):
        alone = True
        for label, one in zip(LABELS[1:], each, strict=False):
            known = one.responses[name].yields if name in one.responses else None
            if known is None:
                continue
            beyond = [estimate_in_words(share, PER_CENT) for share in known.beyond]
            ppk = [estimate_in_words(ppk, AS_IS) for ppk in known.ppk]
            if alone:
                yield [f"{name} A", known.limits[0], beyond[0], "", "", "", ppk[0], ""]
                alone = False
            changes = ["" if n is None else str(n) for n in (known.worse, known.better)]
            yield [
                f"{name} {label}", known.limits[1], beyond[1],
                estimate_in_words(known.beyond_more, PER_CENT), *changes,
                ppk[1], _or_why(known.ppk_more, AS_IS),
            ]  # fmt: skip


def _or_why(estimate: Estimate, scale: Scale) -> Cell:
    """Write an estimate, or why there is none."""
    if math.isnan(estimate.value):
        return estimate.reason
    return estimate_in_words(estimate, scale)


def _notes(each: tuple[Comparison, ...]) -> Iterator[str]:
    """Say what was compared, and what must be known to read it."""
    first = each[0].first
    yield f"A: {first.run}, {first.done} done, {first.failed} failed"
    for label, one in zip(LABELS[1:], each, strict=False):
        second, trials = one.second, one.trials
        text = f"{label}: {second.run}, {second.done} done, {second.failed} failed; "
        text += f"{trials.kind} as in A ({trials.words})"
        if trials.kind == UNPAIRED:
            text = text.replace(" as in A", "")
        else:
            text += f"; {trials.done_in_both} of {trials.asked} trials done in both"
        yield text
        yield f"settings that differ: {_listed(one.settings) or 'none'}"
        if one.deviations:
            yield f"deviations that differ: {_listed(one.deviations)}"
    yield (
        f"with each number its 95 % interval; {each[0].trials.promise}; worse, better: "
        "machines within in A and beyond here, and the other way round"
    )
    other = LABELS[1] if len(each) == 1 else "it"
    yield f"{other} - A: the difference of both medians, and of both 95 % values"


def _listed(differing: Mapping[str, tuple[str, str]]) -> str:
    """Write what differs, those together that differ alike."""
    alike: dict[tuple[str, str], list[str]] = {}
    for name, both in differing.items():
        alike.setdefault(both, []).append(name)
    return "; ".join(
        f"{', '.join(names)}: {a or 'none'} and {b or 'none'}"
        for (a, b), names in alike.items()
    )

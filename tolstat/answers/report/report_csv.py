"""Answers as tables for spreadsheets: a row for each response, units in the heads."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from tolstat.render.plain import csv_text, share_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.summary import QUANTILES, Limited, Summary
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    from tolstat.answers.compare.comparison import Comparisons, ResponseCompared

FIGURES = 12  # what is left when units are converted
UNIT, PER_CENT, PPM, PLAIN = "[unit]", "[%]", "[ppm]", ""
NONE = Estimate(math.nan)
TIMES = {PER_CENT: 100.0, PPM: 1e6, PLAIN: 1.0}

Cells = Iterator[tuple[str, Any]]  # heads, and what stands under them


def comparison_csv(found: Comparisons) -> str:
    """Write runs compared with the first as a table; as `report_csv`.

    Parameters
    ----------
    found : Comparisons
        A row for each response of each run but the first; shares are at one look.
    """
    return _table(
        {
            "first": one.first.run,
            "second": one.second.run,
            "machines": one.trials.kind,
            **_known(name, each.scale),
            **dict(_compared(each)),
            "first: trials done": one.first.done,
            "first: trials failed": one.first.failed,
            "second: trials done": one.second.done,
            "second: trials failed": one.second.failed,
        }
        for one in found.comparisons
        for name, each in one.responses.items()
    )


def _table(rows: Iterable[Mapping[str, Any]]) -> str:
    """Write rows that have the same heads."""
    told = list(rows)
    return csv_text(told[0], [list(each.values()) for each in told])


def _known(name: str, scale: Scale) -> dict[str, str]:
    return {"response": name, "unit": scale.shown}


def _of(words: str, cells: Cells) -> Cells:
    return ((f"{words}: {head}", value) for head, value in cells)


def _nominal(value: float, scale: Scale) -> Cells:
    yield f"nominal {UNIT}", _figures(scale.factor * value)


def _numbers(each: Summary, scale: Scale) -> Cells:
    factor = scale.factor
    yield from _estimate("mean", each.mean, UNIT, factor)
    yield from _estimate("sigma", each.sigma, UNIT, factor)
    yield f"least {UNIT}", _figures(factor * each.least)
    for share in QUANTILES:
        yield from _estimate(share_words(share), each.quantiles[share], UNIT, factor)
    yield f"largest {UNIT}", _figures(factor * each.largest)


def _against(limited: Limited | None, scale: Scale) -> Cells:
    """Write what is said of a limit; empty cells where there is none."""
    yields = limited.yields if limited else None
    yield from _limit(
        limited.limit if limited else None, yields.verdict if yields else "", scale
    )
    yield from _estimate("within", yields.least if yields else NONE, PER_CENT)
    yield from _estimate("beyond", yields.out_of_limit if yields else NONE, PPM)
    yield from _estimate("as Ppk", limited.equivalent if limited else NONE, PLAIN)
    by_percentiles = limited.percentiles.ppk if limited else NONE
    yield from _estimate("Ppk by percentiles", by_percentiles, PLAIN)


def _limit(limit: Limit | None, verdict: str, scale: Scale) -> Cells:
    ends = limit.permitted if limit else (math.nan, math.nan)
    for side, end in zip(("lower", "upper"), ends, strict=True):
        known = end if math.isfinite(end) else math.nan
        yield f"{side} limit {UNIT}", _figures(scale.factor * known)
    demanded = limit.demanded if limit else math.nan
    yield f"demanded {PER_CENT}", _figures(100 * demanded)
    yield "verdict", verdict


def _compared(each: ResponseCompared) -> Cells:
    """Write both sides, by how much they differ, and what their limits make of that."""
    factor, yields, less = each.scale.factor, each.yields, "second less first"
    for words, side in (("first", each.first), ("second", each.second)):
        yield from _of(words, _nominal(side.nominal, each.scale))
        yield from _of(words, _numbers(side, each.scale))
    yield from _estimate(f"{less}: mean", each.shift.mean, UNIT, factor)
    for share, shift in each.shift.quantiles.items():
        yield from _estimate(f"{less}: {share_words(share)}", shift, UNIT, factor)
    yield from _estimate("smaller in second", each.smaller, PER_CENT)
    yield from _estimate("larger in second", each.larger, PER_CENT)
    for i, words in enumerate(("first", "second")):
        yield f"{words}: limit", yields.limits[i] if yields else ""
        beyond = yields.beyond[i] if yields else NONE
        yield from _estimate(f"{words}: beyond", beyond, PPM)
        ppk = yields.ppk[i] if yields else NONE
        yield from _estimate(f"{words}: as Ppk", ppk, PLAIN)
    yield from _estimate(f"{less}: beyond", yields.beyond_more if yields else NONE, PPM)
    yield from _estimate(f"{less}: as Ppk", yields.ppk_more if yields else NONE, PLAIN)
    for head in ("worse", "better"):
        count = getattr(yields, head) if yields else None
        yield head, "" if count is None else count


def _estimate(
    name: str, estimate: Estimate, unit: str, factor: float | None = None
) -> Cells:
    times = TIMES[unit] if factor is None else factor
    for head, value in zip(
        (name, f"{name} lower", f"{name} upper"), estimate[:3], strict=True
    ):
        yield f"{head} {unit}".strip(), _figures(times * value)


def _figures(value: float) -> float | str:
    """Return a number without the noise of its conversion; nothing for none."""
    if math.isnan(value):
        return ""
    return float(f"{value:.{FIGURES}g}")

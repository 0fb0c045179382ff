"""The report's numbers as a table for spreadsheets: a row for each response."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from tolstat.reporting.findings import Findings, ResponseFindings
from tolstat.reporting.plain import csv_text, share_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.summary import QUANTILES, Limited

FIGURES = 12  # what is left when units are converted
UNIT, PER_CENT, PPM, PLAIN = "[unit]", "[%]", "[ppm]", ""
TIMES = {PER_CENT: 100.0, PPM: 1e6, PLAIN: 1.0}

Cells = Iterator[tuple[str, Any]]  # heads, and what stands under them


def report_csv(found: Findings) -> str:
    """Write what a report says of each response as a table.

    Parameters
    ----------
    found : Findings
        Of a run.

    Returns
    -------
    str
        CSV. The column "unit" says what [unit] in the heads is; other units stand
        there. Each estimate is followed by the ends of its 95 % interval. A cell is
        empty where there is no such number.
    """
    rows = []
    for name, each in found.responses.items():
        told: dict[str, Any] = {
            "title": found.title, "response": name, "unit": each.scale.shown,
        }  # fmt: skip
        told |= dict(_numbers(each))
        told["trials done"] = found.trials.done
        told["trials failed"] = found.trials.failed
        rows.append(told)
    return csv_text(rows[0], [list(told.values()) for told in rows])


def _numbers(each: ResponseFindings) -> Cells:
    factor = each.scale.factor
    yield f"nominal {UNIT}", _figures(factor * each.nominal)
    yield from _estimate("mean", each.mean, UNIT, factor)
    yield from _estimate("sigma", each.sigma, UNIT, factor)
    yield f"least {UNIT}", _figures(factor * each.least)
    for share in QUANTILES:
        yield from _estimate(share_words(share), each.quantiles[share], UNIT, factor)
    yield f"largest {UNIT}", _figures(factor * each.largest)
    yield from _against(each.limited, factor)


def _against(limited: Limited | None, factor: float) -> Cells:
    """Write what is said of a limit; empty cells where there is none."""
    none = Estimate(math.nan)
    ends = limited.limit.permitted if limited else (math.nan, math.nan)
    for side, end in zip(("lower", "upper"), ends, strict=True):
        known = end if math.isfinite(end) else math.nan
        yield f"{side} limit {UNIT}", _figures(factor * known)
    demanded = limited.limit.demanded if limited else math.nan
    yield f"demanded {PER_CENT}", _figures(100 * demanded)
    yield "verdict", limited.yields.verdict if limited else ""
    yields = limited.yields if limited else None
    yield from _estimate("within", yields.least if yields else none, PER_CENT)
    yield from _estimate("beyond", yields.beyond if yields else none, PPM)
    yield from _estimate("as Ppk", limited.equivalent if limited else none, PLAIN)
    by_percentiles = limited.percentiles.ppk if limited else none
    yield from _estimate("Ppk by percentiles", by_percentiles, PLAIN)


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

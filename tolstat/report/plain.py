"""Estimates as plain data, and back."""

from __future__ import annotations

import math
from typing import Any

from tolstat.statistics.estimate import Estimate

Found = dict[str, Any]


def estimate(found: Estimate) -> Found:
    """Return an estimate as plain data."""
    return {
        "value": number(found.value),
        "lower": number(found.lower),
        "upper": number(found.upper),
        "reason": found.reason,
    }


def number(value: float) -> float | None:
    """Return a plain number; None for NaN. Infinite ones stay: Ppk may be."""
    return None if math.isnan(value) else float(value)


def share_words(share: float) -> str:
    """Name a quantile: 0.00135 is "0.135 %"."""
    return f"{100 * share:.10g} %"


def estimate_from(found: Found) -> Estimate:
    """Return plain data as the estimate that it was."""
    value, lower, upper = (
        math.nan if found[key] is None else found[key]
        for key in ("value", "lower", "upper")
    )
    return Estimate(value, lower, upper, found["reason"])

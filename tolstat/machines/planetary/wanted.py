"""What is asked of the synthesis, and what cannot be asked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from tolstat.errors import ModelError
from tolstat.machines.planetary.scheme import Scheme, ratio, scheme_of

WHEELS = ("z1", "z2", "z3", "z4")
STEEPEST = 1.5  # helix angle, rad
MOST_TEETH = 10_000
MOST_TRIPLES = 500_000_000  # of z1, z2, z3: some minutes


class Wanted(NamedTuple):
    """What a gear shall be; see `tolstat.machines.planetary.designs`."""

    scheme: str
    ratio: float
    ratio_tolerance: float
    satellites: int
    z1: Sequence[float]
    z2: Sequence[float]
    z3: Sequence[float]
    z4: Sequence[float]
    helix: Sequence[float]
    module: float = 1.0
    module_ratio: float = 1.0
    addendum: float = 1.0

    @property
    def teeth(self) -> list[tuple[int, int]]:
        """Fewest and most teeth of each wheel."""
        return [(int(low), int(high)) for low, high in self[4:8]]


def checked(wanted: Wanted) -> Scheme:
    """Return the scheme that is asked for.

    Raises
    ------
    ModelError
        If a range is none, or no gear of the scheme or of these teeth has the ratio.
    """
    scheme = scheme_of(wanted.scheme)
    for name in ("ratio", "ratio_tolerance", "satellites", "module", "module_ratio",
                 "addendum"):  # fmt: skip
        value = getattr(wanted, name)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not abs(value) < 1e9:
            raise ModelError(f"{name} = {value!r}: a number is expected, SI")
    for wheel in WHEELS:
        ends = getattr(wanted, wheel)
        whole = _is_range(ends) and all(z == int(z) for z in ends)
        if not whole or not 1 <= ends[0] <= ends[1] <= MOST_TEETH:
            raise ModelError(
                f"{wheel} = {ends!r}: fewest and most teeth are expected, as (17, 60), "
                f"up to {MOST_TEETH}"
            )
    if not _is_range(wanted.helix) or wanted.helix[0] < 0 or wanted.helix[1] > STEEPEST:
        raise ModelError(
            f"helix = {wanted.helix!r}: least and greatest angle are expected, in rad "
            f"from 0 to {STEEPEST}, such as (0.14, 0.52)"
        )
    k = wanted.satellites
    if k < 2 or k != int(k):
        raise ModelError(f"satellites = {k!r}: a whole number from 2 is expected")
    for name in ("module", "module_ratio"):
        if not 0 < getattr(wanted, name) < math.inf:
            raise ModelError(f"{name} = {getattr(wanted, name)!r}: it must be above 0")
    for name in ("ratio_tolerance", "addendum"):
        if not 0 <= getattr(wanted, name) < math.inf:
            raise ModelError(
                f"{name} = {getattr(wanted, name)!r}: 0 or more is expected"
            )
    triples = math.prod(high - low + 1 for low, high in wanted.teeth[:3])
    if triples > MOST_TRIPLES:
        raise ModelError(
            f"{triples} sets of z1, z2, z3 are too many to be looked at, at most "
            f"{MOST_TRIPLES} would do: narrow their ranges"
        )
    _check_reach(wanted, scheme)
    return scheme


def _is_range(ends: Any) -> bool:
    """Tell two finite numbers, the lower first."""
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError, OverflowError):
        return False
    if any(isinstance(end, str) for end in ends):
        return False
    return -math.inf < low <= high < math.inf


def _check_reach(wanted: Wanted, scheme: Scheme) -> None:
    """Refuse a ratio that no teeth in the ranges have."""
    i, slack = wanted.ratio, wanted.ratio_tolerance * abs(wanted.ratio)
    if scheme.s12 == scheme.s34:
        possible, words = i < 1 and i != 0, "below 1 and not 0"
    else:
        possible, words = i > 1, "above 1"
    if not possible or not math.isfinite(i):
        raise ModelError(f"ratio {i:g}: the scheme {wanted.scheme} has ratios {words}")
    (low1, high1), (low2, high2), (low3, high3), (low4, high4) = wanted.teeth
    ends = (
        ratio(scheme, low1, high2, low3, high4),
        ratio(scheme, high1, low2, high3, low4),
    )
    # a hair more: an end belongs to its range
    slack += 1e-9 * abs(i)
    if max(ends) < i - slack or i + slack < min(ends):
        raise ModelError(
            f"ratio {i:g}: with these ranges of teeth the scheme {wanted.scheme} has "
            f"ratios from {min(ends):.6g} to {max(ends):.6g}; widen them"
        )

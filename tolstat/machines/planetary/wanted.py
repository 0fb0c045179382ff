"""What is asked of the synthesis, and what cannot be asked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from tolstat.errors import ModelError
from tolstat.machines.planetary.scheme import Scheme, ratio, scheme_of
from tolstat.model.setting_kinds import Number

WHEELS = ("z1", "z2", "z3", "z4")
STEEPEST = 1.5  # helix angle, rad
MOST_TEETH = 10_000
MOST_TRIPLES = 500_000_000  # of z1, z2, z3: some minutes
NUMBERS = {
    "ratio": Number(),
    "ratio_tolerance": Number(at_least=0),
    "satellites": Number(at_least=2, whole=True),
    "module": Number(above=0),
    "module_ratio": Number(above=0),
    "addendum": Number(at_least=0),
}
TEETH = Number(at_least=1, at_most=MOST_TEETH, whole=True)
HELIX = Number(at_least=0, at_most=STEEPEST)


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
    for name, kind in NUMBERS.items():
        value = getattr(wanted, name)
        try:
            kind.checked(value)
        except ModelError as error:
            raise ModelError(f"{name} = {value!r}: {error}") from None
    for wheel in WHEELS:
        words = f"fewest and most teeth are expected, as (17, 60), up to {MOST_TEETH}"
        _check_range(wanted, wheel, TEETH, words)
    words = "least and greatest angle are expected, in rad from 0 to "
    _check_range(wanted, "helix", HELIX, f"{words}{STEEPEST}, such as (0.14, 0.52)")
    triples = math.prod(high - low + 1 for low, high in wanted.teeth[:3])
    if triples > MOST_TRIPLES:
        raise ModelError(
            f"{triples} sets of z1, z2, z3 are too many to be looked at, at most "
            f"{MOST_TRIPLES} would do: narrow their ranges"
        )
    _check_reach(wanted, scheme)
    return scheme


def _check_range(wanted: Wanted, name: str, kind: Number, words: str) -> None:
    """Refuse what is not two numbers of a kind, the lower first."""
    ends = getattr(wanted, name)
    try:
        low, high = (kind.checked(end) for end in ends)
    except (TypeError, ValueError):
        low, high = 1, 0
    if low > high:
        raise ModelError(f"{name} = {ends!r}: {words}")


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

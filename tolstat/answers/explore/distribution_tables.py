"""Distributions as tables: deviations in half widths of their zone, by normal score."""

from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.answers.explore.interval_tables import EVERY
from tolstat.answers.explore.packed import packed
from tolstat.arrays import Array
from tolstat.deviations.density_ratio import SCORES
from tolstat.deviations.distributions import (
    Distribution,
    Normal,
    Tolerance,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from tolstat.deviations.spread import PLACES, WIDTHS, spread_of, zone_of
from tolstat.study.distribution_entry import KEYS, OF_THE_TOLERANCE

UNIT = Tolerance(-1.0, 1.0)
EQUAL = 1e-9  # half widths


def tolerance_of(distribution: Distribution) -> Tolerance:
    """Return the zone of a distribution that has one, SI."""
    zone = zone_of(distribution)
    assert zone is not None
    return zone


def standard_deviations(distribution: Distribution) -> Array:
    """Return deviations at `SCORES`, in half widths of the zone from its middle."""
    zone = tolerance_of(distribution)
    return (distribution.deviations(ndtr(SCORES)) - zone.middle) / zone.half


class Kind(NamedTuple):
    """A distribution that a page offers."""

    label: str
    keys: dict[str, Any]  # of a study, beside the tolerance
    distribution: Distribution


OFFERED = {
    "normal": Kind("normal, Cp 1", {}, Normal(UNIT)),
    "normal_133": Kind("normal, Cp 1.33", {"cp": 1.33}, Normal(UNIT, cp=1.33)),
    "screened": Kind(
        "normal, screened",
        {"distribution": "truncated_normal", "outside": "screened"},
        TruncatedNormal(UNIT, outside="screened"),
    ),
    "uniform": Kind("uniform", {"distribution": "uniform"}, Uniform(UNIT)),
    "triangular": Kind("triangular", {"distribution": "triangular"}, Triangular(UNIT)),
}


def distribution_table(kind: Kind) -> dict[str, Any]:
    """Return a kind as data; without densities where parts have equal deviations."""
    deviations = standard_deviations(kind.distribution)
    increasing = bool(np.all(np.diff(deviations) > 0))
    slope = np.gradient(deviations, SCORES) if increasing else None
    spread, zone = spread_of(kind.distribution), tolerance_of(kind.distribution)
    return {
        "label": kind.label,
        "keys": kind.keys,
        "mean": (spread.mean - zone.middle) / zone.half,
        "sigma": spread.sigma / zone.half,
        "deviations": packed(deviations[::EVERY], "f8"),
        "log_slope": None if slope is None else packed(np.log(slope)[::EVERY], "f8"),
    }


def offered_kind(distribution: Distribution) -> str:
    """Return the name of the offered kind that a distribution is; empty if none."""
    deviations = standard_deviations(distribution)
    for name, kind in OFFERED.items():
        other = standard_deviations(kind.distribution)
        if np.allclose(deviations, other, rtol=0, atol=EQUAL):
            return name
    return ""


def keys_in_zone(keys: dict[str, Any], distribution: Distribution) -> dict[str, Any]:
    """Return the keys of an entry beside its tolerance.

    Those that follow its zone are shares of it: `across`, places in half widths from
    the middle, or `times`, half widths.
    """
    zone, moving = tolerance_of(distribution), dict[str, Any]()
    for key, value in keys.items():
        if key not in KEYS or key in OF_THE_TOLERANCE:
            continue
        typed = getattr(distribution, key, None)
        if key in (*PLACES, "mean") and typed is not None:
            places = typed if isinstance(typed, Tolerance) else (typed,)
            across = [(spot - zone.middle) / zone.half for spot in places]
            moving[key] = {"across": across}
        elif key in WIDTHS and typed is not None:
            moving[key] = {"times": [typed / zone.half]}
        else:
            moving[key] = value
    return moving

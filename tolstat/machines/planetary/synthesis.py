"""Synthesis: every set of tooth numbers for a ratio, with its balanced helix angles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import ModelError
from tolstat.machines.planetary import scheme as schemes
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.scheme import SCHEMES, Scheme, ratio
from tolstat.model.setting_kinds import Interval, Number, Numbers
from tolstat.units.grammar import Range

if TYPE_CHECKING:
    import pandas as pd

Column = NDArray[Any]
Columns = dict[str, Column]

UNITS = {
    "helix_2": "rad", "helix_3": "rad",
    "size": "m", "neighbouring": "m", "tip_gap": "m", "balance": "1/rad",
}  # fmt: skip
ROUNDING = 1e-12  # smaller differences are none: at ends of ranges, between wheels
SLICE = 2**18  # sets of teeth evaluated together: some tens of MB
MOST_DESIGNS = 2_000_000
MOST_TRIPLES = 500_000_000  # of z1, z2, z3: some minutes
KINDS = {"ratio": Number(), **{f.name: f.metadata["kind"] for f in fields(Settings)}}


def designs(
    *,
    scheme: str,
    ratio: float,
    ratio_tolerance: float,
    satellites: int,
    z1: tuple[int, int],
    z2: tuple[int, int],
    z3: tuple[int, int],
    z4: tuple[int, int],
    helix: tuple[float, float],
    module: float | None = None,
    module_ratio: float = 1.0,
    addendum: float = 1.0,
    order: str = "teeth",
) -> pd.DataFrame:
    """Return every gear of a ratio, by teeth, helix angles and assembly.

    Wheels have no profile shift and are coaxial; their axial forces are in balance, at
    helix angles within a range; the satellites can be assembled, and do not touch at
    their pitch circles.

    Parameters
    ----------
    scheme : str
        AA, II or AI.
    ratio : float
        Wanted speed of wheel 1 over that of the carrier, wheel 4 at rest.
    ratio_tolerance : float
        Permitted error of the ratio, as a share of it.
    satellites : int
        k, 2 or more.
    z1, z2, z3, z4 : tuple of int
        Fewest and most teeth, both included.
    helix : tuple of float
        Least and greatest helix angle of wheels 2 and 3, rad, both included.
    module : float, optional
        Normal module of wheels 1 and 2, m; without it lengths are multiples of it.
    module_ratio : float
        That module over the one of wheels 3 and 4.
    addendum : float
        Height of the teeth for the column tip_gap, in modules.
    order : str
        teeth, ratio_error (then size), size or balance (then ratio error).

    Returns
    -------
    DataFrame
        A row is a gear; none where nothing fits. z1, z2, z3, z4; ratio; D = dw2 / dw3;
        helix_2, helix_3 (rad); ratio_error, a share of the wanted ratio; size, the
        diameter that the pitch circles of the satellites sweep (m); neighbouring, the
        gap between pitch circles of two satellites, and tip_gap, that between their
        tips, which may be below 0 (m); assembly, the whole number that the condition of
        assembly leaves; balance, the axial force on a satellite that independent errors
        of both helix angles leave, for a force of 1 in mesh 1-2 (1/rad).
        `attrs["units"]` holds the units, `attrs["left"]` how many sets of teeth each
        condition left.

    Raises
    ------
    ModelError
        If a range is wrong, no gear of the scheme or of these teeth has the ratio, or
        there are too many.

    Notes
    -----
    Undercut and interference are not checked; choose ranges without them. Teeth that
    are coaxial as spur wheels (kap = 1) are listed only where `helix` begins at 0,
    though with mr z2 = z3 any helix angle would balance them.

    Examples
    --------
    >>> designs(scheme="AI", ratio=7, ratio_tolerance=0.01, satellites=3, z1=(17, 26),
    ...         z2=(17, 60), z3=(17, 60), z4=(61, 130), helix=(0.14, 0.52))
    """
    arguments = {**locals(), "module": 1.0 if module is None else module}
    import pandas as pd

    checked = {name: _checked(name, value) for name, value in arguments.items()}
    i = checked.pop("ratio")
    columns, counts = search(Settings(**checked), i)
    frame = pd.DataFrame(columns)
    units = {name: UNITS.get(name, "1") for name in columns}
    if module is None:
        units = {name: "1" if unit == "m" else unit for name, unit in units.items()}
    frame.attrs = {"units": units, "left": counts}
    return frame


def _checked(name: str, value: Any) -> Any:
    """Return a given value if it fits its declaration; ends may be equal."""
    kind = KINDS[name]
    try:
        if not isinstance(kind, Interval):
            return kind.checked(value)
        low, high = Numbers(kind.each, 2, 2).checked(value)
        if low > high:
            raise ModelError("the lower end comes first")
        return Range(low, high)
    except ModelError as error:
        unit = ", in rad" if name == "helix" else ""
        raise ModelError(f"{name} = {value!r}: {error}{unit}") from None


def search(settings: Settings, i: float) -> tuple[Columns, dict[str, int]]:
    """Return the gears of the ratio i for the settings; see `designs`.

    Columns, a row for each gear; and how many sets of teeth each condition left, in
    words.
    """
    scheme = SCHEMES[settings.scheme]
    _check_reach(settings, scheme, i)
    parts: list[Columns] = []
    totals: dict[str, int] = {}
    n_found = 0
    for teeth in _candidates(settings, scheme, i):
        part, counts = _conditions(settings, scheme, i, teeth)
        parts.append(part)
        totals = {words: totals.get(words, 0) + n for words, n in counts.items()}
        n_found += len(part["z1"])
        if n_found > MOST_DESIGNS:
            raise ModelError(
                f"more than {MOST_DESIGNS} gears fit: narrow the ranges of teeth or "
                "helix angles, or the tolerance of the ratio"
            )
    columns = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    return _ordered(columns, settings.order), totals


def _check_reach(settings: Settings, scheme: Scheme, i: float) -> None:
    """Refuse ranges that are too wide, and a ratio that no teeth in them have."""
    (low1, high1), (low2, high2), (low3, high3), (low4, high4) = _teeth(settings)
    triples = (high1 - low1 + 1) * (high2 - low2 + 1) * (high3 - low3 + 1)
    if triples > MOST_TRIPLES:
        raise ModelError(
            f"{triples} sets of z1, z2, z3 are too many, at most {MOST_TRIPLES} are "
            "searched: narrow their ranges"
        )
    if scheme.s12 == scheme.s34:
        possible, words = i < 1 and i != 0, "below 1 and not 0"
    else:
        possible, words = i > 1, "above 1"
    if not possible:
        raise ModelError(
            f"ratio {i:g}: the scheme {settings.scheme} has ratios {words}"
        )
    ends = (
        ratio(scheme, low1, high2, low3, high4),
        ratio(scheme, high1, low2, high3, low4),
    )
    # a bit more: an end belongs to its range
    slack = (settings.ratio_tolerance + 1e-9) * abs(i)
    if max(ends) < i - slack or i + slack < min(ends):
        raise ModelError(
            f"ratio {i:g}: with these ranges of teeth the scheme {settings.scheme} has "
            f"ratios from {min(ends):.6g} to {max(ends):.6g}; widen them"
        )


def _teeth(settings: Settings) -> list[tuple[int, int]]:
    """Return fewest and most teeth of each wheel."""
    ranges = (settings.z1, settings.z2, settings.z3, settings.z4)
    return [(int(low), int(high)) for low, high in ranges]


def _ordered(columns: Columns, order: str) -> Columns:
    """Sort gears; equal ones by ratio error, or size, and last by teeth."""
    if order == "teeth":
        return columns
    keys = {**columns, "ratio_error": np.abs(columns["ratio_error"])}
    second = "size" if order == "ratio_error" else "ratio_error"
    # differences by rounding alone do not count
    rank = np.lexsort((np.round(keys[second], 12), np.round(keys[order], 12)))
    return {name: values[rank] for name, values in columns.items()}


def _candidates(
    settings: Settings, scheme: Scheme, i: float
) -> Iterator[tuple[Column, ...]]:
    """Yield z1, z2, z3, z4 by teeth, slice by slice: the z4 that the ratio allows."""
    (low1, high1), (low2, high2), (low3, high3), (low4, high4) = _teeth(settings)
    n2, n3 = high2 - low2 + 1, high3 - low3 + 1
    pairs, at_once = (high1 - low1 + 1) * n2, max(1, SLICE // n3)
    slack = settings.ratio_tolerance * abs(i)
    for start in range(0, pairs, at_once):
        pair = np.arange(start, min(start + at_once, pairs))
        z1, z2 = np.repeat(low1 + pair // n2, n3), np.repeat(low2 + pair % n2, n3)
        z3 = np.tile(np.arange(low3, high3 + 1), len(pair))
        ends = [schemes.fourth(scheme, i + d, z1, z2, z3) for d in (-slack, slack)]
        # rounding must not lose one: the ratio itself decides later
        first = np.ceil(np.clip(np.minimum(*ends) - 0.5, low4, high4 + 1))
        last = np.floor(np.clip(np.maximum(*ends) + 0.5, low4 - 1, high4))
        first, n4 = first.astype(np.int64), np.maximum(last - first + 1, 0).astype(int)
        total = np.cumsum(n4)
        cuts = np.searchsorted(total, np.arange(SLICE, total[-1], SLICE))
        for part in np.split(np.arange(len(z1)), cuts):
            n = n4[part]
            row = np.repeat(part, n)
            nth = np.arange(len(row)) - np.repeat(np.cumsum(n) - n, n)
            yield z1[row], z2[row], z3[row], first[row] + nth


def _conditions(
    settings: Settings, scheme: Scheme, i: float, teeth: tuple[Column, ...]
) -> tuple[Columns, dict[str, int]]:
    """Return the gears among sets of teeth, and how many each condition left."""
    counts = {}
    k, mr = settings.satellites, settings.module_ratio
    gears: Columns = dict(zip(("z1", "z2", "z3", "z4"), teeth, strict=True))

    def fitting(words: str, fit: Column) -> Columns:
        """Count and return those that fit."""
        counts[words] = int(np.count_nonzero(fit))
        return {name: values[fit] for name, values in gears.items()}

    z1, z2, z3, z4 = teeth
    ratios = ratio(scheme, *teeth)
    fit = np.abs(ratios / i - 1) <= settings.ratio_tolerance + ROUNDING
    fit &= (z1 + scheme.s12 * z2 > 0) & (z4 + scheme.s34 * z3 > 0)  # rings
    fit &= ratios != 0  # with 0 wheel 1 never turns
    gears = fitting("have the ratio", fit)

    _, _, b2, b3 = schemes.balanced(scheme, mr, *gears.values())
    gears |= {"helix_2": b2, "helix_3": b3}
    least, most = settings.helix[0] - ROUNDING, settings.helix[1] + ROUNDING
    fit = (least <= b2) & (b2 <= most) & (least <= b3) & (b3 <= most)
    gears = fitting("are balanced at such helix angles", fit)

    z1, z2, z3, z4, _, _ = gears.values()
    dividend, divisor = schemes.assembly(scheme, k, z1, z2, z3, z4)
    gears["assembly"] = dividend // divisor
    gears = fitting("can be assembled", dividend % divisor == 0)

    z1, z2, z3, z4, b2, b3, assembly = gears.values()
    ratios, D = (f(scheme, z1, z2, z3, z4) for f in (ratio, schemes.diameter_ratio))
    m2, m3 = settings.module, settings.module / mr
    dw2, dw3 = m2 * z2 / np.cos(b2), m3 * z3 / np.cos(b3)
    centres = m2 * (z1 + scheme.s12 * z2) / np.cos(b2)  # 2a
    between = centres * math.sin(math.pi / k)
    tips = 2 * settings.addendum
    gears = {
        "z1": z1, "z2": z2, "z3": z3, "z4": z4, "ratio": ratios, "D": D,
        "helix_2": b2, "helix_3": b3,
        "ratio_error": (ratios - i) / abs(i),
        "size": centres + np.maximum(dw2, dw3),
        "neighbouring": between - np.maximum(dw2, dw3),
        "tip_gap": between - np.maximum(dw2 + tips * m2, dw3 + tips * m3),
        "assembly": assembly,
        # change of tan b2 - D tan b3 with each of the angles
        "balance": np.hypot(1 / np.cos(b2) ** 2, D / np.cos(b3) ** 2),
    }  # fmt: skip
    room = gears["neighbouring"] > ROUNDING * gears["size"]  # 0 is a touch
    return fitting("have room for the satellites", room), counts

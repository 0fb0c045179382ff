"""Measured parts against the tolerance of their drawing, decided; no words."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.measured import fit
from tolstat.errors import DistributionError
from tolstat.statistics import sample_checks
from tolstat.statistics.capability import Capability, Tolerance, capability_of
from tolstat.statistics.lots import by_lot
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

FEW = 50  # parts: fewer do not settle the tails
NEAR = 5  # widths of the tolerance: parts that all lie farther out are others
NO_TEST = math.nan


class FewParts(NamedTuple):
    """Fewer parts than settle a tail."""

    parts: int
    kind: str = "few parts"


class NotNormal(NamedTuple):
    """Parts that a normal distribution does not fit."""

    p_value: float  # Anderson-Darling
    kind: str = "not normal"


class TwoKinds(NamedTuple):
    """Two kinds of parts."""

    peaks: sample_checks.TwoPeaks
    kind: str = "two kinds"


class Sorted(NamedTuple):
    """A tail that ends at a limit."""

    cut: sample_checks.CutOff
    kind: str = "cut off at a limit"


class Drift(NamedTuple):
    """A trend in the order of the parts."""

    trend: sample_checks.Trend
    kind: str = "trend"


class OtherLots(NamedTuple):
    """Lots that differ."""

    lots: sample_checks.LotsDiffer
    kind: str = "lots differ"


class CoarseStep(NamedTuple):
    """Values rounded to a coarse step."""

    step: float  # SI
    kind: str = "coarse step"


class FarParts(NamedTuple):
    """Parts far from all others."""

    values: tuple[float, ...]  # SI
    places: tuple[str, ...]  # where each stands
    kind: str = "far from all others"


class Copies(NamedTuple):
    """Rows of the file that repeat others in every cell."""

    places: tuple[str, ...]
    first: tuple[str, ...]  # the place of the earlier row of each
    kind: str = "copied rows"


class NotNear(NamedTuple):
    """Parts that all lie far outside the tolerance."""

    least: float  # SI
    most: float
    tolerance: Tolerance
    kind: str = "not near the tolerance"


PartsFinding = (
    FewParts
    | NotNormal
    | TwoKinds
    | Sorted
    | Drift
    | OtherLots
    | CoarseStep
    | FarParts
    | NotNear
    | Copies
)


class Lot(NamedTuple):
    """The parts of a lot; numbers are SI."""

    parts: int
    mean: float
    sigma: float  # NaN for one part
    outside: int


class Sample(NamedTuple):
    """Measured parts in their order, as they are judged."""

    values: Array  # float64[part], SI
    tolerance: Tolerance = Tolerance()
    nominal: float = math.nan  # on the drawing; NaN where it is not known
    lots: Sequence[str] = ()  # the lot of each; empty without lots
    places: Sequence[str] = ()  # where each stands; by default its number
    # float64[part] as written, to see how they are rounded; and SI of 1 of that unit
    written: Sequence[float] = ()
    copies: Sequence[tuple[str, str]] = ()  # places of rows that repeat earlier ones
    unit: float = 1.0


@dataclass(frozen=True, kw_only=True)
class JudgedParts:
    """Measured parts of one characteristic, judged; numbers are SI."""

    scale: Scale
    source: str  # where they come from, and how that was read
    tolerance: Tolerance
    nominal: float  # NaN where it is not known
    capability: Capability
    p_value: float  # of normal parts (Anderson-Darling); NaN where not tested
    in_order: bool  # whether they stand in an order other than that of their size
    lots: Mapping[str, Lot]
    warnings: tuple[PartsFinding, ...]
    # the parts in their order, and the lot of each
    values: Array = field(metadata={"json": False})
    lot_of_each: tuple[str, ...] = field(metadata={"json": False})

    @property
    def unusual(self) -> list[PartsFinding]:
        """What concerns a study that samples from the parts.

        Its intervals count how few they are, and it needs no normal ones.
        """
        others = FewParts | NotNormal
        return [finding for finding in self.warnings if not isinstance(finding, others)]


def judged_parts(sample: Sample, scale: Scale, source: str) -> JudgedParts:
    """Return measured parts, judged against their tolerance."""
    values, tolerance, lots = sample.values, sample.tolerance, tuple(sample.lots)
    p_value = _p_value(values)
    warnings = tuple(_warnings(sample, p_value))
    normal = not p_value < sample_checks.LEVEL
    capability = capability_of(values, tolerance, lots, normal=normal)
    return JudgedParts(
        scale=scale.telling(capability.sigma.value, tolerance.finite),
        source=source,
        tolerance=tolerance,
        nominal=sample.nominal,
        capability=capability,
        p_value=p_value,
        in_order=not sample_checks.is_sorted(values),
        lots=_lots(values, tolerance, lots),
        warnings=warnings,
        values=values,
        lot_of_each=lots,
    )


def judged_parts_of(run: Run) -> dict[str, JudgedParts]:
    """Return the measured parts of a run, judged as deviations, by entry."""
    judged = {}
    for sample in run.measured:
        scale = run.scales[sample.contributors[0]]
        values, lots = sample.values, list[str]()
        if sample.order is not None:
            values = values[sample.order]
        if sample.lot is not None:
            lots = [sample.lot_names[lot] for lot in sample.lot]
        parts = Sample(
            values,
            Tolerance(sample.lower, sample.upper),
            lots=lots,
            written=(scale.factor * values).tolist(),
            unit=1 / scale.factor,
        )
        judged[sample.name] = judged_parts(parts, scale, sample.source)
    return judged


def _p_value(values: Array) -> float:
    try:
        return fit(values, "normal").p_value
    except DistributionError:  # too few, or all equal
        return NO_TEST


def _warnings(sample: Sample, p_value: float) -> Iterator[PartsFinding]:
    """Yield what a quality engineer would look at first."""
    values, tolerance = sample.values, sample.tolerance
    if _is_far(values, tolerance):
        yield NotNear(float(values.min()), float(values.max()), tolerance)
    if sample.copies:
        rows, first = zip(*sample.copies, strict=True)
        yield Copies(rows, first)
    if len(values) < FEW:
        yield FewParts(len(values))
    far = sample_checks.outliers(values)
    if len(far):
        places = sample.places or [f"part {i + 1}" for i in range(len(values))]
        yield FarParts(tuple(values[far].tolist()), tuple(str(places[i]) for i in far))
    others = np.delete(values, far)
    peaks = sample_checks.two_peaks(others)
    if peaks:
        yield TwoKinds(peaks)
    for end in tolerance.finite:
        if cut := sample_checks.cut_off(values, end):
            yield Sorted(cut)
    if drift := sample_checks.trend(values):
        yield Drift(drift)
    if sample.lots and (different := sample_checks.lots_differ(values, sample.lots)):
        yield OtherLots(different)
    step = sample_checks.step_of(sample.written) * sample.unit if sample.written else 0
    sigma = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    coarse = step > 0 and sample_checks.is_coarse(step, sigma, tolerance)
    if coarse:
        yield CoarseStep(step)
    if p_value < sample_checks.LEVEL and not (peaks or coarse):
        yield NotNormal(p_value)


def _is_far(values: Array, tolerance: Tolerance) -> bool:
    """Return whether all parts lie on one side, far outside the tolerance."""
    lower, upper = tolerance
    width = upper - lower
    if not math.isfinite(width):
        width = max(map(abs, tolerance.finite), default=math.inf)
    beyond = max(values.min() - upper, lower - values.max())
    return bool(beyond > NEAR * width > 0)


def _lots(values: Array, tolerance: Tolerance, lots: Sequence[str]) -> dict[str, Lot]:
    lower, upper = tolerance
    return {
        lot: Lot(
            len(group),
            float(group.mean()),
            float(group.std(ddof=1)) if len(group) > 1 else math.nan,
            int(np.count_nonzero((group < lower) | (group > upper))),
        )
        for lot, group in by_lot(values, lots).items()
    }

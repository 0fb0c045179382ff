"""The answer of an allocation: tolerances, costs, fractions out of limit."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from tolstat.answers.allocate.fresh_runs import Scheme
from tolstat.answers.allocate.search import Point
from tolstat.answers.answer import Answer
from tolstat.answers.cells import ppm
from tolstat.document.inline import Number, Row
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale


class Role(StrEnum):
    """What tolerances are compared."""

    DRAWING = "drawing"
    FOUND = "found"
    TIGHTEST = "tightest"  # where none meet the limits
    EQUAL_COST = "equal_cost"  # the best at the drawing's cost, where they are met
    ROOT_SUM_SQUARE = "root_sum_square"
    WORST_CASE = "worst_case"
    PROOF = "proof"  # of those found, by which they were chosen


class Omission(StrEnum):
    """Why there is no scheme by linear analysis."""

    NO_SLOPE = "the model has a response without a slope"
    LIMITS_MISSED = "no tolerances meet the limits"


class PermittedShift(NamedTuple):
    """The shift of an entry that brings a mean back within its limit."""

    entry: str
    by: float  # SI, in all
    scale: Scale


class OffLimit(NamedTuple):
    """The mean of a response whose limit no permitted tolerance meets."""

    outside: bool  # the limit; else too near one of its ends
    distance: Estimate  # from the limit, SI
    scale: Scale
    shift: PermittedShift | None  # to be permitted; None if no shift would do


class AllocatedEntry(NamedTuple):
    """One entry of the study."""

    name: str
    parts: int  # that share its tolerance
    specified: str  # the tolerance on the drawing
    found: str
    cost_specified: float  # of all its parts
    cost: float
    at_loosest: bool  # whether it is as loose as it may be


@dataclass(frozen=True, repr=False)
class Allocation(Answer):
    """The cheapest tolerances with which a study meets its limits."""

    cost: float
    half_widths: dict[str, float]  # SI; of the tightest where none meet the limits
    met: bool  # whether a fresh run shows that they meet every limit
    entries: tuple[AllocatedEntry, ...]
    # all but the tightest by runs of one seed, by which nothing was chosen
    schemes: dict[Role, Scheme]
    omitted_schemes: dict[Role, Omission]  # of the last two, and why
    proof: Scheme  # the answer, by the fresh run that its verdicts are of
    verdicts: dict[str, str]  # of each limit, by the proof
    # limits that a step looser of some tolerance would break: a tenth, as far as it may
    # be, or the next option of a list
    active_limits: tuple[str, ...]
    exhaustive: bool  # whether all combinations of lists were tried
    wide_trials: int  # that were weighted, of no fresh run
    fresh_trials: tuple[int, ...]  # of each fresh run, in the order they were made
    trade_off: tuple[Point, ...]
    off_limit: dict[str, OffLimit]  # limits that are missed because of their mean
    measured: dict[str, int]  # parts by entry, that all verdicts take as all there are
    title: str = field(metadata={"json": False})
    # with these tolerances, and the trials of the proof, as a file
    study: str = field(metadata={"json": False})
    listed: bool = field(metadata={"json": False})  # whether all are one of a list
    integrates: bool = field(metadata={"json": False})  # whether its model does

    answers = "allocate"
    index = "scheme"

    @property
    def _short(self) -> str:
        return f"cost {self.cost:.4g}, limits {'met' if self.met else 'not met'}"

    def rows(self) -> list[Row]:
        """Return a row for each scheme: cost, fractions out of limit, tolerances."""
        rows = list[Row]()
        for name, scheme in self.with_proof.items():
            row: dict[str, Number | str | int] = {"scheme": str(name)}
            row["cost"] = Number(scheme.cost)
            row["out of any limit [ppm]"] = ppm(scheme.fraction_out_of_any_limit)
            for limit, share in scheme.fraction_out_of_limit.items():
                row[f"{limit} out of limit [ppm]"] = ppm(share)
            for entry, words in scheme.tolerances.items():
                shift = entry not in scheme.half_widths
                row[entry if shift else f"{entry} tolerance"] = words
            rows.append({**row, "trials": scheme.trials, "seed": scheme.seed})
        return rows

    @property
    def with_proof(self) -> dict[Role, Scheme]:
        """The schemes, and the proof of the one that meets the limits."""
        return self.schemes | ({Role.PROOF: self.proof} if self.met else {})

    def study_file(self, found_by: str = "", proved_by: str = "") -> str:
        """Return the study with these tolerances, and above it where they come from.

        `found_by` and `proved_by` are commands that find and prove them again.
        """
        proof, drawing = self.proof, self.schemes[Role.DRAWING]
        cost = f"{proof.cost:.6g} (drawing: {drawing.cost:.6g})"
        verdict = "All limits are met" if self.met else "NOT all limits are met"
        lines = [
            f"Tolerances allocated at a cost of {cost}.",
            found_by,
            f"{verdict} in a fresh run of {proof.trials} random trials with seed "
            f"{proof.seed}.",
            proved_by,
        ]
        return "".join(f"# {line}\n" for line in lines if line) + f"\n{self.study}"

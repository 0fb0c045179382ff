"""What all trials of an FMU with the same settings have in common."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.fmu.model_xml import Variable
from tolstat.fmu.parameters import Quantity
from tolstat.fmu.taken import Reduction
from tolstat.fmu.trial_points import Method, Points
from tolstat.model.description import Contributor, Description


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """Trials of an FMU with the same settings."""

    contributors: Mapping[str, Quantity]
    sizes: Array  # float64[contributor], SI: their nominal values
    constants: Mapping[Variable, Any]  # of other parameters, as the FMU takes them
    reductions: tuple[Reduction, ...]
    method: Method

    @cached_property
    def description(self) -> Description:
        """Contributors and responses."""
        return Description(
            tuple(
                Contributor(
                    name, part.unit.si, sentence=part.sentence, size=float(size),
                    shown=part.unit.display,
                )
                for (name, part), size in zip(
                    self.contributors.items(), self.sizes, strict=True
                )
            ),
            tuple(reduction.response for reduction in self.reductions),
        )  # fmt: skip

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of each contributor, SI."""
        ends = [part.bounds for part in self.contributors.values()]
        least, most = np.array(ends, dtype=np.float64).reshape(-1, 2).T
        return least, most

    def values(self, row: Array) -> dict[Variable, Any]:
        """Return the values, as the FMU takes them, of a trial of these deviations.

        They are float64[contributor], SI. Start values are left out: a reset restores
        them.
        """
        sizes = (self.sizes + row).tolist()
        changed = {
            part.variable: part.to_fmu(size)
            for part, size in zip(self.contributors.values(), sizes, strict=True)
            if size != part.start
        }
        return {**changed, **self.constants}

    def responses(self, points: Points) -> list[float]:
        """Return the responses of a trial that reached the stop time, SI."""
        columns = {v: i for i, v in enumerate(self.method.watched)}
        return [
            reduction.value(points.time, points.values[:, columns[reduction.variable]])
            for reduction in self.reductions
        ]

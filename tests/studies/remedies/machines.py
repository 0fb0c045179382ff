"""The designs of `tests.statistics.remedy_problems` as models: --machine FILE.py:P1."""

from __future__ import annotations

import math

import numpy as np

from tests.statistics.remedy_problems import PROBLEMS, Problem
from tolstat import Contributor, Description, Model, Outcome, Response

MILLIMETRE = 1e-3


class Design(Model):
    """A design: deviations and responses in millimetres."""

    def __init__(self, name: str, problem: Problem) -> None:
        self.name, self.problem = name, problem
        self.title = problem.name

    def describe(self, settings):
        parts = [
            Contributor(f"part_{chr(97 + i)}", "m", shown="mm") for i in self._parts
        ]
        responses = [Response(name, "m", shown="mm") for name in self._responses]
        return Description(tuple(parts), tuple(responses))

    def evaluate(self, deviations, settings):
        responses = self.problem.responses(*(deviations / MILLIMETRE).T)
        return Outcome(np.stack(responses, axis=1) * MILLIMETRE)

    @property
    def study(self):
        """The study of the design, as a table."""
        problem = self.problem
        kind = {"distribution": "uniform"} if problem.uniform else {}
        centres = problem.centres + np.zeros(len(problem.halves))
        entries = {}
        for i in self._parts:
            lower, upper = (centres[i] + s * problem.halves[i] for s in (-1, 1))
            fixed = {"fixed": True} if i in problem.fixed else {}
            zone = f"{lower:.6g}..{upper:.6g} mm"
            entries[f"part_{chr(97 + i)}"] = {"tolerance": zone, **kind, **fixed}
        limits = zip(self._responses, problem.limits, strict=True)
        return {
            "title": self.title, "model": self.name, "trials": 4096, "seed": 1,
            "deviations": entries,
            "limits": {name: limit(*ends) for name, ends in limits},
        }  # fmt: skip

    @property
    def _parts(self):
        return range(len(self.problem.halves))

    @property
    def _responses(self):
        return [f"gap_{i + 1}" for i in range(len(self.problem.limits))]


def limit(lower, upper):
    """A limit as a study has it."""
    if math.isinf(lower):
        return f"<= {upper} mm"
    return f">= {lower} mm" if math.isinf(upper) else f"{lower}..{upper} mm"


DESIGNS = {f"P{i}": Design(f"p{i}", problem) for i, problem in enumerate(PROBLEMS, 1)}
globals().update(DESIGNS)

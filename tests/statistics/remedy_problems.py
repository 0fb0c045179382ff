"""Ten designs that miss limits; nine of them can be mended without fixed parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.remedies.change import Change, Design, drawing_step
from tolstat.statistics.remedies.movable_trials import MovableTrials, movable_trials
from tolstat.statistics.sample import Sample
from tolstat.status import Status


class Problem(NamedTuple):
    """Normal deviations of +-3 sigma, or uniform ones, and their responses."""

    name: str
    halves: Array
    responses: Callable[..., list[Array]]
    limits: Array
    centres: Array | float = 0.0
    fixed: tuple[int, ...] = ()
    uniform: bool = False
    solvable: bool = True

    def sample(
        self, trials: int, rng: np.random.Generator, change: Change
    ) -> tuple[Array, Array]:
        """Return deviations and responses after a change."""
        shape = trials, len(self.halves)
        z = rng.uniform(-1, 1, shape) if self.uniform else rng.normal(0, 1 / 3, shape)
        x = self.centres + self.halves * (change.shift + change.ratio * z)
        return x, np.stack(self.responses(*x.T), axis=1)


def sampled(problem: Problem, trials: int, seed: int) -> MovableTrials:
    """Return stored trials of a problem."""
    number = len(problem.halves)
    design = Design(
        problem.centres + np.zeros(number),
        np.arange(number),
        problem.halves,
        np.array([drawing_step(half) for half in problem.halves]),
        ~np.isin(np.arange(number), problem.fixed),
        np.ones(number, bool),
    )
    x, y = problem.sample(trials, np.random.default_rng(seed), design.none)
    limits = [Limit(*ends) for ends in problem.limits]
    sample = Sample(np.full(trials, Status.DONE))
    movable = movable_trials(x, y, sample, limits, design)
    assert isinstance(movable, MovableTrials)
    return movable


def _temperatures(h, s, left, right, a, b):
    return [
        (150.25 + h) * (1 + 23.8e-6 * (1 + a) * t)
        - (150.01 + s + ring) * (1 + 11.5e-6 * (1 + b) * t)
        + 0.01
        for ring in (left, right)
        for t in (-40.0, 60.0)
    ]


def _crank(r, e, rod, turn):
    angle = np.radians(40 + turn)
    offset = (30 + r) * np.sin(angle) + 5 + e
    reach = (30 + r) * np.cos(angle) + np.sqrt((90 + rod) ** 2 - offset**2)
    return [reach - 109.75, offset - 24.35, (30 + r) * (90 + rod) / 2700 - 1]


_RNG = np.random.default_rng(5)
TWENTY = _RNG.choice([-1, 0, 0, 1], (5, 20)) * _RNG.uniform(0.3, 1, (5, 20))
OFF = TWENTY[:, [2, 7, 11]] @ np.array([0.5, -0.45, 0.4])


def _problem(name, halves, responses, *limits, **others):
    centres = np.array(others.pop("centres", 0.0))
    ends = np.array(limits, float)
    return Problem(name, np.array(halves), responses, ends, centres, **others)


PROBLEMS = [
    _problem(
        "two gaps at two temperatures", [0.08, 0.05, 0.03, 0.03, 0.02, 0.04],
        _temperatures, *[(0.05, 0.5)] * 4,
        centres=[0, -0.05, 0, 0, 0, 0], fixed=(4, 5),
    ),
    _problem(
        "three gaps", [0.1, 0.06, 0.06, 0.08, 0.05],
        lambda h, a, b, c, e: [h - a - b + 0.35, h - c + 0.08, c - e - a + 0.22],
        (0.05, 0.45), (-0.2, 0.2), (0, 0.35),
    ),
    _problem(
        "crank", [0.1, 0.1, 0.15, 0.5], _crank,
        (-0.35, 0.35), (-0.45, 0.45), (-0.006, 0.006), fixed=(3,),
    ),
    _problem(
        "off centre and wide", [0.15, 0.1, 0.08, 0.05],
        lambda a, b, c, e: [a - b - c - e + 0.12], (-0.15, 0.15),
    ),
    _problem(
        "a bought part too wide", [0.05, 0.05, 0.3],
        lambda a, b, c: [a - b - c], (-0.2, 0.2), fixed=(2,), solvable=False,
    ),
    _problem(
        "bought bearings", [0.05, 0.06, 0.06, 0.018, 0.03],
        lambda s, b1, b2, sleeve, ring: [0.2 + s - b1 - b2 - sleeve - ring],
        (0, 0.4), centres=[0.05, -0.06, -0.06, -0.018, -0.03], fixed=(1, 2),
    ),
    _problem(
        "two spreads", [0.1, 0.12, 0.1, 0.14, 0.05],
        lambda a, b, c, e, f: [a + b, c + e + 0.2 * a, f - e],
        (-0.12, 0.12), (-0.12, 0.12), (-0.16, 0.16),
    ),
    _problem(
        "opposing, uniform", [0.06, 0.04, 0.05],
        lambda a, b, c: [a + b + 0.04, a - c - 0.05],
        (-math.inf, 0.1), (-0.11, math.inf), uniform=True,
    ),
    _problem(
        "square", [0.1, 0.05, 0.05],
        lambda x, y, z: [(x / 0.1) ** 2 + y * 10, y * 10 - z * 8],
        (-math.inf, 1), (-0.6, 0.6),
    ),
    _problem(
        "twenty parts, five limits", [0.1] * 20,
        lambda *x: list(TWENTY @ np.array(x) + OFF[:, None]), *[(-0.3, 0.3)] * 5,
    ),
]  # fmt: skip

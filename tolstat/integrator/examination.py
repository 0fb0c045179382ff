"""Examination of an integration: what demands its steps, and its errors.

The same trials are integrated again with one thing changed: the error of one state
alone counts, the longest step or rtol is another. So every finding is an experiment.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.integrator.integrate import Integration, integrate, observed
from tolstat.integrator.problem import SIZE, Accuracy, Residual, Solution, System
from tolstat.integrator.residual import largest_residual
from tolstat.integrator.stiffness import Stiffness, stiffness_of
from tolstat.status import Status

FREE = 1e9  # times its scale: the error of such a state does not count
FEWER = 0.9  # of the steps, or fewer, are left: what was changed had demanded them
LOOSER = 100.0  # rtol
LOOSEST = 0.1  # rtol, at which stability alone still limits steps
SHIFT = 1e-6  # of its scale: change of a start, to see how it grows
SENSITIVE = 10.0  # growth of such a change, above which errors grow as well
MOST_STEPS = 200_000  # of a trial that is integrated again
FEW_STEPS = 200  # of a trial: too few to tell stability from accuracy
STIFF = 0.7  # of the steps at least are left at larger rtol
PERMITTED = 300.0  # of rtol, for a healthy error


@dataclass(frozen=True)
class Examination:
    """Findings on the integration of a few trials."""

    steps: Integers  # [trial]
    failed: Truths  # [trial]
    # shares of the steps that are left, by what is changed:
    alone: tuple[float, ...]  # [state], only the error of this state counts
    longer: float  # the longest step is four times as long
    looser: float  # rtol is a hundred times as large
    loosest: float  # rtol is ten thousand times as large, at most 0.1
    undamped: float | None  # no state is damped; None if none is
    # by kind of result, of rtol: against rtol/1000 and a quarter of the longest step
    errors: Mapping[str, float]
    scale: Array  # as declared
    proposed: Array  # [state]
    residual: Residual | None  # inside the steps
    stiffness: Stiffness  # of the trial with most steps
    growth: float  # of a small change of the start, until the end

    @property
    def demanding(self) -> int:
        """The number, from 0, of the state that demands most steps."""
        return int(np.argmax(self.alone))

    @property
    def by_longest(self) -> bool:
        """Whether the longest step decides the number of steps."""
        return self.longer < FEWER

    @property
    def by_rtol(self) -> bool:
        """Whether a larger rtol saves steps."""
        return self.looser < FEWER

    @property
    def stiff(self) -> bool:
        """Whether stability limits the steps, not accuracy: by a measured lambda.

        Unmarked events, too, need steps that hardly depend on rtol; but fewer at a far
        larger one, and the results depend on whether steps meet them.
        """
        if self.steps.max() <= FEW_STEPS or not self.stiffness.limits:
            return False
        if self.failed.any():
            return True
        least = min(self.looser, self.loosest)
        return least > STIFF and not self.by_longest and self.accurate

    @property
    def accurate(self) -> bool:
        """Whether the results are as accurate as rtol lets expect."""
        return max(self.errors.values()) <= PERMITTED

    @property
    def kinked(self) -> bool:
        """Whether the rates bend or jump inside steps."""
        return self.residual is not None and self.residual.kinked

    @property
    def sensitive(self) -> bool:
        """Whether errors are large because the motion makes small changes grow."""
        grows = self.growth > SENSITIVE
        return grows and not (self.accurate or self.kinked)


def examine(integration: Integration) -> Examination:
    """Return what demands the steps of an integration, and its errors.

    Parameters
    ----------
    integration : Integration
        Of a few trials: they are integrated again once for each state, and eight times.
    """
    system, block = integration.system, integration.block
    rtol, longest, most = block.accuracy
    capped = Accuracy(rtol, longest, min(most, MOST_STEPS))
    with observed(surveyed=True) as surveyed:
        base = _again(integration, capped)

    def share(accuracy: Accuracy, **changed: Any) -> float:
        other = _again(integration, accuracy, replace(system, **changed))
        return float(other.steps.sum() / base.steps.sum())

    def alone(state: int) -> float:
        scale = FREE * np.array(system.scale, float)
        scale[state] = system.scale[state]
        return share(capped, scale=scale)

    undamped = None
    if system.damped:  # the rows of lambda become watched quantities
        spare = len(system.damped) * (1 + len(system.sloped))
        above = system.n_above + spare
        undamped = share(capped, damped=(), sloped=(), watch=None, n_above=above)
    precise = _again(integration, capped.tightened())
    return Examination(
        base.steps,
        base.status != Status.DONE,
        tuple(alone(i) for i in range(len(system.scale))),
        share(capped._replace(max_step=4.0 * longest)),
        share(capped._replace(rtol=LOOSER * rtol)),
        share(capped._replace(rtol=max(min(LOOSER**2 * rtol, LOOSEST), LOOSER * rtol))),
        undamped,
        _errors(base, precise, system.scale, rtol),
        np.array(system.scale, float),
        _sizes(surveyed[0]),
        largest_residual(surveyed),
        stiffness_of(surveyed[0]),
        _growth(integration, capped, precise),
    )


def _growth(integration: Integration, accuracy: Accuracy, precise: Solution) -> float:
    """Return how many times a small change of the start is larger at the end."""
    system, block = integration.system, integration.block
    scale = np.array(system.scale, float)
    moved = block._replace(start=block.start + SHIFT * scale)
    other = _again(integration._replace(block=moved), accuracy.tightened())
    change = np.abs(other.states[:, -1] - precise.states[:, -1]) / (SHIFT * scale)
    return float(np.nanmax(change, initial=0.0))


def proposed_scale(
    system: System, start: Array, parameters: Array, marks: Array, accuracy: Accuracy
) -> Array:
    """Return a scale for each state: its largest size in these trials.

    Parameters
    ----------
    system, start, parameters, marks, accuracy
        As of `integrate`; with any scale of the system that lets the trials end.

    Returns
    -------
    float64[state]
        Rounded to one digit. A state that stays zero keeps its scale.
    """
    with observed(surveyed=True) as surveyed:
        integrate(system, start, parameters, marks, accuracy)
    return _sizes(surveyed[0])


def _sizes(surveyed: Integration) -> Array:
    """Return the largest size of each state in any step, rounded to one digit."""
    system, _, solution = surveyed
    declared = np.array(system.scale, float)
    sizes = np.nanmax(np.abs(solution.states), axis=(0, 1), initial=0.0)
    inside = solution.survey[:, : len(declared), SIZE].max(axis=0, initial=0.0)
    size = np.fmax(sizes, inside)
    size = np.where(size > 0.0, size, declared)
    digit = 10.0 ** np.floor(np.log10(size))
    rounded: Array = np.round(size / digit) * digit
    return rounded


def _again(
    integration: Integration, accuracy: Accuracy, system: System | None = None
) -> Solution:
    block = integration.block
    return integrate(
        system or integration.system,
        block.start,
        block.parameters,
        block.marks,
        accuracy,
        watch_from=block.watch_from,
    )


def _errors(
    base: Solution, other: Solution, scale: Array, rtol: float
) -> dict[str, float]:
    """Return the largest differences, of rtol times the size of what differs."""

    def largest(a: Array, b: Array, size: Array) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.nanmax(np.abs(a - b) / (rtol * size), initial=0.0))

    errors = {"states": largest(base.states, other.states, np.asarray(scale))}
    for name in ("quadratures", "peak"):
        a, b = getattr(base, name), getattr(other, name)
        if a.size:
            errors[name] = largest(a, b, np.abs(b).max(axis=0))
    return errors

"""Responses of a run that jump: their trials fall into two clusters."""

import math
from collections.abc import Iterable

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.statistics.clusters import NO_TURNS, Clusters, clusters_of
from tolstat.store.stored_run import Run

# by SI unit of a response: its steps that are turns, and the fewest trials a turn away
# that are named; atan and the axis of a body jump by half a turn, and a plain number
# may be an angle
TURNS = {
    "rad": ({2 * math.pi: 1.0, math.pi: 0.5}, 1),
    "1": ({2 * math.pi: 1.0, 360.0: 1.0}, 5),
}


def jumping(
    run: Run, trials: Integers, responses: Iterable[str]
) -> dict[str, Clusters]:
    """Return the clusters of responses that jump, by response.

    `trials` are done; of a rare run those of any stage.
    """
    names = list(run.assumed)

    def rows(some: Integers) -> Array:
        parts = [run.column(name)[trials[some]] for name in names]
        return np.stack(parts, axis=1) if parts else np.empty((len(some), 0))

    clusters = {
        name: clusters_of(
            run.column(name)[trials], rows, *TURNS.get(run.units[name], (NO_TURNS,))
        )
        for name in responses
    }
    return {name: found for name, found in clusters.items() if found}


def turning(run: Run, trials: Integers) -> list[str]:
    """Return the limited responses that jump as an angle: they have no verdict."""
    clusters = jumping(run, trials, run.limits)
    return [name for name, found in clusters.items() if found.turn]

"""Responses of a run that jump: their trials fall into two clusters."""

import math
from collections.abc import Iterable

import numpy as np

from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array, Integers
from tolstat.statistics.clusters import Clusters, clusters_of

# by SI unit of a response: its whole turns, and the fewest trials a turn away that are
# named; a plain number may be an angle
TURNS = {"rad": ((2 * math.pi,), 1), "1": ((2 * math.pi, 360.0), 5)}


def jumping(drawn: Drawn, responses: Iterable[str]) -> dict[str, Clusters]:
    """Return the clusters of responses that jump, by response."""
    done, units = np.flatnonzero(drawn.sample.done), drawn.run.units
    names = list(drawn.run.assumed)

    def rows(trials: Integers) -> Array:
        parts = [drawn.values(name)[done[trials]] for name in names]
        return np.stack(parts, axis=1) if parts else np.empty((len(trials), 0))

    every = {
        n: clusters_of(drawn.done(n), rows, *TURNS.get(units[n], ())) for n in responses
    }
    return {name: clusters for name, clusters in every.items() if clusters}


def turning(drawn: Drawn) -> list[str]:
    """Return the limited responses that jump by a whole turn: they have no verdict."""
    clusters = jumping(drawn, drawn.run.limits)
    return [name for name, found in clusters.items() if found.turn]

"""All deviations of a study, drawn before anything runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations import samplers
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.parts import find_in
from tolstat.deviations.tolerance import Tolerance


class Spread(NamedTuple):
    """How the deviation of one contributor is distributed."""

    distribution: Distribution
    tolerance: Tolerance


def draw(
    contributors: Sequence[str],
    spreads: Mapping[str, Spread],
    *,
    sampling: str,
    seed: int,
    trials: int,
) -> NDArray[np.float64]:
    """Draw the deviations of all trials.

    Parameters
    ----------
    contributors : sequence of str
        Every contributor of the model, in order.
    spreads : mapping of str to Spread
        Those that deviate; the others stay zero.
    sampling : str
        Name of a sampler.
    seed : int
        Of the study.
    trials : int
        How many.

    Returns
    -------
    float64[trial, contributor]
        SI.
    """
    names = [name for name in contributors if name in spreads]
    unit = find_in(samplers, sampling)().unit_samples(seed, names, trials)
    deviations = np.zeros((trials, len(contributors)))
    for column, name in enumerate(names):
        distribution, tolerance = spreads[name]
        where = contributors.index(name)
        deviations[:, where] = distribution.deviations(unit[:, column], tolerance)
    return deviations

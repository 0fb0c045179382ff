"""All deviations of a study, drawn before anything runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations import samplers
from tolstat.deviations.dependence import Dependence, joined
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.names import known_or_general
from tolstat.deviations.parts import find_in


def draw(
    contributors: Sequence[str],
    distributions: Mapping[str, Distribution],
    *,
    sampling: str,
    seed: int,
    trials: int,
    dependence: Dependence | None = None,
) -> NDArray[np.float64]:
    """Draw the deviations of all trials.

    Parameters
    ----------
    contributors : sequence of str
        Every contributor of the model, in order.
    distributions : mapping of str to Distribution
        Those that deviate; the others stay zero.
    sampling : str
        Name of a sampler.
    seed : int
        Of the study.
    trials : int
        How many.
    dependence : Dependence, optional
        What hangs together.

    Returns
    -------
    float64[trial, contributor]
        SI.
    """
    dependence = dependence or Dependence()
    # fixed for the model, whatever the study says
    general = [n for n in known_or_general(contributors) if n not in contributors]
    number = {name: i for i, name in enumerate([*contributors, *general])}
    wanted = {*distributions, *(batch.name for batch in dependence.batches.values())}
    streams = {name: i for name, i in number.items() if name in wanted}
    table = find_in(samplers, sampling)().unit_samples(seed, streams, trials)
    unit = joined(dict(zip(streams, table.T, strict=True)), dependence)
    deviations = np.zeros((trials, len(contributors)))
    for name, distribution in distributions.items():
        deviations[:, number[name]] = distribution.deviations(unit[name])
    return deviations

"""The samplers by their names in study files, and the deviations they sample."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from itertools import count

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.dependence import Dependence, joined
from tolstat.deviations.distributions import Constant, Distribution
from tolstat.deviations.names import known_or_general
from tolstat.deviations.samplers import Random, Sampler, Stage

# by name in study files: module and class
KINDS = {
    "latin": ("samplers", "Latin"),
    "random": ("samplers", "Random"),
    "rare": ("rare", "Rare"),
    "saltelli": ("samplers", "Saltelli"),
    "sobol": ("samplers", "Sobol"),
}


class Samplers(Mapping[str, Sampler]):
    """The samplers; the search of rare runs, seven files, is loaded when it is used."""

    def __getitem__(self, name: str) -> Sampler:
        """Return a sampler by its name."""
        module, kind = KINDS[name]
        sampler: Sampler = getattr(
            import_module(f"tolstat.deviations.{module}"), kind
        )()
        return sampler

    def __iter__(self) -> Iterator[str]:
        """Yield the names."""
        return iter(KINDS)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(KINDS)


SAMPLERS = Samplers()

# yields stages and their deviations; for each it is sent the margins of the trials
Course = Generator[tuple[Stage, Array], Array, None]


def draw_in_stages(
    contributors: Sequence[str],
    distributions: Mapping[str, Distribution],
    *,
    sampling: str,
    seed: int,
    trials: int,
    dependence: Dependence,
) -> Course:
    """Yield stages of trials with deviations, from a sampler by its name.

    `contributors` are all of the model, in order; without a distribution they are zero.
    Each stage comes with float64[trial, contributor], its deviations, SI. Send the
    margins of its trials as for `Sampler.stages`.
    """
    streams = streams_of(contributors, distributions, dependence)
    stages = SAMPLERS[sampling].stages(seed, streams, trials)
    with suppress(StopIteration):
        stage = next(stages)
        for number in count():
            rows = _deviations(stage.unit, contributors, distributions, dependence)
            stage = stages.send((yield replace(stage, number=number), rows))


def drawn_between(
    contributors: Sequence[str],
    distributions: Mapping[str, Distribution],
    *,
    seed: int,
    between: tuple[int, int],
    dependence: Dependence,
) -> Array:
    """Return the deviations of random trials from one number up to another one.

    They are those of the trials with these numbers of any random sample of the seed.
    """
    first, stop = between
    streams = streams_of(contributors, distributions, dependence)
    unit = Random().from_trial(first, seed, streams, stop - first)
    return _deviations(unit, contributors, distributions, dependence)


def streams_of(
    contributors: Sequence[str],
    distributions: Mapping[str, Distribution],
    dependence: Dependence,
) -> dict[str, int]:
    """Return the independent streams with their numbers, in order: see `Sampler`."""
    varying = factors(distributions, dependence)
    return {name: i for name, i in _numbers(contributors).items() if name in varying}


def _deviations(
    table: Array,
    contributors: Sequence[str],
    distributions: Mapping[str, Distribution],
    dependence: Dependence,
) -> Array:
    """Return deviations[trial, contributor], SI, of unit samples[trial, stream]."""
    number = _numbers(contributors)
    streams = streams_of(contributors, distributions, dependence)
    unit = joined(dict(zip(streams, table.T, strict=True)), dependence)
    deviations = np.zeros((len(table), len(contributors)))
    middle = np.full(len(table), 0.5)  # of constant contributors
    for name, distribution in distributions.items():
        u = unit.get(name, middle)
        deviations[:, number[name]] = distribution.deviations(u)
    return deviations


def factors(
    distributions: Mapping[str, Distribution], dependence: Dependence
) -> set[str]:
    """Return the names that vary independently: contributors, and batches of parts.

    A part that equals its batch is not a separate factor.
    """
    batches = dependence.batches
    separate = {
        name
        for name, distribution in distributions.items()
        if not isinstance(distribution, Constant)
        and not (name in batches and batches[name].share == 1)
    }
    return separate | {batch.name for batch in batches.values()}


def _numbers(contributors: Sequence[str]) -> dict[str, int]:
    """Return the number of each contributor and batch, fixed for a model."""
    general = [n for n in known_or_general(contributors) if n not in contributors]
    return {name: i for i, name in enumerate([*contributors, *general])}

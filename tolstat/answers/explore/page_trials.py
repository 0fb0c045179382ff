"""The trials that a page carries: all of them, or those out of limit and a sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from tolstat.answers.explore.packed import packed
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array, Integers
from tolstat.deviations.density_ratio import FARTHEST, Density
from tolstat.deviations.distributions import Constant, Tolerance, Uniform
from tolstat.deviations.draw import draw_in_stages
from tolstat.statistics.limits.limit import within
from tolstat.study.study import Study

MOST_BYTES = 540_000  # of the arrays of all trials; as base64 four thirds of it
MOST_OUT = 0.7  # of the trials of a page: more are a sample like all others
SEED = 1  # of the sample
WHOLE = 32767  # of a normal score in two bytes


@dataclass(frozen=True)
class PageTrials:
    """Trials of a page, each standing for some of the run's."""

    number: int  # that ran
    places: Integers  # among those that statistics rest on
    times: Array | None  # float64[trial]; None where each stands for itself
    bits: int  # of a normal score

    def data(self, scores: Sequence[Array]) -> dict[str, Any]:
        """Return them as data, with float64[trial] scores of each part."""
        small = self.bits == 16
        kind, unit = ("i2", FARTHEST / WHOLE) if small else ("f4", 1.0)
        times = self.times
        return {
            "trials": self.number,
            "rows": len(self.places),
            "times": None if times is None else packed(times, "f4"),
            "times_differ": times is not None,
            "times_ends": [1.0]
            if times is None
            else [float(times.min()), float(times.max())],
            "score_unit": unit,
            "scores": [packed(score / unit, kind) for score in scores],
        }


def page_trials(sampled: Drawn, parts: int, numbers: int) -> PageTrials:
    """Choose the trials of a page.

    All where they fit. Else every trial out of some limit, and a sample of the rest,
    each of which stands for many.

    Parameters
    ----------
    parts, numbers : int
        Normal scores and other numbers of a trial.
    """
    ran = np.flatnonzero(sampled.sample.ran)
    for bits in (32, 16):
        most = MOST_BYTES // (parts * bits // 8 + 4 * numbers + 4)
        if len(ran) <= most:
            return PageTrials(len(ran), ran, None, bits)
    limits = sampled.run.limits.items()
    inside = [within(sampled.values(name)[ran], x.permitted) for name, x in limits]
    out = ~np.all(inside, axis=0) if inside else np.zeros(len(ran), np.bool_)
    if np.count_nonzero(out) > MOST_OUT * most:
        times = np.full(most, len(ran) / most)
        return PageTrials(len(ran), ran[:most], times, 16)
    rest = most - int(np.count_nonzero(out))
    others = np.random.default_rng(SEED).choice(ran[~out], rest, replace=False)
    places = np.sort(np.concatenate([ran[out], others]))
    flagged = np.isin(places, ran[out])
    times = np.where(flagged, 1.0, np.count_nonzero(~out) / rest)
    return PageTrials(len(ran), places, times, 16)


def sampled_scores(study: Study, sampled: Drawn) -> Mapping[str, Array]:
    """Return the normal scores that the parts of each trial were sampled with.

    Of measured parts, too, whose deviations do not tell them.
    """
    unit = Uniform(Tolerance(0.0, 1.0))
    names = [part.name for part in study.description.contributors]
    distributions = {
        name: x if isinstance(x, Constant) else unit
        for name, x in study.deviating.distributions.items()
    }
    assert sampled.run.sampled is not None
    course = draw_in_stages(
        names, distributions, sampling=study.sampling, seed=sampled.run.sampled.seed,
        trials=sampled.run.trials, dependence=study.deviating.dependence,
    )  # fmt: skip
    _, table = next(course)
    scores = ndtri(table[sampled.trials])
    return {n: bounded(x) for n, x in zip(names, scores.T, strict=True)}


def density_scores(study: Study, sampled: Drawn, name: str) -> Array:
    """Return the normal scores of a contributor's deviations, by its density."""
    density = Density(study.deviating.distributions[name])
    return bounded(density.scores(sampled.values(name)))


def bounded(scores: Array) -> Array:
    """Return normal scores within the range of the tables."""
    return np.clip(scores, -FARTHEST, FARTHEST)

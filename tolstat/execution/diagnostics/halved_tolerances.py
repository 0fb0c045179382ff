"""Fraction out of limit with halved tolerances, from weighted trials."""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from tolstat.deviations.density_ratio import DensityRatio
from tolstat.deviations.distributions import Constant, Tolerance
from tolstat.deviations.samplers import OWN
from tolstat.deviations.spread import halved, zone_of
from tolstat.errors import DistributionError
from tolstat.execution.planning import assumed_of
from tolstat.execution.trial_table import Trials
from tolstat.model.description import Contributor, kinds_of_part
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import Weights
from tolstat.statistics.limits.limit import within
from tolstat.statistics.sensitivity.named_causes import Effect, named_causes
from tolstat.store.run_records import Assumed, Halved, Members
from tolstat.study.study import Study

TURN = 2 * math.pi * (1 - 1e-9)


def effects_of(
    limited: Iterable[str],
    assumed: Mapping[str, Assumed],
    slopes: Mapping[str, Mapping[str, float]],
    contributors: Iterable[Contributor],
) -> dict[str, dict[str, Effect]]:
    """Return what is known of each contributor, by limited response."""
    kinds = kinds_of_part(list(assumed), contributors)
    kind_of = {name: kind for kind, members in kinds.items() for name in members}
    return {
        response: {
            name: Effect(
                each.words,
                slopes.get(response, {}).get(name, math.nan)
                * (each.tolerance[1] - each.tolerance[0]),
                kind_of.get(name, ""),
            )
            for name, each in assumed.items()
        }
        for response in limited
    }


def halved_shares(
    study: Study, trials: Trials, slopes: Mapping[str, Mapping[str, float]]
) -> dict[str, dict[Members, Halved]]:
    """Return the fraction out of limit with halved tolerances, by weighting trials.

    Keys are the limited response and the contributors halved: each one, each kind of
    part, and those that are named together as a cause. Empty where trials depend on
    each other, or are no sample. Failed trials count as out of limit. Slopes are by
    response and contributor, SI.
    """
    sampler = study.sampler
    if sampler is None or sampler.replicates or not sampler.sample:
        return {}
    own = np.arange(len(trials.status)) % sampler.group(len(study.factors)) < OWN
    deviating = study.deviating
    every = {
        each.name: trials.deviations[own, column]
        for column, each in enumerate(study.description.contributors)
        if each.name in deviating.distributions
        and not isinstance(deviating.distributions[each.name], Constant)
    }
    out_of_limit = {
        name: ~within(trials.response(name)[own], limit.permitted)
        for name, limit in study.limits.items()
    }
    if not every or not out_of_limit:
        return {}
    weighting = DensityRatio(every, deviating.distributions, deviating.dependence)
    contributors = study.description.contributors
    kinds = kinds_of_part(list(every), contributors).values()
    found: dict[str, dict[Members, Halved]] = {name: {} for name in out_of_limit}
    # a deviation over a full turn, the phase of a run-out, has no tolerance to halve
    zones = {name: zone_of(deviating.distributions[name]) for name in every}
    turning = [e.name for e in contributors if is_turn(e.unit, zones.get(e.name))]
    unfit, sized = set[str](), deviating.sized  # refused alone; these come first
    alone = [(name,) for name in every]
    effects = effects_of(
        out_of_limit, assumed_of(deviating), slopes, study.description.contributors
    )
    named = [
        members
        for causes in named_causes(every, out_of_limit, effects).values()
        for members in causes.groups
    ]
    for members in dict.fromkeys([*alone, *map(tuple, kinds), *named]):
        these = [name for name in members if name not in turning]
        try:
            if not these:
                raise DistributionError("a full turn is no tolerance")
            new = {
                name: halved(deviating.distributions[name], sized=name in sized)
                for name in these
            }
            weights = Weights(weighting.weights(new))
        except DistributionError as error:
            refused = [name for name in these if name in unfit and len(members) > 1]
            reason = f"{', '.join(refused)}: {error}" if refused else str(error)
            unfit.update(these if len(members) == 1 else ())
            for of in found.values():
                of[members] = Halved(Estimate(math.nan, reason=reason), 0)
            continue
        for name, of in found.items():
            share = weighted_share(out_of_limit[name], weights)
            of[members] = Halved(share, weights.number)
    return found


def is_turn(unit: str, zone: Tolerance | None) -> bool:
    """Return whether a deviation covers a full turn."""
    return unit == "rad" and zone is not None and zone.upper - zone.lower >= TURN

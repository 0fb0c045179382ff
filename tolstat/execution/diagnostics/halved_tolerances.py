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
    """Return the effect of each contributor, by limited response."""
    kinds = kinds_of_part(list(assumed), contributors)
    kind_of = {name: kind for kind, members in kinds.items() for name in members}
    return {
        response: {
            name: Effect(
                assumption.words,
                slopes.get(response, {}).get(name, math.nan)
                * (assumption.tolerance[1] - assumption.tolerance[0]),
                kind_of.get(name, ""),
            )
            for name, assumption in assumed.items()
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
    independent = (
        np.arange(len(trials.status)) % sampler.group(len(study.factors)) < OWN
    )
    deviating, contributors = study.deviating, study.description.contributors
    distributions = deviating.distributions
    deviations = {
        contributor.name: trials.deviations[independent, column]
        for column, contributor in enumerate(contributors)
        if not isinstance(distributions.get(contributor.name), Constant | None)
    }
    out_of_limit = {
        name: ~within(trials.response(name)[independent], limit.permitted)
        for name, limit in study.limits.items()
    }
    if not deviations or not out_of_limit:
        return {}
    ratio = DensityRatio(deviations, distributions, deviating.dependence)
    # a deviation over a full turn, the phase of a run-out, has no tolerance to halve
    turning = {
        contributor.name
        for contributor in contributors
        if contributor.name in deviations
        and is_turn(contributor.unit, zone_of(distributions[contributor.name]))
    }
    effects = effects_of(out_of_limit, assumed_of(deviating), slopes, contributors)
    causes = named_causes(deviations, out_of_limit, effects).values()
    groups = [
        *((name,) for name in deviations),
        *map(tuple, kinds_of_part(list(deviations), contributors).values()),
        *(members for cause in causes for members in cause.groups),
    ]
    shares: dict[str, dict[Members, Halved]] = {name: {} for name in out_of_limit}
    unfit = set[str]()  # refused alone; these come first
    for members in dict.fromkeys(groups):
        narrowed = [name for name in members if name not in turning]
        try:
            if not narrowed:
                raise DistributionError("a full turn is no tolerance")
            new = {
                name: halved(distributions[name], sized=name in deviating.sized)
                for name in narrowed
            }
            weights = Weights(ratio.weights(new))
        except DistributionError as error:
            refused = [n for n in narrowed if n in unfit and len(members) > 1]
            reason = f"{', '.join(refused)}: {error}" if refused else str(error)
            unfit.update(narrowed if len(members) == 1 else ())
            for of_response in shares.values():
                of_response[members] = Halved(Estimate(math.nan, reason=reason), 0)
            continue
        for name, of_response in shares.items():
            share = weighted_share(out_of_limit[name], weights)
            of_response[members] = Halved(share, weights.number)
    return shares


def is_turn(unit: str, zone: Tolerance | None) -> bool:
    """Return whether a deviation covers a full turn."""
    return unit == "rad" and zone is not None and zone.upper - zone.lower >= TURN

"""Influence of contributors: slopes, halved tolerances, and who changes nothing."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.deviations.distributions import Constant, Tolerance
from tolstat.deviations.samplers import OWN
from tolstat.deviations.spread import halved, spread_of
from tolstat.errors import DistributionError
from tolstat.execution.stages import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.contract import Model
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import Weights
from tolstat.statistics.limits.limit import within
from tolstat.statistics.sensitivity.named_causes import named_causes
from tolstat.status import Status
from tolstat.store.assumed import Assumed, effects_of, is_turn
from tolstat.store.run_records import Halved, Members
from tolstat.study.study import Study

STEP = 0.1  # of a usual deviation, to either side
WHOLE = 6  # usual deviations of a whole tolerance
ROUNDING = 1e-12  # of the largest value of a response: no change
ALIKE = 1e-6  # of the change of a response to either side: no difference of both
FEWEST_TRIALS, MOST_TRIALS = 8, 64  # trials in which a contributor is moved
TOGETHER = 256  # most trials in which contributors are moved together
OTHERS = 4  # of these, whose deviation it takes, beside both ends of its tolerance


def slopes(
    model: Model,
    settings: Any,
    usual: Array,
    workers: Workers,
    trial: Array | None = None,
    sizes: Array | None = None,
) -> Array:
    """Return the slopes of the responses at one trial.

    Parameters
    ----------
    model : Model
        The model.
    settings : object
        Its settings.
    usual : float64[contributor]
        Usual size of each deviation, SI; a contributor with zero has no slope.
    workers : Workers
        Evaluate the trials.
    trial : float64[contributor], optional
        Deviations of the trial, SI; the nominal one if not given.
    sizes : float64[response], optional
        Largest absolute value in other trials, SI: it shows how far a response rounds.

    Returns
    -------
    float64[contributor, response]
        By central differences over a tenth of `usual` to either side; zero where these
        are rounding, beside the size of the response or its change to either side. NaN
        where a trial failed.
    """
    varying = np.flatnonzero(usual > 0)
    if not len(varying):
        return np.zeros((len(usual), len(model.describe(settings).responses)))
    step = STEP * usual[varying]
    moves = np.diag(STEP * usual)[varying]
    rows = np.concatenate([moves, -moves, np.zeros((1, len(usual)))])
    rows += 0.0 if trial is None else trial
    values = workers.simulate(model, rows, settings).responses
    ahead, behind = np.split(values[:-1], 2)
    difference = ahead - behind
    change = np.fmax(np.abs(ahead - values[-1]), np.abs(behind - values[-1]))
    largest = np.fmax.reduce(np.abs(values), axis=0)
    largest = largest if sizes is None else np.fmax(largest, sizes)
    rounding = np.fmax(ALIKE * change, ROUNDING * largest * 2 * STEP / WHOLE)
    difference[np.abs(difference) <= rounding] = 0.0
    table = np.zeros((len(usual), values.shape[1]))
    table[varying] = difference / (2 * step[:, None])
    return table


def tolerance_ends(study: Study) -> Array:
    """Return the ends of each contributor's tolerance: float64[2, contributor], SI.

    They are zero without tolerance.
    """
    names = [contributor.name for contributor in study.description.contributors]
    ends = np.zeros((2, len(names)))
    for name, distribution in study.deviating.distributions.items():
        ends[:, names.index(name)] = spread_of(distribution)[:2]
    return ends


def slopes_by_name(
    study: Study, table: Array, varying: Truths
) -> dict[str, dict[str, float]]:
    """Return slopes by response and contributor that deviates."""
    if not varying.any():
        return {}
    names = [contributor.name for contributor in study.description.contributors]
    return {
        response.name: {names[i]: float(slope[i]) for i in np.flatnonzero(varying)}
        for response, slope in zip(study.description.responses, table.T, strict=True)
    }


def idle_contributors(
    study: Study, trials: Trials, ends: Array, slopes: Array, workers: Workers
) -> tuple[str, ...]:
    """Return the contributors that change no response, over their whole tolerance.

    The phase of a run-out is left out: it acts with its run-out.
    Those without a slope at the nominal trial are moved alone, all else as in stored
    trials: random ones, and those with the least and the largest responses. The ones
    left are moved together, and where that changes something alone again. Slopes are
    float64[contributor, response], `ends` those of `tolerance_ends`, SI.
    """
    done = np.flatnonzero(trials.status == Status.DONE)
    if not len(done):
        return ()
    lower, upper = ends
    rounding = ROUNDING * np.abs(trials.responses[done]).max(0)
    moves = np.any(np.abs(slopes) > 0, axis=1)  # NaN where the nominal trial failed
    turns = [
        is_turn(contributor.unit, Tolerance(*zone))
        for contributor, zone in zip(
            study.description.contributors, ends.T, strict=True
        )
    ]
    suspects = np.flatnonzero((lower < upper) & ~moves & ~np.array(turns, np.bool_))
    if not len(suspects):
        return ()
    rows = trials.deviations[_chosen(trials, done, len(suspects))]
    several = trials.deviations[_chosen(trials, done, 1, TOGETHER)]
    evaluate = partial(_changes, study, workers, rounding)
    joined = False
    while len(suspects):
        values = np.concatenate([ends, rows[:: max(1, len(rows) // OTHERS)]])
        moved = [_moved(rows, [i], way) for i in suspects for way in values]
        changed = evaluate(rows, moved).reshape(len(suspects), -1).any(axis=1)
        if joined and not changed.any():
            return ()  # only together they change something
        suspects, joined = suspects[~changed], True
        moved = [_moved(several, suspects, way) for way in (*ends, ends.mean(axis=0))]
        changed = evaluate(several, moved)
        # where one of them alone may change something
        where = [several[changed.any(axis=0)]]
        where += [x[which] for x, which in zip(moved, changed, strict=True)]
        rows = np.concatenate([x[: FEWEST_TRIALS // 4] for x in where])
        if not len(rows):
            break
    names = [contributor.name for contributor in study.description.contributors]
    return tuple(names[i] for i in suspects)


def _moved(rows: Array, columns: Integers | list[Any], values: Array) -> Array:
    """Return trials with the deviations of some contributors: all in the same way."""
    moved = rows.copy()
    moved[:, columns] = values[columns]
    return moved


def _changes(
    study: Study, workers: Workers, rounding: Array, rows: Array, moved: list[Array]
) -> Truths:
    """Return which trials, moved in some ways, end otherwise: bool[way, row]."""
    every = np.concatenate([rows, *moved])
    answers = workers.simulate(study.model, every, study.settings)
    status = answers.status.reshape(-1, len(rows))
    responses = answers.responses.reshape(*status.shape, -1)
    differ = np.abs(responses[1:] - responses[0]) > rounding
    changes: Truths = differ.any(axis=2) | (status[1:] != status[0])
    return changes


def _chosen(
    trials: Trials, done: Integers, suspects: int, most: int = MOST_TRIALS
) -> Integers:
    """Return trials, int[n]: the first ones, and the ends of each response.

    As many as make the moved ones no more than the run has: FEWEST_TRIALS at least.
    """
    number = len(done) // (suspects * (2 + OTHERS))
    first = done[: min(max(number, FEWEST_TRIALS), most)]
    of_done = trials.responses[done]
    outermost = done[np.stack([of_done.argmin(0), of_done.argmax(0)], 1).ravel()]
    return np.unique(np.concatenate([first, outermost[: len(first)]]))


def halved_shares(
    study: Study,
    trials: Trials,
    assumed: Mapping[str, Assumed],
    slopes: Mapping[str, Mapping[str, float]],
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
        and is_turn(contributor.unit, assumed[contributor.name].tolerance)
    }
    effects = effects_of(out_of_limit, assumed, slopes, contributors)
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

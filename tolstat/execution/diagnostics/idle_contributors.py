"""Contributors that deviate and change nothing, as a name that misses does."""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.deviations.distributions import Tolerance
from tolstat.execution.diagnostics.halved_tolerances import is_turn
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.status import Status
from tolstat.study.study import Study

Indices = NDArray[np.int64]

ROUNDING = 1e-12  # of the largest value of a response: no change
FEWEST_TRIALS, MOST_TRIALS = 8, 64  # trials in which a contributor is moved
OTHERS = 4  # of these, whose deviation it takes, beside both ends of its tolerance


def idle_contributors(
    study: Study,
    trials: Trials,
    lower: Array,
    upper: Array,
    slopes: Array,
    workers: Workers,
) -> tuple[str, ...]:
    """Return the contributors that change no response, over their whole tolerance.

    The phase of a run-out is left out: it acts with its run-out.
    Those without a slope at the nominal trial are moved alone, all else as in stored
    trials: random ones, and those with the least and the largest responses. Slopes are
    float64[contributor, response], ends float64[contributor], SI.
    """
    done = np.flatnonzero(trials.status == Status.DONE)
    if not len(done):
        return ()
    rounding = ROUNDING * np.abs(trials.responses[done]).max(0)
    effects = np.abs(slopes) * (upper - lower)[:, None]
    moves = np.any(effects > rounding, axis=1)  # NaN where the nominal trial failed
    turns = [
        is_turn(contributor.unit, Tolerance(*ends))
        for contributor, *ends in zip(
            study.description.contributors, lower, upper, strict=True
        )
    ]
    suspects = np.flatnonzero((lower < upper) & ~moves & ~np.array(turns, np.bool_))
    if not len(suspects):
        return ()
    rows = trials.deviations[_chosen(trials, done, len(suspects))]
    ends = np.stack([lower, upper])
    values = np.concatenate([ends, rows[:: max(1, len(rows) // OTHERS)]])
    moved = np.tile(rows, (len(suspects), len(values), 1, 1))
    for i, column in enumerate(suspects):
        moved[i, :, :, column] = values[:, None, column]
    trials_moved = np.concatenate([rows, moved.reshape(-1, rows.shape[1])])
    answers = workers.simulate(study.model, trials_moved, study.settings)
    shape = (len(suspects), -1, len(rows))
    status = answers.status[len(rows) :].reshape(shape)
    responses = answers.responses[len(rows) :].reshape(*shape, len(rounding))
    before = answers.responses[: len(rows)]
    changed: Truths = np.any(status != answers.status[: len(rows)], axis=(1, 2))
    changed |= np.any(np.abs(responses - before) > rounding, axis=(1, 2, 3))
    names = [contributor.name for contributor in study.description.contributors]
    return tuple(names[i] for i in suspects[~changed])


def _chosen(trials: Trials, done: Indices, suspects: int) -> Indices:
    """Return trials, int[n]: the first ones, and the ends of each response.

    As many as make the moved ones no more than the run has: FEWEST_TRIALS at least,
    MOST_TRIALS at most.
    """
    number = len(done) // (suspects * (2 + OTHERS))
    first = done[: min(max(number, FEWEST_TRIALS), MOST_TRIALS)]
    of_done = trials.responses[done]
    outermost = done[np.stack([of_done.argmin(0), of_done.argmax(0)], 1).ravel()]
    return np.unique(np.concatenate([first, outermost[: len(first)]]))

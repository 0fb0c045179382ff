"""Trials of a rare run: each stage drawn once the answers to those before are known."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.rare_stage import Stage
from tolstat.execution.diagnostics.trial_selection import margins
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.status import Status
from tolstat.store.layout import DISTANCE, SPREAD, STAGE, WEIGHT
from tolstat.store.stored_run import Run
from tolstat.study.study import Study

Array = NDArray[np.float64]
Course = Generator[tuple[Stage, Array], Array, None]

NOT_YET = -1  # stage of a trial that has not been drawn


def columns_of(study: Study) -> dict[str, NDArray[np.float64]]:
    """Return what is stored beside the deviations, of trials that are not drawn yet."""
    if not study.rare:
        return {}
    names, n = (STAGE, SPREAD, DISTANCE, WEIGHT), study.trials
    found = {name: np.full(n, np.nan) for name in names}
    found[STAGE][:] = NOT_YET
    return found


def drawn_in_stages(
    study: Study,
    trials: Trials,
    write: Callable[[slice], None],
    workers: Workers | None = None,
) -> Iterator[int]:
    """Draw stage by stage.

    Parameters
    ----------
    study : Study
        Of a rare run.
    trials : Trials
        Deviations and columns of each stage are filled in.
    write : callable
        Called with the trials of each stage that is drawn.
    workers : Workers, optional
        Once they stop no stage is waited for: `Interrupted`. A fit among a hundred
        directions takes many seconds.

    Yields
    ------
    int
        How many trials are to be over before the next stage is drawn.
    """
    course, limit, first = study.stages(), study.limits[study.rare], 0
    number = 0
    stage, deviations = next(course)
    while True:
        rows = slice(first, first + len(deviations))
        trials.deviations[rows] = deviations
        for name, values in (
            (STAGE, np.full(len(deviations), float(number))),
            (SPREAD, stage.spread),
            (DISTANCE, stage.distance),
            (WEIGHT, stage.weight),
        ):
            trials.drawn[name][rows] = values
        write(rows)
        yield rows.stop
        within = margins(trials.response(study.rare)[rows], limit)
        within[trials.status[rows] != Status.DONE] = -np.inf  # failed: beyond
        drawn = (
            workers.here(_drawn, course, within) if workers else _drawn(course, within)
        )
        if drawn is None:
            return
        stage, deviations = drawn
        first, number = rows.stop, number + 1


def _drawn(course: Course, within: Array) -> tuple[Stage, Array] | None:
    """Draw the next stage; None after the last."""
    try:
        return course.send(within)
    except StopIteration:
        return None


def drawn_again(run: Run, study: Study, workers: Workers | None = None) -> Trials:
    """Draw the trials of a stored run again.

    Parameters
    ----------
    run : Run
        Stored; complete or not.
    study : Study
        Of it.
    workers : Workers, optional
        As of `drawn_in_stages`.

    Returns
    -------
    Trials
        Whose deviations are the study's, and whose answers are those that are stored
        whole. Those of a rare run are NaN from the first stage on that is drawn from
        answers which are not all there.
    """
    whole = run.status != Status.NOT_RUN
    whole[run.damage.trials] = False
    known = np.pad(whole, (0, study.trials - run.trials))
    trials = Trials.of_run(run, study.deviations(), known)
    trials.drawn = columns_of(study)
    if study.rare:
        for stop in drawn_in_stages(study, trials, lambda rows: None, workers):
            if not trials.status[:stop].all():
                break
        trials.forget(~is_drawn(trials.deviations))
    return trials


def is_drawn(deviations: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which trials are drawn: bool[trial]."""
    return np.asarray(~np.isnan(deviations).any(axis=1), np.bool_)

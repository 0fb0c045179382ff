"""Scenarios of cheap models: the same trials, evaluated with other deviations."""

import time
from pathlib import Path

import numpy as np

from tolstat.answers.what_if.fresh_study import edited
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.checked import simulate
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.study.editor import StudyChange
from tolstat.study.study import Study, load

TRIALS, PATIENCE = 20_000, 10.0  # trials in so many seconds, or as the run took
TRIED = 64  # trials that show how long they take


def is_cheap(run: Run, study: Study) -> bool:
    """Tell whether a scenario is evaluated rather than estimated from stored trials.

    A model that moves is as fast as in its run; of any other some trials are timed.
    """
    if run.aim or run.listed or not run.ended:
        return False
    seconds = float(run.provenance["seconds"])
    limit, per_trial = max(PATIENCE, seconds), seconds / run.ended
    if not study.model.integrates:
        done = np.flatnonzero(run.status == Status.DONE)[:TRIED]
        if not len(done):
            return False
        names = [contributor.name for contributor in study.description.contributors]
        deviations = np.column_stack([run.column(name)[done] for name in names])
        started = time.perf_counter()
        simulate(study.model, deviations, study.settings)
        elapsed = time.perf_counter() - started
        per_trial = min(per_trial, elapsed / len(done))
    return TRIALS * per_trial <= limit


def scenario_run(run: Run, study: Study, change: StudyChange) -> Run:
    """Return the run of a scenario, in memory, with the seed and trials of the run."""
    assert run.sampled is not None
    editor = edited(run, study, change).editor
    editor.table |= {"seed": run.sampled.seed, "trials": run.trials}
    folder = run.data_folder or Path()
    scenario = load(editor.table, model=study.model, folder=folder)
    with Workers(None) as workers:
        return execute(scenario, None, workers)

"""One study of a queue: run, resumed, or finished before."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from tolstat.catalogue import place_of
from tolstat.deviations.draw import SAMPLERS
from tolstat.errors import Advice, RunFileError, StoppedError
from tolstat.execution.compatibility import check_same, study_differs
from tolstat.execution.continuation import go_on, plan_again, study_of
from tolstat.execution.execute import execute, run_of
from tolstat.execution.run_loop import Telling
from tolstat.execution.trial_table import drawn_again
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.study import Study, load

FINISHED, RESUMED, FINISHED_BEFORE = "finished", "resumed", "finished before"


class Done(NamedTuple):
    """What became of a study."""

    run: Run  # complete, or as far as it came
    how: str  # "finished", "resumed" or "finished before"
    notes: tuple[str, ...] = ()  # what has to be known of it


def work_off(study_file: Path, workers: Workers, tell: Telling) -> Done:
    """See to it that the run of a study is complete; refuse one of another study."""
    study, path = load(study_file), run_of(study_file)
    if not os.path.lexists(path):
        run = execute(study, path, workers, progress=tell)
        return Done(run, FINISHED, study.doubts)
    run = open_run(path, damaged=True)
    _check_asked(run, study)
    if run.complete and not run.damage:
        again = study_of(run)
        try:
            drawn = drawn_again(run, again, workers).trials
        except Interrupted:
            raise StoppedError(f"stopped: the run in {path} is as it was") from None
        check_same(run, plan_again(run, again, drawn))
        notes = run.made_otherwise(study.model.source_digest)
        return Done(run, FINISHED_BEFORE, tuple(notes))
    del run  # its columns are not needed twice
    return Done(go_on(path, workers, progress=tell), RESUMED)


def _check_asked(run: Run, study: Study) -> None:
    """Refuse a run of another study, of another seed, or of fewer trials."""
    said, machine = study_differs(run, study.path), place_of(study.model)
    advice = []
    if run.sampled and run.sampled.seed != study.seed:
        said.append(f"seed: the run has {run.sampled.seed}, the study {study.seed}")
    if run.sampled and study.until and not run.rules:
        said.append(
            f"trials: the run has {run.trials} without a stopping rule; the study runs "
            f"until {', '.join(study.until.rules)}"
        )
    elif run.sampled and not run.rules and run.trials < study.trials:
        more = f"trials: the run has {run.trials}, the study {study.trials}"
        if not said and SAMPLERS[run.sampling].extensible:
            advice.append(Advice("extend", run.path, machine, study.trials))
        said.append(more)
    if said:
        assert study.path
        raise RunFileError(
            f"{run.path} is a run of another study: {'; '.join(said)}; it stays",
            *advice,
            Advice("replace run", study.path, machine),
        )

"""A study run and stored."""

from __future__ import annotations

import os
from concurrent.futures import Executor
from pathlib import Path
from typing import cast

from tolstat.errors import StoppedError, StudyError
from tolstat.execution.planning import cannot_be_built, plan_of
from tolstat.execution.run_loop import Progress, Telling, carry_out
from tolstat.execution.trial_table import Stages
from tolstat.execution.workers.crew import Workers
from tolstat.model.contract import Model
from tolstat.store.lock import Lock
from tolstat.store.open_run import open as open_run
from tolstat.store.run_writer import RunWriter
from tolstat.store.stored_run import Run
from tolstat.store.temporary_files import check_replaceable
from tolstat.study.study import Source, Study, load


def run(
    study: Source,
    *,
    trials: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
    output: str | os.PathLike[str] | None = None,
    force: bool = False,
    model: Model | None = None,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Run:
    """Run a study and store it.

    Parameters
    ----------
    study : path or mapping
        A study file, or what one would hold.
    trials, seed : int, optional
        Instead of the study's.
    workers : int, optional
        Threads; as many as there are processors if not given. The results do not
        depend on it.
    output : path, optional
        The run file; beside the study, with the ending .h5, if not given.
    force : bool
        Whether an existing run file may be replaced.
    model : Model, optional
        A custom model, of the name that the study gives.
    progress : callable, optional
        Called with a `Progress` whenever some trials are over.
    executor : concurrent.futures.Executor, optional
        Of other processes, which evaluate instead of threads: MPI's, a cluster's.

    Returns
    -------
    Run
        As `tolstat.open` returns it.

    Raises
    ------
    StudyError
        If the study is wrong.
    RunFileError
        If the run file exists already or cannot be written.
    """
    asked = load(study, model=model, trials=trials, seed=seed)
    if output is None and asked.path is None:
        raise StudyError(
            'a study that is no file needs the name of its run: output="run.h5"'
        )
    path = Path(output) if output is not None else run_of(cast(Path, asked.path))
    with Workers(workers, executor=executor) as crew:
        return execute(asked, path, crew, force=force, progress=progress)


def run_of(study: Path) -> Path:
    """Return where the run of a study file lies."""
    return study.parent / f"{study.stem}.h5"  # also of what is no file: "."


def execute(
    study: Study,
    path: Path,
    workers: Workers,
    *,
    force: bool = False,
    progress: Telling | None = None,
) -> Run:
    """Run a checked study.

    Once the workers stop the run ends early, with what is finished. Where nothing ran
    of what was to replace another run, that one is put back: StoppedError.
    """
    tell = progress or (lambda progress: None)
    check_replaceable(path, force=True)  # no lock is laid beside a device
    with Lock(path) as lock:
        stages = Stages(study)
        if doubt := cannot_be_built(study, stages.trials.deviations):
            tell(Progress(0, 0, study.trials, doubt=doubt))
        plan = plan_of(study, stages.trials, lock.path)
        with RunWriter.made(lock, plan, force=force) as file:
            carry_out(study, stages, file, workers, tell)
    if file.given_up:
        raise StoppedError(
            f"stopped before any trial was over: the run in {path} is as it was"
        )
    path = file.path
    del stages, plan, file  # before the trials that are stored are read
    return open_run(path)

"""A study run and stored."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.description import Model
from tolstat.machines.settings import fields_of
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.store.run import open as open_run
from tolstat.store.run_writer import Plan, RunWriter, SweptSetting
from tolstat.study.blocks import block_size, finished_blocks
from tolstat.study.evaluate import simulate
from tolstat.study.study import Study, load

# called with the numbers of trials that are over and that failed
Progress = Callable[[int, int], None]


def run(
    study: str | os.PathLike[str],
    *,
    trials: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
    output: str | os.PathLike[str] | None = None,
    force: bool = False,
    model: Model | None = None,
) -> Run:
    """Run a study and store it.

    Parameters
    ----------
    study : path
        A study file.
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
        A machine of your own, of the name that the study gives.

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
    path = Path(output) if output else asked.path.with_suffix(".h5")
    return execute(asked, path, workers=workers, force=force)


def execute(
    study: Study,
    path: Path,
    *,
    workers: int | None = None,
    force: bool = False,
    progress: Progress | None = None,
    stopping: Callable[[], bool] = lambda: False,
) -> Run:
    """Run a checked study on threads of this process.

    Parameters
    ----------
    study : Study
        What is asked.
    path : Path
        The run file.
    workers : int, optional
        Threads; as many as there are processors if not given.
    force : bool
        Whether an existing run file may be replaced.
    progress : callable, optional
        Called with the numbers of trials over and failed, whenever some are stored.
    stopping : callable
        Once true the run ends early; what is finished is stored.

    Returns
    -------
    Run
        Complete, or as far as it came.
    """
    workers = workers or processors()
    # threads: the integration releases the GIL, so one process, one compilation
    executor = ThreadPoolExecutor(workers, thread_name_prefix="worker")
    try:
        return execute_on(
            study,
            path,
            executor,
            workers,
            force=force,
            progress=progress,
            stopping=stopping,
        )
    finally:
        # who stops does not wait for a compilation
        executor.shutdown(wait=not stopping(), cancel_futures=True)


def execute_on(
    study: Study,
    path: Path,
    executor: Executor,
    workers: int,
    *,
    force: bool,
    progress: Progress | None,
    stopping: Callable[[], bool],
) -> Run:
    """Run a checked study on any executor; see `execute`."""
    deviations = study.deviations()
    began = time.perf_counter()
    over, failed = 0, 0
    plan = _plan(study, deviations)
    with RunWriter(path, plan, force=force) as file:
        # the nominal machine goes first; who finds its code not compiled waits for it
        none = np.zeros((1, deviations.shape[1]))
        nominal = executor.submit(simulate, study.model, none, study.settings)
        for blocks in finished_blocks(
            study.model, study.cases, deviations, executor,
            workers=workers, block=block_size(study.trials, workers), stopping=stopping,
        ):  # fmt: skip
            file.write_blocks(blocks)
            status = np.concatenate([outcome.status for _, outcome in blocks])
            over += int(np.count_nonzero(status != Status.NOT_RUN))
            failed += int(np.count_nonzero(status > Status.DONE))
            if progress:
                progress(over, failed)
        if nominal.done() or not stopping():
            file.write_nominal(nominal.result())
        file.write_end(time.perf_counter() - began)
    return open_run(path)


def _plan(study: Study, deviations: NDArray[np.float64]) -> Plan:
    """Say all that is known of a run before anything has run."""
    facts: dict[str, str | int] = {
        "title": study.title,
        "model": study.model.name,
        "sampling": study.sampling,
        "settings": repr(study.settings),
    }
    if study.seed is not None:
        facts["seed"] = study.seed
    if study.sampler:
        facts["replicates"] = study.sampler.replicates
        facts["promise"] = study.sampler.promise
    if study.notes:
        facts["notes"] = "\n".join(study.notes)
    swept = {}
    if study.points and study.points.swept:
        facts["grid"] = " ".join(axis.name for axis in study.points.swept)
        units = {axis.name: axis.unit for axis in study.points.swept}
        fields = fields_of(study.model)
        for name, values in (study.points.settings or {}).items():
            sentence = fields[name].metadata["sentence"]
            swept[name] = SweptSetting(values, units[name], sentence)
    return Plan(
        study.text,
        facts,
        study.description,
        deviations,
        {name: limit.permitted for name, limit in study.limits.items()},
        {name: limit.demanded for name, limit in study.limits.items()},
        swept,
        study.reference,
    )


def processors() -> int:
    """Count the processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1

"""A study run and stored."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.description import Model, Outcome
from tolstat.statistics.precision import FIRST, next_stage
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.store.run import open as open_run
from tolstat.store.run_writer import RunWriter
from tolstat.study.audit import tightened_cases
from tolstat.study.blocks import block_size, finished_blocks
from tolstat.study.evaluate import simulate
from tolstat.study.parallel import processors
from tolstat.study.plan import audit_of, plan_of
from tolstat.study.points import Case
from tolstat.study.study import Study, load
from tolstat.study.until import Until

# called with the numbers of trials that are over, that failed, and that are asked for
Progress = Callable[[int, int, int], None]
AUDIT_BLOCK = 8


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
        Called with the numbers of trials over, failed and asked for, whenever some
        are stored.
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
    audit = audit_of(study, study.trials)
    with RunWriter(path, plan_of(study, deviations, audit), force=force) as file:
        # the nominal machine goes first; who finds its code not compiled waits for it
        none = np.zeros((1, deviations.shape[1]))
        nominal = executor.submit(simulate, study.model, none, study.settings)
        status = np.zeros(len(deviations), np.uint8)
        responses = np.full((len(deviations), len(study.description.responses)), np.nan)
        stages = []
        first, stop = 0, study.trials
        if study.until:
            stop = min(FIRST, stop)
        while True:
            for blocks in finished_blocks(
                study.model, _between(study.cases, first, stop), deviations, executor,
                workers=workers, block=block_size(stop - first, workers),
                stopping=stopping,
            ):  # fmt: skip
                file.write_blocks(blocks)
                _take(blocks, status, responses)
                if progress:
                    over = int(np.count_nonzero(status != Status.NOT_RUN))
                    failed = int(np.count_nonzero(status > Status.DONE))
                    progress(over, failed, stop)
            stages.append(stop)
            if not study.until or stopping():
                break
            more = _more(study, status[:stop], responses[:stop])
            if not more or stop == study.trials:
                audit = audit_of(study, stop)
                file.write_nominal(nominal.result())
                file.keep(stop, audit, _stopped(study.until, stages, reached=not more))
                break
            first, stop = stop, min(more, study.trials)
        if nominal.done() or not stopping():
            file.write_nominal(nominal.result())
        if audit and not stopping():
            for blocks in finished_blocks(
                study.model, tightened_cases(study.cases, audit.trials),
                deviations[audit.trials], executor,
                workers=workers, block=AUDIT_BLOCK, stopping=stopping,
            ):  # fmt: skip
                file.write_audit(blocks)
        file.write_end(time.perf_counter() - began)
    return open_run(path)


def _between(cases: tuple[Case, ...], first: int, stop: int) -> tuple[Case, ...]:
    """Return what of the cases lies between two trials."""
    cut = (c._replace(first=max(c.first, first), stop=min(c.stop, stop)) for c in cases)
    return tuple(case for case in cut if case.first < case.stop)


def _take(
    blocks: list[tuple[int, Outcome]],
    status: NDArray[np.uint8],
    responses: NDArray[np.float64],
) -> None:
    """Keep finished blocks in memory."""
    for first, outcome in blocks:
        trials = slice(first, first + len(outcome.status))
        status[trials], responses[trials] = outcome.status, outcome.responses


def _more(
    study: Study, status: NDArray[np.uint8], responses: NDArray[np.float64]
) -> int:
    """Say how many trials the stopping rule wants in all; 0 if there are enough."""
    assert study.until and study.sampler  # checked with the study
    names = [response.name for response in study.description.responses]
    return next_stage(
        study.until.precisions,
        dict(zip(names, responses.T, strict=True)),
        Sample(status, study.sampler.replicates),
        {name: limit.permitted for name, limit in study.limits.items()},
    )


def _stopped(until: Until, stages: list[int], *, reached: bool) -> dict[str, Any]:
    """Say why the run has as many trials as it has."""
    return {
        "until": "; ".join(each.words for each in until.precisions),
        "until_reached": reached,
        "until_stages": " ".join(str(stage) for stage in stages),
    }

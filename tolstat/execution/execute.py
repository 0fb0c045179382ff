"""Runs of studies: started, resumed, extended."""

import os
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from tolstat.errors import Advice, Remedy, RunFileError, StoppedError
from tolstat.execution import compatibility
from tolstat.execution.planning import cannot_be_built, planned
from tolstat.execution.run_loop import Progress, Telling, carry_out
from tolstat.execution.stages import SampledStages, Trials
from tolstat.execution.workers.block_scheduler import Interrupted, Workers
from tolstat.model.contract import Model
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.files_beside import Lock, check_replaceable
from tolstat.store.memory_recorder import MemoryRecorder
from tolstat.store.open_run import existing
from tolstat.store.open_run import open as open_run
from tolstat.store.provenance import now
from tolstat.store.run_writer import Recorder, RunWriter
from tolstat.store.stored_run import IN_MEMORY, Run
from tolstat.study.files import path_of_study
from tolstat.study.sampling import Rule, deciding
from tolstat.study.study import Source, Study, load

STUDY_ENDING = ".toml"
FINISHED, RESUMED, FINISHED_BEFORE = "finished", "resumed", "finished before"


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
    """Run a study and store it, or keep it in memory.

    Parameters
    ----------
    study : path or mapping
        A study file, or its content as a mapping.
    trials, seed : int, optional
        Instead of the study's.
    workers : int, optional
        Number of threads; by default that of processors. The results do not depend on
        it.
    output : path, optional
        The run file; by default beside the study file, with the ending .h5. The run of
        a mapping is in memory without it: `tolstat.save` writes it later.
    force : bool
        Whether an existing run file may be replaced.
    model : Model, optional
        A custom model, whose name the study gives.
    progress : callable, optional
        Called with a `Progress` whenever some trials are over.
    executor : concurrent.futures.Executor, optional
        Evaluates in other processes instead of threads: of MPI, of a cluster.

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

    Examples
    --------
    >>> run = tolstat.run("runs/stack-up.toml", trials=1000, output="short.h5")
    >>> run.counts["done"], f"{1e3 * run.column('gap').mean():.3f} mm"
    (1000, '0.441 mm')
    """
    loaded = load(study, model=model, trials=trials, seed=seed)
    path = Path(output) if output is not None else loaded.path and run_of(loaded.path)
    with Workers(workers, executor=executor) as crew:
        return execute(loaded, path, crew, force=force, progress=progress)


def resume(
    path: str | os.PathLike[str],
    *,
    workers: int | None = None,
    model: Model | None = None,
    rerun_failed: bool = False,
    regardless: bool = False,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Run:
    """Run the missing trials of a run, and run damaged ones again.

    Parameters
    ----------
    path : path
        The run file.
    workers, model, progress, executor
        As in `tolstat.run`.
    rerun_failed : bool
        Whether failed trials are evaluated again at the end, with the model's tighter
        settings. They still count as failed; the answers are in `run.rerun`.
    regardless : bool
        Whether to continue although source, processor, versions or the study file have
        changed. The study text in the run counts; the run notes the changes.

    Returns
    -------
    Run
        The same run, bit for bit, as without interruption.

    Raises
    ------
    RunFileError
        If the run cannot be resumed; the message says what differs.
    """
    with Workers(workers, executor=executor) as crew:
        return go_on(
            Path(path), crew, model=model, rerun=rerun_failed, regardless=regardless,
            progress=progress,
        )  # fmt: skip


def extend(
    path: str | os.PathLike[str],
    trials: int,
    *,
    workers: int | None = None,
    model: Model | None = None,
    regardless: bool = False,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Run:
    """Add trials to a run.

    Parameters
    ----------
    path : path
        The run file.
    trials : int
        Total number of trials after the extension.
    workers, model, regardless, progress, executor
        As in `resume`.

    Returns
    -------
    Run
        The same run, bit for bit, as one of so many trials from the start.

    Raises
    ------
    RunFileError
        If the run has as many trials already, if its trials would change, or as in
        `resume`.

    Examples
    --------
    >>> tolstat.extend("runs/stack-up.h5", 20_000).trials
    20000
    """
    with Workers(workers, executor=executor) as crew:
        return go_on(
            Path(path), crew, trials=trials, model=model, regardless=regardless,
            progress=progress,
        )  # fmt: skip


def decide(
    source: Source | Run,
    *,
    at_most: int | str | None = None,
    slow: bool | None = None,
    workers: int | None = None,
    output: str | os.PathLike[str] | None = None,
    force: bool = False,
    model: Model | None = None,
    regardless: bool = False,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Run:
    """Run a study, or continue a run, until every limit is met or not met.

    Each verdict is wrong in at most 2.5 % of runs, whatever the distributions.

    Parameters
    ----------
    source : path, mapping or Run
        A study, as of `tolstat.run`, or a run of random sampling.
    at_most : int or str, optional
        A number of trials, or a time such as "60 s", after which limits may stay
        undecided; by default 200 000 trials, or more if these take less than a minute.
    slow : bool, optional
        Whether to evaluate mainly uncertain trials, of which fewer decide. By default
        by the kind of model, and of equations of motion by the trials that are needed.
    workers, output, force, model, progress, executor
        As in `tolstat.run`; a run is changed where it is.
    regardless
        As in `resume`.

    Returns
    -------
    Run
        Its trials are those of any run of this length. `run.stopped.reached` tells
        whether all limits are decided. A run that decides them already is unchanged.

    Raises
    ------
    StudyError
        If the study has no limit, or its trials are not random.
    RunFileError
        As in `tolstat.run` and `resume`.

    Examples
    --------
    >>> run = tolstat.decide("runs/stack-up.h5")
    >>> run.stopped.reached, run.trials
    (True, 11776)
    """
    rule = deciding(at_most, slow)
    with Workers(workers, executor=executor) as crew:
        file = path_of_study(source)
        if file and file.suffix != STUDY_ENDING:
            return go_on(
                file, crew, trials=rule, model=model, regardless=regardless,
                progress=progress,
            )  # fmt: skip
        study = load(source, model=model, trials=rule)
        path = Path(output) if output is not None else study.path and run_of(study.path)
        return execute(study, path, crew, force=force, progress=progress)


def run_of(study: Path) -> Path:
    """Return the path of the run of a study file."""
    return study.parent / f"{study.stem}.h5"  # also of "."


def execute(
    study: Study,
    path: Path | None,
    workers: Workers,
    *,
    force: bool = False,
    progress: Telling | None = None,
) -> Run:
    """Run a checked study, and return its run; without a path it is in memory.

    When the workers stop, the run ends early with the finished trials. If it would
    replace a run and no trial has finished, that run stays: StoppedError.
    """
    tell = progress or (lambda progress: None)
    if path:
        check_replaceable(path, force=True)  # no lock is laid beside a device
    with Lock(path) if path else nullcontext() as lock:
        try:
            stages = workers.call(SampledStages, study)
            _tell_impossible(study, stages.trials, workers, tell)
            place = lock.path if lock else IN_MEMORY
            plan = workers.call(planned, study, stages.trials)
            begun = Run.begun(plan, place, stages.trials.columns(study))
            recorder: Recorder = (
                RunWriter.made(lock, begun, force=force, by=workers)
                if lock
                else MemoryRecorder(begun)
            )
        except Interrupted:
            raise StoppedError("stopped before any trial ran") from None
        with recorder:
            carry_out(study, stages, recorder, workers, tell)
    del stages, begun  # frees memory before stored trials are read
    return recorder.recorded()


def go_on(
    path: Path,
    workers: Workers,
    *,
    trials: int | Rule | None = None,
    model: Model | None = None,
    rerun: bool = False,
    regardless: bool = False,
    progress: Telling | None = None,
) -> Run:
    """Resume a run: see `resume`; with trials, or a rule for them, see `extend`."""
    from tolstat.execution.sampled_again import (  # no new run needs it
        drawn_again,
        unchanged_if_stopped,
    )

    tell = progress or (lambda progress: None)
    with Lock(existing(path)) as lock:
        run = open_run(lock.path, damaged=True)
        if trials is not None:
            compatibility.check_extensible(run, trials)
        study = compatibility.study_of(run, trials, model)
        compatibility.check_rows(run, study, trials)
        if not isinstance(trials, int | None) and _is_decided(run):
            return run
        with unchanged_if_stopped(run):
            stages = drawn_again(run, study, workers)
            begun = workers.call(
                partial(_begun_again, run, study, stages.trials, regardless=regardless)
            )
            if trials is not None:
                _tell_impossible(study, stages.trials, workers, tell)
            rerun = rerun or run.rerun is not None
            status = stages.trials.status[: run.trials]
            nominal = run.nominal_values["status"] != Status.NOT_RUN.word
            nominal &= not run.damage.nominal
            del run  # its columns are in the trials
            file = RunWriter.opened(lock, begun, status, by=workers)
        with file:
            carry_out(study, stages, file, workers, tell, nominal=nominal, rerun=rerun)
    del stages, status, begun  # frees memory before the stored trials are read
    return file.recorded()


def _is_decided(run: Run) -> bool:
    """Return whether the trials of a run decide all of its limits."""
    from tolstat.statistics.deciding.looks import undecided  # seldom

    responses = {n: run.column(n) for n in run.limits}
    sample = Sample(run.status, thinned=run.thinned)
    whole = run.complete and bool(run.limits) and not run.damage
    return whole and not undecided(responses, sample, run.limits)


def _tell_impossible(
    study: Study, trials: Trials, workers: Workers, tell: Telling
) -> None:
    """Warn before any trial runs how many cannot be built; refuse if none can."""
    if warning := workers.call(
        cannot_be_built, study, trials.deviations[: trials.sampled]
    ):
        tell(Progress(0, 0, study.trials, warning=warning))


def _begun_again(run: Run, study: Study, trials: Trials, *, regardless: bool) -> Run:
    """Return a stored run with its plan made again; refuse it if it would change."""
    plan, columns = planned(study, trials), trials.columns(study)
    compatibility.check_same(run, plan, columns)
    notes = plan.notes if run.listed else run.notes
    longer = study.trials != run.trials or study.until is not None
    warnings = [
        *compatibility.study_differs(run),
        *compatibility.made_differently(run, study.model.source_digest),
    ]
    if warnings and not regardless:
        more = study.trials if longer and not study.until else 0
        decides = study.until and run.complete
        again = Remedy.DECIDE_REGARDLESS if decides else Remedy.RESUME_REGARDLESS
        raise RunFileError(
            f"{run.path} cannot be resumed as the same run: " + "; ".join(warnings),
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
            Advice(again, run.path, run.machine, more),
        )
    if warnings:
        notes = (*notes, f"resumed at {now()} although " + "; ".join(warnings))
    kept = [
        "study", "study_file", "made", "title", "machine", "source_digest", "replaces",
    ]  # fmt: skip
    if run.complete and not longer:
        kept += ["stopped", "audited", "rerun", "diagnostics", "complete"]
    as_stored = {name: getattr(run, name) for name in kept}
    rules = plan.rules if longer else run.rules
    as_before = run.isolation or plan.isolation
    plan = replace(plan, isolation=as_before, notes=notes, rules=rules)
    return replace(Run.begun(plan, run.path, columns), **as_stored)


class Completion(NamedTuple):
    """The run of a study, and how it was completed."""

    run: Run  # complete, or interrupted
    how: str  # "finished", "resumed" or "finished before"
    notes: tuple[str, ...] = ()  # warnings for the user


def complete(study_file: Path, workers: Workers, tell: Telling) -> Completion:
    """Return the complete run of a study; refuse the run of another study."""
    study, path = load(study_file), run_of(study_file)
    if not os.path.lexists(path):
        run = execute(study, path, workers, progress=tell)
        return Completion(run, FINISHED, study.warnings)
    from tolstat.execution.sampled_again import drawn_again, unchanged_if_stopped

    run = open_run(path, damaged=True)
    compatibility.check_asked(run, study)
    if run.complete and not run.damage:
        again = compatibility.study_of(run)
        with unchanged_if_stopped(run):
            trials = drawn_again(run, again, workers).trials
        plan, columns = planned(again, trials), trials.columns(again)
        compatibility.check_same(run, plan, columns)
        notes = compatibility.made_differently(run, study.model.source_digest)
        return Completion(run, FINISHED_BEFORE, tuple(notes))
    del run  # frees memory
    return Completion(go_on(path, workers, progress=tell), RESUMED)

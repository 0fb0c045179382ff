"""A stored run resumed: what is missing, more trials, failed ones again."""

from __future__ import annotations

import os
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from tolstat.deviations.draw import SAMPLERS
from tolstat.errors import Advice, RunFileError, StoppedError, StudyError
from tolstat.execution.compatibility import check_same, study_differs
from tolstat.execution.planning import cannot_be_built, plan_of
from tolstat.execution.run_loop import Progress, Telling, carry_out
from tolstat.execution.trial_table import Trials, drawn_again
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.model.contract import Model
from tolstat.status import Status
from tolstat.store.lock import Lock
from tolstat.store.open_run import existing
from tolstat.store.open_run import open as open_run
from tolstat.store.provenance import now
from tolstat.store.run_writer import RunWriter
from tolstat.store.stored_run import Run
from tolstat.study.study import Study, load


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
    """Finish what is missing of a run, and compute again what is damaged.

    Parameters
    ----------
    path : path
        The run file.
    workers, model, progress, executor
        As of `tolstat.run`.
    rerun_failed : bool
        Whether failed trials are evaluated again, with the model's tighter settings,
        once all are over. They still count as failed; the answers are in `run.rerun`.
    regardless : bool
        Whether to continue although source, processor, versions or the study file have
        changed: the run's own text is what counts, and the run says so.

    Returns
    -------
    Run
        Bit for bit the run that was never interrupted.

    Raises
    ------
    RunFileError
        If it is no run that can be continued: what differs.
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
        How many there are to be in all.
    workers, model, regardless, progress, executor
        As of `resume`.

    Returns
    -------
    Run
        Bit for bit one run of so many trials.

    Raises
    ------
    RunFileError
        If there are as many already, if other trials would then have to be drawn, or as
        of `resume`.
    """
    with Workers(workers, executor=executor) as crew:
        return go_on(
            Path(path), crew, trials=trials, model=model, regardless=regardless,
            progress=progress,
        )  # fmt: skip


def go_on(
    path: Path,
    workers: Workers,
    *,
    trials: int | None = None,
    model: Model | None = None,
    rerun: bool = False,
    regardless: bool = False,
    progress: Telling | None = None,
) -> Run:
    """Continue a run: see `resume`; with a number of trials see `extend`."""
    tell = progress or (lambda progress: None)
    with Lock(existing(path)) as lock:
        run = open_run(lock.path, damaged=True)
        if trials is not None:
            _check_wanted(run, trials)
        study = study_of(run, trials, model)
        try:
            stages = drawn_again(run, study, workers)
        except Interrupted:
            raise StoppedError(
                f"stopped before anything was done: the run in {run.path} is as it was",
                Advice("resume", run.path, run.machine),
            ) from None
        plan = _plan(run, study, stages.trials, regardless)
        drawn = stages.trials.deviations
        if trials is not None and (doubt := cannot_be_built(study, drawn)):
            tell(Progress(0, 0, study.trials, doubt=doubt))
        rerun = rerun or run.rerun is not None
        whole = stages.trials.status[: run.trials] != Status.NOT_RUN
        if run.complete and trials is None:
            plan = replace(
                plan, stopped=run.stopped, audited=run.audited, rerun=run.rerun,
                diagnostics=run.diagnostics, complete=True,
            )  # fmt: skip
        nominal = run.nominal_values["status"] != Status.NOT_RUN.word
        nominal &= not run.damage.nominal
        del run  # its columns are in the trials
        with RunWriter.opened(lock, plan, whole) as file:
            carry_out(study, stages, file, workers, tell, nominal=nominal, rerun=rerun)
    path = file.path
    del stages, drawn, plan, file  # before the trials that are stored are read
    return open_run(path)


def study_of(run: Run, trials: int | None = None, model: Model | None = None) -> Study:
    """Read the study of a run again, as the run has it."""
    folder = run.study_file.parent if run.study_file else None
    if run.sampled is None:
        return load(run.study.table, model=model, folder=folder)
    if trials is None and (run.complete or not run.rules):
        trials = run.trials
    return load(
        run.study.table,
        model=model,
        trials=trials,
        seed=run.sampled.seed,
        folder=folder,
    )


def plan_again(run: Run, study: Study, trials: Trials) -> Run:
    """Plan a run again, of `drawn_again`, in the words of the one that is stored."""
    same = study.trials == run.trials
    return replace(
        plan_of(study, trials, run.path),
        study=run.study,
        made=run.made,
        title=run.title,
        machine=run.machine,
        source_digest=run.source_digest,
        notes=run.notes,
        rules=run.rules if same else (),
        study_file=run.study_file,
    )


def _plan(run: Run, study: Study, trials: Trials, regardless: bool) -> Run:
    """Plan the run again, and refuse what would not be the same run."""
    plan = plan_again(run, study, trials)
    check_same(run, plan)
    differing = run.made_otherwise(study.model.source_digest)
    doubts = [*study_differs(run), *differing]
    if doubts and not regardless:
        raise RunFileError(
            f"{run.path} would not become the run that it was to be: "
            + "; ".join(doubts),
            Advice("run again", run.path, run.machine, run=run),
            Advice(
                "resume regardless", run.path, run.machine,
                study.trials if study.trials > run.trials else 0,
            ),
        )  # fmt: skip
    if doubts:
        note = f"resumed at {now()} although " + "; ".join(doubts)
        plan = replace(plan, notes=(*run.notes, note))
    return plan


def _check_wanted(run: Run, trials: int) -> None:
    """Refuse more trials where they would not be added to those that there are."""
    if run.sampled is None:
        raise RunFileError(
            f'{run.path}: sampling = "{run.sampling}" draws nothing; its trials are '
            "those of the study"
        )
    if run.rules and not run.complete:
        raise RunFileError(
            f"{run.path} is not complete: {run.ended} of at most {run.trials} trials "
            "have run; finish it first",
            Advice("resume", run.path, run.machine),
        )
    if trials <= run.trials:
        raise RunFileError(
            f"{run.path} has {run.trials} trials; more than that are expected"
        )
    if not SAMPLERS[run.sampling].extensible:
        raise StudyError(
            f'{run.path}: sampling = "{run.sampling}" is made for a number of trials: '
            f"with {trials} every one would differ",
            Advice("run again", run.path, run.machine, trials, run),
        )

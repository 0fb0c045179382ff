"""The loop of a run: nominal trial, stages in blocks, audit, diagnostics."""

from collections.abc import Callable
from contextlib import chdir, suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import LostError, ModelError
from tolstat.execution.diagnostics.after_run import gather
from tolstat.execution.diagnostics.audit import Choice, audit, evaluated_again
from tolstat.execution.trial_table import Stages, Trials
from tolstat.execution.verification import check_block
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.statistics.intervals.convergence import FIRST, next_stage, trials_wanted
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.run_records import Audited, Diagnostics, Stopped
from tolstat.store.run_writer import Recorder
from tolstat.store.stored_run import Run
from tolstat.study.given_points import Case
from tolstat.study.study import Study

LONGER = 10  # times as long as every checked block is the next one


class Progress(NamedTuple):
    """Progress of a run."""

    # trials finished, trials failed, and trials in this stage
    over: int
    failed: int
    asked: int
    doing: str = "trials"  # or what follows them: "audit", "diagnostics"
    # trials that the stopping rule needs by its first look, if these are more than
    # it may have; infinite if not known yet, else 0
    wanted: float = 0.0
    rules: tuple[str, ...] = ()  # this stopping rule, as it is written
    at_most: int = 0  # most trials that it may have
    warning: str = ""  # for the user, before any trial runs


Telling = Callable[[Progress], None]


def carry_out(
    study: Study,
    stages: Stages,
    file: Recorder,
    workers: Workers,
    tell: Telling,
    *,
    nominal: bool = False,
    rerun: bool = False,
) -> None:
    """Run the missing trials of a study into its file.

    When the workers stop, it ends early with the finished trials. `nominal`: the
    nominal trial is stored already. `rerun`: failed trials are evaluated again at the
    end. A complete run keeps its diagnostics.
    """
    try:
        with suppress(Interrupted), chdir("."):  # a model may leave it
            try:
                if not nominal:
                    # first and alone: code that is not compiled yet is compiled once
                    alone = np.zeros((1, len(study.description.contributors)))
                    found = workers.simulate(study.model, alone, study.settings)
                    file.write_nominal(found)
                looks, wanted = _evaluate(study, stages, file, workers, tell)
            except ModelError as error:
                if (broken := file.failed(error)) is error:
                    raise
                raise broken from error
            over = stages.trials.first(looks[-1])
            ended = run = file.run
            if not run.complete:
                ended = _ended(run, study, over, looks, wanted, workers, tell)
            if rerun and over.failed:
                ended = replace(ended, rerun=_rerun(study, over, workers))
            if ended is not run:
                file.finish(ended)
    except LostError as error:
        raise file.failed(error) from error


def _evaluate(
    study: Study,
    stages: Stages,
    file: Recorder,
    workers: Workers,
    tell: Telling,
) -> tuple[list[int], float]:
    """Evaluate the missing trials, stage by stage.

    While trials alone are exact, the first block and each far longer one is checked.
    Return the number of finished trials at each look of the stopping rule, and how many
    it wants at the last one.
    """
    trials, until, looks, wanted = stages.trials, study.until, list[int](), 0.0
    most, checked, exact = stages.latest.stop, 1 / LONGER, True
    stop = min(FIRST, most) if until else most
    while True:
        cases = _missing(study.cases, trials.status[:stop])
        for blocks in workers.blocks(study.model, cases, trials.deviations):
            first, block = max(blocks, key=lambda each: len(each[1].status))
            if exact and len(block.status) > LONGER * checked:
                checked = len(block.status)
                with suppress(Interrupted):  # finished blocks are written
                    exact = check_block(study, first, block, trials.deviations, workers)
            file.write_blocks(blocks)
            trials.take(blocks)
            tell(Progress(trials.over, trials.failed, stop))
        if not trials.status[:stop].all():
            raise Interrupted
        looks.append(stop)
        wanted = _wanted(study, trials, stop, workers) if until else 0.0
        if until and wanted and stop < most:
            if wanted > most and stop == FIRST:
                state = Progress(trials.over, trials.failed, stop)
                tell(state._replace(wanted=wanted, rules=until.rules, at_most=most))
            stop = min(next_stage(stop, wanted), most)
        elif stop == most and stages.draw_next(workers):
            file.write_drawn(stages.latest)
            stop = most = stages.latest.stop
        else:
            return looks, wanted


def _missing(cases: tuple[Case, ...], status: NDArray[np.uint8]) -> list[Case]:
    """Return the parts of the cases that have not run: trials without a status."""
    found = []
    for case in cases:
        missing = status[case.first : case.stop] == Status.NOT_RUN
        ends = np.flatnonzero(np.diff(np.pad(missing.astype(np.int8), 1)))
        for first, stop in (case.first + ends.reshape(-1, 2)).tolist():
            found.append(case._replace(first=first, stop=stop))
    return found


def _wanted(study: Study, trials: Trials, over: int, workers: Workers) -> float:
    """Return how many trials the stopping rule needs in all; 0 if there are enough.

    With many trials that takes seconds: `Interrupted` once the workers stop.
    """
    assert study.until and study.sampler  # checked with the study
    responses = study.description.responses
    names = [response.name for response in responses]
    wanted: float = workers.here(
        trials_wanted,
        study.until.precisions,
        dict(zip(names, trials.responses[:over].T, strict=True)),
        Sample(trials.status[:over], study.sampler.replicates),
        {name: limit.permitted for name, limit in study.limits.items()},
        {each.name: each.range for each in responses if each.range},
    )
    return wanted


def _ended(
    run: Run,
    study: Study,
    trials: Trials,
    looks: list[int],
    wanted: float,
    workers: Workers,
    tell: Telling,
) -> Run:
    """Return the complete run: audit and diagnostics follow its trials."""
    stopped, over = None, len(trials.status)
    if study.until:
        stopped = Stopped(
            study.until.rules, not wanted, tuple(looks), study.trials, wanted
        )
    audited = None
    try:
        tell(Progress(over, trials.failed, over, "audit"))
        audited = audit(study, trials, workers)
        tell(Progress(over, trials.failed, over, "diagnostics"))
        diagnostics = gather(study, trials, workers)
    except ModelError as error:  # keep the trials although diagnostics fail
        diagnostics = Diagnostics(missing=str(error))
    return replace(
        run.first(over),
        stopped=stopped,
        audited=audited,
        diagnostics=diagnostics,
        complete=True,
    )


def _rerun(study: Study, trials: Trials, workers: Workers) -> Audited:
    """Return the failed trials, evaluated again with tighter settings."""
    failed = np.flatnonzero(trials.status != Status.DONE)
    found = evaluated_again(study, trials, Choice(failed, failed < 0, {}), workers)
    if found is None:
        raise ModelError(
            f"model '{study.model.name}' has no tighter settings, so failed trials "
            "would fail again"
        )
    return found

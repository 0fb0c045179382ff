"""The loop: a proposer gives a stage, workers evaluate it, the record takes it."""

import time
import warnings
from collections.abc import Callable
from contextlib import chdir, suppress
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.errors import LostError, ModelError
from tolstat.execution.diagnostics.audit import audit, evaluated_again
from tolstat.execution.diagnostics.audit_selection import Selection
from tolstat.execution.diagnostics.influence import (
    WHOLE,
    halved_shares,
    idle_contributors,
    slopes,
    slopes_by_name,
    tolerance_ends,
)
from tolstat.execution.diagnostics.worst_cases import few_moved, worst_cases
from tolstat.execution.planning import details_of
from tolstat.execution.stages import (
    MOST_WITH_OUTPUT,
    Proposer,
    StoppingRule,
    StudyStages,
    Trials,
    UntilPrecise,
    rows_of,
)
from tolstat.execution.workers.block_scheduler import Interrupted, Workers
from tolstat.model.contract import Model, TrialResults
from tolstat.status import FIRST_OWN, Status
from tolstat.store.run_records import Audited, Diagnostics, Isolation
from tolstat.store.run_writer import Blocks, Recorder
from tolstat.store.stored_run import ROUNDING, Run
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study

FAILED = Status.TOO_MANY_STEPS, Status.STEP_TOO_SMALL, Status.NOT_FINITE
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


def evaluate_stages(
    model: Model,
    proposer: Proposer,
    trials: Trials,
    workers: Workers,
    tell: Telling,
    *,
    doing: str = "trials",
    file: Recorder | None = None,
    check: Callable[[Blocks], None] = lambda blocks: None,
    look: Callable[[], None] = lambda: None,
    late: Callable[[], bool] = lambda: False,
) -> int:
    """Evaluate stages until the proposer has none; return the number of trials.

    Trials that are over are not evaluated again. With a file, deviations are stored
    before their trials run, and blocks once they are checked; then they are looked at.
    `Interrupted` if the workers stop. Once it is `late`, no block of a stage starts any
    more, and the proposer is asked again.
    """
    stop = trials.sampled
    while stage := workers.call(proposer.next, trials):
        if stage.shortfall:
            state = Progress(trials.ended, trials.failed, trials.ended, doing)
            tell(state._replace(**stage.shortfall._asdict()))
        if trials.add(stage) and file:
            file.write_drawn(slice(stage.first, stage.stop))
        stop = stage.stop
        missing = trials.missing(stage)
        if known := stage.answers:
            rows = ((case.first, range(case.first, case.stop)) for case in missing)
            finished = iter([[(first, rows_of(known, r)) for first, r in rows]])
        else:
            finished = workers.blocks(model, missing, trials.deviations, late)
        for blocks in finished:
            if not known:
                check(blocks)
            if file:
                file.write_blocks(blocks)
            trials.take(blocks)
            tell(Progress(trials.ended, trials.failed, stop, doing))
            look()
        if not trials.status[:stop].all() and (workers.stopping() or not late()):
            raise Interrupted
    return stop


def carry_out(
    study: Study,
    stages: StudyStages,
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
    trials, until = stages.trials, _stopping_rule(study, stages)
    try:
        with suppress(Interrupted), chdir("."):  # a model may leave it
            try:
                if not nominal:
                    # first and alone: code that is not compiled yet is compiled once
                    alone = np.zeros((1, len(study.description.contributors)))
                    file.write_nominal(_nominal(study, alone, workers))
                while True:
                    number = evaluate_stages(
                        study.model, until or stages, trials, workers, tell, file=file,
                        check=BlockCheck(study, trials, workers),
                        look=partial(stop_if_none_is_done, study, trials, workers),
                        late=partial(until.is_late, trials) if until else bool,
                    )  # fmt: skip
                    if not (until and until.rows):
                        break
                    study = workers.call(until.lengthen, trials)
                    columns, details = trials.columns(study), details_of(trials)
                    longer = replace(file.run, columns=columns, details=details)
                    file.write_again(longer, workers)
            except ModelError as error:
                if (broken := file.failed(error)) is error:
                    raise
                raise broken from error
            stopped = until.stopped if until else None
            trials = trials.first(stopped.stages[-1] if stopped else number)
            ended = run = file.run
            if not run.complete:
                ended = _with_diagnostics(run, study, trials, workers, tell)
                ended = _with_output(ended, study, trials)
                ended = replace(ended, stopped=stopped)
            if rerun and trials.failed:
                ended = replace(ended, rerun=_rerun(study, trials, workers))
            if ended is not run:
                file.write_again(ended, workers)
        if not file.run.complete and trials.output:  # else it would be lost
            with suppress(Interrupted):
                file.write_again(_with_output(file.run, study, trials), workers)
    except LostError as error:
        raise file.failed(error) from error


def _nominal(study: Study, alone: Array, workers: Workers) -> TrialResults:
    """Return the answer of the nominal trial; refuse a model that crashes in it.

    One that needs its answer is refused without it, too.
    """
    began = time.perf_counter()
    answers = workers.simulate(study.model, alone, study.settings)
    if part := study.model.isolation:
        part.learn(time.perf_counter() - began)
    if answers.status[0] in (Status.CRASHED, Status.TOOK_TOO_LONG):
        word = Status(answers.status[0]).word
        raise study.model.fault(
            f"the nominal trial {word}: {answers.output.get(0, '')}"
        )
    if study.model.needs_nominal and answers.status[0] >= FIRST_OWN:
        raise study.model.fault(
            f"the nominal trial has no answer: {answers.output.get(0, '')}"
        )
    return answers


def _with_output(run: Run, study: Study, trials: Trials) -> Run:
    """Return a run with what trials printed that failed, if they are isolated."""
    part = study.model.isolation
    if part is None:
        return run
    output = {**trials.output, **(run.isolation.output if run.isolation else {})}
    first = dict(sorted(output.items())[:MOST_WITH_OUTPUT])
    return replace(run, isolation=Isolation(part.longest, first))


def _stopping_rule(study: Study, stages: StudyStages) -> StoppingRule | None:
    if study.until and study.until.budget:
        from tolstat.execution.thinned_stages import ThinnedStages  # seldom
        from tolstat.execution.until_decided import UntilDecided

        thinned = stages if isinstance(stages, ThinnedStages) else None
        return UntilDecided(study, thinned)
    return UntilPrecise(study) if study.until else None


def stop_if_none_is_done(study: Study, trials: Trials, workers: Workers) -> None:
    """Stop a run whose first trials all fail in the integration: a ModelError.

    It says where one of them ended, and by which state.
    """
    if not study.model.integrates or trials.failed < trials.ended:
        return
    ended = np.flatnonzero(trials.status)
    status = trials.status[ended]
    if not np.isin(status, FAILED).all():
        return
    from tolstat.execution.diagnostics.kinks import why_failed  # and the integrator

    first = ended[:1]
    (case,) = cases_among(study.cases, first)
    row = trials.deviations[first]
    why = workers.call(why_failed, study.model, row, case.settings).rstrip(".")
    code = int(np.bincount(status).argmax())
    words = f"{len(ended)}; {Status(code).word}"
    raise study.model.fault(f"all trials of the first block fail ({words}). {why}")


class BlockCheck:
    """Checks the first block and each far longer one, while trials alone are exact."""

    def __init__(self, study: Study, trials: Trials, workers: Workers) -> None:
        self._study, self._trials, self._workers = study, trials, workers
        self._longest, self._exact = 1 / LONGER, True

    def __call__(self, blocks: Blocks) -> None:
        """Check the longest of some blocks."""
        first, block = max(blocks, key=lambda block: len(block[1].status))
        if self._exact and len(block.status) > LONGER * self._longest:
            self._longest = len(block.status)
            with suppress(Interrupted):  # finished blocks are written
                self._exact = self._is_exact(first, block)

    def _is_exact(self, first: int, block: TrialResults) -> bool:
        """Return whether a trial of a block answers alone as it did in the block.

        `first` is the number of the first trial of the block. Its last trial that is
        done is checked, or the last. Other rounding is a warning, else a ModelError.
        """
        model = self._study.model
        done = np.flatnonzero(block.status == Status.DONE)
        row = int(done[-1]) if len(done) else len(block.status) - 1
        trial = np.array([first + row])
        alone = self._workers.simulate_cases(
            model, cases_among(self._study.cases, trial), self._trials.deviations[trial]
        )
        among = rows_of(block, [row])
        if not other_results(among, alone).any():
            return True
        message = (
            f"the answer of trial {first + row} depends on the other trials of "
            "its block; evaluate must compute each row of deviations by itself"
        )
        values, single = (np.nan_to_num(x.responses) for x in (among, alone))
        sizes = np.abs(np.nan_to_num(block.responses)).max(axis=0)
        close = np.abs(values - single) <= ROUNDING * sizes
        if not close.all() or (among.status != alone.status).any():
            raise model.fault(message)
        advice = "in its last bits; write (a * b).sum(axis=1) instead of a @ b"
        warnings.warn(f"{message} ({advice})", RuntimeWarning, stacklevel=2)
        return False


def other_results(first: TrialResults, second: TrialResults) -> Truths:
    """Return which trials have other answers in any bit; one NaN is like another."""
    a, b = (np.ascontiguousarray(x.responses) for x in (first, second))
    same = (a.view(np.uint64) == b.view(np.uint64)) | (np.isnan(a) & np.isnan(b))
    differ = ~same.all(axis=1) | (first.status != second.status)
    if first.steps is not None and second.steps is not None:
        differ |= first.steps != second.steps
    return np.asarray(differ)


def _with_diagnostics(
    run: Run, study: Study, trials: Trials, workers: Workers, tell: Telling
) -> Run:
    """Return the complete run: audit and diagnostics follow its trials."""
    audited, number = None, len(trials.status)
    try:
        tell(Progress(number, trials.failed, number, "audit"))
        audited = workers.call(audit, study, trials, workers)
        tell(Progress(number, trials.failed, number, "diagnostics"))
        diagnostics = workers.call(_diagnostics, run, study, trials, workers)
    except ModelError as error:  # keep the trials although diagnostics fail
        diagnostics = Diagnostics(missing=str(error))
    few = few_moved(study, tolerance_ends(study)) if diagnostics.worst_cases else ()
    notes = tuple(dict.fromkeys([*run.notes, *study.model.notes(), *few]))
    return replace(
        run.first(number),
        audited=audited,
        diagnostics=diagnostics,
        notes=notes,
        complete=True,
    )


def _diagnostics(
    run: Run, study: Study, trials: Trials, workers: Workers
) -> Diagnostics:
    """Return the diagnostics of a run; none if no deviations were sampled."""
    if study.sampler is None:
        return Diagnostics(missing="no deviations were drawn")
    if study.answers:
        return Diagnostics(halved=halved_shares(study, trials, run.assumed, {}))
    random = trials.random
    ends = tolerance_ends(study)
    usual = (ends[1] - ends[0]) / WHOLE  # sigma of a normal part at Cp = 1
    largest = np.fmax.reduce(trials.responses, axis=0)
    sizes = np.fmax(largest, -np.fmin.reduce(trials.responses, axis=0))
    table = slopes(study.model, study.settings, usual, workers, sizes=sizes)
    by_name = slopes_by_name(study, table, usual > 0)
    return Diagnostics(
        by_name,
        worst_cases(study, trials, ends, table, workers),
        halved_shares(study, random, run.assumed, by_name),
        idle_contributors(study, trials, ends, table, workers),
    )


def _rerun(study: Study, trials: Trials, workers: Workers) -> Audited:
    """Return the failed trials, evaluated again with tighter settings."""
    failed = np.flatnonzero(trials.status != Status.DONE)
    again = evaluated_again(study, trials, Selection(failed, failed < 0, {}), workers)
    if again is None:
        raise ModelError(
            f"model '{study.model.name}' has no tighter settings, so failed trials "
            "would fail again"
        )
    return again

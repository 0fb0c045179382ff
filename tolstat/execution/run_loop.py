"""Trials carried out: nominal machine, stages of blocks, ending."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import LostError, ModelError
from tolstat.execution.diagnostics.after_run import gather
from tolstat.execution.diagnostics.audit import audit, evaluated_again
from tolstat.execution.rare_loop import drawn_in_stages
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.statistics.intervals.precision import FIRST, next_stage, trials_wanted
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.audited import Audited
from tolstat.store.run_records import Ending, Stopped
from tolstat.store.run_writer import RunWriter
from tolstat.store.stored_diagnostics import Diagnostics
from tolstat.study.given_points import Case
from tolstat.study.study import Study


class Progress(NamedTuple):
    """How far a run is.

    Attributes
    ----------
    over, failed, asked : int
        Trials that are over, those of them that failed, and all of this stage.
    doing : str
        "trials", or what follows them: "audit", "diagnostics".
    wanted : float
        Trials that the stopping rule asks for after its first look, if these are more
        than it may have; infinite where it cannot tell yet, else 0.
    rules : tuple of str
        This stopping rule, as it is written.
    at_most : int
        Trials that it may have.
    doubt : str
        What has to be known before any trial runs.
    """

    over: int
    failed: int
    asked: int
    doing: str = "trials"
    wanted: float = 0.0
    rules: tuple[str, ...] = ()
    at_most: int = 0
    doubt: str = ""


Telling = Callable[[Progress], None]


def carry_out(
    study: Study,
    trials: Trials,
    file: RunWriter,
    workers: Workers,
    tell: Telling,
    *,
    nominal: bool = False,
    ending: Ending | None = None,
    rerun: bool = False,
) -> None:
    """Run what is missing of a study into its file.

    Once the workers stop it ends early, with what is finished. `nominal` says that the
    nominal machine is stored already; an `ending` of before stays; with `rerun` failed
    trials are evaluated again, once all are over.
    """
    try:
        with suppress(Interrupted):
            try:
                stages = _evaluate(study, trials, file, workers, tell, nominal=nominal)
            except ModelError as error:
                if broken := file.failed(error):
                    raise broken from error
                raise
            over, found = trials.first(stages[-1]), ending
            if found is None:
                found = _ending(study, over, stages, workers, tell)
            if rerun and over.failed:
                found = found._replace(rerun=_rerun(study, over, workers))
            if found is not ending:
                file.finish(found)
    except LostError as error:
        raise file.cut_short(error) from error


def _evaluate(
    study: Study,
    trials: Trials,
    file: RunWriter,
    workers: Workers,
    tell: Telling,
    *,
    nominal: bool,
) -> list[int]:
    """Evaluate what is missing; return how many trials were over at each look."""
    if not nominal:
        # alone and first: who finds code that is not compiled waits for it here
        alone = np.zeros((1, len(study.description.contributors)))
        file.write_nominal(workers.simulate(study.model, alone, study.settings))
    stages: list[int] = []
    for stop in _stages(study, trials, file, workers, tell):
        cases = _missing(study.cases, trials.status[:stop])
        for blocks in workers.blocks(study.model, cases, trials.deviations):
            file.write_blocks(blocks)
            trials.take(blocks)
            tell(Progress(trials.over, trials.failed, stop))
        if not trials.status[:stop].all():
            raise Interrupted
        stages.append(stop)
    return stages


def _rerun(study: Study, trials: Trials, workers: Workers) -> Audited:
    """Evaluate the failed trials again, with tighter settings."""
    failed = np.flatnonzero(trials.status != Status.DONE)
    found = evaluated_again(study, trials, failed, workers)
    if found is None:
        raise ModelError(
            f"model '{study.model.name}' has no tighter settings: what failed would "
            "fail again"
        )
    return found


def _stages(
    study: Study, trials: Trials, file: RunWriter, workers: Workers, tell: Telling
) -> Iterator[int]:
    """Yield how many trials are to be over before anyone looks at them again."""
    if study.rare:
        yield from drawn_in_stages(study, trials, file.write_drawn, workers)
        return
    stop = min(FIRST, study.trials) if study.until else study.trials
    yield stop
    while stop < study.trials and (wanted := _wanted(study, trials, stop)):
        if wanted > study.trials and stop == FIRST:
            rules = study.until.rules if study.until else ()
            state = Progress(trials.over, trials.failed, stop)
            tell(state._replace(wanted=wanted, rules=rules, at_most=study.trials))
        stop = min(next_stage(stop, wanted), study.trials)
        yield stop


def _wanted(study: Study, trials: Trials, over: int) -> float:
    """Say how many trials the stopping rule wants in all; 0 if there are enough."""
    if study.until is None:
        return 0.0
    assert study.sampler  # checked with the study
    responses = study.description.responses
    names = [response.name for response in responses]
    return trials_wanted(
        study.until.precisions,
        dict(zip(names, trials.responses[:over].T, strict=True)),
        Sample(trials.status[:over], study.sampler.replicates),
        {name: limit.permitted for name, limit in study.limits.items()},
        {each.name: each.range for each in responses if each.range},
    )


def _missing(cases: tuple[Case, ...], status: NDArray[np.uint8]) -> list[Case]:
    """Return what of the cases has not run: stretches of trials without a status."""
    found = []
    for case in cases:
        missing = status[case.first : case.stop] == Status.NOT_RUN
        ends = np.flatnonzero(np.diff(np.pad(missing.astype(np.int8), 1)))
        for first, stop in (case.first + ends.reshape(-1, 2)).tolist():
            found.append(case._replace(first=first, stop=stop))
    return found


def _ending(
    study: Study, trials: Trials, stages: list[int], workers: Workers, tell: Telling
) -> Ending:
    """Evaluate what is wanted beyond the trials, all of which are over."""
    stopped = None
    if study.until:
        wanted = _wanted(study, trials, trials.over)
        stopped = Stopped(
            study.until.rules, not wanted, tuple(stages), study.trials, wanted
        )
    audited = None
    try:
        tell(Progress(trials.over, trials.failed, trials.over, "audit"))
        audited = audit(study, trials, workers)
        tell(Progress(trials.over, trials.failed, trials.over, "diagnostics"))
        diagnostics = gather(study, trials, audited, workers)
    except ModelError as error:  # the trials are worth more than what follows them
        diagnostics = Diagnostics(missing=str(error))
    return Ending(trials.over, stopped, audited, diagnostics)

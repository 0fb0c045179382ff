"""A study run and stored: plan, nominal machine, stages of blocks, ending."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tolstat.errors import ModelError, StudyError
from tolstat.execution.audit import audit
from tolstat.execution.further import gather
from tolstat.execution.planning import plan_of
from tolstat.execution.trials import Trials
from tolstat.execution.workers import Interrupted, Workers
from tolstat.model.contract import Model
from tolstat.statistics.precision import FIRST, next_stage, trials_wanted
from tolstat.statistics.sample import Sample
from tolstat.store.evidence import Evidence
from tolstat.store.opening import open as open_run
from tolstat.store.plan import Ending, Stopped
from tolstat.store.run import Run
from tolstat.store.run_writer import RunWriter
from tolstat.study.points import Case
from tolstat.study.study import Source, Study, load


class Progress(NamedTuple):
    """How far a run is.

    Attributes
    ----------
    over, failed, asked : int
        Trials that are over, those of them that failed, and all of this stage.
    doing : str
        "trials", or what follows them: "audit", "evidence".
    wanted : float
        Trials that the stopping rule asks for after its first look, if these are more
        than it may have; infinite where it cannot tell yet, else 0.
    """

    over: int
    failed: int
    asked: int
    doing: str = "trials"
    wanted: float = 0.0


Telling = Callable[[Progress], None]


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
        A machine of your own, of the name that the study gives.
    progress : callable, optional
        Called with a `Progress` whenever some trials are over.

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
    with Workers(workers) as crew:
        path = _run_file(asked, output)
        return execute(asked, path, crew, force=force, progress=progress)


def _run_file(study: Study, output: str | os.PathLike[str] | None) -> Path:
    """Name the file of a run: beside its study if not said otherwise."""
    if output is not None:
        return Path(output)
    if study.path is None:
        raise StudyError(
            'a study that is no file needs the name of its run: output="run.h5"'
        )
    return study.path.with_suffix(".h5")


def execute(
    study: Study,
    path: Path,
    workers: Workers,
    *,
    force: bool = False,
    progress: Telling | None = None,
) -> Run:
    """Run a checked study.

    Parameters
    ----------
    study : Study
        What is asked.
    path : Path
        The run file.
    workers : Workers
        Who evaluate; once they stop the run ends early, with what is finished.
    force : bool
        Whether an existing run file may be replaced.
    progress : callable, optional
        As of `run`.

    Returns
    -------
    Run
        Complete, or as far as it came.
    """
    _carry_out(study, path, workers, force, progress or (lambda progress: None))
    return open_run(path)  # whose trials are read when those that ran are let go


def _carry_out(
    study: Study, path: Path, workers: Workers, force: bool, tell: Telling
) -> None:
    """Run a checked study into its file: plan, nominal machine, stages, ending."""
    trials = Trials.planned(study.description, study.deviations())
    plan = plan_of(study, trials.deviations)
    stages: list[int] = []
    with RunWriter(path, plan, force=force) as file, suppress(Interrupted):
        # alone and first: who finds code that is not compiled waits for it here
        nominal = np.zeros((1, len(study.description.contributors)))
        file.write_nominal(workers.simulate(study.model, nominal, study.settings))
        for stop in _stages(study, trials, tell):
            cases = _between(study.cases, trials.over, stop)
            for blocks in workers.blocks(study.model, cases, trials.deviations):
                file.write_blocks(blocks)
                trials.take(blocks)
                tell(Progress(trials.over, trials.failed, stop))
            if trials.over < stop:
                raise Interrupted
            stages.append(stop)
        file.finish(_ending(study, trials.first(stages[-1]), stages, workers, tell))


def _stages(study: Study, trials: Trials, tell: Telling) -> Iterator[int]:
    """Yield how many trials are to be over before anyone looks at them again."""
    stop = min(FIRST, study.trials) if study.until else study.trials
    yield stop
    while stop < study.trials and (wanted := _wanted(study, trials, stop)):
        if wanted > study.trials and stop == FIRST:
            tell(Progress(trials.over, trials.failed, stop, wanted=wanted))
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


def _between(cases: tuple[Case, ...], first: int, stop: int) -> list[Case]:
    """Return what of the cases lies between two trials."""
    cut = (c._replace(first=max(c.first, first), stop=min(c.stop, stop)) for c in cases)
    return [case for case in cut if case.first < case.stop]


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
    audited, evidence = None, Evidence(missing="the run was stopped before it")
    try:
        tell(Progress(trials.over, trials.failed, trials.over, "audit"))
        audited = audit(study, trials, workers)
        tell(Progress(trials.over, trials.failed, trials.over, "evidence"))
        evidence = gather(study, trials, audited, workers)
    except Interrupted:
        pass
    except ModelError as error:  # the trials are worth more than what follows them
        evidence = Evidence(missing=str(error))
    return Ending(trials.over, stopped, audited, evidence)

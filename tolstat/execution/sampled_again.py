"""The trials of a stored run, sampled again."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from tolstat.errors import Advice, Remedy, StoppedError
from tolstat.execution.stages import SampledStages, StudyStages
from tolstat.execution.workers.block_scheduler import Interrupted
from tolstat.status import Status
from tolstat.store.run_writer import TO_THE_END, Stoppable
from tolstat.store.stored_run import Run
from tolstat.study.study import Study


@contextmanager
def unchanged_if_stopped(run: Run) -> Iterator[None]:
    """Raise StoppedError, which says that a run is unchanged, once the workers stop."""
    path, machine = run.path, run.machine
    try:
        yield
    except Interrupted:
        raise StoppedError(
            f"stopped before any new trial ran; the run in {path} is unchanged",
            Advice(Remedy.RESUME, path, machine),
        ) from None


def drawn_again(run: Run, study: Study, by: Stoppable = TO_THE_END) -> StudyStages:
    """Return the trials of a stored run, sampled again, with their stored answers.

    Stages that depend on missing answers are left out. Workers may stop it.
    """
    if study.thinned:
        from tolstat.execution.thinned_stages import ThinnedStages  # seldom

        stages: StudyStages = by.call(ThinnedStages.of_run, study)
    else:
        stages = by.call(SampledStages, study)
    trials = stages.trials
    answered = run.status != Status.NOT_RUN
    answered[run.damage.trials] = False
    trials.take_stored(run, answered)
    while trials.status[: trials.sampled].all():
        stage = by.call(stages.next, trials)
        if stage is None or (study.thinned and stage.stop > len(trials.status)):
            break
        trials.add(stage)
    not_sampled = slice(trials.sampled, None)
    trials.status[not_sampled], trials.responses[not_sampled] = Status.NOT_RUN, np.nan
    return stages

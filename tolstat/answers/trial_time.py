"""How long a trial of a run takes, on a busy machine, too."""

import time
from contextlib import suppress

import numpy as np

from tolstat.errors import TolstatError
from tolstat.model.checked import simulate
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.study.study import Study

TRIED = 1, 1, 8, 8, 64, 64  # trials that show how long they take: the quickest count
LONGEST = 0.25  # s, that some of them may take


def seconds_per_trial(run: Run, study: Study | None) -> float:
    """Return the time of a trial, s: that of the run, or of some evaluated again.

    The run took the compilation, the audit, and what else the machine did. Trials of a
    model that moves are not evaluated again, nor without a study.
    """
    seconds = float(run.times.get("seconds", np.inf)) / max(run.ended, 1)
    done = np.flatnonzero(run.status == Status.DONE)[: TRIED[-1]]
    if study is None or study.model.integrates or not len(done):
        return seconds
    names = [contributor.name for contributor in study.description.contributors]
    deviations = np.column_stack([run.column(name)[done] for name in names])
    with suppress(TolstatError):  # a model that fails says so where it is needed
        for number in TRIED:
            rows = deviations[:number]
            if len(rows) * seconds > LONGEST:
                break
            began = time.perf_counter()
            simulate(study.model, rows, study.settings)
            seconds = min(seconds, (time.perf_counter() - began) / len(rows))
    return seconds

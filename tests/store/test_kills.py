"""SIGKILL at random moments: at creation, writing, between, resuming, at the end."""

from __future__ import annotations

import multiprocessing
import random
import time

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tolstat.execution.execute import execute, go_on
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store import run_writer
from tolstat.study.study import load

STUDY = """\
model = "toy"
trials = { until = "gap p95 +-4 %", at_most = 6000 }
seed = 1
[deviations]
part = "+-1 mm"
[limits]
gap = "-1..2 mm"
"""


class Slow(Toy):
    def evaluate(self, deviations, settings):
        time.sleep(0.001)
        return super().evaluate(deviations, settings)


def carry_on(study, path):
    """Run, or go on; in a process that will be killed."""
    run_writer.SAFE_EVERY = 0.0  # each block is a commit
    with Workers(2, block=128) as crew:
        if path.exists():
            go_on(path, crew, model=Slow())
        else:
            execute(load(study, model=Slow()), path, crew)


def killed(tmp_path, kills):
    """Kill so often; check after each what is there. Return how many runs got whole."""
    study, path = tmp_path / "study.toml", tmp_path / "run.h5"
    study.write_text(STUDY)
    whole = tolstat.run(study, model=Slow(), output=tmp_path / "whole.h5")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    rng, ended, complete, seconds = random.Random(12), 0, 0, None
    while kills:
        process = context.Process(target=carry_on, args=(study, path))
        began = time.monotonic()
        process.start()
        process.join(seconds and rng.uniform(0.0, 1.2 * seconds))
        if process.is_alive():
            process.kill()
            process.join()
            kills -= 1
        else:
            assert process.exitcode == 0
            seconds = seconds or time.monotonic() - began  # of one that nobody killed
        if not path.exists():
            assert ended == 0
            continue
        run = tolstat.open(path)
        ran = run.status != 0
        assert np.count_nonzero(ran) >= ended
        ended = np.count_nonzero(ran)
        for name in (*run.units, "status"):
            known = whole.column(name)[: run.trials]
            found = run.column(name)[: whole.trials][ran[: whole.trials]]
            np.testing.assert_array_equal(found, known[ran[: whole.trials]])
        assert run.provenance["trials_done"] == np.count_nonzero(run.status == 1)
        assert np.isfinite(run.provenance["seconds"])
        if ended:
            assert run.nominal["status"] == "done"
        if run.complete:
            assert run.frame().equals(whole.frame())
            assert repr(run.diagnostics) == repr(whole.diagnostics)
            assert run.stopped == whole.stopped
            path.unlink()
            ended, complete = 0, complete + 1
    return complete


def test_killed_at_random_moments(tmp_path):
    killed(tmp_path, 6)


@pytest.mark.long
def test_killed_at_300_random_moments(tmp_path):
    assert killed(tmp_path, 300) > 10

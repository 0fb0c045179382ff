"""A real Dask cluster on loopback: workers may die or differ."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from distributed import Client

import tolstat
from tests.cli.command_line import call, chain
from tests.conftest import ROOT
from tests.execution.same_answers import same
from tolstat import catalogue
from tolstat.errors import BrokenError, ModelError, StudyError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.execution.workers.cluster import Cluster
from tolstat.execution.workers.remote_blocks import packed
from tolstat.model.checked import simulate
from tolstat.status import Status
from tolstat.study.study import load

WORKER = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]


@contextmanager
def started(kind, *options, folder, **environment):
    """Start a part of a cluster as a user does; end it however the test does."""
    command = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.dask_{kind}"]
    with (folder / "log.txt").open("a") as log:
        process = subprocess.Popen(
            [*command, *options], stdout=log, stderr=log, cwd=folder,
            env={**os.environ, **environment},
        )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.wait()


class Ring(NamedTuple):
    address: str
    workers: list[subprocess.Popen]
    join: list[str]

    @property
    def alive(self):
        return [each for each in self.workers if each.poll() is None]


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """A scheduler and two worker processes."""
    folder = tmp_path_factory.mktemp("cluster")
    place = folder / "scheduler.json"
    with ExitStack() as stack:
        at = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        to = ["--scheduler-file", str(place)]
        stack.enter_context(started("scheduler", *at, *to, folder=folder))
        while not (place.is_file() and place.read_text().endswith("}")):
            time.sleep(0.05)
        address = json.loads(place.read_text())["address"]
        join = [address, *WORKER]
        workers = [
            stack.enter_context(started("worker", *join, folder=folder))
            for _ in range(2)
        ]
        wait_for_workers(address, 2)
        yield Ring(address, workers, join)


def wait_for_workers(address, number):
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(number, timeout=60)


def test_a_model_that_crashes_costs_its_trials_alone(ring, tmp_path):
    catalogue.load(f"{ROOT / 'tests/isolation/trouble.py'}:RowByRow")
    study = tmp_path / "study.toml"
    study.write_text(
        'model = "trouble_by_row"\ntrials = 80\nseed = 3\nsettings.how = "crash"\n'
        'deviations.x = "+-3 m"\n'
    )
    with Cluster(ring.address) as cluster, Workers(executor=cluster, block=20) as crew:
        far = execute(load(study), tmp_path / "far.h5", crew)
    x, crashed = far.column("x"), far.status == Status.CRASHED
    assert crashed.any()
    assert (crashed == (x > 2)).all()
    assert far.column("y")[~crashed].tobytes() == (2 * x[~crashed] + 1).tobytes()
    assert [*far.isolation.output] == np.flatnonzero(crashed).tolist()


def test_a_killed_worker_changes_no_bit(ring, tmp_path):
    text = (ROOT / "runs/planetary-ai.toml").read_text()
    study = tmp_path / "study.toml"
    study.write_text(text.replace("trials = 20000", "trials = 2000"))
    local = tolstat.run(study, output=tmp_path / "local.h5")
    over, before = [], len(ring.alive)

    def tell(progress):
        over.append(progress.over)
        if progress.over > 600 and len(ring.alive) == before:
            ring.alive[0].kill()

    with Cluster(ring.address) as cluster, Workers(executor=cluster, block=50) as crew:
        assert crew.number == before == 2
        run = execute(load(study), tmp_path / "far.h5", crew, progress=tell)
        # a cluster looks once in a while who is there, and the run may end before
        deadline = time.monotonic() + 60
        while crew.number == 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        assert crew.number == 1
    assert len(ring.alive) == 1
    assert any(600 < each < 2000 for each in over)
    same(run, local)


def test_a_cluster_on_the_command_line(ring, tmp_path, monkeypatch):
    """A machine of one's own is found by its file."""
    monkeypatch.setattr(catalogue, "_custom", {})
    study, far = ROOT / "runs/own/stack.toml", tmp_path / "far.h5"
    machine = ["--machine", "runs/own/stack.py:Stack"]
    options = [*machine, "--cluster", ring.address]
    done = call("run", study, "--trials", 500, *options, "-o", far)
    assert done.exit_code == 0, done.output
    done = call("extend", far, "--trials", 800, *options)
    assert done.exit_code == 0, done.output
    local = tolstat.run(study, trials=800, output=tmp_path / "local.h5")
    same(tolstat.open(far), local)
    both = call("run", study, *options, "--workers", 2)
    assert both.exit_code == 2 and "--workers" in both.stderr


def test_a_worker_with_different_results_is_not_used(ring, tmp_path):
    study = chain(tmp_path, "chain")
    code = "import tolstat.lanes.digest as d; d.SKIPPED = set()\n"
    (tmp_path / "other.py").write_text(code)
    other = [*ring.join, "--preload", str(tmp_path / "other.py")]
    with started("worker", *other, folder=tmp_path):
        good = len(ring.alive)
        wait_for_workers(ring.address, good + 1)
        with (
            Cluster(ring.address) as cluster,
            Workers(executor=cluster, block=20) as crew,
            pytest.warns(RuntimeWarning, match="not used: its source of model"),
        ):
            run = execute(load(study), tmp_path / "mixed.h5", crew)
            assert crew.number == good
        same(run, tolstat.run(study))
        for each in ring.alive:
            each.kill()
        with (
            Cluster(ring.address) as cluster,
            Workers(executor=cluster) as crew,
            pytest.warns(RuntimeWarning, match="not used"),
            pytest.raises(BrokenError, match="none of its workers can be used"),
        ):
            execute(load(study), tmp_path / "none.h5", crew)


def test_a_cluster_without_workers_ends_the_run(ring, tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.execution.workers.cluster.PATIENCE", 1.5)
    for each in ring.alive:
        each.kill()
    study = chain(tmp_path, "chain")
    done = call("run", study, "--cluster", ring.address)
    assert done.exit_code == 1 and "no worker for" in done.stderr
    assert f"`dask worker {ring.address}` starts a worker" in done.stderr
    assert f"`tolstat resume {study.with_suffix('.h5')}` continues it" in done.stderr
    assert call("resume", study.with_suffix(".h5")).exit_code == 0
    assert tolstat.open(study.with_suffix(".h5")).complete


def test_models_that_cannot_be_sent_are_refused(toy):
    with pytest.raises(ModelError, match="load it from its file"):
        packed(partial(simulate, toy, np.zeros((1, 3)), None))


@pytest.mark.parametrize(
    "address",
    ["x", "localhost", "tcp://localhost", "tls://h:1", "inproc://1.2/3", "ucx://h:1",
     "runs/cluster.py", ""],
)  # fmt: skip
def test_an_address_of_another_form_is_refused_at_once(address):
    with pytest.raises(StudyError, match="expected the address of a Dask scheduler"):
        Cluster(address)


def test_a_scheduler_that_does_not_answer(tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.execution.workers.cluster.CONNECT", 0.5)
    study = chain(tmp_path, "chain")
    done = call("run", study, "--cluster", "tcp://127.0.0.1:1")
    assert done.exit_code == 1 and "no Dask scheduler answers" in done.stderr
    done = call("run", study, "--cluster", "nonsense://x")
    assert done.exit_code == 2 and "expected the address" in done.stderr
    assert not study.with_suffix(".h5").exists()

"""Processes that evaluate: a pool, MPI, and the request to SLURM."""

from __future__ import annotations

import runpy
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from dask_jobqueue.slurm import SLURMJob

import tolstat
from tests.cli.command_line import chain
from tests.conftest import ROOT
from tests.execution.same_answers import same
from tolstat.errors import BrokenError, Remedy
from tolstat.execution.workers import remote_blocks as parcel
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.execution.workers.local_blocks import Mismatch
from tolstat.execution.workers.remote_blocks import carried_out, packed
from tolstat.operating_system import processors

BIN = Path(sys.executable).parent
MPI = """\
import sys
import tolstat
from mpi4py.futures import MPIPoolExecutor

if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        tolstat.run(sys.argv[1], output=sys.argv[2], executor=executor)
        print(executor.num_workers)
"""


def test_processes_give_the_same_bits(tmp_path):
    study, far = chain(tmp_path, "study"), tmp_path / "far.h5"
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        run = tolstat.run(study, output=far, executor=executor)
        assert executor.submit(len, "it is still ours").result() == 16
    same(run, tolstat.run(study))


@pytest.mark.long
def test_mpi_on_loopback(tmp_path):
    study, far = chain(tmp_path, "study"), tmp_path / "far.h5"
    script = tmp_path / "run.py"
    script.write_text(MPI)
    command = [BIN / "mpiexec", "-n", "3", sys.executable, "-m", "mpi4py.futures"]
    done = subprocess.run(
        [*command, script, study, far], capture_output=True, text=True, timeout=100,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0 and done.stdout == "2\n", done
    same(tolstat.open(far), tolstat.run(study))


def test_a_process_with_different_results_is_not_used(tmp_path, monkeypatch):
    study = tolstat.run(chain(tmp_path, "study")).study  # a machine that is installed
    assert study.table["model"] == "dimension_chain"
    call = partial(np.zeros, 3)
    np.testing.assert_array_equal(carried_out(packed(call)), np.zeros(3))
    sent = packed(call)
    monkeypatch.setattr(
        parcel, "decisive", lambda _: {**sent.decisive, "processor": "arm64 neon"}
    )
    found = carried_out(sent)
    assert isinstance(found, Mismatch)
    assert "processor is arm64 neon" in found.reasons[0]
    other = {**sent.decisive, "machine code": "generic"}
    monkeypatch.setattr(parcel, "decisive", lambda _: other)
    assert "its machine code is generic, the run" in carried_out(sent).reasons[0]


def test_errors_of_a_pool_are_messages(tmp_path):
    study = chain(tmp_path, "study")
    executor = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    executor.submit(sys.exit).exception()
    for process in executor._processes.values():
        process.kill()
    path = study.with_suffix(".h5")
    with (
        executor,
        pytest.raises(BrokenError, match=r"0 of 1000 trials are stored$") as broken,
    ):
        tolstat.run(study, executor=executor)
    assert [(each.remedy, each.path) for each in broken.value.advice] == [
        (Remedy.RESUME, path)
    ]
    assert Workers(executor=executor).number == processors()
    assert tolstat.resume(path).complete
    # where none ran of what was to replace it, the run stays: nothing to go on with
    words = f"the run in {path} is unchanged$"
    with pytest.raises(BrokenError, match=words):
        tolstat.run(study, seed=9, force=True, executor=executor)
    assert tolstat.open(path).complete


def test_the_request_to_slurm():
    """The example is not run: there is no SLURM; its job script is known."""
    lent = runpy.run_path(str(ROOT / "runs/cluster.py"))["LENT"]
    job = SLURMJob(scheduler="tcp://HOST:1", name="0", job_name="tolstat",
                   queue="normal", **lent)  # fmt: skip
    head, _, command = job.job_script().strip().rpartition("\n\n")
    assert head.splitlines() == [
        "#!/usr/bin/env bash", "", "#SBATCH -J tolstat", "#SBATCH -p normal",
        "#SBATCH -n 1", "#SBATCH --cpus-per-task=16", "#SBATCH --mem=30G",
        "#SBATCH -t 02:00:00",
    ]  # fmt: skip
    python, *rest = command.split()
    assert python == sys.executable
    assert " ".join(rest).startswith(
        "-m distributed.cli.dask_worker tcp://HOST:1 --name 0 --nthreads 16"
    )

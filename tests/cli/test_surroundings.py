"""Surroundings in which no command can work: it says so in a sentence."""

from __future__ import annotations

import os
import resource
import subprocess
import time
from contextlib import suppress
from datetime import datetime

import pytest

from tests.cli.command_line import TOLSTAT
from tolstat.store.integrity import clock_of, times_of
from tolstat.store.provenance import now


def ended(*arguments, out=subprocess.PIPE, limit=None, **environment):
    return subprocess.run(
        [TOLSTAT, *arguments], stdout=out, stderr=subprocess.PIPE, text=True,
        env={**os.environ, **environment},
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_AS, limit)),
    )  # fmt: skip


@pytest.mark.parametrize("zone", ["UTC+24", "UTC-99:99", "nonsense"])
def test_any_time_zone_gives_a_time(monkeypatch, zone):
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        for written in (now(), times_of(clock_of(1.0))["ended_at"]):
            assert abs(datetime.fromisoformat(written).timestamp() - time.time()) < 10
    finally:
        monkeypatch.undo()
        time.tzset()


@pytest.mark.parametrize(
    ("package", "name", "value"),
    [("numba", "NUMBA_NUM_THREADS", "0"), ("dask", "DASK_CONFIG", "broken.yaml")],
)
def test_a_package_that_cannot_be_loaded_is_named(tmp_path, package, name, value):
    """With what the environment tells it."""
    (tmp_path / "broken.yaml").write_text("a: [\n b: }")
    value = value if value.isdigit() else str(tmp_path / value)
    run = ended("run", "runs/stack-up.toml", "-o", tmp_path / "r.h5", **{name: value})
    assert run.returncode == 1
    line, *more = run.stderr.strip().splitlines()  # the display of progress has ended
    assert line.startswith(f"tolstat: {package} cannot be loaded: ValueError: ")
    assert name in line and not more
    assert {path.name for path in tmp_path.iterdir()} == {"broken.yaml"}


def test_too_little_memory_is_a_sentence():
    """Libraries would fail to load, and BLAS would try for long."""
    run = ended("run", "runs/stack-up.toml", limit=(500_000_000, 500_000_000))
    assert run.returncode == 1 and "500 MB of memory are allowed" in run.stderr


@pytest.mark.parametrize("command", [["--help"], ["run", "--help"]])
def test_help_that_does_not_fit_on_a_disk_is_a_sentence(command):
    with open("/dev/full", "w") as full:
        run = ended(*command, out=full)
    assert run.returncode == 1 and run.stderr.startswith("tolstat: the disk of")


def test_output_waits_for_its_reader():
    """A program that does not wait shares its pipe or terminal: output was cut."""
    read, write = os.pipe()
    os.set_blocking(write, False)
    with suppress(BlockingIOError):
        while True:
            os.write(write, b" ")  # until it is full
    with subprocess.Popen([TOLSTAT, "--help"], stdout=write) as command:
        os.close(write)
        with os.fdopen(read) as output:
            time.sleep(1.0)
            text = output.read()
    assert command.returncode == 0
    assert text.lstrip() == ended("--help").stdout

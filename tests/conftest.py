"""Studies and models that many tests need."""

from __future__ import annotations

import os
import re
import shutil
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import tolstat
from tolstat import (
    Contributor,
    Description,
    Model,
    Outcome,
    Response,
    catalogue,
    setting,
)

ROOT = Path(__file__).parents[1]
# files that begin first: at the end the others would wait for them
LONGEST = ("test_tutorial.py", "test_shifts.py", "test_mutants.py", "test_kills.py")


# rooms whose tests compile nothing, draw nothing and sample little
QUICK = ("model", "study", "units")


def pytest_configure():
    """Let Ctrl-C reach the processes of tests that run in a shell's background."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Mark what is quick, by its room; put the longest files first."""
    for item in items:
        if item.path.parent.name in QUICK and item.path.name not in LONGEST:
            item.add_marker("quick")
    items.sort(key=lambda item: item.path.name not in LONGEST)


def _without_new_models():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(catalogue, "_custom", {**catalogue._custom})
        patch.setattr(catalogue, "_places", {**catalogue._places})
        yield


@pytest.fixture(autouse=True, scope="module")
def _of_a_file():
    """Forget models that the fixtures of a file load."""
    yield from _without_new_models()


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch):
    """Let studies be named as the README does; forget models that a test loads."""
    monkeypatch.chdir(ROOT)
    # rich reads these: the same width on every machine
    monkeypatch.setitem(os.environ, "COLUMNS", "1000")
    yield from _without_new_models()


@dataclass(frozen=True)
class ToySettings:
    gain: float = setting(2.0, "what the sum is multiplied with", above=0.0)
    speed: float = setting(1.0, "not used", unit="rad/s", above=0.0)
    mode: str = setting("plain", "how", choices=("plain", "odd"))


class Toy(Model):
    """A closed formula; a part longer than 0.9 mm cannot be mounted."""

    name = "toy"
    title = "sum of two parts"
    settings = ToySettings

    def describe(self, settings):
        parts = tuple(
            Contributor(f"part_{i}", "m", f"l{i}", f"length of part {i}", "sum")
            for i in (1, 2)
        )
        angle = Contributor("angle", "rad", "a", "an angle", "none")
        return Description(
            (*parts, angle),
            (
                Response("gap", "m", "g", "sum of the parts", "sum"),
                Response(
                    "ratio", "1", "q", "share of the first part", "sum", shown="1"
                ),
            ),
        )

    def evaluate(self, deviations, settings):
        total = settings.gain * deviations[:, :2].sum(axis=1)
        status = np.where(deviations[:, 0] > 0.9e-3, 4, 1)
        return Outcome(np.stack([total, deviations[:, 0] / 1e-3], axis=1), status)


@pytest.fixture
def toy():
    return Toy()


TOY_STUDY = """\
title = "toy"
model = "toy"
trials = 1000
seed = 1
[deviations]
part = "+-1 mm"
angle = { tolerance = "0..360 deg", distribution = "uniform" }
[limits]
gap = "-1..2 mm"
"""


@pytest.fixture
def toy_study(tmp_path):
    path = tmp_path / "toy.toml"
    path.write_text(TOY_STUDY)
    return path


def mill_text(name="khpt75"):
    """A study of the mill with the steps of the defaults: they take half the time."""
    text = (ROOT / "runs" / f"{name}.toml").read_text()
    return re.sub(r"^(rtol|max_step) = .*\n", "", text, flags=re.MULTILINE)


def small_in(folder):
    """runs/khpt75.toml with 24 trials, in a folder."""
    path = folder / "small.toml"
    path.write_text(mill_text().replace("trials = 4096", "trials = 24"))
    return path


@pytest.fixture
def small_study(tmp_path):
    return small_in(tmp_path)


@pytest.fixture(scope="session")
def small_as_run(tmp_path_factory):
    """Run once; who changes it takes a copy."""
    return tolstat.run(small_in(tmp_path_factory.mktemp("small"))).path


@pytest.fixture
def small_run(small_study, small_as_run):
    """A copy beside its study."""
    return shutil.copy(small_as_run, small_study.with_suffix(".h5"))

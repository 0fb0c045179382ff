"""Runs whose reports are tested."""

from __future__ import annotations

import os

import portalocker
import pytest

import tolstat
from tests.conftest import mill_text


def run_once(factory, name):
    """2200 trials of a mill, for all processes of the tests: 2000 are rasterised."""
    folder = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    path = folder / f"{name}.h5"
    with portalocker.Lock(folder / f"{name}.tests", timeout=600):
        if not path.exists():
            study = folder / f"{name}.toml"
            study.write_text(mill_text(name))
            tolstat.run(study, trials=2200)
    return tolstat.open(path)


@pytest.fixture(scope="session")
def mill(tmp_path_factory):
    """Two rods drive one carriage."""
    return run_once(tmp_path_factory, "khpt75")


@pytest.fixture(scope="session")
def linked(tmp_path_factory):
    """The same machines with an equalizing link."""
    return run_once(tmp_path_factory, "khpt75-equalized")


def chain(limit, **more):
    """A gap between large dimensions: its numbers need many figures."""
    links = {
        "H": {"nominal": "2450 mm", "tolerance": "+-0.2 mm"},
        "a": {"nominal": "33.33 mm", "tolerance": "+-0.1 mm"},
    }
    return {
        "model": "dimension_chain", "trials": 5000, "seed": 5, "links": links,
        "settings": {"gap": "H - a"}, "limits": {"gap": limit},
    } | more  # fmt: skip

"""Runs whose reports are tested."""

from __future__ import annotations

import pytest

import tolstat
from tests.conftest import ROOT


@pytest.fixture(scope="session")
def mill(tmp_path_factory):
    """2200 trials of the main study: above 2000 scatters are rasterised."""
    folder = tmp_path_factory.mktemp("mill")
    return tolstat.run(
        ROOT / "runs" / "khpt75.toml", trials=2200, output=folder / "mill.h5"
    )


@pytest.fixture(scope="session")
def linked(tmp_path_factory):
    """The same machines with an equalizing link."""
    folder = tmp_path_factory.mktemp("linked")
    return tolstat.run(
        ROOT / "runs" / "khpt75-equalized.toml",
        trials=2200,
        output=folder / "linked.h5",
    )


def chain(limit, **more):
    """A gap between large dimensions: its numbers need many figures."""
    links = {
        "H": {"nominal": "2450 mm", "tolerance": "+-0.2 mm"},
        "a": {"nominal": "33.33 mm", "tolerance": "+-0.1 mm"},
    }
    return {
        "model": "dimension_chain", "trials": 5000, "seed": 5, "links": links,
        "settings": {"gap": "H - a"}, "limits": {"gap": limit}, **more,
    }  # fmt: skip

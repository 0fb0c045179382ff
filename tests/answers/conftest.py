"""Runs whose reports are looked at."""

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

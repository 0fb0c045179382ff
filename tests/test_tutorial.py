"""The tutorial's notebooks run, and reproduce their stored output."""

from __future__ import annotations

import re
import shutil

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from tests.conftest import ROOT

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")
NOTEBOOKS = sorted((ROOT / "runs" / "tutorial").glob("*.ipynb"))


def printed(notebook):
    """The plain texts of each cell's outputs: printed in one piece or in several."""
    for cell in notebook.cells:
        outputs = cell.get("outputs", ())
        yield "".join(e.get("text") or e["data"]["text/plain"] for e in outputs)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")  # of the kernel's own libraries
def test_a_notebook_runs_and_reproduces_its_output(path, tmp_path):
    shutil.copytree(
        ROOT / "runs",
        tmp_path / "runs",
        ignore=shutil.ignore_patterns("*.h5*", "*.html"),
    )
    stored = nbformat.read(path, as_version=4)
    again = nbformat.read(path, as_version=4)
    folder = {"metadata": {"path": str(tmp_path / "runs" / "tutorial")}}
    NotebookClient(again, timeout=300, resources=folder).execute()
    for one, other in zip(printed(stored), printed(again), strict=True):
        assert NUMBER.sub("#", one) == NUMBER.sub("#", other)
        np.testing.assert_allclose(
            [float(each) for each in NUMBER.findall(other)],
            [float(each) for each in NUMBER.findall(one)],
            rtol=2e-3,
        )


def test_there_are_five_short_steps():
    assert [path.stem[0] for path in NOTEBOOKS] == [*"12345"]
    for path in NOTEBOOKS:
        cells = nbformat.read(path, as_version=4).cells
        assert len(cells) <= 25
        assert all(len(cell.source.splitlines()) <= 25 for cell in cells)

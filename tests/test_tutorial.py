"""The tutorial's notebooks run, and reproduce their stored output.

python -m tests.test_tutorial runs them and stores what they say today.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from html import unescape
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from tests.conftest import ROOT

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")
# how long more trials would take depends on the machine
DURATION = re.compile(r"(?:less than a|about [\d.]+) (?:minutes?|hours?|days?)")
NOTEBOOKS = sorted((ROOT / "runs" / "tutorial").glob("*.ipynb"))


def words_of(output):
    """What an output says: its text, and the words of its page or table."""
    if "text" in output:
        return output["text"]
    data = output["data"]
    page = data.get("text/html", "")
    if inner := re.search(r'srcdoc="([^"]*)"', page):
        page = unescape(inner[1])
    page = re.sub(r"<(style|svg|script)\b.*?</\1>", "", page, flags=re.DOTALL)
    page = unescape(re.sub(r"<[^>]*>", " ", page)).replace("\u202f", "")
    return data["text/plain"] + " ".join(["", *page.split()])


def printed(notebook):
    """The words of each cell's outputs: printed in one piece or in several."""
    for cell in notebook.cells:
        yield "".join(map(words_of, cell.get("outputs", ())))


def executed(path, folder):
    """A notebook as it runs now, in a copy of the folder of studies."""
    runs = folder / "runs"
    ignored = shutil.ignore_patterns("*.h5*", "*.html")
    shutil.copytree(ROOT / "runs", runs, ignore=ignored)
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(runs / "tutorial")}}
    NotebookClient(notebook, timeout=300, resources=resources).execute()
    return notebook


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")  # of the kernel's own libraries
def test_a_notebook_runs_and_reproduces_its_output(path, tmp_path):
    stored, again = nbformat.read(path, as_version=4), executed(path, tmp_path)
    for before, now in zip(printed(stored), printed(again), strict=True):
        before, now = (DURATION.sub("a while", text) for text in (before, now))
        words = [NUMBER.sub("#", text) for text in (before, now)]
        assert words[0] == words[1], "python -m tests.test_tutorial stores it again"
        np.testing.assert_allclose(
            [float(number) for number in NUMBER.findall(now)],
            [float(number) for number in NUMBER.findall(before)],
            rtol=2e-3,
        )


def test_the_words_of_a_page_are_compared():
    page = '<iframe srcdoc="&lt;style&gt;p {}&lt;/style&gt;&lt;p&gt;met: 5 &amp;lt; 6">'
    data = {"text/html": page, "text/plain": "<a page>"}
    assert words_of({"data": data}) == "<a page> met: 5 < 6"


def test_there_are_five_short_steps():
    assert [path.stem[0] for path in NOTEBOOKS] == [*"12345"]
    for path in NOTEBOOKS:
        cells = nbformat.read(path, as_version=4).cells
        assert len(cells) <= 25
        assert all(len(cell.source.splitlines()) <= 25 for cell in cells)


if __name__ == "__main__":
    for path in NOTEBOOKS:
        with tempfile.TemporaryDirectory() as folder:
            nbformat.write(executed(path, Path(folder)), path)

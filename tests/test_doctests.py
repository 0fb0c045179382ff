"""The examples of public docstrings give what they show."""

from __future__ import annotations

import doctest
import shutil

import numpy as np
import pytest

import tolstat
from tests.conftest import ROOT
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.statistics.intervals.shares import proportion

PUBLIC = {name: getattr(tolstat, name) for name in tolstat.__all__}
PUBLIC |= {each.__name__: each for each in (quantiles, proportion)}
EXAMPLES = {
    name: found
    for name, each in PUBLIC.items()
    if (found := doctest.DocTestFinder(recurse=False).find(each, name)[0]).examples
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with the studies, and the run of the stack-up."""
    folder = tmp_path_factory.mktemp("examples")
    shutil.copytree(
        ROOT / "runs", folder / "runs", ignore=shutil.ignore_patterns("*.h5*")
    )
    tolstat.run(folder / "runs" / "stack-up.toml")
    return folder


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_gives_what_it_shows(name, runs, tmp_path, monkeypatch):
    shutil.copytree(runs, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    example = EXAMPLES[name]
    example.globs = {"tolstat": tolstat, "np": np, name: PUBLIC[name]}
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    said: list[str] = []
    doctest.DocTestRunner(optionflags=flags).run(example, out=said.append)
    assert not said, "".join(said)


def test_there_are_examples_of_what_one_begins_with():
    first = {"run", "open", "summary", "report", "what_if", "compare", "evaluate"}
    assert first <= set(EXAMPLES)

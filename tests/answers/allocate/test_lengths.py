"""Number of trials of an allocation, and refusals before the first."""

from __future__ import annotations

import re

import pytest

import tolstat
from tests.answers.allocate.linear_stack import Linear, Two, reciprocal
from tolstat.answers.allocate import allocate_tolerances as allocating
from tolstat.errors import StudyError
from tolstat.study import memory_needed as size

ARCSINE = {"tolerance": "+-0.1 mm", "distribution": "arcsine", "cost": {"+-0.1 mm": 1}}


GRID = {"link_1": ["0 mm"]}


def test_the_strictest_limit_sets_the_number_of_trials(monkeypatch):
    monkeypatch.setattr(allocating, "_answer", lambda search, *_: search.runs.trials)
    given = reciprocal(trials=10)
    given["limits"]["any"] = {"limit": "-9..9 mm", "yield": "99.5 %"}
    assert tolstat.allocate(given, model=Two()) == 50 / 0.005


@pytest.mark.parametrize(
    ("trials", "memory"), [(None, 1e11), (2000, 1e11), (2000, 1e8)]
)
def test_the_trials_of_a_proof_are_reported_before_the_run(trials, memory, monkeypatch):
    """Or refused where no such run can show what is demanded."""
    monkeypatch.setattr(size, "memory", lambda: memory)
    given, told = reciprocal(), []
    given["limits"] = {"gap": {"limit": "<= 1 mm", "ppm": 10}}

    def tell(progress):
        told.append(progress.warning)
        raise KeyboardInterrupt

    if trials:
        words = "No first proof of 8000 trials.* give 120000 trials or more"
        with pytest.raises(StudyError, match=words):
            tolstat.allocate(given, model=Linear(), trials=trials)
        trials = 120_000
    with pytest.raises(KeyboardInterrupt):
        tolstat.allocate(given, model=Linear(), trials=trials, progress=tell)
    assert len(told) == 1 and "gap permits 10 ppm out of limit" in told[0]
    assert ("(fewer trials may be requested, 120000 at least)" in told[0]) == (
        trials is None
    )
    # a longer proof, which an answer can do without, has to fit into the memory
    longer = {1e11: f"or {32 * (trials or 5_000_001)} where", 1e8: "480000"}
    assert longer[memory] in told[0] and ("where" in told[0]) == (memory > 1e8)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"limits": {}}, "no [limits]"),
        ({"deviations": {"link": "+-0.1 mm"}}, "has a cost; give one or more"),
        ({"deviations": {"link": ARCSINE}}, "link has a cost, but cannot be weighted"),
        ({"limits": {"gap": {"limit": "<= 1 mm", "ppm": 1e-3}}}, "trials"),
        ({"sampling": "grid", "grid": GRID, "deviations": {}}, "samples nothing"),
    ],
)  # fmt: skip
def test_studies_without_costs_or_limits_are_refused(change, words):
    given = {k: v for k, v in (reciprocal() | change).items() if v or k != "deviations"}
    if "grid" in given:
        given = {k: v for k, v in given.items() if k not in ("trials", "seed")}
    with pytest.raises(StudyError, match=re.escape(words)):
        tolstat.allocate(given, model=Linear())


@pytest.mark.parametrize("trials", [0, -5, 2.5])
def test_the_number_of_trials_is_whole(trials):
    with pytest.raises(StudyError, match="a whole number from 1 is expected"):
        tolstat.allocate(reciprocal(), trials=trials, model=Linear())

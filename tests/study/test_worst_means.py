"""Means that lie anywhere within a range, at their worst, while parts scatter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.conftest import Toy
from tests.study.chains import chain, problems_of
from tolstat.execution.execute import run as run_study
from tolstat.model.checked import simulate
from tolstat.study.study import load

PART = {
    "nominal": "10 mm", "tolerance": "+-0.02 mm", "sigma": "0.00333333333333 mm",
    "mean_within": "+-0.01 mm",
}  # fmt: skip


def test_four_means_at_their_worst(tmp_path):
    links = {name: dict(PART) for name in "abcd"}
    study = chain("a - b + c - d", links, limits={"gap": "-0.055..0.055 mm"})
    run = tolstat.run({**study, "trials": 200_000}, output=tmp_path / "means.h5")
    exact = stats.norm.sf(2.25)  # (0.055 - 0.04) / (2 * 0.01 / 3)
    assert 1e6 * exact == pytest.approx(12_224, abs=1)
    frame = run.frame()
    for name in ("gap_at_least", "gap_at_largest"):
        assert np.mean(abs(frame[name]) > 0.055e-3) == pytest.approx(exact, rel=0.06)
    numbers = {number.name: number.value for number in run.numbers}
    assert numbers["rss_mean_at_largest"] == pytest.approx(0.04e-3)
    assert numbers["rss_sigma_at_largest"] == pytest.approx(0.02e-3 / 3)
    corners = {
        side: case.value for side, case in run.worst_cases("gap_at_least").items()
    }
    assert corners == pytest.approx({"least": -0.12e-3, "largest": 0.04e-3})
    assert numbers["worst_max_at_least"] == pytest.approx(0.04e-3)
    assert run.assumed["a"].words.endswith(", mean within +-0.01 mm")
    assert any("means lie within their ranges" in note for note in run.notes)
    assert tolstat.replay(run, 5).differences == ()


def test_each_response_has_worst_means_of_its_own():
    study = {
        "model": "toy", "trials": 16, "seed": 1, "settings": {"gain": 2},
        "deviations": {"part": {"tolerance": "+-9 um", "mean_within": "-0.1..0.2 mm"}},
    }  # fmt: skip
    loaded = load(study, model=Toy())
    names = [response.name for response in loaded.description.responses]
    assert names == [
        "gap_at_least",
        "gap_at_largest",
        "ratio_at_least",
        "ratio_at_largest",
    ]
    rows = np.zeros((1, 3))
    responses = simulate(loaded.model, rows, loaded.settings).responses[0]
    # gap = 2 (a + b), ratio = a / mm
    assert responses == pytest.approx([-0.4e-3, 0.8e-3, -0.1, 0.2])


def test_means_and_cases_together():
    links = {"a": dict(PART), "b": "9.9 +-0.02 mm"}
    cases = {"thin": {"b": "9.8 mm"}, "thick": {"b": "9.9 mm"}}
    run = run_study(
        chain("a - b", links, cases=cases, limits={"gap_at_thin": ">= 0 mm"})
    )
    assert [*run.limits] == ["gap_at_thin_at_least", "gap_at_thin_at_largest"]
    frame = run.frame()
    assert frame["gap_at_thick_at_least"].mean() == pytest.approx(0.09e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("within", "words"),
    [
        (3, 'mean_within: a text such as "+-0.01 mm" is expected'),
        ("0.01..0.02 mm", "a range about the mean is expected"),
        ("much", "cannot be read"),
    ],
)
def test_wrong_ranges_are_refused(within, words):
    links = {"a": {**PART, "mean_within": within}, "b": "9.9 mm"}
    assert words in problems_of(chain("a - b", links))

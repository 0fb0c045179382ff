"""Numbers of a study: from the model, stored, shown, and refused if wrong."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest

import tolstat
from tests.model.rich import Rich
from tolstat import StudyNumber
from tolstat.answers.report.full_report import report_of
from tolstat.deviations.distributions import (
    Lognormal,
    Normal,
    Tolerance,
    TruncatedNormal,
    Weibull,
)
from tolstat.deviations.spread import spread_of
from tolstat.errors import ModelError
from tolstat.model.checked import numbers_of
from tolstat.model.settings import make

STUDY = {
    "model": "rich", "trials": 64, "seed": 1,
    "deviations": {"A1": "+-0.06 mm", "A2": {"tolerance": "+-0.03 mm", "cp": 2}},
    "limits": {"stress": "<= 210 MPa"},
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("numbers") / "rich.h5"
    return tolstat.run(STUDY, model=Rich(), output=path)


def test_numbers_depend_on_settings_and_tolerances(run):
    stress, reach, wheels = run.numbers
    sigma = 1e11 * np.hypot(0.02e-3, 0.005e-3)
    assert stress.value == pytest.approx(sigma, rel=1e-9)
    assert reach.value == pytest.approx(0.09e-3)
    assert wheels == StudyNumber("wheels", "1", 2.0, "how many", "count")


def test_numbers_are_in_the_file_and_in_answers(run):
    with h5py.File(run.path) as file:
        stored = file["numbers/rss_stress"]
        assert stored.attrs["value"] == run.numbers[0].value
        assert stored.attrs["units"] == "Pa"
    found = json.loads(report_of(run).json())["numbers"]
    assert found["rss_stress"]["value"] == run.numbers[0].value
    assert run.scale_of(run.numbers[0]).mark == "MPa"  # as the limit is written
    assert run.scale_of(run.numbers[1]).words(run.numbers[1].value) == "90 um"
    assert run.scale_of(run.numbers[2]).words(2.0) == "2"
    notes = " ".join(tolstat.summary(run).trials.notes)
    assert (
        "from tolerances alone: rss_stress 2.062 MPa" in notes and "wheels" not in notes
    )


def test_a_grid_has_no_numbers(tmp_path):
    study = {
        "model": "rich", "sampling": "grid", "grid": {"A1": ["0 mm", "1 um"]},
    }  # fmt: skip
    assert tolstat.run(study, model=Rich(), output=tmp_path / "g.h5").numbers == ()


@pytest.mark.parametrize(
    "numbers, words",
    [
        ([StudyNumber("a", "mm", 1.0)], "number a: 'mm' is not an SI unit"),
        ([StudyNumber("a", "m", 1.0, shown="kN")], "number a: 'kN' is of another kind"),
        ([StudyNumber("a", "m", 1.0)] * 2, "a is given twice"),
        ([StudyNumber("", "m", 1.0)], "the number '' cannot be typed"),
        ([StudyNumber("a", "m", 1.0, of="stress")], "no response stress with its unit"),
        ([StudyNumber("a/b", "m", 1.0)], "the number 'a/b' cannot be typed"),
        ([StudyNumber("a", "m", np.ones(3))], "is not a number"),
        ([StudyNumber("a", "m", 1.0, None)], "number a: None cannot be printed"),
        ([3.0], "3.0 is not a contributor or response or number"),
    ],
)
def test_wrong_numbers_are_refused_by_name(numbers, words):
    class Wrong(Rich):
        def numbers(self, settings, spreads, *, independent=True):
            return numbers

    with pytest.raises(ModelError, match=words):
        numbers_of(Wrong(), make(Wrong()), {})


ZONE = Tolerance(0.0, 3.0)
SPREADS = {
    Normal(Tolerance(-3.0, 3.0), cp=1.5): (0.0, 2 / 3),
    Weibull(ZONE, 2.0): None,
    Lognormal(ZONE, 0.4): None,
    TruncatedNormal(Tolerance(-1.0, 2.0), outside="screened"): None,
}


@pytest.mark.parametrize("distribution", SPREADS, ids=lambda d: type(d).__name__)
def test_moments_match_the_deviations_of_a_distribution(distribution):
    found = spread_of(distribution)
    assert (found.lower, found.upper) == tuple(distribution.tolerance)
    # in the middles of a million equal shares
    x = distribution.deviations((np.arange(10**6) + 0.5) / 10**6)
    mean, sigma = SPREADS[distribution] or (x.mean(), x.std())
    assert found.mean == pytest.approx(mean, abs=2e-5)
    assert found.sigma == pytest.approx(sigma, rel=2e-4)

"""A model in cases: known results, the same units in each, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.conftest import Toy
from tests.study.chains import chain, problems_of
from tolstat.deviations.names import expand
from tolstat.model.case_changes import case_axis
from tolstat.model.checked import simulate
from tolstat.model.in_cases import Condition
from tolstat.study.study import load

PLATES = {"a": "10 +-0.1 mm", "b": "9.6 +-0.1 mm"}
SIZES = ("9.65 mm", "9.60 mm", "9.55 mm", "9.50 mm")
STACK = {
    "L": "300.3 +-0.1 mm", "S": "300 +-0.1 mm",
    "aL": "11.5e-6 1/K", "aS": "23.1e-6 1/K", "dT": "0 K",
}  # fmt: skip
THERMAL = "L*(1 + aL*dT) - S*(1 + aS*dT)"
TEMPERATURES = {"cold": {"dT": "-40 K"}, "hot": {"dT": "60 K"}}


def test_the_yield_over_a_nominal_is_that_of_the_normal_distribution(tmp_path):
    study = chain("a - b", PLATES, cases={"b": SIZES}, limits={"gap": ">= 0.3 mm"})
    run = tolstat.run(
        {**study, "trials": 200_000, "cases": {"b": [*SIZES]}},
        output=tmp_path / "cases.h5",
    )
    gaps = run.frame()[[f"gap_at_{i}" for i in (1, 2, 3, 4)]]
    sigma, sizes = np.sqrt(2) * 0.1 / 3, np.array([9.65, 9.60, 9.55, 9.50])
    exact = stats.norm.cdf((0.3 - (10 - sizes)) / sigma)
    assert 1e6 * exact == pytest.approx([144_422, 16_947, 731, 11], abs=1)
    out = (gaps < 0.3e-3).mean().to_numpy()
    assert np.all(np.abs(out - exact) < 4 * np.sqrt(exact / 200_000))
    # the same parts in each case
    assert np.ptp(gaps.to_numpy() - 1e-3 * (10 - sizes), axis=1).max() < 1e-12
    assert {*run.limits} == {*gaps}
    assert tolstat.replay(run, 3).differences == ()
    axis = case_axis(run.study.table["cases"])
    assert axis.name == "b" and axis.values == pytest.approx(1e-3 * sizes)


def test_a_thermal_stack_has_its_known_spread():
    cold_to_hot = {"tolerance": "20..60 K", "distribution": "uniform"}
    links = {**STACK, "dT": {"nominal": "0 K", **cold_to_hot}}
    run = tolstat.run({**chain(THERMAL, links), "trials": 200_000})
    gap = run.frame()["gap"]
    assert gap.mean() == pytest.approx(0.16094e-3, abs=3e-7)
    assert gap.std() == pytest.approx(0.06194e-3, rel=0.01)
    assert np.mean(gap < 0.1e-3) == pytest.approx(0.168178, abs=0.004)


def test_cases_by_name_have_numbers_and_limits_of_their_own():
    limits = {"gap_at_hot": ">= 0 mm"}
    run = tolstat.run(chain(THERMAL, STACK, cases=TEMPERATURES, limits=limits))
    assert [r.name for r in run.responses] == ["gap_at_cold", "gap_at_hot"]
    assert run.responses[0].sentence == f"{THERMAL}, dT -40 K"
    assert [*run.limits] == ["gap_at_hot"]
    numbers = {number.name: number for number in run.numbers}
    hot = 300.3e-3 * (1 + 11.5e-6 * 60) - 300e-3 * (1 + 23.1e-6 * 60)
    assert numbers["rss_mean_at_hot"].value == pytest.approx(hot)
    assert numbers["rss_mean_at_hot"].of == "gap_at_hot"
    assert "cold = { dT = " in run.settings["cases"].words


def test_any_model_is_evaluated_as_it_is_in_each_case():
    cases = {"small": {"gain": 1.5}, "large": {"gain": 3}}
    study = {
        "model": "toy", "trials": 64, "seed": 3, "cases": cases,
        "deviations": {"part": "+-1 mm"},
    }  # fmt: skip
    loaded = load(study, model=Toy())
    rows = loaded.deviations()
    together = simulate(loaded.model, rows, loaded.settings)
    names = [response.name for response in loaded.description.responses]
    for case, changes in cases.items():
        alone = load({**study, "cases": {}, "settings": changes}, model=Toy())
        answers = simulate(alone.model, rows, alone.settings)
        plain = [response.name for response in alone.description.responses]
        for column, name in enumerate(plain):
            mine = together.responses[:, names.index(f"{name}_at_{case}")]
            assert np.array_equal(mine, answers.responses[:, column], equal_nan=True)


def test_a_trial_ends_as_it_first_fails():
    links = {"a": "1 +-0.3 mm", "b": "0 mm"}
    cases = {"b": ["0 mm", "0.9 mm"]}
    run = tolstat.run(chain("sqrt(a*a - b*b)", links, cases=cases))
    frame = run.frame()
    failed = (1e-3 + frame["a"] < 0.9e-3).to_numpy()
    assert failed.any() and ((frame["status"] != "done").to_numpy() == failed).all()
    assert frame.loc[failed, ["gap_at_1", "gap_at_2"]].isna().all(axis=None)


@pytest.mark.parametrize(
    "cases, words",
    [
        ({"cold": {"dX": "3 K"}}, "dX is neither a setting nor a link"),
        ({"cold": {"dT": "3 mm"}}, "the size of the link is expected in K"),
        ({"dT": ["3 +-1 K"]}, "cannot be read"),
        ({"dT": ["3 +-1 K"]}, "its tolerance is that of [links]"),
        ({"dT": []}, "dT: the list is empty"),
        ({"dT": ["3 K", "4 K"], "L": ["300 mm"]}, "same length, not dT 2, L 1"),
        ({"dT": ["3 K"], "cold": {"dT": "3 K"}}, "dT has a list, and cold has none"),
        ({"cold": {}}, "a table or a list is expected"),
        ({"too cold": {"dT": "3 K"}}, "letters, digits and _ are allowed"),
        ({"cold": {"gap": "L - x"}}, "[links] has no x"),
        ({"cold": {"gap": "L*L"}}, "write a study for each"),
        ({"dT": {"from": "0 K", "to": "1 K"}}, "from, to, points are expected"),
        ({"dT": {"from": "0 K", "to": "1 mm", "points": 3}}, "two ends of one kind"),
        ({"dT": {"from": "0 K", "to": "1 K", "points": 10**9}}, "at most 500"),
    ],
)  # fmt: skip
def test_wrong_cases_are_refused(cases, words):
    assert words in problems_of(chain(THERMAL, STACK, cases=cases))


@pytest.mark.parametrize(
    "values",
    [
        {"from": 0.4, "to": 0.6, "points": 3},
        {"from": "0.4", "to": "0.6", "points": 3},
        [0.4, 0.5, 0.6],
    ],
)
def test_cases_of_a_plain_number(values):
    study = chain("k*a", {"a": "10 mm", "k": "0.5 +-0.1"}, cases={"k": values})
    frame = tolstat.run(study).frame()
    gaps = frame[["gap_at_1", "gap_at_2", "gap_at_3"]].to_numpy()
    exact = 0.01 * (np.array([0.4, 0.5, 0.6]) + frame[["k"]].to_numpy())
    np.testing.assert_allclose(gaps, exact, rtol=1e-12)


def test_a_case_settles_its_settings_once(monkeypatch):
    counted = []
    settled = Condition.settings

    def counting(self, settings):
        counted.append(self.name)
        return settled(self, settings)

    study = load(chain(THERMAL, STACK, cases=TEMPERATURES))
    monkeypatch.setattr(Condition, "settings", counting)
    for _ in range(3):
        simulate(study.model, study.deviations(), study.settings)
    assert len(counted) <= len(TEMPERATURES)


def test_a_limit_of_an_unknown_case_is_refused():
    study = chain(THERMAL, STACK, cases=TEMPERATURES, limits={"gap_at_warm": ">= 0 mm"})
    assert "gap_at_warm = " in problems_of(study) and "gap_at_hot" in problems_of(study)


def test_names_without_case_mean_all_cases():
    names = ["f_1_at_a", "f_1_at_b", "f_2_at_a", "g_at_a", "gx_at_a"]
    assert expand("f", names) == ["f_1_at_a", "f_1_at_b", "f_2_at_a"]
    assert expand("f_1", names) == ["f_1_at_a", "f_1_at_b"]
    assert expand("f_at_a", names) == ["f_1_at_a", "f_2_at_a"]
    assert expand("g", names) == ["g_at_a"]
    own = ["force_at_start_1", "force_at_start_2"]  # of a model, without cases
    assert expand("force_at_start", own) == own


def test_a_case_cannot_change_what_an_audit_tightens():
    cases = {"fine": {"rtol": 1e-9}}
    study = {"model": "stand", "trials": 8, "seed": 1, "cases": cases}
    assert "rtol is the same in all cases" in problems_of(study)
    swept = {"model": "stand", "sampling": "grid", "grid": {"crank_speed": ["5 rad/s"]}}
    cases = {"slow": {"crank_speed": "5 rad/s"}}
    assert "crank_speed is in [grid], too" in problems_of({**swept, "cases": cases})

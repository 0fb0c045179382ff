"""Main causes of units out of limit: valid levels, known causes that are found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import (
    LEAST_EFFECTIVE,
    Weights,
    effective_number,
)
from tolstat.statistics.sensitivity.out_of_limit import (
    CLEAR,
    differences,
    least_level,
    of_kind,
)


def parts(n, k, seed):
    X = np.random.default_rng(seed).normal(size=(k, n))
    return {f"part_{i + 1}": x for i, x in enumerate(X)}


@pytest.mark.parametrize("digits", [16, 0])
def test_levels_match_two_rank_sum_tests(digits):
    x = np.random.default_rng(1).normal(size=300).round(digits)
    beyond = x + np.random.default_rng(2).normal(size=300) > 1.2

    def level(x):
        return stats.mannwhitneyu(
            x[beyond], x[~beyond], method="asymptotic", use_continuity=False
        ).pvalue

    found = differences({"rod": x}, {"y": beyond})["y"]["rod"]
    known = 2 * min(level(x), level(np.abs(x - np.median(x))))
    assert found.level == pytest.approx(known, rel=1e-9)
    off = (x[beyond] - x.mean()) / x.std()
    assert found.shift == pytest.approx(off.mean())
    assert found.width == pytest.approx(np.sqrt(np.mean(off**2)))


def test_levels_have_holms_correction():
    X = parts(400, 5, 3)
    beyond = X["part_1"] + 0.3 * X["part_2"] > 2
    alone = [
        differences({name: x}, {"y": beyond})["y"][name].level for name, x in X.items()
    ]
    found = [each.level for each in differences(X, {"y": beyond})["y"].values()]
    order = np.argsort(alone)
    known = np.maximum.accumulate(np.sort(alone) * [5, 4, 3, 2, 1])
    assert np.array(found)[order] == pytest.approx(np.minimum(known, 1))
    assert of_kind(["part_2", "part_1"], differences(X, {"y": beyond})["y"]) == found[0]


@pytest.mark.parametrize(("beyond", "trials"), [(5, 800), (20, 800), (200, 800)])
def test_chance_seldom_gives_a_significant_cause(beyond, trials):
    """Among twenty contributors that have nothing to do with it, also with five."""
    studies, hits = 400, 0
    machines = np.arange(trials) < beyond
    for seed in range(studies):
        found = differences(parts(trials, 20, seed), {"y": machines})["y"]
        hits += any(each.clear for each in found.values())
    assert hits / studies < CLEAR + 3.5 * np.sqrt(CLEAR * (1 - CLEAR) / studies)


def test_joint_causes_are_found_among_five_units():
    """Each is far off to either side among them, and in the middle of neither."""
    X = parts(4000, 20, 11)
    apart = np.abs(X["part_1"] - X["part_2"])
    found = differences(X, {"y": apart > np.sort(apart)[-6]})["y"]
    assert {name for name, each in found.items() if each.clear} == {"part_1", "part_2"}
    assert found["part_1"].width > 1.8


def test_too_few_units_out_of_limit_are_not_significant():
    X = parts(4000, 20, 5)
    worst = np.argsort(X["part_1"])
    for few in (1, 2, 3, 4):
        beyond = np.zeros(4000, dtype=bool)
        beyond[worst[-few:]] = True
        level = differences(X, {"y": beyond})["y"]["part_1"].level
        least = least_level(few, 20)
        assert level >= least * (1 - 1e-9) and level == pytest.approx(least, rel=0.05)
    assert least_level(3, 20) > CLEAR > least_level(4, 20)
    nobody = {"y": np.zeros(4000, bool), "z": np.ones(4000, bool)}
    assert differences(X, nobody) == {"y": {}, "z": {}}


def test_equal_weights_give_poisson_intervals():
    machines = np.arange(1000) < 7
    found = weighted_share(machines, Weights(np.ones(1000)))
    poisson = stats.gamma.ppf([0.025, 0.975], [7, 8]) / 1000  # Garwood (1936)
    assert found[:3] == pytest.approx((0.007, *poisson), rel=1e-9)
    assert effective_number(np.ones(1000)) == 1000


def test_zero_units_out_of_limit_have_an_upper_bound():
    weights = np.where(np.arange(1000) < 500, 2.0, 0.0)
    assert effective_number(weights) == 500
    found = weighted_share(np.zeros(1000, bool), Weights(weights))
    assert found.value == found.lower == 0
    assert found.upper == pytest.approx(-np.log(0.025) * 2 / 1000)


def test_too_small_an_effective_sample_size_gives_no_number():
    weights = np.zeros(1000)
    weights[: LEAST_EFFECTIVE - 1] = 1000 / (LEAST_EFFECTIVE - 1)
    found = weighted_share(weights > 0, Weights(weights))
    assert (
        np.isnan(found.value)
        and found.reason == "effective sample size 149; 150 needed"
    )
    assert effective_number(np.zeros(5)) == 0

"""Main causes of units out of limit: valid levels, known causes that are found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.statistics.failing_parts import parts
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import (
    LEAST_EFFECTIVE,
    Weights,
    effective_number,
)
from tolstat.statistics.sensitivity.out_of_limit import CLEAR, differences, holm


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


def test_holms_correction():
    levels = np.array([0.03, 0.001, 0.2, 0.01])
    assert holm(levels) == pytest.approx([0.06, 0.004, 0.2, 0.03])


def test_joint_causes_are_found_among_five_units():
    """Each is far off to either side among them, and in the middle of neither."""
    X = parts(4000, 20, 11)
    apart = np.abs(X["part_1"] - X["part_2"])
    found = differences(X, {"y": apart > np.sort(apart)[-6]})["y"]
    assert {n for n, each in found.items() if 20 * each.level < CLEAR} == {
        "part_1",
        "part_2",
    }
    assert found["part_1"].width > 1.8


def test_none_or_all_out_of_limit_differ_in_nothing():
    X = parts(4000, 20, 5)
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

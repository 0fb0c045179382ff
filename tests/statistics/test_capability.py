"""Capability of measured parts: coverage on normal parts, and what a check finds."""

import math

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics import sample_checks as checks
from tolstat.statistics.capability import Tolerance, capability_of, sigma_within
from tolstat.statistics.estimate import Lack


@pytest.mark.parametrize("parts", [8, 40])
def test_intervals_hold_the_truth(parts):
    rng, trials = np.random.default_rng(7), 800
    truth = {"mean": 0.3, "sigma": 1.0, "pp": 4 / 3, "ppk": 3.7 / 3}
    held = dict.fromkeys(truth, 0)
    for _ in range(trials):
        numbers = capability_of(rng.normal(0.3, 1.0, parts), Tolerance(-4.0, 4.0))
        for name, true in truth.items():
            value = getattr(numbers, name)
            held[name] += value.lower <= true <= value.upper
    for count in held.values():
        assert abs(count / trials - 0.95) < 3 * math.sqrt(0.95 * 0.05 / trials)


def test_one_end_is_the_tolerance_factor_of_the_noncentral_t():
    """Ppk of one end: 3 sqrt(n) Ppk is noncentral t about 3 sqrt(n) times the truth."""
    values = np.random.default_rng(1).normal(0.0, 1.0, 25)
    ppk = capability_of(values, Tolerance(upper=3.0)).ppk
    assert ppk.value == pytest.approx((3 - values.mean()) / (3 * values.std(ddof=1)))
    root = 3 * math.sqrt(25)
    above = stats.nct.sf(root * ppk.value, 24, root * ppk.lower)
    below = stats.nct.cdf(root * ppk.value, 24, root * ppk.upper)
    assert (above, below) == pytest.approx((0.025, 0.025), rel=1e-4)


def test_sigma_and_pp_are_of_chi_square():
    values = np.random.default_rng(2).normal(0.0, 1.0, 12)
    numbers = capability_of(values, Tolerance(-3.0, 3.0))
    ends = values.std(ddof=1) * np.sqrt(11 / stats.chi2.ppf([0.975, 0.025], 11))
    assert numbers.sigma[1:3] == pytest.approx(tuple(ends))
    assert numbers.pp.value == pytest.approx(1 / values.std(ddof=1))
    assert numbers.pp[1:3] == pytest.approx((1 / ends[1], 1 / ends[0]))


def test_lots_have_their_sigma():
    values = np.array([1.0, 3.0, 11.0, 13.0])
    sigma, freedom = sigma_within(values, ["a", "a", "b", "b"])
    assert (sigma, freedom) == (pytest.approx(math.sqrt(2)), 2)
    assert sigma_within(values, ["a"] * 4)[1] == 0
    numbers = capability_of(np.repeat(values, 5), Tolerance(0.0, 20.0),
                            ["a"] * 10 + ["b"] * 10)  # fmt: skip
    assert numbers.cpk.value > numbers.ppk.value


def test_what_has_no_interval_says_why():
    values = np.array([1.0, 2.0, 3.0])
    assert capability_of(values, Tolerance(upper=9)).ppk.lack is Lack.FEWEST_PARTS
    values = np.random.default_rng(3).exponential(1.0, 100)
    skewed = capability_of(values, Tolerance(upper=9), normal=False)
    assert skewed.ppk.lack is Lack.NORMAL_PARTS and skewed.outside.sure
    assert skewed.mean.sure  # of many
    assert math.isnan(capability_of(values, Tolerance()).ppk.value)
    assert capability_of(np.ones(9), Tolerance(0, 2)).ppk.lack is Lack.SPREAD
    assert capability_of(values, Tolerance(upper=3)).above == np.sum(values > 3)


def test_checks_are_silent_on_normal_parts():
    rng, alarms = np.random.default_rng(11), 0
    for _ in range(40):
        values = rng.normal(0.0, 1.0, 80)
        alarms += bool(
            len(checks.outliers(values)) or checks.two_peaks(values)
            or checks.trend(values) or checks.cut_off(values, 2.5)
            or checks.lots_differ(values, ["a", "b"] * 40)
        )  # fmt: skip
    assert alarms <= 3


def test_two_kinds_of_parts():
    rng = np.random.default_rng(4)
    values = np.concatenate([rng.normal(0, 1, 60), rng.normal(6, 1, 90)])
    peaks = checks.two_peaks(values)
    assert peaks.lower == pytest.approx(0, abs=0.4)
    assert peaks.upper == pytest.approx(6, abs=0.4)
    assert peaks.share == pytest.approx(0.4, abs=0.03)
    for sample in (rng.uniform(0, 1, 150), rng.exponential(1, 150)):
        assert checks.two_peaks(sample) is None


def test_parts_sorted_by_a_limit():
    rng = np.random.default_rng(5)
    values = rng.normal(0, 1, 400)
    cut = checks.cut_off(values[values <= 1.3], 1.3)
    assert cut.expected > 10
    assert checks.cut_off(values, 1.3) is None  # some lie beyond
    assert checks.cut_off(-values[values <= 1.3], -1.3).end == -1.3


def test_a_trend_and_lots():
    rng = np.random.default_rng(6)
    values = rng.normal(0, 1, 100) + np.linspace(0, 3, 100)
    assert checks.trend(values).drift == pytest.approx(3, abs=1)
    assert checks.trend(np.sort(values)) is None and checks.is_sorted(np.sort(values))
    differ = checks.lots_differ(values, ["first"] * 50 + ["last"] * 50)
    assert (differ.lowest, differ.highest) == ("first", "last")


def test_outliers_are_named_the_farthest_first():
    values = np.random.default_rng(8).normal(0, 1, 50)
    values[[7, 30]] = 9.0, -12.0
    assert checks.outliers(values).tolist() == [30, 7]


@pytest.mark.parametrize(
    ("written", "step"),
    [([20.01, 20.02, 19.98], 0.01), ([1.0, 2.0, 5.0], 1.0), ([0.5, 1.5, 1.0], 0.5),
     ([20.02, 20.04, 20.1], 0.02), ([7.0, 7.0], 0.0)],
)  # fmt: skip
def test_the_step_of_a_gauge(written, step):
    assert checks.step_of(written) == step


def test_a_coarse_step():
    assert checks.is_coarse(0.01, 0.01, Tolerance())
    assert checks.is_coarse(0.01, 1.0, Tolerance(0, 0.1))
    assert not checks.is_coarse(0.001, 0.01, Tolerance(0, 0.1))


def test_of_lots_that_differ_intervals_rest_on_the_number_of_lots():
    """As closed forms of balanced lots have them: Student's t of the means of lots."""
    rng, lots = np.random.default_rng(5), np.repeat(np.arange(6), 30)
    values = rng.standard_normal(6)[lots] + rng.standard_normal(180)
    names, tolerance = [*map(str, lots)], Tolerance(-5.0, 5.0)
    found, alone = (capability_of(values, tolerance, x) for x in (names, []))
    means = values.reshape(6, 30).mean(axis=1)
    ends = stats.t.interval(0.95, 5, means.mean(), stats.sem(means))
    assert (found.mean.lower, found.mean.upper) == pytest.approx(ends)
    # all parts of a lot alike: then sigma is worth as many parts as there are lots
    widest = stats.chi2.ppf([0.975, 0.025], 5) / 5
    ratios = (found.sigma.value / np.array(found.sigma[1:3])) ** 2
    assert widest[1] <= ratios[1] < 0.5 and 1.5 < ratios[0] <= widest[0]
    for one, other in ((found.ppk, alone.ppk), (found.outside, alone.outside)):
        assert one.value == other.value
        assert one.upper - one.lower > 1.4 * (other.upper - other.lower)
    assert capability_of(values[:90], tolerance, names[:90]).ppk.lack is (
        Lack.FEWEST_LOTS
    )
    # lots that differ by chance alone leave all as it is
    same = capability_of(rng.standard_normal(180), tolerance, [*"ABCDEF"] * 30)
    assert same.mean.sure


def test_intervals_of_lots_hold():
    """Coverage of 95 % intervals, six lots of 12 parts, half of the variance between.

    `tests.studies.coverage.lots` has all cells.
    """
    rng, names, hits = (
        np.random.default_rng(8),
        [*map(str, np.repeat(range(6), 12))],
        [],
    )
    tolerance = Tolerance(upper=2.0)
    for _ in range(200):
        values = np.repeat(rng.normal(0, 0.7071, 6), 12) + rng.normal(0, 0.7071, 72)
        found = capability_of(values, tolerance, names)
        truths = (found.mean, 0.0), (found.sigma, 1.0), (found.ppk, 2 / 3)
        truths += ((found.outside, stats.norm.sf(2.0)),)
        hits.append([x.lower <= truth <= x.upper for x, truth in truths])
    assert np.mean(hits, axis=0).min() > 0.91


@pytest.mark.parametrize("shift", [-1, 1])
def test_an_index_far_from_0_has_the_interval_of_sigma(shift):
    """There it is that of 1/sigma; near the change both agree."""
    values = np.random.default_rng(3).normal(0.0, 1.0, 60)
    for distance in (290, 310, 136_000):
        ppk = capability_of(values + shift * distance, Tolerance(upper=0.0)).ppk
        ends = np.sqrt(stats.chi2.ppf([0.025, 0.975], 59) / 59) * ppk.value
        assert ppk[1:3] == pytest.approx(tuple(np.sort(ends)), rel=1e-4)

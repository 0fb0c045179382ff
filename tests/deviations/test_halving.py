"""Weights of trials with halved tolerances, against trials sampled so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.deviations.drawing import draw
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.distributions import (
    Arcsine,
    Beta,
    Constant,
    Lognormal,
    Normal,
    StudentT,
    Tolerance,
    Trapezoidal,
    Triangular,
    TruncatedNormal,
    Uniform,
    Weibull,
)
from tolstat.deviations.measured import Fitted, Measured
from tolstat.deviations.spread import Shifted, fixed_point, halved, resized
from tolstat.errors import DistributionError


def weights_of(x, distributions, names, dependence=None, sized=True):
    new = {name: halved(distributions[name], sized=sized) for name in names}
    return DensityRatio(x, distributions, dependence or Dependence()).weights(new)


ZONE, HALF = Tolerance(-0.1, 0.3), Tolerance(0.0, 0.2)  # about its middle
FROM_ZERO, HALF_FROM_ZERO = Tolerance(0.0, 1.0), Tolerance(0.0, 0.5)
NAMES = ["rod_1", "rod_2", "gear"]
TRIALS = 200_000


def drawn(distributions, dependence=None, seed=3):
    table = draw(
        NAMES, distributions, sampling="random", seed=seed, trials=TRIALS,
        dependence=dependence,
    )  # fmt: skip
    return dict(zip(NAMES, table.T, strict=True))


@pytest.mark.parametrize(
    ("made", "half"),
    [
        (Normal(ZONE, shift=0.05), Normal(HALF, shift=0.025)),
        (Normal(ZONE, cp=1.3, cpk=1.0), Normal(HALF, cp=1.3, cpk=1.0)),
        (TruncatedNormal(ZONE, outside="screened"),
         TruncatedNormal(HALF, outside="screened")),
        (Uniform(ZONE), Uniform(HALF)),
        (Triangular(ZONE, 0.2), Triangular(HALF, 0.15)),
        (Trapezoidal(ZONE), Trapezoidal(HALF)),
        (Beta(ZONE, 2.0, 4.0), Beta(HALF, 2.0, 4.0)),
        (Weibull(FROM_ZERO, 2.0), Weibull(HALF_FROM_ZERO, 2.0)),
        (Lognormal(FROM_ZERO, 0.3), Lognormal(HALF_FROM_ZERO, 0.15)),
        (StudentT(ZONE, 5.0), StudentT(HALF, 5.0)),
        # of one sign: an end that stood still would move the mean of all parts
        (Uniform(Tolerance(16.0, 34.0)), Uniform(Tolerance(20.5, 29.5))),
        (Uniform(Tolerance(-34.0, -16.0)), Uniform(Tolerance(-29.5, -20.5))),
        (Uniform(FROM_ZERO), Uniform(Tolerance(0.25, 0.75))),  # a grade H
    ],
)  # fmt: skip
def test_weighted_parts_are_those_of_the_halved_tolerance(made, half):
    x = made.deviations((np.arange(TRIALS) + 0.5) / TRIALS)
    weights = weights_of({"rod_1": x}, {"rod_1": made}, ["rod_1"])
    assert weights.mean() == pytest.approx(1, abs=2e-3)
    below = np.cumsum(weights) / TRIALS
    for share in (0.01, 0.2, 0.5, 0.8, 0.99):
        end = half.deviations(np.array([share]))[0]
        assert np.interp(end, x, below) == pytest.approx(share, abs=2e-3)


def test_the_weight_of_a_normal_part_is_the_ratio_of_two_normal_densities():
    x = np.array([0.0, 0.3, -0.8, 2.0, 4.5])
    normal = Normal(Tolerance(-3.0, 3.0))
    weights = weights_of({"rod_1": x}, {"rod_1": normal}, ["rod_1"])
    known = stats.norm.pdf(x, 0, 0.5) / stats.norm.pdf(x)
    np.testing.assert_allclose(weights, known, rtol=1e-3, atol=1e-12)


PAIR = {"rod_1": Normal(ZONE), "rod_2": Uniform(ZONE), "gear": Normal(ZONE)}
HALF_OF = {"rod_1": Normal(HALF), "rod_2": Uniform(HALF), "gear": Normal(HALF)}


@pytest.mark.parametrize("members", [("rod_1",), ("rod_2",), ("rod_1", "rod_2")])
@pytest.mark.parametrize(
    "dependence",
    [
        Dependence({}, {("rod_1", "rod_2"): 0.6}),
        Dependence({name: Batch("rod", 0.5) for name in NAMES[:2]}),
        Dependence(),
    ],
    ids=["correlated", "batch", "free"],
)
def test_correlation_is_kept(dependence, members):
    x = drawn(PAIR, dependence)
    weights = weights_of(x, PAIR, members, dependence)
    again = drawn(PAIR | {n: HALF_OF[n] for n in members}, dependence, seed=4)
    for statistic in (
        lambda x: (x["rod_1"] > 0.1) & (x["rod_2"] > 0.12),
        lambda x: np.abs(x["rod_1"] - x["rod_2"]) > 0.1,
    ):
        expected = statistic(again).mean()
        noise = np.sqrt(np.mean(weights**2 * statistic(x)) / TRIALS)
        assert np.mean(weights * statistic(x)) == pytest.approx(
            expected, abs=5 * noise + 5 * np.sqrt(expected / TRIALS)
        )


def test_a_batch_of_equal_parts_is_halved_as_one():
    distributions = dict.fromkeys(NAMES[:2], Normal(ZONE))
    alike = Dependence({name: Batch("rod", 1.0) for name in NAMES[:2]})
    x = drawn(distributions, alike)
    both = weights_of(x, distributions, NAMES[:2], alike)
    single = weights_of(x, distributions, ["rod_1"])
    np.testing.assert_array_equal(both, single)
    with pytest.raises(DistributionError, match="all parts of its batch are equal"):
        weights_of(x, distributions, ["rod_1"], alike)
    distributions["rod_2"] = replace(distributions["rod_2"], cp=2.0)
    with pytest.raises(DistributionError, match="different tolerances"):
        weights_of(x, distributions, NAMES[:2], alike)


@pytest.mark.parametrize(
    ("distribution", "words"),
    [
        (Constant(0.1), "no tolerance"),
        (Measured(np.array([0.1, 0.2])), "no tolerance"),
        (Fitted("normal", 0.0, 1.0, 0.5, 20), "no tolerance"),
        (TruncatedNormal(ZONE, cp=0.5, outside="clipped"), "nearly the same deviation"),
        (Arcsine(ZONE), "nearly the same deviation"),
    ],
)
def test_a_refusal_to_halve_has_a_reason(distribution, words):
    x = {"rod_1": distribution.deviations(np.array([0.2, 0.6]))}
    with pytest.raises(DistributionError, match=words):
        weights_of(x, {"rod_1": distribution}, ["rod_1"])


FRICTION, FROM_60 = Tolerance(-20.0, 40.0), Tolerance(0.0, 60.0)


@pytest.mark.parametrize(
    ("made", "sized", "fixed"),
    [
        (Uniform(Tolerance(0.0, 21.0)), True, 10.5),  # H7 of 25 mm
        (Normal(Tolerance(-20.0, -7.0)), True, -13.5),
        (Triangular(Tolerance(-0.2, 0.0), -0.18), True, -0.1),
        (Triangular(FRICTION, 0.0), True, 10.0),  # of a link: the middle
        # no nominal value: an amplitude, and what is typed as most likely
        (Uniform(FROM_60), False, 0.0),
        (Triangular(FROM_60, 12.0), False, 0.0),
        (Triangular(FRICTION, 0.0), False, 0.0),
        (Triangular(FRICTION, 5.0), False, 5.0),
        (Lognormal(Tolerance(-50.0, 100.0), 0.0), False, 0.0),
        (Trapezoidal(FRICTION, Tolerance(-5.0, 9.0)), False, 2.0),
        (Uniform(FRICTION), False, 10.0),
        (Uniform(Tolerance(-50.0, -20.0)), False, -35.0),  # teeth made thinner
        (Uniform(Tolerance(-50.0, 0.0)), False, -25.0),
        # they begin at their lower end
        (Lognormal(FROM_60, 10.0), False, 0.0),
        (Lognormal(Tolerance(0.1, 0.4), 0.2), True, 0.1),
        (Weibull(Tolerance(-0.3, 0.4), 2.0), True, -0.3),
    ],
)  # fmt: skip
def test_a_zone_narrows_about_its_middle_unless_the_drawing_says_otherwise(
    made, sized, fixed
):
    for by in (0.0, 7.0):
        moved = Shifted(made, by) if by else made
        assert fixed_point(moved, sized=sized) == pytest.approx(fixed + by)
        ends = halved(moved, sized=sized).deviations(np.array([0.1, 0.9]))
        at = moved.deviations(np.array([0.1, 0.9])) - by
        np.testing.assert_allclose(ends - by, fixed + (at - fixed) / 2, rtol=1e-12)
        # a search narrows it the same way, with its mode, median and plateau
        half = resized(moved, made.tolerance.half / 2, sized=sized)
        found = half.deviations(np.array([0.1, 0.9]))
        np.testing.assert_allclose(found, ends, rtol=1e-9, atol=1e-9)


def test_a_search_moves_the_shift_of_a_mean_with_the_tolerance():
    half = resized(Normal(Tolerance(10.0, 30.0), shift=2.0), 5.0, sized=True)
    assert half == Normal(Tolerance(15.0, 25.0), shift=1.0)

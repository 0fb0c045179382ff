"""Each distribution against SciPy's, and contradictory keys."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from tolstat.deviations import measured
from tolstat.deviations.distributions import (
    DISTRIBUTIONS,
    Arcsine,
    Beta,
    Circular,
    Constant,
    CurvilinearTrapezoid,
    Gamma,
    Gumbel,
    Lognormal,
    Mixture,
    Normal,
    Source,
    StudentT,
    Tolerance,
    Trapezoidal,
    Triangular,
    TruncatedNormal,
    Uniform,
    Weibull,
)
from tolstat.deviations.measured import Fitted, Measured, fit
from tolstat.deviations.samplers import Random
from tolstat.deviations.spread import spread_of
from tolstat.errors import DistributionError

ZONE = Tolerance(-1e-4, 3e-4)  # unequal ends
MIDDLE, HALF = 1e-4, 2e-4
WIDTH = 2 * HALF
LOW, HIGH = ZONE

BELOW_THREE_SIGMA = stats.norm.cdf(3)
LOG_SIGMA = np.log(4) / 3  # the median a quarter of the way up
WEIBULL = WIDTH / stats.weibull_min(2).ppf(BELOW_THREE_SIGMA)

GUMBEL = np.diff(stats.gumbel_r.ppf([1 - BELOW_THREE_SIGMA, BELOW_THREE_SIGMA]))[0]
GUMBEL_SCALE = WIDTH / GUMBEL
GUMBEL_LOC = LOW - GUMBEL_SCALE * stats.gumbel_r.ppf(1 - BELOW_THREE_SIGMA)
SOURCES = (Source(0.7, 0.0, 2e-5), Source(0.3, 5e-5, 4e-5))


class TwoSources(stats.rv_continuous):
    """The mixture of two sources, by SciPy's search for a root."""

    def _cdf(self, x):
        return sum(w * ndtr((1e-4 * x - m) / s) for w, m, s in SOURCES)

    def _pdf(self, x):
        scores = [(1e-4 * w / s, (1e-4 * x - m) / s) for w, m, s in SOURCES]
        return sum(h * np.exp(-z * z / 2) for h, z in scores) / np.sqrt(2 * np.pi)

    def _munp(self, n):
        return sum(w * stats.norm(1e4 * m, 1e4 * s).moment(n) for w, m, s in SOURCES)


class Curvilinear(stats.rv_continuous):
    """A curvilinear trapezoid between -1 and 1, each end +-0.1 (JCGM 101, 6.4.3)."""

    def _pdf(self, x):
        s = np.abs(x)
        flank = np.log(1.1 / np.maximum(s, 0.9)) / 0.4
        return np.where(s <= 1.1, flank, 0.0)

    def _cdf(self, x):
        s = np.abs(x)
        over = np.maximum(s, 0.9)
        tail = (1.1 - over - over * np.log(1.1 / over)) / 0.4
        tail = tail + (over - s) * np.log(1.1 / 0.9) / 0.4
        return np.where(x < 0, tail, 1 - tail)

    def _munp(self, n):
        """The moment of a uniform distribution whose half width is uniform, too."""
        m = n + 1
        return (1 - n % 2) * (1.1**m - 0.9**m) / (0.2 * m**2)


CASES = [
    (Normal(ZONE), stats.norm(MIDDLE, HALF / 3)),
    (Normal(ZONE, cp=1.33), stats.norm(MIDDLE, HALF / 3.99)),
    (Normal(ZONE, cp=1.33, shift=5e-5), stats.norm(MIDDLE + 5e-5, HALF / 3.99)),
    (Normal(ZONE, cpk=1.33), stats.norm(MIDDLE, HALF / 3.99)),
    (Normal(ZONE, cp=2.0, cpk=1.5), stats.norm(MIDDLE + HALF / 4, HALF / 6)),
    (Normal(ZONE, cpk=1.0, shift=-5e-5), stats.norm(MIDDLE - 5e-5, 1.5e-4 / 3)),
    (
        TruncatedNormal(ZONE, cp=0.5, shift=1e-4, outside="screened"),
        stats.truncnorm(-2.25, 0.75, MIDDLE + 1e-4, HALF / 1.5),
    ),
    (Uniform(ZONE), stats.uniform(LOW, WIDTH)),
    (Arcsine(ZONE), stats.arcsine(LOW, WIDTH)),
    (Triangular(ZONE), stats.triang(0.5, LOW, WIDTH)),
    (Triangular(ZONE, mode=0.0), stats.triang(0.25, LOW, WIDTH)),
    (Circular(ZONE), stats.beta(1.5, 1.5, LOW, WIDTH)),
    (Trapezoidal(ZONE), stats.trapezoid(0.25, 0.75, LOW, WIDTH)),
    (
        Trapezoidal(ZONE, Tolerance(-0.6e-4, 1e-4)),
        stats.trapezoid(0.1, 0.5, LOW, WIDTH),
    ),
    (Beta(ZONE, 2.0, 5.0), stats.beta(2, 5, LOW, WIDTH)),
    (Beta(ZONE, 0.7, 0.8), stats.beta(0.7, 0.8, LOW, WIDTH)),
    (Lognormal(ZONE, 0.0), stats.lognorm(LOG_SIGMA, LOW, WIDTH / 4)),
    (Weibull(ZONE, 2.0), stats.weibull_min(2, LOW, WEIBULL)),
    (
        StudentT(ZONE, 12.0),
        stats.t(12, MIDDLE, HALF / stats.t(12).ppf(BELOW_THREE_SIGMA)),
    ),
    (
        Gamma(ZONE, 2.5),
        stats.gamma(2.5, LOW, WIDTH / stats.gamma(2.5).ppf(BELOW_THREE_SIGMA)),
    ),
    (Gumbel(ZONE), stats.gumbel_r(GUMBEL_LOC, GUMBEL_SCALE)),
    (
        CurvilinearTrapezoid(ZONE, HALF / 10),
        Curvilinear(a=-1.1, b=1.1)(loc=MIDDLE, scale=HALF),
    ),
    (Mixture(SOURCES), TwoSources(a=-5, b=5)(scale=1e-4)),
    (Fitted("normal", 1e-4, 2e-4, 0.5, 20), stats.norm(1e-4, 2e-4)),
    (Fitted("lognormal", -9.0, 0.4, 0.5, 20), stats.lognorm(0.4, scale=np.exp(-9))),
]
LIMITING = [  # no flank, one flank; no fourth moment
    (Triangular(ZONE, mode=LOW), stats.triang(0.0, LOW, WIDTH)),
    (Triangular(ZONE, mode=HIGH), stats.triang(1.0, LOW, WIDTH)),
    (Trapezoidal(ZONE, ZONE), stats.uniform(LOW, WIDTH)),
    (StudentT(ZONE, 3.0), stats.t(3, MIDDLE, HALF / stats.t(3).ppf(BELOW_THREE_SIGMA))),
]


def named(cases):
    """Parameters with the names of their distributions."""
    return [
        pytest.param(d, known, id=f"{type(d).__name__} {i}")
        for i, (d, known) in enumerate(cases)
    ]


def test_every_distribution_is_tested():
    tested = {type(distribution) for distribution, _ in CASES} - {Fitted}
    assert tested == set(DISTRIBUTIONS.values()) - {Constant}


@pytest.mark.parametrize(("distribution", "known"), named(CASES + LIMITING))
def test_inverse_matches_scipy(distribution, known):
    u = np.concatenate([np.linspace(1e-9, 1 - 1e-9, 1001), [2**-53, 1 - 2**-53]])
    if isinstance(known.dist, TwoSources | Curvilinear):  # found by a search there
        u = u[:-2]
    found = distribution.deviations(u)
    np.testing.assert_allclose(found, known.ppf(u), rtol=1e-8, atol=1e-13)


@pytest.mark.parametrize(("distribution", "known"), named(CASES))
def test_samples_follow_the_distribution(distribution, known):
    """Kolmogorov-Smirnov, four moments within their own scatter, and the ends."""
    n = 100_000
    u = Random().unit_samples(75, {"rod_length_1": 0}, n)[:, 0]
    draws = distribution.deviations(u)
    assert stats.kstest(draws, known.cdf).pvalue > 1e-3
    lower, upper = known.support()
    assert lower <= draws.min() and draws.max() <= upper
    scores = (draws - known.mean()) / known.std()
    mean, variance, skew, kurtosis = known.stats("mvsk")
    expected = (0.0, 1.0, float(skew), float(kurtosis) + 3)
    for power, moment in enumerate(expected, start=1):
        values = scores**power
        assert abs(values.mean() - moment) < 4.5 * values.std() / np.sqrt(n), power
    assert np.isfinite([mean, variance]).all()


def test_clipped_parts_lie_at_the_ends():
    """Rework moves exactly the parts outside, each to the end it missed."""
    u = Random().unit_samples(75, {"rod_length_1": 0}, 100_000)[:, 0]
    process = Normal(ZONE, cp=0.5, shift=1e-4).deviations(u)
    clipped = TruncatedNormal(ZONE, cp=0.5, shift=1e-4, outside="clipped").deviations(u)
    inside = (process > LOW) & (process < HIGH)
    np.testing.assert_array_equal(clipped[inside], process[inside])
    np.testing.assert_array_equal(clipped[process >= HIGH], HIGH)
    np.testing.assert_array_equal(clipped[process <= LOW], LOW)
    share = np.mean(clipped == HIGH)
    assert abs(share - stats.norm.sf(0.75)) < 4 * np.sqrt(0.25 / 100_000)


def test_student_of_four_has_a_closed_form_and_of_many_is_normal():
    """W. T. Shaw, J. Comput. Finance 9(4), 2006."""
    u = np.append(np.linspace(0.001, 0.999, 999), BELOW_THREE_SIGMA)
    root = np.sqrt(4 * u * (1 - u))
    t = np.sign(u - 0.5) * 2 * np.sqrt(np.cos(np.arccos(root) / 3) / root - 1)
    found = StudentT(ZONE, 4.0).deviations(u)
    np.testing.assert_allclose(found, MIDDLE + HALF * t / t[-1], rtol=0, atol=1e-13)
    many, normal = StudentT(ZONE, 1e7).deviations(u), Normal(ZONE).deviations(u)
    np.testing.assert_allclose(many, normal, rtol=0, atol=1e-6 * HALF)


@pytest.mark.parametrize("freedom", [3.0, 5.0, 30.0])
def test_the_spread_of_student_is_its_own(freedom):
    """Sigma follows from the heavy tails, not from the tolerance."""
    student = StudentT(ZONE, freedom)
    lower, upper, mean, sigma = spread_of(student)
    assert (lower, upper) == ZONE
    assert mean == pytest.approx(MIDDLE, rel=1e-9)
    scale = HALF / stats.t(freedom).ppf(BELOW_THREE_SIGMA)
    known = scale * np.sqrt(freedom / (freedom - 2))
    assert sigma == pytest.approx(known, rel=2e-5)
    inside = np.diff(stats.t(freedom, mean, scale).cdf([lower, upper]))
    assert inside == pytest.approx(stats.norm.cdf(3) - stats.norm.cdf(-3), rel=1e-12)


def test_constant_is_constant():
    np.testing.assert_array_equal(Constant(3e-4).deviations(np.array([0.1, 0.9])), 3e-4)


def test_measured_parts_are_equally_likely():
    parts = np.sort(np.random.default_rng(5).normal(1e-4, 2e-5, 60))
    u = Random().unit_samples(75, {"rod_length_1": 0}, 100_000)[:, 0]
    draws = Measured(parts).deviations(u)
    found, counts = np.unique(draws, return_counts=True)
    np.testing.assert_array_equal(found, parts)
    assert stats.chisquare(counts).pvalue > 1e-3
    known = stats.rv_discrete(values=(np.arange(60), np.full(60, 1 / 60)))
    np.testing.assert_array_equal(draws, parts[known.ppf(u).astype(int)])
    ends = Measured(parts).deviations(np.array([2**-53, 1 - 2**-53]))
    np.testing.assert_array_equal(ends, parts[[0, -1]])


def test_fits_and_their_p_values():
    rng = np.random.default_rng(3)
    normal, skewed = rng.normal(2e-4, 5e-5, 200), rng.lognormal(-9, 0.9, 200)
    right = fit(normal, "normal")
    assert right.mean == normal.mean() and right.sigma == normal.std(ddof=1)
    assert right.p_value > 0.05 > fit(skewed, "normal").p_value
    assert fit(skewed, "lognormal").p_value > 0.05
    assert fit(skewed, "lognormal").mean == pytest.approx(
        stats.lognorm.fit(skewed, floc=0)[2]
        and np.log(stats.lognorm.fit(skewed, floc=0)[2])
    )
    # the test with estimated parameters, not the table for known ones
    again = [fit(rng.normal(0, 1, 30), "normal").p_value for _ in range(60)]
    assert stats.kstest(again, "uniform").pvalue > 1e-3


def test_many_parts_are_tested_against_a_smaller_sample(monkeypatch):
    """The level hardly depends on their number: as far off as 999 samples scatter."""
    parts = np.random.default_rng(8).standard_t(25, 400)
    exact = fit(parts, "normal").p_value
    assert 0.02 < exact < 0.9
    monkeypatch.setattr(measured, "MOST_SIMULATED", 150)
    assert fit(parts, "normal").p_value == pytest.approx(exact, abs=0.05)
    many = np.random.default_rng(9).normal(0, 1, 100_000)
    assert 0.001 <= fit(many, "normal").p_value <= 1


@pytest.mark.parametrize(
    ("values", "kind", "words"),
    [
        ([1.0] * 5, "normal", "too few"),
        ([1.0] * 20, "normal", "equal"),
        (np.linspace(-1, 1, 20), "lognormal", "above zero"),
    ],
)
def test_impossible_fits_are_refused(values, kind, words):
    with pytest.raises(DistributionError, match=words):
        fit(np.array(values), kind)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Normal(ZONE, cp=0.0), "above zero"),
        (lambda: Normal(ZONE, cp=-1.0), "above zero"),
        (lambda: Normal(ZONE, cp=1.0, cpk=1.33), "at most cp"),
        (lambda: Normal(ZONE, cp=1.0, cpk=0.9, shift=1e-5), "not all three"),
        (lambda: Normal(ZONE, shift=3e-4), "outside the tolerance"),
        (lambda: TruncatedNormal(ZONE, cp=0.0, outside="clipped"), "above zero"),
        (lambda: Triangular(ZONE, mode=4e-4), "outside the tolerance"),
        (lambda: Trapezoidal(ZONE, Tolerance(-2e-4, 1e-4)), "outside the tolerance"),
        (lambda: Beta(ZONE, 0.0, 1.0), "alpha = 0"),
        (lambda: Beta(ZONE, 1.0, -1.0), "beta = -1"),
        (lambda: Lognormal(ZONE, 3e-4), "outside the tolerance"),
        (lambda: Weibull(ZONE, 0.0), "above zero"),
        (lambda: Gamma(ZONE, -1.0), "above zero"),
        (lambda: CurvilinearTrapezoid(ZONE, HALF), "less than half the tolerance"),
        (lambda: Mixture((Source(0.7, 0.0, 1e-5),)), "100 % together, not 70 %"),
        (lambda: StudentT(ZONE, 2.9), "degrees_of_freedom = 2.9: at least 3"),
        (lambda: StudentT(ZONE, float("nan")), "at least 3"),
    ],
)
def test_contradictory_keys_are_refused(make, words):
    with pytest.raises(DistributionError, match=words):
        make()


def test_distributions_are_found_by_their_name():
    assert {"normal", "truncated_normal", "weibull"} <= set(DISTRIBUTIONS)
    assert all(map(dataclasses.is_dataclass, DISTRIBUTIONS.values()))
    assert DISTRIBUTIONS["truncated_normal"] is TruncatedNormal


def test_measured_parts_have_ends_at_three_sigma_quantiles():
    """Nobody gave them a tolerance: its ends lie where those of others do at Cp = 1."""
    lower, upper, mean, sigma = spread_of(Fitted("normal", 1e-4, 2e-5, 0.5, 20))
    assert (lower, upper) == pytest.approx((0.4e-4, 1.6e-4), rel=1e-12)
    assert (mean, sigma) == pytest.approx((1e-4, 2e-5), rel=1e-9)
    fitted = spread_of(Fitted("lognormal", -9.0, 0.4, 0.5, 20))
    assert fitted[:2] == pytest.approx(np.exp([-9 - 1.2, -9 + 1.2]), rel=1e-12)
    about = np.exp(-9 + 0.4**2 / 2)
    assert fitted.mean == pytest.approx(about, rel=1e-9)
    assert fitted.sigma == pytest.approx(about * np.sqrt(np.expm1(0.4**2)), rel=1e-9)
    # of 10 000 parts 13.5 lie beyond on either side
    parts = np.arange(10_000) * 1e-8
    assert spread_of(Measured(parts))[:2] == (parts[13], parts[-14])


def test_two_suppliers():
    """70 % at 10, 30 % at 10.05, sigma 0.02 each: 24 411 ppm outside 9.95 to 10.08."""
    mixture = Mixture((Source(0.7, 0.0, 2e-5), Source(0.3, 5e-5, 2e-5)))
    lower, upper = -5e-5, 8e-5
    below = sum(w * stats.norm.cdf(lower, m, s) for w, m, s in mixture.parts)
    above = sum(w * stats.norm.sf(upper, m, s) for w, m, s in mixture.parts)
    assert 1e6 * (below + above) == pytest.approx(24411, abs=0.5)
    ends = mixture.deviations(np.array([below, 1 - above]))
    np.testing.assert_allclose(ends, (lower, upper), rtol=1e-12)


@pytest.mark.parametrize("inexactness", [1e-9, 1e-5, 0.9999 * HALF])
def test_a_curvilinear_trapezoid_of_any_inexactness(inexactness):
    u = (np.arange(100_000) + 0.5) / 100_000
    parts = CurvilinearTrapezoid(ZONE, inexactness).deviations(u)
    assert (np.diff(parts) > 0).all()
    variance = WIDTH**2 / 12 + inexactness**2 / 9
    assert parts.var() == pytest.approx(variance, rel=1e-6)

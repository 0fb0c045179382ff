"""Efficiency of weighted trials: closed forms, and refusals before the run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.deviations.density_ratio import DensityRatio, check_overlap, overlap_of
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.distributions import Normal, Tolerance, Triangular, Uniform
from tolstat.errors import DistributionError


def normal(sigma, mean=0.0):
    return Normal(Tolerance(mean - 3 * sigma, mean + 3 * sigma))


def uniform(lower, upper):
    return Uniform(Tolerance(lower, upper))


def of_normal(sigma, mean=0.0):
    """One over the mean square of the weights, in closed form."""
    return sigma * np.sqrt(2 - sigma**2) * np.exp(-(mean**2) / (2 - sigma**2))


@pytest.mark.parametrize(
    ("drawn", "new", "worth"),
    [
        (normal(1), normal(0.5), of_normal(0.5)),
        (normal(1), normal(0.1), of_normal(0.1)),
        (normal(1), normal(1.2), of_normal(1.2)),
        (normal(1), normal(1, 0.7), of_normal(1, 0.7)),
        (normal(1), normal(0.8, -0.5), of_normal(0.8, -0.5)),
        (uniform(0, 1), uniform(0.2, 0.6), 0.4),
        (uniform(-1, 1), Triangular(Tolerance(-1, 1)), 0.75),
    ],
)
def test_effective_sample_size_matches_the_closed_form(drawn, new, worth):
    assert check_overlap(drawn, new) == pytest.approx(worth, rel=0.01)
    both = overlap_of(
        {"a": drawn, "b": drawn}, Dependence(), {"a": new, "b": new}, 1000
    )
    assert both.efficiency == pytest.approx(worth**2, rel=0.05)


@pytest.mark.parametrize(
    ("drawn", "new", "said"),
    [
        (normal(1), normal(1.45), "tails are too heavy"),  # from sqrt 2 on: no variance
        (Triangular(Tolerance(-1, 1)), uniform(-1, 1), "tails are too heavy"),
        (uniform(0, 1), uniform(0, 1.25), "20 % of these parts lie outside"),
        (uniform(-3, 3), normal(1), "0.27 % of these parts"),
        (normal(1), normal(1, 4), "lie outside the sampled range"),
    ],
)
def test_distributions_outside_the_sample_are_refused(drawn, new, said):
    with pytest.raises(DistributionError, match=said):
        check_overlap(drawn, new)


def test_the_cut_is_the_share_above_the_cap():
    drawn, new = {"a": normal(1)}, {"a": normal(1, 0.8)}
    found = overlap_of(drawn, Dependence(), new, 4000)
    # weights exp(0.8 z - 0.32): above the cap from there on, and so much of the excess
    z = (np.log(found.most) + 0.32) / 0.8
    excess = stats.norm.sf(z - 0.8) - found.most * stats.norm.sf(z)
    assert found.cut == pytest.approx(excess, rel=0.2)
    assert 0.5 < 4000 * stats.norm.sf(z) / np.log(40) < 2
    narrower = overlap_of(drawn, Dependence(), {"a": normal(0.5)}, 4000)
    assert narrower.most == pytest.approx(2, rel=1e-3) and narrower.cut < 1e-6


CLOSE = Dependence({}, {("a", "b"): 0.9})


def test_a_change_of_one_correlated_part_is_refused():
    drawn = {"a": normal(1), "b": normal(1)}
    with pytest.raises(DistributionError, match="change all parts that are correlated"):
        overlap_of(drawn, CLOSE, {"a": normal(0.5)}, 4000)
    both = overlap_of(drawn, CLOSE, {"a": normal(0.5), "b": normal(0.5)}, 4000)
    assert both.efficiency == pytest.approx(of_normal(0.5) ** 2, rel=0.05)
    alike = Dependence({n: Batch("x", 1.0) for n in "ab"})
    once = overlap_of(drawn, alike, {"a": normal(0.5), "b": normal(0.5)}, 4000)
    assert once.efficiency == pytest.approx(of_normal(0.5), rel=0.02)


def test_weights_are_ratios_of_densities():
    z = np.random.default_rng(1).standard_normal((2, 2000))
    rho = 2 * np.sin(np.pi * 0.5 / 6)
    x = {"a": z[0], "b": rho * z[0] + np.sqrt(1 - rho**2) * z[1]}
    together = Dependence({}, {("a", "b"): 0.5})
    drawn = {"a": normal(1), "b": normal(1)}
    found = DensityRatio(x, drawn, together).weights({"b": normal(0.8, 0.3)})
    points = np.stack([x["a"], x["b"]], axis=1)
    new = stats.multivariate_normal([0, 0.3], [[1, 0.8 * rho], [0.8 * rho, 0.64]])
    old = stats.multivariate_normal([0, 0], [[1, rho], [rho, 1]])
    known = new.pdf(points) / old.pdf(points)
    np.testing.assert_allclose(found, known, rtol=3e-3, atol=1e-9)
    with pytest.raises(DistributionError, match="did not deviate"):
        DensityRatio(x, drawn, together).weights({"c": normal(1)})

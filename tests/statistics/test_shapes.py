"""Named distributions: parameters as SciPy's, levels that are levels, atoms said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.shapes import NAMES, atom_of, best_shape, fit_shape

DRAWN = {
    "normal": stats.norm(5.0, 2.0),
    "lognormal": stats.lognorm(0.7, scale=3.0),
    "weibull": stats.weibull_min(1.7, scale=4.0),
    "gumbel": stats.gumbel_r(3.0, 2.0),
}


def draws(name, n, seed=0):
    return DRAWN[name].rvs(n, random_state=seed)


def test_parameters_are_those_of_scipy():
    x = draws("gumbel", 3000)
    location, scale = stats.gumbel_r.fit(x)
    found = fit_shape(x, "gumbel").parameters
    assert found == pytest.approx({"location": location, "scale": scale}, rel=1e-4)
    x = draws("weibull", 3000)
    shape, _, scale = stats.weibull_min.fit(x, floc=0)
    found = fit_shape(x, "weibull").parameters
    assert found == pytest.approx({"shape": shape, "scale": scale}, rel=1e-4)
    x = draws("lognormal", 3000)
    found = fit_shape(x, "lognormal").parameters
    logs = np.log(x)
    assert found == pytest.approx({"mean": logs.mean(), "sigma": logs.std(ddof=1)})
    x = draws("normal", 3000)
    found = fit_shape(x, "normal").parameters
    assert found == pytest.approx({"mean": x.mean(), "sigma": x.std(ddof=1)})


@pytest.mark.parametrize("name", NAMES)
def test_the_nearest_is_the_true_one(name):
    found = best_shape(draws(name, 5000))
    assert found.name == name and not found.rejected


@pytest.mark.parametrize("name", NAMES)
def test_a_true_distribution_is_rejected_as_often_as_the_level_says(name):
    rng = np.random.default_rng(3)
    levels = np.array(
        [
            fit_shape(DRAWN[name].rvs(100, random_state=rng), name).level
            for _ in range(1000)
        ]
    )
    for level in (0.25, 0.1, 0.05, 0.025):
        error = np.sqrt(level * (1 - level) / 1000)
        assert abs(np.mean(levels <= level) - level) < 4 * error


def test_another_distribution_is_rejected():
    assert fit_shape(draws("weibull", 2000), "normal").rejected
    assert fit_shape(draws("normal", 2000), "gumbel").rejected


def test_what_cannot_be_fitted_says_why():
    assert fit_shape(np.arange(20.0), "normal").refused == "needs 50"
    assert "above zero" in fit_shape(np.linspace(-1, 1, 60), "weibull").refused
    assert "does not spread" in fit_shape(np.ones(60), "normal").refused


def test_machines_that_share_a_value_are_an_atom():
    rng = np.random.default_rng(1)
    loss = np.where(rng.random(4000) < 0.9, 0.0, rng.exponential(0.01, 4000))
    atom = atom_of(loss)
    assert atom.value == 0.0 and atom.share.lower < 0.9 < atom.share.upper
    rest = atom.without(loss)
    assert len(rest) == np.count_nonzero(loss)
    assert fit_shape(rest, "weibull").parameters["shape"] == pytest.approx(1, abs=0.1)


def test_as_good_as_the_same_is_an_atom_too():
    """A loss of smoothed friction is never quite zero."""
    rng = np.random.default_rng(2)
    jammed = rng.random(4000) < 0.05
    nothing = 1e-8 * rng.lognormal(size=4000)
    loss = np.where(jammed, rng.exponential(0.01, 4000), nothing)
    atom = atom_of(loss)
    assert atom.share.value == pytest.approx(0.95, abs=0.02)
    assert atom.largest < 1e-5 < atom.without(loss).min() * 10


@pytest.mark.parametrize("name", NAMES)
def test_a_smooth_response_has_no_atom(name):
    assert atom_of(draws(name, 5000)) is None
    assert atom_of(np.random.default_rng(0).weibull(0.5, 5000)) is None
    assert atom_of(np.ones(100)) is None and atom_of(np.empty(0)) is None

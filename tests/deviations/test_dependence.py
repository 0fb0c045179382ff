"""Parts of one batch, and correlations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.deviations.drawing import draw
from tolstat.deviations.dependence import (
    Batch,
    Dependence,
    correlation_of_scores,
    groups,
)
from tolstat.deviations.distributions import Lognormal, Normal, Tolerance, Uniform
from tolstat.errors import DependenceError

NAMES = ["rod_1", "rod_2", "rod_3", "mass"]
ZONE = Tolerance(-1e-3, 1e-3)
PARTS = {
    "rod_1": Normal(ZONE),
    "rod_2": Lognormal(ZONE, -0.8e-3),
    "rod_3": Uniform(ZONE),
    "mass": Normal(ZONE),
}


def draws(dependence, parts=PARTS, trials=100_000, sampling="random"):
    return draw(
        NAMES, parts, sampling=sampling, seed=3, trials=trials, dependence=dependence
    )


def standard_error(rank, trials):
    """Of a rank correlation: Bonett and Wright (2000)."""
    return np.sqrt((1 + rank**2 / 2) / trials) * (1 - rank**2)


@pytest.mark.parametrize("sampling", ["random", "latin", "sobol"])
def test_rank_correlations_are_reached(sampling):
    wanted = {
        ("rod_1", "rod_2"): 0.6,
        ("rod_2", "rod_3"): -0.3,
        ("mass", "rod_1"): -0.5,
    }
    table = draws(Dependence({}, wanted), sampling=sampling)
    found = stats.spearmanr(table).statistic
    for i in range(4):
        for j in range(i):
            rank = wanted.get((NAMES[j], NAMES[i]), wanted.get((NAMES[i], NAMES[j]), 0))
            error = standard_error(rank, len(table))
            assert abs(found[i, j] - rank) < 4 * error, (NAMES[i], NAMES[j])


def test_correlation_keeps_every_distribution():
    table = draws(Dependence({}, {("rod_1", "rod_2"): 0.6, ("rod_2", "rod_3"): 0.4}))
    alone = draws(Dependence())
    for column in range(4):
        assert stats.ks_2samp(table[:, column], alone[:, column]).pvalue > 1e-3
    np.testing.assert_array_equal(table[:, 3], alone[:, 3])  # hangs on nothing
    np.testing.assert_array_equal(table[:, 0], alone[:, 0])


def test_parts_of_one_batch_are_equal():
    rods = {f"rod_{i}": Batch("rod", 1.0) for i in (1, 2, 3)}
    table = draws(Dependence(rods), dict.fromkeys(NAMES, Normal(ZONE)))
    np.testing.assert_array_equal(table[:, 0], table[:, 1])
    np.testing.assert_array_equal(table[:, 0], table[:, 2])
    assert abs(np.corrcoef(table[:, 0], table[:, 3])[0, 1]) < 4 / np.sqrt(len(table))


def test_a_batch_shifts_its_parts_by_its_share_of_the_variance():
    """Analysis of variance: between batches 60 %, within them 40 %."""
    rods = {f"rod_{i}": Batch("rod", 0.6) for i in (1, 2, 3)}
    table = draws(Dependence(rods), dict.fromkeys(NAMES, Normal(ZONE)))[:, :3]
    n, sigma = len(table), 1e-3 / 3
    within = table.var(axis=1, ddof=1).mean()
    between = table.mean(axis=1).var(ddof=1) - within / 3
    assert within / sigma**2 == pytest.approx(0.4, abs=4 * 0.4 / np.sqrt(n))
    assert between / sigma**2 == pytest.approx(0.6, abs=4 * 1.1 / np.sqrt(n))
    for column in table.T:
        assert stats.kstest(column, stats.norm(0, sigma).cdf).pvalue > 1e-3


def test_groups_are_independent_of_each_other():
    pairs = [("a", "b"), ("c", "d"), ("e", "f"), ("d", "b")]
    assert sorted(groups(pairs)) == [["a", "b", "c", "d"], ["e", "f"]]


def test_an_impossible_correlation_names_its_entries():
    pairs = {
        ("rod_1", "rod_2"): 0.9,
        ("rod_2", "rod_3"): 0.9,
        ("rod_1", "rod_3"): -0.9,
        ("mass", "rod_1"): 0.1,
    }
    with pytest.raises(DependenceError) as refused:
        correlation_of_scores(NAMES, Dependence({}, pairs))
    for words in ("rod_1 with rod_2 (0.9)", "rod_1 with rod_3 (-0.9)", "not positive"):
        assert words in str(refused.value)
    assert "mass" not in str(refused.value)

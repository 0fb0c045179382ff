"""Parts of one batch, and correlations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.deviations.drawing import draw
from tolstat.deviations.dependence import (
    Batch,
    Dependence,
    correlation_of_scores,
    groups,
    pearson_of_rank,
    rank_of_pearson,
    scores_of_rank,
)
from tolstat.deviations.distributions import Lognormal, Normal, Tolerance, Uniform
from tolstat.errors import DependenceError, StudyError
from tolstat.study.study import load

NAMES = ["rod_1", "rod_2", "rod_3", "mass"]
ZONE = Tolerance(-1e-3, 1e-3)
LOG = np.log(2e-3 / 0.2e-3) / 3  # sigma of the logarithm of rod_2
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


def quadrature(first, second, r):
    """Return Pearson's correlation of two deviations whose scores have r."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(120)
    weights = weights / weights.sum()
    z = r * nodes[:, None] + np.sqrt(1 - r * r) * nodes
    x, y = (
        part.deviations(np.clip(stats.norm.cdf(scores), 1e-16, 1 - 1e-16))
        for part, scores in ((first, nodes), (second, z))
    )
    x = x - weights @ x
    y = y - weights @ y @ weights
    square_x, square_y = weights @ x**2, weights @ y**2 @ weights
    return (weights @ (x * (y @ weights))) / np.sqrt(square_x * square_y)


@pytest.mark.parametrize("pearson", [0.9, 0.3, -0.6])
def test_pearson_of_normal_deviations_is_that_of_their_scores(pearson):
    rank = rank_of_pearson(pearson, PARTS["rod_1"], PARTS["mass"])
    assert rank == pytest.approx(6 / np.pi * np.arcsin(pearson / 2), abs=1e-9)
    assert scores_of_rank(rank) == pytest.approx(pearson, abs=1e-9)


@pytest.mark.parametrize("pearson", [0.9, 0.3, -0.6])
def test_pearson_of_uniform_deviations_is_their_rank_correlation(pearson):
    rank = rank_of_pearson(pearson, Uniform(ZONE), Uniform(Tolerance(0, 3.0)))
    assert rank == pytest.approx(pearson, abs=1e-6)


def test_pearson_of_lognormal_and_normal_is_a_closed_form():
    """That of a normal and a lognormal is r s / sqrt(exp(s^2) - 1)."""
    s = np.log(2e-3 / 0.2e-3) / 3
    rank = rank_of_pearson(0.5, PARTS["rod_1"], PARTS["rod_2"])
    r = 0.5 * np.sqrt(np.expm1(s * s)) / s
    assert scores_of_rank(rank) == pytest.approx(r, abs=1e-6)


@pytest.mark.parametrize("names", [("rod_2", "rod_3"), ("rod_2", "rod_2")])
def test_pearson_of_other_deviations_by_quadrature(names):
    parts = [PARTS[name] for name in names]
    r = scores_of_rank(rank_of_pearson(0.7, *parts))
    assert quadrature(*parts, r) == pytest.approx(0.7, abs=1e-4)


def test_a_pearson_correlation_out_of_reach_is_refused():
    with pytest.raises(DependenceError, match=r"reach -0\.555 to 1"):
        rank_of_pearson(-0.9, Lognormal(ZONE, -0.8e-3), Lognormal(ZONE, -0.8e-3))


@pytest.mark.parametrize(("sign", "sigma"), [("-", 0.4472), ("+", 1.9494)])
def test_sigma_of_two_links_with_pearson(tmp_path, sign, sigma):
    """sqrt(1 + 1 -+ 2 x 0.9) mm for two links of sigma 1 mm."""
    link = {"nominal": "100 mm", "tolerance": "+-3 mm"}
    study = {"model": "dimension_chain", "trials": 40_000, "seed": 1}
    study |= {"settings": {"gap": f"A {sign} B"}, "links": {"A": link, "B": link}}
    study["correlation"] = {"A": {"B": {"pearson": 0.9}}}
    run = tolstat.run(study, output=tmp_path / "run.h5", workers=1)
    assert 1e3 * run.column("gap").std() == pytest.approx(sigma, rel=0.015)
    assert run.correlation["A"]["B"] == pytest.approx(0.8915, abs=1e-4)
    note = "A and B: Pearson's correlation 0.9, rank correlation 0.8915"
    assert note in run.notes


@pytest.mark.parametrize(
    ("names", "known"),
    [
        (("rod_1", "mass"), lambda r: r),
        (("rod_3", "rod_3"), lambda r: 6 / np.pi * np.arcsin(r / 2)),
        # a normal one with a lognormal one: r s / sqrt(exp(s^2) - 1)
        (("rod_1", "rod_2"), lambda r: r * LOG / np.sqrt(np.expm1(LOG**2))),
        (("rod_2", "rod_2"), lambda r: np.expm1(r * LOG**2) / np.expm1(LOG**2)),
    ],
)
@pytest.mark.parametrize("rank", [0.6, -0.4])
def test_pearson_of_a_rank_correlation(names, known, rank):
    """That of these two distributions, by closed form, both ways."""
    parts = [PARTS[name] for name in names]
    found = pearson_of_rank(rank, *parts)
    assert found == pytest.approx(known(scores_of_rank(rank)), abs=1e-5)
    assert rank_of_pearson(found, *parts) == pytest.approx(rank, abs=1e-6)


def notes_of(value, **entries):
    link = {"nominal": "100 mm", "tolerance": "+-3 mm"}
    study = {"model": "dimension_chain", "trials": 8, "seed": 1}
    study |= {"settings": {"gap": "A - B"}, "links": {"A": link, "B": link | entries}}
    study["correlation"] = {"A": {"B": value}}
    loaded = load(study)
    return loaded.deviating.dependence.correlations, loaded.deviating.notes


def test_spearman_is_the_rank_correlation_as_typed():
    for entries in ({}, {"distribution": "uniform"}):
        typed, plain = notes_of({"spearman": 0.9}, **entries), notes_of(0.9, **entries)
        assert typed == plain and typed[0] == {("A", "B"): 0.9}
    # normal with uniform: r sqrt(3 / pi)
    linear = 2 * np.sin(np.pi * 0.9 / 6) * np.sqrt(3 / np.pi)
    note = f"A and B: rank correlation 0.9, Pearson's correlation {linear:.4g}"
    assert note in typed[1]


def test_the_note_of_a_typed_pearson_echoes_it():
    (pair, notes) = notes_of({"pearson": 0.6}, distribution="uniform")
    rank = 6 / np.pi * np.arcsin(0.6 / np.sqrt(3 / np.pi) / 2)
    assert pair["A", "B"] == pytest.approx(rank, abs=1e-6)
    assert f"A and B: Pearson's correlation 0.6, rank correlation {rank:.4g}" in notes


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"pearsn": 0.9}, "did you mean 'pearson'"),
        ({"pearson": 1.5}, "between -1 and 1"),
        ({"rank": 0.9}, "no key rank"), ({}, "pearson = .* or .* spearman = "),
        ({"pearson": 0.9, "spearman": 0.9}, "one of both"),
        ({"spearmann": 0.9}, "did you mean 'spearman'"),
        ({"spearman": -1.5}, "rank correlation -1.5: a number between -1 and 1"),
        ({"spearman": "high"}, "such as { rod_length_2"),
        ({"pearson": "high"}, "such as { rod_length_2"),
    ],
)  # fmt: skip
def test_wrong_pearson_correlations(value, words):
    study = {"model": "stand", "trials": 8, "seed": 1}
    study["deviations"] = {"rod_length": "+-1 mm"}
    study["correlation"] = {"rod_length_1": {"rod_length_2": value}}
    with pytest.raises(StudyError, match=words):
        load(study)

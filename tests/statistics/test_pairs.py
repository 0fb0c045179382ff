"""Pairs that explain units out of limit: valid levels, planted pairs found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.statistics.failing_parts import parts, worst
from tolstat.statistics.sensitivity.out_of_limit import CLEAR
from tolstat.statistics.sensitivity.pairs import BOTH_FAR, DIFFERENCE, MORE, SUM, pairs


def of_one(X, beyond):
    return pairs(X, {"y": beyond})["y"]


PLANTED = {
    "difference": (lambda a, b: np.abs(a - b), DIFFERENCE),
    "sum": (lambda a, b: np.abs(a + b), SUM),
    "product": (lambda a, b: np.abs(a * b), BOTH_FAR),
    "uneven": (lambda a, b: np.abs(4 * a - 3 * b), DIFFERENCE),
}


@pytest.mark.parametrize("machines", [15, 40])
@pytest.mark.parametrize("name", PLANTED)
def test_planted_pairs_are_found_among_twenty_contributors(name, machines):
    of, how = PLANTED[name]
    for seed in range(2):
        X = parts(4096, 20, seed)
        noise = 0.2 * np.random.default_rng(seed + 100).normal(size=4096)
        found = of_one(X, worst(of(X["part_3"], X["part_8"]) + noise, machines))
        assert found[0].members == ("part_3", "part_8") and found[0].how == how
        assert found[0].far.value > max(found[0].alone, 0.5)


@pytest.mark.parametrize("ends", [1, 2])
@pytest.mark.parametrize("number", [3, 12])
def test_equal_parts_of_a_sum_are_no_pair(number, ends):
    """To one side they are causes alone; to both sides they are named as several."""
    X = parts(4096, 20, 4)
    y = np.sum([X[f"part_{i + 1}"] for i in range(number)], axis=0)
    for machines in (20, 40, 100):
        found = of_one(X, worst(np.abs(y) if ends == 2 else y, machines))
        assert not any(len(each.members) == 2 for each in found)
        if number == 3:
            assert [(e.members, e.how) for e in found] == [
                (("part_1", "part_2", "part_3"), MORE)
            ][: ends - 1]


@pytest.mark.parametrize(
    ("factors", "machines"), [((1, 2, -1), 40), ((1, 1, -1), 20), ((1, 1, -1, -1), 20)]
)
def test_those_that_follow_a_pair_join_it(factors, machines):
    for seed in range(3):
        X = parts(4096, 20, seed)
        names = tuple(f"part_{i + 1}" for i in range(len(factors)))
        y = np.sum([f * X[n] for f, n in zip(factors, names, strict=True)], axis=0)
        found = of_one(X, worst(np.abs(y), machines))
        assert [(each.members, each.how) for each in found] == [(names, MORE)]


def test_a_pair_does_not_grow_by_one_of_little_effect():
    """The third has a fiftieth of the variance."""
    X = parts(4096, 20, 3)
    y = np.abs(X["part_1"] - X["part_2"] + 0.2 * X["part_3"])
    (found,) = of_one(X, worst(y, 100))
    assert found.members == ("part_1", "part_2")


SINGLE = {
    "nothing": lambda X, noise: noise,
    "one": lambda X, noise: X["part_1"],
    "one, to both sides": lambda X, noise: np.abs(X["part_1"]) + 0.2 * noise,
    "either of three": lambda X, noise: np.max(
        [np.abs(X[f"part_{i}"]) for i in (1, 2, 3)], axis=0
    ),
}


@pytest.mark.parametrize("machines", [6, 40])
@pytest.mark.parametrize("name", SINGLE)
def test_single_contributors_are_seldom_taken_for_a_pair(name, machines):
    studies, hits = 50, 0
    for seed in range(studies):
        X = parts(600, 6, seed)
        noise = np.random.default_rng(seed + 1000).normal(size=600)
        hits += bool(of_one(X, worst(SINGLE[name](X, noise), machines)))
    assert hits / studies < CLEAR + 3.5 * np.sqrt(CLEAR * (1 - CLEAR) / studies)


def test_the_level_is_that_of_the_less_significant_member():
    X = parts(3000, 3, 4)  # three pairs, and two kinds; two of the pairs are near
    beyond = worst(np.abs(2 * X["part_1"] - 1.5 * X["part_2"]), 12)
    a, b = (
        stats.norm.ppf((stats.rankdata(X[name]) - 0.5) / 3000)[beyond]
        for name in ("part_1", "part_2")
    )
    about_zero = np.sum(a * b) / max(np.linalg.norm(a), np.linalg.norm(b))
    c, d = a - a.mean(), b - b.mean()
    score = min(
        abs(about_zero), abs(a @ d) / np.linalg.norm(d), abs(b @ c) / np.linalg.norm(c)
    )
    (found,) = of_one(X, beyond)
    known = np.log(4 * 2 * stats.norm.sf(score) * 3)
    assert np.log(found.level) == pytest.approx(known, rel=0.02)
    assert found.of_all == 0.05 and found.far.value == 1.0
    far = stats.norm.isf(0.025)
    alone = max(np.mean(np.abs(a) > far), np.mean(np.abs(b) > far))
    assert found.alone == alone <= found.single


def test_correlated_contributors_are_no_pair():
    X = parts(4000, 4, 2)
    X["part_2"] = 0.7 * X["part_3"] + 0.7 * X["part_2"]
    X["part_1"] = 0.7 * X["part_3"] + 0.7 * X["part_1"]
    assert of_one(X, worst(X["part_3"], 40)) == []
    X["part_1"] = X["part_4"] = parts(4000, 1, 9)["part_1"]  # of one batch
    assert of_one(X, worst(np.abs(X["part_1"]), 40)) == []


def test_no_units_or_no_pairs_give_an_empty_result():
    X = parts(100, 3, 1)
    assert of_one(X, np.zeros(100, bool)) == of_one(X, np.ones(100, bool)) == []
    assert of_one({"part_1": X["part_1"]}, X["part_1"] > 2) == []


def test_nearly_equal_parts_are_ranked_by_chance():
    """Two sizes only: what falls together is in no order."""
    X = {n: np.sign(x) for n, x in parts(2000, 6, 3).items()}
    rng = np.random.default_rng(5)
    hits = sum(
        bool(of_one(X, np.isin(np.arange(2000), rng.choice(2000, 20, False))))
        for _ in range(40)
    )
    assert hits / 40 < CLEAR + 3.5 * np.sqrt(CLEAR * (1 - CLEAR) / 40)


@pytest.mark.parametrize(
    "parts_of, number, machines",
    [
        (lambda rng, n: rng.integers(0, 3, n).astype(float), 20, 15),
        (lambda rng, n: np.maximum(rng.uniform(-1, 1, n), 0.0), 4, 1800),
    ],
    ids=["three values", "half at an end"],
)
def test_ties_of_contributors_are_ranked_independently(parts_of, number, machines):
    hits, studies = 0, 20
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        X = {f"part_{i}": parts_of(rng, 4096) for i in range(number)}
        beyond = np.isin(np.arange(4096), rng.choice(4096, machines, False))
        hits += bool(of_one(X, beyond))
    assert hits / studies < CLEAR + 3.5 * np.sqrt(CLEAR * (1 - CLEAR) / studies)


def test_mostly_equal_parts_are_not_correlated():
    rng = np.random.default_rng(2)
    X = {
        f"part_{i}": np.where(rng.random(4096) < 0.7, 0.0, rng.normal(size=4096))
        for i in range(4)
    }
    found = of_one(X, worst(np.abs(X["part_0"] - X["part_3"]), 40))
    assert [each.members for each in found] == [("part_0", "part_3")]


def test_a_chain_of_correlations_links_its_ends():
    """The first and the last of nine have next to nothing in common."""
    X = parts(4000, 9, 2)
    for i in range(2, 10):
        X[f"part_{i}"] = 0.5 * X[f"part_{i - 1}"] + X[f"part_{i}"]
    ends = np.abs(X["part_1"] - X["part_9"])
    assert abs(stats.spearmanr(X["part_1"], X["part_9"])[0]) < 4 / np.sqrt(4000)
    assert of_one(X, worst(ends, 40)) == []

"""Clusters that a jump of a formula makes, and those that parts or failures make."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tests.studies.coverage.problems import PROBLEMS
from tolstat.statistics.clusters import clusters_of

TURN = 2 * math.pi


def wrapped(angle):
    return (angle + math.pi) % TURN - math.pi


def found_in(values, parts, turns=(TURN,), fewest=1):
    steps = dict.fromkeys(turns, 1.0)
    return clusters_of(values, lambda trials: parts[trials], steps, fewest)


def parts_of(n, seed=1):
    x = np.random.default_rng(seed).standard_normal((n, 3))
    return x, x @ [1.0, 0.5, 0.2]


# of the response from parts and their sum: the step between clusters
JUMPS = {
    "atan2 beside 180 deg": (
        lambda x, s: np.arctan2(0.01 * x[:, 0], 0.1 * x[:, 1] - 1), TURN
    ),
    "a wrap of some trials": (lambda x, s: wrapped(math.pi - 0.02 + 0.01 * s), TURN),
    "a wrap of a wide angle": (lambda x, s: wrapped(math.pi + 0.3 * s), TURN),
    "degrees": (lambda x, s: np.degrees(wrapped(math.pi + 0.01 * s)), 360.0),
    "a branch": (lambda x, s: 0.1 * s + 5 * (x[:, 0] > 1), 5.0),
    "a branch the other way": (lambda x, s: 0.1 * s - 5 * (x[:, 0] > 1), 5.0),
}  # fmt: skip


@pytest.mark.parametrize("case", JUMPS)
@pytest.mark.parametrize("n", [200, 1000, 20_000])
def test_a_jump_of_a_formula_is_seen(case, n):
    x, s = parts_of(n)
    response, step = JUMPS[case]
    values = response(x, s)
    found = found_in(values, x, (TURN, 360.0))
    assert found.step == pytest.approx(step, rel=2e-3)
    assert found.turn == (step in (TURN, 360.0))
    assert (found.below, found.above) == (
        np.sum(values <= found.lower), np.sum(values >= found.upper),
    )  # fmt: skip
    assert found.below + found.above == n


def test_one_trial_a_whole_turn_away_is_seen():
    x, s = parts_of(500)
    angle = math.pi - 0.01 * (np.sort(s)[-2:].mean()) + 0.01 * s
    found = found_in(wrapped(angle), x)
    assert found.turn and (found.below, found.above) == (1, 499)
    # of a response that is no angle it may be an outlier
    assert found_in(wrapped(angle), x, (), 5) is None


@pytest.mark.parametrize(
    "wrapped_at_half",
    [
        lambda angle: np.arctan(np.tan(angle)),
        lambda angle: 0.5 * np.angle(np.exp(2j * angle)),
        lambda angle: (angle + math.pi / 2) % math.pi - math.pi / 2,
    ],
)
def test_half_a_turn_is_told_from_a_whole_one(wrapped_at_half):
    x, s = parts_of(500)
    values = wrapped_at_half(math.pi / 2 + 0.01 * s)
    turns = {TURN: 1.0, math.pi: 0.5}
    found = clusters_of(values, lambda trials: x[trials], turns, 1)
    assert found.turn == 0.5 and found.step == pytest.approx(math.pi, rel=1e-3)
    assert found.below == np.sum(s > 0)
    whole = clusters_of(wrapped(math.pi + 0.01 * s), lambda t: x[t], turns, 1)
    assert whole.turn == 1.0


def _batches(x):
    batch = (x[:, 0] > 0.3) * 4.0
    return np.column_stack([batch + 0.05 * x[:, 2], x[:, 1] * 0.1])


HONEST = {
    "linear": lambda x, s: s,
    "a point mass": lambda x, s: np.maximum(s - 2, 0.0),
    "a jam far away": lambda x, s: np.where(s > 1.8, 5 + np.abs(x[:, 2]), 0.0),
    "a rare kind of failure": lambda x, s: np.where(x[:, 0] > 2, 30 + x[:, 2], x[:, 1]),
    "a count": lambda x, s: np.round(s),
    "yes or no": lambda x, s: (s > 1) * 1.0,
    "heavy tails": lambda x, s: stats.t.ppf(stats.norm.cdf(s), 1.5),
    "lognormal": lambda x, s: np.exp(3 * s),
    "a pole of a physical kind": lambda x, s: 1 / np.abs(s),
    "a contact": lambda x, s: np.where(s > 0, 1000 * s, s),
    "noise": lambda x, s: np.random.default_rng(9).standard_normal(len(s)),
}


@pytest.mark.parametrize("case", HONEST)
@pytest.mark.parametrize("n", [200, 1000, 20_000])
def test_an_honest_response_does_not_jump(case, n):
    for seed in range(5):
        x, s = parts_of(n, seed)
        assert found_in(HONEST[case](x, s), x, (TURN, 360.0)) is None


@pytest.mark.parametrize(
    "response",
    [
        lambda parts: parts.sum(axis=1),
        lambda parts: (parts.sum(axis=1) + 3) ** 2,
        lambda parts: np.exp(parts.sum(axis=1)),
        lambda parts: TURN / 4 * parts[:, 0],
    ],
)
def test_two_batches_of_parts_explain_their_clusters(response):
    for n in (200, 2000):
        parts = _batches(parts_of(n)[0])
        assert found_in(response(parts), parts) is None
        parts = np.round(parts, 0)  # two sizes alone
        assert found_in(response(parts), parts) is None


@pytest.mark.parametrize("name", PROBLEMS)
def test_known_problems_do_not_jump(name):
    """With parts that tell nothing of the response, and with the one that decides."""
    for n in (200, 1000, 4096):
        for seed in range(3):
            rng = np.random.default_rng(seed)
            u = rng.random(n)
            values = PROBLEMS[name].inverse(u)
            for x in (stats.norm.ppf(u)[:, None], rng.standard_normal((n, 4))):
                assert found_in(values, x, (TURN, 360.0)) is None

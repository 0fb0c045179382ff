"""Which verdicts stand beside what an audit shows: errors planted in known values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import beta

from tolstat.statistics.integration_error import AuditedResponse

N = 4000
RANDOM = np.arange(0, N, 100)


def audited(error, finer=0.0, values=None, limit=(-math.inf, 4.0), out=()):
    """An audit whose first and third evaluation err by so much; 40 trials, 24 of it."""
    truth = np.random.default_rng(1).normal(size=N) if values is None else values
    stored, trials = truth + np.zeros(N), np.union1d(RANDOM, out).astype(int)
    stored[trials] += np.broadcast_to(error, len(trials))
    third = np.arange(0, len(trials))[:24]
    precise = truth[trials].copy()
    precise[third] += finer
    return AuditedResponse(
        stored, limit, trials, precise, np.isin(trials, RANDOM),
        np.isin(trials, out), third, truth[trials][third],
    )  # fmt: skip


def one(size, number=40, where=7):
    error = np.zeros(number)
    error[where] = size
    return error


@pytest.mark.parametrize(
    ("error", "finer", "stands"),
    [
        (1e-4, 1e-6, True), (0.03, 1e-4, True), (0.3, 0.01, True),
        (one(0.5), 0.0, False),  # one event that steps missed
        (one(0.05), 0.0, True),  # too small to matter
        (0.0, one(0.5, 24), False),  # missed by the audit as well
        (0.01, 0.015, True), (0.1, 0.08, False),  # it does not converge
        (50.0, 0.0, False),  # errors are the response
    ],
)  # fmt: skip
def test_met_stands_beside_small_and_regular_errors_only(error, finer, stands):
    assert audited(error, finer).permits(True, 0.0, 0.0027) is stands


def test_not_met_stands_if_enough_of_the_trials_out_of_limit_stay_out():
    values = np.random.default_rng(2).normal(size=N)
    out = np.flatnonzero(values > 2.0)[:20]
    trials = np.union1d(RANDOM, out)
    error = np.zeros(len(trials))
    error[np.flatnonzero(np.isin(trials, out))[:5]] = 3.0  # 5 of 20 are within
    values[out[:5]] -= 3.0
    found = audited(error, 0.0, values, (-math.inf, 2.0), out)
    assert found.irregular.sum() == 5
    assert found.most_within == pytest.approx(beta.isf(0.025, 6, 15))  # 0.49
    assert found.permits(False, 0.02, 0.0027)
    assert not found.permits(False, 0.005, 0.0027)
    assert not found.permits(True, 0.02, 0.0027)


def test_errors_count_beside_the_spread_and_the_room_to_the_limit():
    normal = audited(0.0)
    assert normal.spread == pytest.approx(1.0, rel=0.05)
    still = audited(0.0, values=np.full(N, 3.0), limit=(0.0, 5.0))
    assert still.spread == pytest.approx(0.02)
    rare = np.zeros(N)
    rare[::50] = 1.0
    assert audited(0.0, values=rare).spread == pytest.approx(0.04)


def test_a_trial_that_fails_the_third_time_is_not_settled():
    found = audited(0.0)
    found.most_precise[3] = np.nan
    assert found.unsettled.sum() == 1 and not found.permits(True, 0.0, 0.0027)
    found.precise[found.third[3]] = np.nan  # nor was it done before
    assert not found.unsettled.any()

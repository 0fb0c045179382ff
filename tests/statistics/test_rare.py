"""The share of rare machines: what few heavy ones leave open."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tolstat.statistics.rare import rare_share, unmet

N = 1000


@pytest.mark.parametrize("number", [99, 100])
def test_few_machines_beyond_leave_room_for_the_heaviest_of_all(number):
    """Of a hundred the heaviest beyond stands for the next one (Fay and Feuer)."""
    weights = np.full(N, 0.01)
    weights[-1] = 2.0  # not beyond
    found = rare_share(np.arange(N) < number, weights)
    counts = weights[:number] / N
    assert found.value == pytest.approx(counts.sum())
    next_one = (0.01 if number == 100 else 2.0) / N
    mean, variance = counts.sum() + next_one, (counts**2).sum() + next_one**2
    upper = variance / mean / 2 * chi2.ppf(0.975, 2 * mean**2 / variance)
    assert found.upper == pytest.approx(upper, rel=1e-6)


def test_where_none_is_beyond_the_heaviest_bounds_the_share():
    weights = np.linspace(0.5, 2.0, N)
    found = rare_share(np.zeros(N, bool), weights)
    assert found == (0, 0, unmet(weights), "")
    assert (1 - found.upper / 2.0) ** N == pytest.approx(0.025)
    assert rare_share(np.zeros(0, bool), weights[:0]).reason

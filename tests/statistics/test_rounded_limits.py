"""Values on an end of a limit are permitted, whatever their last bit is."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from tolstat.statistics.limits.limit import within


@pytest.mark.parametrize("step", [4e-5, 5e-5, 2e-5, 1e-4])
def test_whole_steps_on_a_limit_are_within(step):
    """By fractions: the step and the end as they are typed."""
    typed = Fraction(str(step))
    for number in range(1, 200):
        end = float(typed * number)
        values = np.array([step * number, -step * number, end * (1 + 1e-9)])
        assert within(values, (-end, end)).tolist() == [True, True, False]
    assert within(np.array([0.0, -1e-300]), (0.0, np.inf)).tolist() == [True, False]
    assert not within(np.array([np.nan]), (-np.inf, np.inf))[0]

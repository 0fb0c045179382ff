"""The cheapest choice: against Lagrange, and against every combination."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from tolstat.answers.allocate import optimizer as module
from tolstat.answers.allocate.optimizer import DesignVariable, cheapest

COSTS = (7.0, 3.0, 20.0, 1.0)
BOUND = 0.05


def continuous(cost):
    """A width, as its logarithm; its price is reciprocal."""
    return DesignVariable(lambda x: cost / math.exp(x), math.log(1e-3), math.log(0.2))


def listed(cost, options=7):
    return DesignVariable(lambda x: cost / width(x), options - 1.0, 0.0, options)


def width(x):
    return 0.06 * 0.75**x


def excess(widths):
    return np.array([math.log(math.hypot(*widths) / BOUND)])


def test_continuous_choices_match_lagrange():
    found = cheapest([continuous(cost) for cost in COSTS], lambda x: excess(np.exp(x)))
    T = np.cbrt(COSTS)
    T *= BOUND / math.hypot(*T)
    assert np.exp(found.choice) == pytest.approx(T, rel=0.01)
    assert found.cost == pytest.approx(np.sum(COSTS / T), rel=1e-4)


def by_hand(options):
    return min(
        sum(c / width(x) for c, x in zip(COSTS, choice, strict=True))
        for choice in itertools.product(range(options), repeat=4)
        if math.hypot(*map(width, choice)) <= BOUND
    )


def test_lists_are_enumerated_or_searched_by_exchange(monkeypatch):
    variables = [listed(cost) for cost in COSTS]
    found = cheapest(variables, lambda x: excess([*map(width, x)]))
    assert found.exhaustive and found.cost == pytest.approx(by_hand(7))
    monkeypatch.setattr(module, "MOST_TRIED", 100)
    near = cheapest(variables, lambda x: excess([*map(width, x)]))
    assert not near.exhaustive and found.cost <= near.cost < 1.05 * found.cost


@pytest.mark.parametrize("most", [64, 3])
def test_lists_and_continuous_choices_together(most, monkeypatch):
    monkeypatch.setattr(module, "MOST_SOLVED", most)
    variables = [continuous(COSTS[0]), *(listed(cost, 4) for cost in COSTS[1:3])]

    def beyond(x):
        return excess([math.exp(x[0]), *map(width, x[1:])])

    found = cheapest(variables, beyond)
    best = math.inf
    for choice in itertools.product(range(4), repeat=2):
        room = BOUND**2 - sum(width(x) ** 2 for x in choice)
        if room > 0:
            rest = sum(c / width(x) for c, x in zip(COSTS[1:], choice, strict=False))
            best = min(best, COSTS[0] / min(math.sqrt(room), 0.2) + rest)
    assert beyond(found.choice)[0] <= 1e-4
    assert (
        best * (1 - 1e-4) <= found.cost <= best * (1.001 if found.exhaustive else 1.02)
    )


def test_no_feasible_choice_returns_none():
    def never(x):
        return np.array([0.1])

    assert cheapest([continuous(1.0), listed(1.0)], never) is None
    assert cheapest([listed(1.0)] * 6, never) is None


def unknown_at_the_ends(x):
    """As a pool is: where few machines tell, no interval is narrow enough."""
    share = (x[0] - math.log(1e-3)) / (math.log(0.2) - math.log(1e-3))
    return np.array([excess(np.exp(x[:1]))[0], 0.2 - share, 2.5 - sum(x[1:])])


@pytest.mark.parametrize("most", [64, 1])
def test_the_tightest_is_not_always_safe(most, monkeypatch):
    monkeypatch.setattr(module, "MOST_SOLVED", most)
    variables = [continuous(1.0), DesignVariable(lambda x: 1.0 + x, 3.0, 0.0, 4)]
    found = cheapest(variables, unknown_at_the_ends)
    assert found.choice == pytest.approx((math.log(BOUND), 3.0), rel=1e-3)


def test_an_infeasible_choice_moves_towards_a_feasible_one():
    """Solved for a slope that leads astray, between two ends that do not keep."""
    variable = continuous(1.0)
    middle = 0.5 * (variable.tightest + variable.loosest)

    def about_the_middle(x):
        return np.array([abs(x[0] - middle) - 0.3, 2.0 * (x[0] - middle) - 0.4])

    found = cheapest([variable], about_the_middle, (variable.tightest,))
    assert found.choice[0] == pytest.approx(middle + 0.2, abs=0.01)
    search = module._Search([variable], about_the_middle, ())
    within, beyond = np.array([0.5]), np.array([1.0])
    span = variable.loosest - variable.tightest
    (near,) = search._towards(
        beyond, within, lambda x: (variable.tightest + span * x[0],)
    )
    assert near == pytest.approx(middle + 0.2, abs=0.002) and near <= middle + 0.2001


@pytest.mark.parametrize(("kept", "begin"), [(0.5, 0.9), (0.0, 0.9), (0.25, 0.25)])
def test_start_middle_or_tightest_is_used_without_slopes(kept, begin):
    """Only one of them does; from there as far as it goes towards what was solved."""
    variable = DesignVariable(lambda x: 9.0 - x, 0.0, 1.0)

    def about(x):
        return np.array([-1.0 if abs(x[0] - kept) < 0.125 else 1.0])

    found = cheapest([variable], about, (begin,))
    assert found.choice[0] == pytest.approx(kept + 0.125, abs=1e-3)
    assert about(found.choice)[0] < 0


def test_the_search_of_lists_begins_at_a_feasible_choice(monkeypatch):
    monkeypatch.setattr(module, "MOST_TRIED", 10)
    variables = [DesignVariable(lambda x: 1.0 + x, 4.0, 0.0, 5)] * 4

    def between(x):
        return np.array([abs(sum(x) - 7.0) - 1.5])

    assert cheapest(variables, between).cost == pytest.approx(4 + 6)

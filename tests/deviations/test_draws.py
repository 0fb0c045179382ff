"""A draw depends on seed, index and name alone."""

from __future__ import annotations

import numpy as np

from tolstat.deviations.distributions.normal import Normal
from tolstat.deviations.distributions.uniform import Uniform
from tolstat.deviations.draw import Spread, draw
from tolstat.deviations.samplers.random import Random
from tolstat.deviations.tolerance import Tolerance

NAMES = ["rod_length_1", "rod_length_2", "crank_angle_1", "friction"]
ROD = Spread(Normal(), Tolerance(-1.2e-3, 1.2e-3))
ANGLE = Spread(Uniform(), Tolerance(0.0, 1e-3))


def draws(spreads, names=NAMES, seed=75, trials=500):
    return draw(names, spreads, sampling="random", seed=seed, trials=trials)


def test_one_column_never_moves_another():
    base = draws({"rod_length_1": ROD, "crank_angle_1": ANGLE})
    wider = Spread(Normal(cp=0.5), Tolerance(-5e-3, 9e-3))
    changed = draws({"rod_length_1": wider, "crank_angle_1": ANGLE})
    more = draws(
        {
            "friction": ROD,
            "rod_length_2": ROD,
            "rod_length_1": ROD,
            "crank_angle_1": ANGLE,
        }
    )
    turned = draws({"rod_length_1": ROD, "crank_angle_1": ANGLE}, NAMES[::-1])[:, ::-1]
    np.testing.assert_array_equal(base[:, 2], changed[:, 2])
    np.testing.assert_array_equal(base[:, [0, 2]], more[:, [0, 2]])
    np.testing.assert_array_equal(base, turned)
    assert not np.any(base[:, 0] == changed[:, 0])


def test_more_trials_leave_the_first_as_they_were():
    few, many = draws({"rod_length_1": ROD}), draws({"rod_length_1": ROD}, trials=1777)
    np.testing.assert_array_equal(few, many[:500])


def test_seeds_and_names_give_independent_draws():
    names = [f"part_{i}" for i in range(40)]
    one, other = (Random().unit_samples(seed, names, 4000) for seed in (1, 2))
    together = np.corrcoef(np.hstack([one, other]).T)
    off = np.abs(together - np.eye(80)).max()
    assert off < 5.5 / np.sqrt(4000)  # the greatest of 3160 normal numbers


def test_unit_samples_exclude_both_ends():
    u = Random().unit_samples(3, ["a"], 200_000)
    assert u.min() > 0 and u.max() < 1
    assert (2**-53 + 0.0) > 0 and ((2**52 - 1) + 0.5) * 2.0**-52 < 1


def test_the_same_draws_for_all_time():
    """Stored runs must stay repeatable: these numbers may never change."""
    u = Random().unit_samples(75, ["rod_length_1"], 3)[:, 0]
    assert u.tolist() == FIRST


FIRST = [0.8902395116438918, 0.8572559516785431, 0.540016298452043]


def test_numpys_global_state_is_untouched():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    draws({"rod_length_1": ROD})
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002

"""Changes that meet all limits: closed forms of a stack, and planted problems."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from tests.statistics.remedy_problems import PROBLEMS, Problem, sampled
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.intervals.weights import Thinned, Weights
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.remedies.change import Change, Design, drawing_step
from tolstat.statistics.remedies.movable_trials import NoRemedy, movable_trials
from tolstat.statistics.remedies.prediction import predicted, proved, steps
from tolstat.statistics.remedies.remedy import (
    AIM_PREDICTED,
    AIM_PROVED,
    smallest_change,
)
from tolstat.statistics.remedies.surface import fitted_surface
from tolstat.statistics.remedies.unavoidable import unavoidable, wider_limits
from tolstat.statistics.sample import Sample
from tolstat.status import Status

N = 4096
HALVES = np.array([0.3, 0.2, 0.1])


def stack(limit, free=(True, True, True), centre=0.0, trials=N, step=None, seed=1):
    """A sum of three normal deviations of +-3 sigma, movable."""
    z = np.random.default_rng(seed).standard_normal((trials, 3)) / 3
    x = z * HALVES
    grid = np.array([drawing_step(half) for half in HALVES])
    design = Design(
        np.zeros(3), np.arange(3), HALVES,
        grid if step is None else np.full(3, step), np.array(free),
        np.ones(3, bool),
    )  # fmt: skip
    y = x.sum(axis=1, keepdims=True) + centre
    return movable_trials(x, y, whole(trials), [Limit(*limit)], design)


def thinned_stack(seed, end=0.347, centre=0.015, drawn=50_000, first=2048, least=0.02):
    """The stack off centre, most trials far from its end of 2.78 sigma left out."""
    rng = np.random.default_rng(seed)
    x = HALVES * rng.standard_normal((drawn, 3)) / 3
    y = x.sum(axis=1) + centre
    plain = np.arange(drawn) < first
    chance = np.where(plain | (y > end - 0.05), 1.0, least)
    rows = np.flatnonzero(rng.random(drawn) < chance)
    stage = (chance[rows], np.where(plain, first, drawn)[rows].astype(float),
             np.where(plain, 1.0, least)[rows])  # fmt: skip
    sample = Sample(np.full(len(rows), Status.DONE), thinned=Thinned(*stage))
    design = stack((0, 1)).design
    return movable_trials(
        x[rows], y[rows, None], sample, [Limit(-math.inf, end)], design
    )


def whole(trials):
    return Sample(np.full(trials, Status.DONE))


def quadratic(z, rng, responses=2):
    contributors = z.shape[1]
    slopes = rng.normal(size=(contributors, responses))
    bends = rng.normal(size=(responses, contributors, contributors))
    bends += bends.transpose(0, 2, 1)
    return slopes, bends, quadratic_of(z, slopes, bends)


def quadratic_of(z, slopes, bends):
    return z @ slopes + np.einsum("ti,jik,tk->tj", z, bends, z) / 2


def test_a_surface_knows_a_quadratic_function_and_moves_its_trials():
    rng = np.random.default_rng(0)
    z = rng.uniform(-1, 1, (10_000, 4))
    z += [0, 0.5, -2, 3]  # off centre
    slopes, bends, y = quadratic(z, rng)
    kept = rng.normal(size=y.shape) * 1e-3
    surface = fitted_surface(z, y)
    np.testing.assert_allclose(surface.slopes, slopes, atol=1e-9)
    twice = np.einsum("jii->ij", bends)
    np.testing.assert_allclose(surface.bends, twice, atol=1e-9)
    products = bends - np.einsum("ij,ik->jik", twice, np.eye(4))
    np.testing.assert_allclose(surface.products, products, atol=1e-9)
    at = surface.slopes_at(z[0])
    np.testing.assert_allclose(at, slopes + (bends @ z[0]).T, atol=1e-8)
    assert surface.remainders.max() < 1e-6
    shift, ratio = np.array([0.3, 0, -1, 0]), np.array([1, 0.5, 0.2, 1])
    moved = quadratic_of(shift + ratio * z, slopes, bends)
    gains = surface.change(z, shift, ratio)
    np.testing.assert_allclose(y + kept + gains, moved + kept, atol=1e-8)


def test_a_surface_has_products_only_where_they_pay():
    z = np.random.default_rng(0).standard_normal((500, 20))
    noise = np.random.default_rng(1).standard_normal((500, 1))
    linear = fitted_surface(z, z.sum(axis=1, keepdims=True))
    assert linear.is_straight
    few = fitted_surface(z, z[:, :1] * z[:, 1:2] + noise)  # 231 terms for 500 trials
    assert not few.products.any()
    assert few.remainders[0] == pytest.approx(math.sqrt(2), rel=0.1)


def test_a_surface_of_few_trials_passes_through_them():
    """One of more terms than trials is the least one, by singular values."""
    z = np.random.default_rng(0).standard_normal((30, 40))
    y = z @ np.random.default_rng(1).normal(size=(40, 2))
    surface = fitted_surface(z, y)
    u = (z - z.mean(axis=0)) / z.std(axis=0)
    terms = np.hstack([np.ones((30, 1)), u, u * u - 1])
    least = np.linalg.pinv(terms) @ ((y - y.mean(axis=0)) / y.std(axis=0))
    squares = least[41:].T * y.std(axis=0)[:, None] * 2 / z.std(axis=0) ** 2
    assert surface.remainders.max() < 1e-6
    np.testing.assert_allclose(surface.bends, squares.T, atol=1e-9)


def test_a_surface_of_many_contributors_has_the_products_of_the_main_ones():
    z = np.random.default_rng(0).standard_normal((6000, 40))
    y = z[:, :2].sum(axis=1) + 0.5 * z[:, 0] * z[:, 1]  # 861 terms with all products
    surface = fitted_surface(z, y[:, None])
    assert surface.products[0, *np.searchsorted(surface.main, [0, 1])] == pytest.approx(
        0.5
    )
    assert surface.remainders[0] < 1e-6


def test_a_constant_contributor_and_one_of_two_values_do_no_harm():
    rng = np.random.default_rng(0)
    z = np.column_stack([rng.normal(size=900), np.zeros(900), rng.choice([-1, 1], 900)])
    y = z @ [[1.0], [5.0], [2.0]]
    surface = fitted_surface(z, y)
    assert surface.slopes[:, 0] == pytest.approx([1, 0, 2], abs=1e-9)


def test_a_stack_off_centre_is_shifted_to_the_middle():
    trials = stack((-0.5, 0.5), centre=0.2)
    moved = smallest_change(trials, AIM_PROVED)
    (entry,) = moved.change.shifted
    assert entry == 0  # the least shift over its tolerance
    # the middle is a margin of 0.5 / 0.374; centring ends at 1.25
    needed = 0.5 - 1.25 * math.sqrt((HALVES**2).sum())
    assert 0.2 + 0.3 * moved.change.shift[0] == pytest.approx(needed, abs=0.02)
    assert not moved.change.tightened.size and moved.score > 1.2
    share = predicted(trials, moved.change).joint
    assert share.lower <= 2 * ndtr(-0.47 / 0.1247) <= share.upper


def test_thinned_trials_move_with_their_weights():
    """The closed form of the stack lies in the interval; each seed has 5 % to miss."""
    sigma, shift = math.sqrt((HALVES**2).sum()) / 3, -0.02
    inside, shifts = 0, []
    for seed in range(20):
        trials = thinned_stack(seed)
        none = trials.moved(trials.design.none)
        (reach,), (middle,) = none.reach[:, 1], none.middle
        assert reach == pytest.approx(-ndtri(0.0027) * sigma, rel=0.06)
        assert middle == pytest.approx(0.015, abs=0.02)
        assert none.variance == pytest.approx(sigma**2, rel=0.15)
        change = trials.design.none.with_entry(0, shift=shift / HALVES[0])
        shares = predicted(trials, change)
        after = ndtr((0.015 + shift - 0.347) / sigma)
        inside += shares.joint.lower <= after <= shares.joint.upper
        before = predicted(trials, trials.design.none)
        assert shares.improve(before, trials.permitted_out)
        if seed < 4:
            best = smallest_change(trials, AIM_PREDICTED).change
            assert best.shifted.tolist() == [0]
            shifts.append(best.shift[0] * HALVES[0])
    assert inside >= 18
    # to a margin of `CENTRED`, as plain trials
    expected = 0.347 - 0.015 + 1.25 * ndtri(0.0027) * sigma
    np.testing.assert_allclose(shifts, expected, atol=0.02)


def test_a_thinned_share_after_a_change_knows_the_largest_weight():
    """None is out after it: trials of the least chance may be, of unseen kinds."""
    trials = thinned_stack(1)
    far = trials.design.none.with_entry(0, shift=-1.0)
    share = predicted(trials, far).joint
    assert share.value == 0 and share.upper > 3.69 / (2048 + 0.02 * 48_000)


def test_parts_that_cancel_do_not_move_together_far_away():
    """Two parts at several temperatures: both 30 times smaller would gain a little."""
    x = np.random.default_rng(1).standard_normal((N, 2)) / 30
    design = Design(
        np.zeros(2), np.arange(2), np.full(2, 0.1), np.full(2, 1e-3),
        np.ones(2, bool), np.ones(2, bool),
    )  # fmt: skip
    grow = np.array([-0.002, 0.0, 0.002])
    y = (120.3 + x[:, :1]) * (1 + grow) - (120 + x[:, 1:]) * (1 + grow / 2)
    limits = [Limit(0.1, 0.5)] * 3
    trials = movable_trials(x, y, whole(N), limits, design)
    change = smallest_change(trials, AIM_PROVED).change
    assert np.abs(change.shift).max() <= 3


def test_margins_of_a_normal_stack_are_the_needed_sigmas():
    trials = stack((-0.4, math.inf), trials=100_000)
    (low, high), *_ = trials.moved(trials.design.none).margins
    sigma = math.sqrt((HALVES**2).sum()) / 3
    assert low == pytest.approx(0.4 / sigma / -ndtri(0.0027), rel=0.02)
    assert high == math.inf


def test_tightening_reaches_the_needed_sigma_with_little_to_spare():
    trials = stack((-0.3, 0.3))
    moved = smallest_change(trials, AIM_PREDICTED)
    spread = math.sqrt(((moved.change.ratio * HALVES) ** 2).sum())
    assert 0.3 / 1.3 < spread < 0.3 / 1.1
    assert not moved.change.size
    found = steps(trials, moved.change, lambda change: predicted(trials, change))
    last = [step.after.joint.value for step in found]
    assert last == sorted(last, reverse=True)
    assert last[-1] == predicted(trials, moved.change).joint.value


def test_a_last_change_that_hardly_helps_is_no_step():
    trials = stack((-0.2, 0.2), trials=1000)
    change = trials.design.none.with_entry(0, ratio=0.5)
    both = change.with_entry(2, ratio=0.97)
    (step,) = steps(trials, both, lambda change: predicted(trials, change))
    np.testing.assert_array_equal(step.change, change)
    (step,) = steps(trials, change, lambda change: predicted(trials, change))
    np.testing.assert_array_equal(step.change, change)


def test_shifts_and_tolerances_are_rounded_as_on_a_drawing():
    assert [drawing_step(half) for half in (0.12, 0.1, 0.0999)] == [1e-3, 1e-3, 1e-4]
    for step in (None, 0.05):
        trials = stack((-0.28, 0.28), centre=0.2, step=step)
        change = smallest_change(trials, AIM_PROVED).change
        steps_of = trials.design.steps
        for size in (change.shift * HALVES, change.ratio * HALVES):
            np.testing.assert_allclose(size / steps_of, np.round(size / steps_of))
        assert change.shifted.size and change.tightened.size


def test_a_coarse_step_takes_the_better_neighbour():
    trials = stack((-0.5, 0.5), centre=0.155, step=0.1, trials=100_000)
    change = smallest_change(trials, 1.2).change
    assert HALVES @ change.shift == pytest.approx(-0.2)  # -0.12 is enough


def test_a_limit_that_is_met_needs_no_change():
    change = smallest_change(stack((-0.6, 0.6)), AIM_PREDICTED).change
    assert not change.size and not change.tightened.size
    assert proved(stack((-0.6, 0.6)), None) is None


def test_parts_of_an_entry_change_together():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((N, 3)) / 3 * [1, 1, 0.1]
    design = Design(
        np.zeros(3), np.array([0, 0, 1]), np.array([1.0, 0.1]),
        np.array([1e-2, 1e-3]), np.array([True, True]),
        np.ones(2, bool),
    )  # fmt: skip
    y = x.sum(axis=1, keepdims=True) + 4
    trials = movable_trials(x, y, whole(N), [Limit(-2, 2)], design)
    change = smallest_change(trials, AIM_PROVED).change
    assert change.shifted.tolist() == [0]
    assert -2.2 < change.shift[0] < -1.7  # two parts, 1.9 each at least


def test_fixed_entries_never_change_and_what_stays_is_theirs():
    trials = stack((-0.2, 0.2), free=(False, True, True))
    assert smallest_change(trials, AIM_PROVED).change.ratio[0] == 1
    rest = unavoidable(trials, AIM_PROVED)
    expected = 2 * ndtr(-0.2 / 0.1)
    assert rest.shares.joint.value == pytest.approx(expected, rel=0.1)
    assert rest.contributions == pytest.approx([1, 0, 0], abs=1e-3)
    (helped,) = rest.freed
    assert helped.entry == 0 and helped.change.ratio[0] * HALVES[0] < 0.2
    assert unavoidable(stack((-0.2, 0.2)), AIM_PROVED) is None


def test_wider_limits_are_those_of_the_design_as_it_is():
    trials = stack((-0.2, 0.2), free=(False, True, True), trials=20_000)
    fresh = stack((-0.2, 0.2), free=(False, True, True), trials=20_000, seed=2)
    ((lower, upper),) = wider_limits(trials, fresh, np.array([1.0]))
    reach = -ndtri(0.00135) * np.sqrt(HALVES @ HALVES) / 3  # all three spread
    assert -1.15 * reach < lower < -reach and reach < upper < 1.15 * reach
    wide = stack((-0.2, 0.2), centre=0.01, trials=20_000, seed=2)  # half as wide again
    other = replace(wide, responses=1.5 * wide.responses)
    assert wider_limits(trials, other, np.array([1.0])) is None


def test_a_point_mass_at_the_middle_is_judged_by_counts():
    x = np.random.default_rng(1).standard_normal((N, 1))
    y = np.where(x > 3.2, 1.0, 0.0)
    design = Design(
        np.zeros(1),
        np.array([0]),
        np.ones(1),
        np.full(1, 0.01),
        np.ones(1, bool),
        np.ones(1, bool),
    )
    trials = movable_trials(x, y, whole(N), [Limit(-math.inf, 0.5)], design)
    margin = trials.moved(trials.design.none).margins[0, 1]
    share = (y.sum() + 0.5) / (N + 1)
    assert margin == pytest.approx(ndtri(share) / ndtri(0.0027))


def test_trials_that_fail_stay_out_of_limit():
    trials = stack((-0.6, 0.6))
    status = np.full(N + 5, Status.DONE)
    status[-5:] = Status.STEP_TOO_SMALL
    x = np.vstack([trials.z * HALVES, np.zeros((5, 3))])
    y = np.vstack([trials.responses, np.full((5, 1), np.nan)])
    arguments = x, y, Sample(status)
    with_failed = movable_trials(*arguments, [Limit(-0.6, 0.6)], trials.design)
    assert predicted(with_failed, trials.design.none).joint == proportion(5, N + 5)
    assert (
        with_failed.moved(with_failed.design.none).score
        < trials.moved(trials.design.none).score
    )
    strict = [Limit(-0.6, 0.6, 0.9999)]
    assert movable_trials(*arguments, strict, trials.design) is NoRemedy.FAILED


@pytest.mark.parametrize(
    ("reason", "changes"),
    [
        (NoRemedy.LIMITS, {"limits": []}),
        (NoRemedy.TRIALS, {"trials": 150}),
        (NoRemedy.WEIGHTED, {"weights": True}),
        (NoRemedy.FREE, {"free": False}),
    ],
)
def test_what_has_no_remedy_says_why(reason, changes):
    n = changes.pop("trials", N)
    trials = stack((-0.2, 0.2), trials=max(n, 200))
    sample = whole(n)
    if changes.pop("weights", False):
        weights = object.__new__(Weights)
        sample = sample._replace(weights=weights)
    free = np.full(3, changes.pop("free", True))
    arguments = {"limits": [Limit(-0.2, 0.2)], **changes}
    answer = movable_trials(
        trials.z[:n] * HALVES, trials.responses[:n], sample,
        design=trials.design._replace(free=free), **arguments,
    )  # fmt: skip
    assert answer is reason


def test_an_interval_is_wider_where_the_surface_bends_or_explains_little():
    rng = np.random.default_rng(3)
    x = rng.standard_normal((N, 2)) / 3
    design = Design(
        np.zeros(2),
        np.arange(2),
        np.ones(2),
        np.full(2, 0.01),
        np.ones(2, bool),
        np.ones(2, bool),
    )
    change = Change(np.array([0.3, 0.0]), np.array([0.8, 1.0]))

    def width(y):
        trials = movable_trials(x, y[:, None], whole(N), [Limit(-2.0, 1.2)], design)
        joint = predicted(trials, change).joint
        exact = proportion(round(joint.value * N), N)
        return (joint.upper - joint.lower) / (exact.upper - exact.lower)

    assert width(x.sum(axis=1)) == pytest.approx(1)
    assert width(x.sum(axis=1) + x[:, 0] ** 2) > 1.2
    assert width(x.sum(axis=1) + 0.2 * np.sin(40 * x[:, 0])) > 1.2


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.name)
def test_a_proved_remedy_meets_all_limits_in_truth(problem, record_property):
    started = time.process_time()
    trials = sampled(problem, N, seed=0)

    def sample(change, seed):
        return problem.sample(20_000, np.random.default_rng([2, seed]), change)

    proof = proved(trials, sample)
    record_property("seconds", time.process_time() - started)
    if not problem.solvable:
        assert not (proof and proof.met)
        assert unavoidable(trials, AIM_PROVED).shares.joint.lower > 0.0027
        return
    assert proof.met and proof.improves
    _, y = problem.sample(400_000, np.random.default_rng(99), proof.change)
    lower, upper = problem.limits.T
    assert np.all(((y < lower) | (y > upper)).mean(axis=0) <= 0.0027)
    shift, ratio = trials.design.none
    for step in proof.steps:  # what is said of earlier ones is of fresh trials, too
        shift, ratio = shift + step.change.shift, ratio * step.change.ratio
        _, y = sample(Change(shift, ratio), proof.seed)
        out = np.any((y < lower) | (y > upper), axis=1)
        assert step.after.joint == proportion(int(out.sum()), len(y))
    np.testing.assert_array_equal((shift, ratio), proof.change)


def proved_with_fresh_trials(problem, seed=1):
    def sample(change, seed):
        return problem.sample(20_000, np.random.default_rng([1, seed]), change)

    return proved(sampled(problem, N, seed), sample)


def test_one_shift_stands_instead_of_two_that_do_the_same():
    """The second search, about |a - b| = 0, sees no side of it; the first one does."""
    problem = Problem(
        "distance", np.array([0.1, 0.08]), lambda a, b: [np.abs(a - b + 0.05)],
        np.array([(-math.inf, 0.1)]),
    )  # fmt: skip
    proof = proved_with_fresh_trials(problem)
    assert proof.met and len(proof.change.shifted) == 1


def two_sides(n, limit, power=1):
    """|sum of half the parts less that of the others|, or its square."""
    return Problem(
        "sides", np.full(n, 0.1),
        lambda *x: [np.abs(sum(x[::2]) - sum(x[1::2])) ** power],
        np.array([(-math.inf, limit)]),
    )  # fmt: skip


def test_all_parts_are_tightened_where_a_surface_is_blind():
    """Of 44 parts products are too many to fit, and squares show nothing."""
    proof = proved_with_fresh_trials(two_sides(44, 0.2, power=2))
    assert proof.met and len(proof.steps) == 1
    (ratio,) = {*proof.change.ratio.tolist()}
    sigma = 0.1 / 3 * math.sqrt(44)
    assert -ratio * sigma * ndtri(0.0027 / 2) < math.sqrt(0.2)
    assert not proof.change.size


def test_shifts_that_cancel_are_left_out(monkeypatch):
    monkeypatch.setattr("tolstat.statistics.remedies.prediction.ALL_TIGHTER", ())
    proof = proved_with_fresh_trials(two_sides(6, 0.12), seed=3)
    assert proof.improves and not proof.met and not proof.change.size


def test_one_part_moves_far_rather_than_ten_a_little():
    """Ten plates share an offset of seven times their tolerance."""
    halves = np.array([0.05, *[0.002] * 10])
    problem = Problem(
        "plates", halves, lambda h, *plates: [h - sum(plates) + 0.03],
        np.array([(-0.055, 0.055)]), fixed=(0,),
    )  # fmt: skip
    change = smallest_change(sampled(problem, N, seed=1), AIM_PROVED).change
    assert len(change.shifted) == 1 and not change.tightened.size


def test_a_limit_is_not_widened_where_the_median_lies_far_out_of_it():
    trials = stack((0.0, 0.9), free=(False, False, True), centre=5.0)
    still = trials.design._replace(movable=np.zeros(3, bool))
    rest = unavoidable(replace(trials, design=still), AIM_PROVED)
    assert rest.beyond == pytest.approx([4.1], abs=0.01)
    assert wider_limits(trials, trials, np.array([1.0])) is None
    assert unavoidable(trials, AIM_PROVED) is None  # 46 half tolerances lead there


def test_a_length_stays_above_zero():
    trials = stack((-0.3, 0.1), free=(True, False, False), centre=1.0)
    longer = trials.design._replace(lowest=np.array([-2.0, -np.inf, -np.inf]))
    moved = smallest_change(replace(trials, design=longer), AIM_PROVED)
    assert -2 <= moved.change.shift[0] < -1.9 and moved.score < 0

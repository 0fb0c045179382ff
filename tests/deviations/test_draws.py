"""A sample depends only on seed, index and name; samplers keep their promises."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from tests.deviations.drawing import draw
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.distributions import Constant, Normal, Tolerance, Uniform
from tolstat.deviations.draw import SAMPLERS, factors
from tolstat.deviations.samplers import Latin, Random, Sobol

NAMES = ["rod_length_1", "rod_length_2", "crank_angle_1", "friction"]
ROD = Normal(Tolerance(-1.2e-3, 1.2e-3))
ANGLE = Uniform(Tolerance(0.0, 1e-3))
SAMPLINGS = ["random", "latin", "sobol"]


def draws(distributions, names=NAMES, seed=75, trials=500, sampling="random", **more):
    return draw(
        names, distributions, sampling=sampling, seed=seed, trials=trials, **more
    )


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_columns_are_independent_of_each_other(sampling):
    both = {"rod_length_1": ROD, "crank_angle_1": ANGLE}
    base = draws(both, sampling=sampling)
    wider = Normal(Tolerance(-5e-3, 9e-3), cp=0.5)
    changed = draws({**both, "rod_length_1": wider}, sampling=sampling)
    kind = draws({**both, "rod_length_1": ANGLE}, sampling=sampling)
    more = draws(
        {"friction": ROD, "rod_length_2": ROD, **both},
        sampling=sampling,
        dependence=Dependence({}, {("friction", "rod_length_2"): 0.5}),
    )
    np.testing.assert_array_equal(base[:, 2], changed[:, 2])
    np.testing.assert_array_equal(base[:, 2], kind[:, 2])
    np.testing.assert_array_equal(base[:, [0, 2]], more[:, [0, 2]])
    assert not np.any(base[:, 0] == changed[:, 0])
    # a batch has a stream of its own
    batch = Dependence({f"rod_length_{i}": Batch("rod_length", 0.5) for i in (1, 2)})
    joined = draws({**both, "rod_length_2": ROD}, sampling=sampling, dependence=batch)
    np.testing.assert_array_equal(base[:, 2], joined[:, 2])


def test_random_samples_do_not_depend_on_the_order_of_contributors():
    both = {"rod_length_1": ROD, "crank_angle_1": ANGLE}
    turned = draws(both, NAMES[::-1])[:, ::-1]
    np.testing.assert_array_equal(draws(both), turned)


@pytest.mark.parametrize("sampling", ["random", "sobol"])
def test_more_trials_keep_the_first_trials(sampling):
    dependence = Dependence({}, {("rod_length_1", "rod_length_2"): 0.7})
    rods = {"rod_length_1": ROD, "rod_length_2": ROD}
    few, many = (
        draws(rods, trials=n, sampling=sampling, dependence=dependence)
        for n in (500, 1777)
    )
    np.testing.assert_array_equal(few, many[:500])


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_seeds_and_names_give_independent_samples(sampling):
    streams = {f"part_{i}": i for i in range(40)}
    sampler = SAMPLERS[sampling]
    one, other = (sampler.unit_samples(seed, streams, 4096) for seed in (1, 2))
    # two scrambles of one Sobol' dimension share its order, as they should
    table = one if sampling == "sobol" else np.hstack([one, other])
    off = np.abs(np.corrcoef(table.T) - np.eye(table.shape[1])).max()
    assert off < 5.5 / np.sqrt(4096)  # the greatest of 3160 normal numbers
    assert not np.any(one == other)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("trials", [1, 2, 3, 1000, 65_536])
def test_unit_samples_exclude_both_ends(sampling, trials):
    u = SAMPLERS[sampling].unit_samples(3, {"a": 0, "b": 5}, trials)
    assert u.shape == (trials, 2) and u.min() > 0 and u.max() < 1


def test_random_samples_are_uniform():
    u = Random().unit_samples(3, {"a": 0}, 200_000)[:, 0]
    assert stats.kstest(u, "uniform").pvalue > 1e-3


def test_a_latin_hypercube_fills_every_strip_once():
    u = Latin().unit_samples(3, {"a": 0, "b": 1}, 4000)
    for replicate in range(16):
        for column in u[replicate::16].T:
            strips = np.floor(column * 250).astype(int)
            np.testing.assert_array_equal(np.sort(strips), np.arange(250))
    within = (u * 250) % 1
    assert stats.kstest(within.ravel(), "uniform").pvalue > 1e-3


def test_sobol_points_are_a_digital_net():
    """Each replicate has one point in every elementary box of two dimensions."""
    u = Sobol().unit_samples(11, {"a": 0, "b": 1}, 16 * 256)
    for replicate in (0, 7, 15):
        for split in range(9):
            scaled = u[replicate::16] * [2**split, 2 ** (8 - split)]
            assert len(np.unique(np.floor(scaled).astype(int), axis=0)) == 256
    # as SciPy's own scramble in 31 dimensions, and far below random points
    streams = {f"part_{i}": i for i in range(31)}
    own = qmc.discrepancy(Sobol().unit_samples(11, streams, 16 * 1024)[3::16, :8])
    peer = qmc.discrepancy(qmc.Sobol(8, rng=np.random.default_rng(1)).random(1024))
    plain = qmc.discrepancy(Random().unit_samples(11, streams, 1024)[:, :8])
    assert own < 1.3 * peer and own < 0.3 * plain


def test_scrambled_points_are_unbiased():
    """The average over scrambles is the integral: each point is uniform by itself."""
    scrambles = [  # [point, replicate, contributor]
        Sobol().unit_samples(seed, {"a": 0, "b": 3}, 64).reshape(4, 16, 2)
        for seed in range(125)
    ]
    for point in np.concatenate(scrambles, axis=1):
        for column in point.T:
            assert len(column) == 2000
            assert stats.kstest(column, "uniform").pvalue > 1e-3


def test_sobol_integrates_better_than_random():
    """The sum of 8 normal scores squared: mean 8."""

    def error(sampler):
        streams = {f"part_{i}": i for i in range(8)}
        found = [
            np.sum(
                stats.norm.ppf(sampler.unit_samples(seed, streams, 1024)) ** 2, axis=1
            ).mean()
            for seed in range(30)
        ]
        return np.sqrt(np.mean((np.array(found) - 8) ** 2))

    assert error(Sobol()) < 0.3 * error(Random())
    assert error(Latin()) < 0.3 * error(Random())


def test_samples_never_change():
    """Stored runs must stay repeatable: these numbers may never change."""
    for sampling, known in FIRST.items():
        streams = {"rod_length_1": 0, "friction": 28}
        u = SAMPLERS[sampling].unit_samples(75, streams, 3)
        assert u.ravel().tolist() == known, sampling


FIRST = {
    "random": [
        0.8902395116438918, 0.43615326339337235, 0.8572559516785431,
        0.6361902187205798, 0.540016298452043, 0.7604684923860162,
    ],
    "latin": [
        0.3676514930918221, 0.419789679428071, 0.9085729899693354,
        0.22941321383971036, 0.1440210787046864, 0.3702169014356095,
    ],
    "sobol": [
        0.8912403413832165, 0.42574611710669885, 0.8201450004780274,
        0.05022590836514873, 0.4272658370105812, 0.2739435525719204,
    ],
}  # fmt: skip


def test_the_global_state_of_numpy_is_unchanged():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    for sampling in SAMPLINGS:
        draws({"rod_length_1": ROD}, sampling=sampling)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_saltelli_changes_one_factor_at_a_time():
    parts = {"rod_length_1": ROD, "rod_length_2": ROD, "crank_angle_1": ANGLE}
    groups = draws(parts, sampling="saltelli", trials=100 * 5).reshape(100, 5, 4)
    A, B = groups[:, 0], groups[:, 1]
    assert np.all((A != B)[:, :3]) and np.all(groups[:, :, 3] == 0)
    for member, changed in enumerate((0, 1, 2), start=2):
        known = A.copy()
        known[:, changed] = B[:, changed]
        np.testing.assert_array_equal(groups[:, member], known)


def test_saltelli_takes_parts_of_a_batch_as_one_factor():
    alike = Dependence({f"rod_length_{i}": Batch("rod_length", 1.0) for i in (1, 2)})
    parts = {"rod_length_1": ROD, "rod_length_2": ROD, "crank_angle_1": ANGLE}
    assert factors(parts, alike) == {"rod_length", "crank_angle_1"}
    groups = draws(parts, sampling="saltelli", trials=200, dependence=alike)
    groups = groups.reshape(50, 4, 4)
    np.testing.assert_array_equal(groups[:, :, 0], groups[:, :, 1])
    # in the order of the model's names, batches last
    np.testing.assert_array_equal(groups[:, 2, 2], groups[:, 1, 2])
    np.testing.assert_array_equal(groups[:, 3, 0], groups[:, 1, 0])


def test_constants_are_no_factors():
    parts = {"rod_length_1": ROD, "friction": Constant(0.1)}
    assert factors(parts, Dependence()) == {"rod_length_1"}
    found = draws(parts, sampling="saltelli", trials=30)
    assert np.all(found[:, 3] == 0.1)


def test_saltelli_continues_with_the_next_group():
    few, many = (
        draws({"rod_length_1": ROD, "friction": ROD}, sampling="saltelli", trials=n)
        for n in (400, 800)
    )
    np.testing.assert_array_equal(few, many[:400])


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_studies_without_deviations_are_sampled(sampling):
    assert not draws({}, sampling=sampling, trials=6).any()

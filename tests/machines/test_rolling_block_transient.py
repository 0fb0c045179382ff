"""The rolling block under load: integrated, in closed form, by matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import minimize_scalar

import tolstat
from tests.machines import rolling_block_reference as known
from tests.machines.rolling_blocks import B, scattered, solved
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import (
    contributions,
    drives,
    modes_of,
    moments,
    nominal,
)
from tolstat.machines.rolling_block.motion import (
    damping_matrix,
    followed,
    load_steps,
    pulse,
)

STATIC = np.array([1, 1, 0.5, 0.5, 0.25, 0.25, 0.25, 0.25])
STANDS = (31, 32, 33, 34)


def steps_of(settings, drive, modes):
    """The loading as the closed form takes it."""
    motor = {1: 0.25} if settings.motor == "matched" else {}
    return [
        (time, contributions(modes, drive.C, {stand: 0.25, **motor}))
        for time, stand in zip(settings.entries, STANDS, strict=True)
    ]


def peaks_in_closed_form(modes, zeta, steps, horizon):
    """The greatest moments of one drive: a scan, then the minimiser at each top."""
    time = np.linspace(0.0, horizon, 10_001)
    scan = abs(moments(time, modes.omega, zeta, steps)[0])
    found = []
    for link, row in enumerate(scan):
        candidates = [row.max()]
        for top in np.argsort(row)[-4:]:

            def depth(t, link=link):
                return -abs(
                    moments(np.array([t]), modes.omega, zeta, steps)[0, link, 0]
                )

            near = (max(time[top] - 2e-4, 0.0), min(time[top] + 2e-4, horizon))
            best = minimize_scalar(
                depth, bounds=near, method="bounded", options={"xatol": 1e-11}
            )
            candidates.append(-best.fun)
        found.append(max(candidates))
    return np.array(found)


def test_the_closed_form_against_the_matrix_exponential():
    """Scattered drives in angles of the masses, motor free: no modes at all."""
    drive, modes = scattered(3)
    settings = Settings(motor="free")
    time = np.array([0.0, 0.01, 0.0234, 0.05, 0.1, 0.2])
    found = moments(time, modes.omega, drive.zeta, steps_of(settings, drive, modes))
    H = damping_matrix(modes, drive.C, drive.zeta)
    load = np.array([0.0] * 5 + [-0.25] * 4)
    for trial in range(3):
        Q, C = drive.Q[trial], drive.C[trial]
        A = np.zeros((19, 19))  # angles, rates, and the constant 1
        A[:9, 9:18] = np.eye(9)
        A[9:18, :9] = -(B.T @ np.diag(C) @ B) / Q[:, None]
        A[9:18, 9:18] = -(B.T @ H[trial] @ B) / Q[:, None]
        A[9:18, 18] = load / Q
        for k, t in enumerate(time):
            angles = scipy.linalg.expm(A * t)[:9, 18]
            np.testing.assert_allclose(found[trial, :, k], C * (B @ angles), atol=1e-9)


def test_the_printed_moments_after_a_step():
    drive, modes = solved()
    settings = Settings(motor="free")
    time = np.array([0.01, 0.0234, 0.05, 0.1, 0.2])
    found = moments(time, modes.omega, drive.zeta, steps_of(settings, drive, modes))[0]
    M12 = [0.120699554, 1.098091575, -0.092403596, -0.089479818, 0.125628761]
    M47 = [0.236475920, 0.185016909, 0.112744101, 0.158830392, 0.105005871]
    np.testing.assert_allclose(found[0], M12, atol=5.1e-10)
    np.testing.assert_allclose(found[5], M47, atol=5.1e-10)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"motor": "free"},
        {"delay": (5e-3,)},
        {"delay": (3e-3, 0.0, 10e-3), "motor": "free"},
        {"combination": (1, 3, 3, 3)},
        {"damping_ratio": 0.3, "scale": 7.0},
    ],
)
@pytest.mark.parametrize(("second", "off"), [(False, 1e-12), (True, 1e-7)])
def test_followed_against_the_closed_form(given, second, off):
    """The whole second of any drive, exactly; by Runge-Kutta to 1e-7 of the peak."""
    settings = Settings(**given, runge_kutta=second)
    time = np.linspace(0.0, 1.0, 1501)
    drive, modes = scattered(6, settings=settings)
    for loading, steps in (
        (load_steps(settings), steps_of(settings, drive, modes)),
        (pulse(settings), pulsed(drive, modes, 31, settings.pulse_length)),
    ):
        solution = followed(drive, loading, settings, time)
        found = solution.history[:, :, :8].transpose(0, 2, 1) * drive.C[:, :, None]
        expected = moments(time, modes.omega, drive.zeta, steps)
        peak = abs(expected).max(axis=2)
        assert (abs(found - expected).max(axis=2) < off * peak).all()


def pulsed(drive, modes, stand, length):
    a = contributions(modes, drive.C, {stand: 1.0})
    return [(0.0, a), (length, -a)]


@pytest.mark.parametrize(("given", "expected"), known.AMPLIFICATIONS)
def test_amplifications_as_printed(given, expected):
    found = tolstat.evaluate("rolling_block", None, given).iloc[0]
    K = np.array([found[f"amplification_{ij}"] for ij in known.LINKS])
    np.testing.assert_allclose(K, expected, atol=5.1e-7)
    peak = [found[f"moment_peak_{ij}"] for ij in known.LINKS]
    np.testing.assert_allclose(peak, 35_950.293 * STATIC * K, rtol=1e-13)


@pytest.mark.parametrize(("length", "expected"), known.PULSES.items())
def test_pulses_as_printed(length, expected):
    drive, modes = solved()
    steps = pulsed(drive, modes, 31, length)
    closed = peaks_in_closed_form(modes, drive.zeta, steps, 1.0)
    np.testing.assert_allclose(closed, expected, atol=1.1e-9)
    given = {"pulse_length": length, "pulse_moment": 250.0}
    found = tolstat.evaluate("rolling_block", None, given).iloc[0]
    peak = [found[f"pulse_peak_{ij}"] for ij in known.LINKS]
    np.testing.assert_allclose(np.array(peak) / 250.0, expected, atol=1.1e-9)


@pytest.mark.parametrize("stand", STANDS)
def test_a_pulse_on_any_stand_of_any_drive(stand):
    settings = Settings(pulse_stand=stand, horizon=0.15)
    drive, _ = scattered(3)
    solution = followed(drive, pulse(settings), settings)
    for trial in range(3):
        one = tuple(each[trial : trial + 1] for each in drive[:3])
        of_one = modes_of(*one[:2])
        steps = pulsed(type(drive)(*one, of_one), of_one, stand, settings.pulse_length)
        expected = peaks_in_closed_form(of_one, one[2], steps, 0.15)
        found = np.maximum(solution.greatest, -solution.least)[trial]
        np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_delays_one_number_or_three():
    short = {"horizon": 0.2}
    one = tolstat.evaluate("rolling_block", None, {"delay": 4e-3, **short})
    three = tolstat.evaluate("rolling_block", None, {"delay": (4e-3,) * 3, **short})
    assert one.equals(three)
    other = {"delay": (4e-3, 4e-3, 5e-3), **short}
    assert not one.equals(tolstat.evaluate("rolling_block", None, other))


def test_without_damping_the_peak_is_the_sum_of_all_modes_at_most():
    """For ever, |sum a| + sum |a|: what is printed; a second comes near to it."""
    drive, modes = solved()
    a = contributions(modes, drive.C, {1: 1.0, **dict.fromkeys(STANDS, 0.25)})[0]
    bound = (abs(a.sum(axis=1)) + abs(a).sum(axis=1)) / STATIC
    printed = [2.201170, 2.202573, 2.179772, 2.550779,
               2.000579, 2.000579, 2.239763, 2.239763]  # fmt: skip
    np.testing.assert_allclose(bound, printed, atol=5.1e-7)
    found = tolstat.evaluate("rolling_block", None, {"damping_ratio": 0.0}).iloc[0]
    K = np.array([found[f"amplification_{ij}"] for ij in known.LINKS])
    assert (bound > K).all() and (bound < 1.1 * K).all()


def test_the_spread_of_the_amplifications():
    """Means, standard deviations and 95 % points within the sampling error."""
    trials = 1500
    settings = Settings(horizon=0.2, rtol=1e-6)
    spread = np.array([0.02] * 9 + [0.05] * 8 + [0.0])
    normal = np.random.default_rng(8).standard_normal((trials, 18))
    drive = drives(spread * normal, settings)
    solution = followed(drive, load_steps(settings), settings)
    K = np.maximum(solution.greatest, -solution.least) / STATIC
    sigma = np.array(known.LOADED_SIGMA)
    off = abs(K.mean(axis=0) - known.LOADED_MEAN) / sigma
    assert (off < 4 / np.sqrt(trials) + 0.01).all()
    # skewed: the fourth moment of the sample tells how sure its sigma is
    kurtosis = ((K - K.mean(axis=0)) ** 4).mean(axis=0) / K.var(axis=0) ** 2
    sure = np.sqrt((kurtosis - 1) / (4 * trials))
    assert (abs(K.std(axis=0) / sigma - 1) < 4 * sure + 0.01).all()
    beyond = (known.LOADED_P95 < K).mean(axis=0)
    assert (abs(beyond - 0.05) < 4 * np.sqrt(0.05 * 0.95 / trials) + 0.003).all()


def test_damping_deviates_in_all_modes():
    short = {"horizon": 0.1}
    less = tolstat.evaluate("rolling_block", {"damping": -0.5}, short)
    same = tolstat.evaluate("rolling_block", None, {"damping_ratio": 0.01, **short})
    assert less.equals(same)


@pytest.mark.parametrize("zeta", [0.999999, 1.0, 1.000001, 1.6, 40.0])
def test_a_drive_that_does_not_swing(zeta):
    """Critical and beyond: closed form and integrated, by the matrix exponential."""
    drive, modes = scattered(1)
    drive = drive._replace(zeta=np.array([zeta]))
    settings = Settings(motor="matched", horizon=0.3)
    time = np.array([0.0, 1e-3, 0.02, 0.1, 0.3])
    found = moments(time, modes.omega, drive.zeta, steps_of(settings, drive, modes))[0]
    H = damping_matrix(modes, drive.C, drive.zeta)[0]
    twisting = np.diag(1.0 / drive.Q[0])
    # twists' = B angles'; angles'' = Q^-1 (load - B^T (C twists + H rates))
    A = np.zeros((17, 17))
    A[:8, 8:] = B
    A[8:, :8] = -twisting @ B.T @ np.diag(drive.C[0])
    A[8:, 8:] = -twisting @ B.T @ H @ B
    load = np.concatenate([np.zeros(8), twisting @ ([1.0] + [0.0] * 4 + [-0.25] * 4)])
    whole = np.block([[A, load[:, None]], [np.zeros((1, 18))]])
    for t, moment in zip(time, found.T, strict=True):
        twists = scipy.linalg.expm(whole * t)[:8, 17]
        assert moment == pytest.approx(drive.C[0] * twists, abs=1e-7)
    solution = followed(drive, load_steps(settings), settings, time)
    for link in range(8):
        moment = drive.C[0, link] * solution.history[0, :, link]
        assert moment == pytest.approx(found[link], abs=1e-11)


def test_a_tighter_rtol_does_not_change_peaks():
    """What is said at rtol 1e-9 is true to 1e-6 of itself."""
    short = {"horizon": 0.3, "runge_kutta": True}
    usual = tolstat.evaluate("rolling_block", None, short)
    close = tolstat.evaluate("rolling_block", None, {"rtol": 1e-11, **short})
    names = [n for n in usual if n.startswith(("ampl", "moment", "pulse"))]
    np.testing.assert_allclose(usual[names], close[names], rtol=1e-6)
    assert close["steps"].iloc[0] > 2 * usual["steps"].iloc[0]
    exact = tolstat.evaluate("rolling_block", None, {"horizon": 0.3})
    np.testing.assert_allclose(exact[names], close[names], rtol=1e-9)


def test_the_result_scales_with_load_and_drive():
    """Linear: a heavier drive under a greater load, the same amplification."""
    given = {"scale": 1e-3, "total_load": 1.0, "horizon": 0.2}
    small = tolstat.evaluate("rolling_block", None, given).iloc[0]
    usual = tolstat.evaluate("rolling_block", None, {"horizon": 0.2}).iloc[0]
    for ij in known.LINKS:
        name = f"amplification_{ij}"
        assert small[name] == pytest.approx(usual[name], rel=1e-9)
    assert nominal(Settings(scale=1e-3)).C[0, 0] == pytest.approx(8e3)


def test_bit_for_bit_the_same_in_any_block():
    settings = Settings(delay=(3e-3, 0.0, 10e-3), horizon=0.1)
    drive, _ = scattered(21)
    whole = followed(drive, load_steps(settings), settings)
    for rows in (slice(0, 1), slice(3, 8), slice(17, None), slice(None, None, -1)):
        one = [each[rows] for each in drive[:3]]
        part = type(drive)(*one, modes_of(*one[:2]))
        found = followed(part, load_steps(settings), settings)
        np.testing.assert_array_equal(found.peak, whole.peak[rows])
        np.testing.assert_array_equal(found.steps, whole.steps[rows])

"""The drive under the assumed speed regulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.machines.rolling_blocks import scattered
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import nominal
from tolstat.machines.rolling_block.regulator import closed_loop

PLAIN = Settings()
HARD = replace(PLAIN, combination=(1, 0, 0, 0))
K_P = 13570.547563


def growth(settings, hz=None):
    notch = None if hz is None else np.array([2 * np.pi * hz])
    return closed_loop(nominal(settings), settings, K_P, notch)[0, 0].real


def listing(**settings):
    return tolstat.view("rolling_block", "regulator", settings=settings).frame()


def test_table_1_as_computed_elsewhere():
    f1 = nominal(PLAIN).modes.omega[0, 0] / (2 * np.pi)
    assert growth(PLAIN) == pytest.approx(-1.0923803, abs=5.1e-8)
    assert growth(PLAIN, f1) == pytest.approx(-2.2198955, abs=5.1e-8)
    assert growth(PLAIN, 16.0) == pytest.approx(-2.5272746, abs=5.1e-8)
    assert growth(PLAIN, 24.0) == pytest.approx(-1.6575136, abs=5.1e-8)
    notch = np.array([2 * np.pi * f1])
    poles = closed_loop(nominal(PLAIN), PLAIN, K_P, notch)[0]
    for hz, zeta in ((3.376757, 0.28992383), (20.194395, 0.01749532)):
        at = poles[np.argmin(abs(abs(poles) - 2 * np.pi * hz))]
        assert abs(at) / (2 * np.pi) == pytest.approx(hz, abs=5.1e-7)
        assert -at.real / abs(at) == pytest.approx(zeta, abs=5.1e-9)


def test_all_combinations_as_computed_elsewhere():
    frame = listing().set_index("combination")
    bare, held = frame["no notch"], frame["notch"]
    assert (bare > 0).sum() == 18
    assert bare.max() == bare["0 0 0 0"] == pytest.approx(0.2849101, abs=5.1e-8)
    assert (held > 0).sum() == 1
    assert held["1 0 0 0"] == pytest.approx(0.0334443, abs=5.1e-8)
    # what is assumed stands beside each number
    assert (frame["assumed K_p"].round(6) == K_P).all()
    assert set(frame["assumed T_i"]) == {0.1}
    assert (frame["at"].round(9) == 15.0).sum() == 32
    for hz, n, worst in ((20.0, 16, 0.8949466), (25.0, 17, None)):
        fixed = listing(notch_frequency=hz)["notch"]
        assert (fixed > 0).sum() == n
        assert worst is None or fixed.max() == pytest.approx(worst, abs=5.1e-8)
    assert (listing(notch_damping=0.1)["notch"] > 0).sum() == 16
    light = listing(damping_ratio=0.01)
    assert (light["notch"] > 0).sum() == 16
    assert (light["no notch"] > 0).sum() == 92


@pytest.mark.parametrize(("factor", "n"), [(0.7, 1), (1.2, 1), (1.3, 9)])
def test_a_notch_beside_the_mode(factor, n):
    unstable = 0
    for one in PLAIN.every_combination:
        f1 = nominal(one).modes.omega[0, 0] / (2 * np.pi)
        unstable += growth(one, np.clip(factor * f1, 15.0, 25.0)) > 0
    assert unstable == n


def test_tolerances_of_the_combination_that_the_notch_does_not_reach():
    for settings, share in ((HARD, 0.60), (PLAIN, 0.0)):
        drive, _ = scattered(1000, settings=settings)
        f1 = nominal(settings).modes.omega[0, 0]
        notch = np.full(1000, np.clip(f1, 30 * np.pi, 50 * np.pi))
        drive = drive._replace(zeta=np.full(1000, 0.02))
        found = closed_loop(drive, settings, K_P, notch)[:, 0].real > 0
        assert found.mean() == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize("T", [5e-3, 10e-3, 30e-3])
def test_other_loops_need_no_notch(T):
    given = {"speed_gain": 1 / (2 * T), "integral_time": 4 * T}
    frame = listing(**given, speed_lag=T / 2, torque_lag=T / 2)
    assert (frame["no notch"] < 0).all()


def test_the_rigid_limit_and_the_open_loop():
    stiff = replace(PLAIN, stiffnesses=tuple(1e4 * c for c in PLAIN.stiffnesses))
    T, J = PLAIN.torque_lag, 680.0
    known = np.roots([T * T, 2 * T, 1, K_P / J, K_P / (0.1 * J)])
    found = closed_loop(nominal(stiff), stiff, K_P, None)[0]
    near = [found[np.argmin(abs(found - root))] for root in known]
    np.testing.assert_allclose(near, known, rtol=1e-4)
    # without gain: the modes, two lags, the rigid speed and the integral
    drive = nominal(PLAIN)
    alone = closed_loop(drive, PLAIN, 0.0, None)[0]
    omega = drive.modes.omega[0]
    swings = np.sort(abs(alone[abs(alone.imag) > 1]))[::2]
    np.testing.assert_allclose(swings, omega, rtol=1e-9)
    # no lags and no notch: stable for any gain
    quick = replace(PLAIN, torque_lag=1e-7, speed_lag=1e-7)
    for gain in (1e3, 1e5):
        assert closed_loop(nominal(quick), quick, gain, None)[0, 0].real < 0

"""Random torques, beats and travelling pulses of the rolling block."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import tolstat
from tests.machines.rolling_blocks import B
from tolstat.errors import ModelError
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import contributions, nominal
from tolstat.machines.rolling_block.resonance import rolling_speeds
from tolstat.machines.rolling_block.torques import (
    deviations_of,
    peaks,
    residual,
    travelling,
)

PLAIN = Settings()
DRIVE = nominal(PLAIN)
SEEN = [0, 1, 2, 3, 4, 6]  # links 12 23 34 35 46 58


def test_rms_under_random_torques_as_computed_elsewhere():
    independent, one = deviations_of(DRIVE, PLAIN)
    known = [38.7283558, 39.3217715, 42.4588841, 35.8799862, 30.2166413, 26.9894990]
    np.testing.assert_allclose(independent[SEEN], known, atol=5.1e-8)
    known = [70.0673862, 70.9358768, 28.4075779, 41.5038317, 17.7997753, 17.9871692]
    np.testing.assert_allclose(one[SEEN], known, atol=5.1e-8)
    slow, _ = deviations_of(DRIVE, replace(PLAIN, torque_corner=15.0))
    known = [22.1919372, 22.9219914, 23.5032558, 20.0457556, 14.1641065, 14.4990075]
    np.testing.assert_allclose(slow[SEEN], known, atol=5.1e-8)


def test_rms_in_closed_form():
    """White torque: sums over pairs of modes, by residues."""
    f, z = DRIVE.modes.omega[0] / (2 * np.pi), 0.02
    b = f[None, :] / f[:, None]
    rho = 8 * z**2 * (1 + b) * b**1.5 / ((1 - b**2) ** 2 + 4 * z**2 * b * (1 + b) ** 2)
    weight = np.pi / (4 * z) * np.sqrt(np.outer(f, f)) * rho
    a = np.array(
        [contributions(DRIVE.modes, DRIVE.C, {s: 1.0})[0] for s in range(31, 35)]
    )
    known = np.sqrt(np.einsum("slr,rq,slq->l", a, weight, a))
    np.testing.assert_allclose(deviations_of(DRIVE, PLAIN)[0], known, rtol=1e-9)


def test_rms_of_damped_links_by_lyapunov():
    settings = replace(PLAIN, link_damping=(2e-3, *[1e-4] * 7))
    G = B @ np.diag(1 / DRIVE.Q[0]) @ B.T
    C, tau = np.diag(DRIVE.C[0]), np.diag(settings.link_damping)
    A = np.block([[np.zeros((8, 8)), np.eye(8)], [-G @ C, -G @ C @ tau]])
    noise = np.vstack([np.zeros((8, 4)), (B @ np.diag(1 / DRIVE.Q[0]))[:, 5:]])
    # a one-sided density of 1 is a two-sided of a half
    P = scipy.linalg.solve_continuous_lyapunov(A, -0.5 * noise @ noise.T)
    known = DRIVE.C[0] * np.sqrt(np.diag(P)[:8])
    np.testing.assert_allclose(deviations_of(DRIVE, settings)[0], known, rtol=1e-9)


def test_a_spectrum_of_points_and_the_view():
    points = [{"frequency": f, "density": 3.0} for f in (0.0, 1e5)]
    settings = {"torque_spectrum": points, "loss_factors": (0.03,) * 8}
    frame = tolstat.view("rolling_block", "rms", settings=settings).frame()
    plain = {"loss_factors": (0.03,) * 8}
    known = tolstat.view("rolling_block", "rms", settings=plain).frame()
    for head in ("independent", "one torque"):
        ratio = frame[head] / known[head]
        np.testing.assert_allclose(ratio, np.sqrt(3), rtol=1e-8)
    chart = tolstat.view("rolling_block", "torques")
    assert chart.curves[0].name == "independent"
    # the curve is the density: over its axis it has nearly all of the variance
    S = chart.curves[0].values
    assert np.sqrt(np.trapezoid(S, chart.at)) == pytest.approx(38.73, rel=0.03)


def test_a_mode_without_damping_has_no_rms():
    only = {"link_damping": (2e-3, *[0.0] * 7)}  # rolls against rolls swing freely
    with pytest.raises(ModelError, match="a mode has no damping"):
        tolstat.view("rolling_block", "rms", settings=only)


def test_beats_as_computed_elsewhere():
    frame = tolstat.view("rolling_block", "beats").frame()
    pairs = frame.set_index(["mode", "and mode"])
    beat = [pairs.loc[pair, "beat"] for pair in ((1, 2), (2, 3), (1, 3))]
    np.testing.assert_allclose(beat, [2.598270, 2.433005, 5.031275], atol=5.1e-7)
    # of amplitudes with six digits: 0.5614645
    assert pairs.loc[(1, 2), "depth"] == pytest.approx(0.5614641, abs=5.1e-8)
    lasting = pairs.loc[(1, 2), "beats before 1/e"]
    f = [20.133330738, 22.731601012]
    assert lasting == pytest.approx((f[1] - f[0]) / (np.pi * 0.02 * sum(f)))


def test_what_a_travelling_pulse_leaves():
    found = residual(DRIVE, replace(PLAIN, delay=(5e-3,)))[0, 0, [0, 1, 4]]
    known = [1.14799316, 0.37578987, 0.10973840]
    np.testing.assert_allclose(found, known, atol=5.1e-9)


@pytest.mark.parametrize(
    ("length", "delay", "known"),
    [
        (5e-3, 3e-3, [1.53826688, 1.51379379, 1.13888422, 1.64121779,
                      0.71765411, 0.60732756, 0.47575955, 0.66415591]),
        (0.1, 5e-3, [3.26370800, 3.49408856, 2.41248621, 2.97944801,
                     1.35316498, 1.55171110, 1.38350641, 1.86875943]),
    ],
)  # fmt: skip
def test_peaks_of_a_travelling_pulse_as_computed_elsewhere(length, delay, known):
    settings = replace(PLAIN, pulse_length=length, delay=(delay,))
    np.testing.assert_allclose(peaks(DRIVE, settings), known, atol=5.1e-9)
    given = {"pulse_length": length, "delay": (delay,), "pulse_moment": 10.0}
    frame = tolstat.view("rolling_block", "travel", settings=given).frame()
    np.testing.assert_allclose(frame["peak"] / 10, known, rtol=1e-8)


def test_the_rod_brings_the_pulse():
    settings = replace(PLAIN, stand_distance=0.5)
    begins = [begin for begin, _ in travelling(DRIVE, settings)][::2]
    speeds = 1200 * np.pi / 30 * rolling_speeds(PLAIN)
    np.testing.assert_allclose(np.diff(begins), 0.5 / speeds[:3])

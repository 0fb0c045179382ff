"""Inputs, outputs and dampings of the rolling block, gearbox and rolling speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import tolstat
from tests.machines.rolling_blocks import RPM, B, scattered
from tolstat.errors import ModelError
from tolstat.machines.rolling_block import structure
from tolstat.machines.rolling_block.channels import (
    Input,
    Output,
    input_of,
    loads,
    output_of,
    poles_of,
    transfer,
)
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import nominal
from tolstat.machines.rolling_block.resonance import rolling_speeds

PLAIN = Settings()
BY_LINK = replace(
    PLAIN, stiffnesses=(4e6, *PLAIN.stiffnesses[1:]), link_damping=(2e-3, *[0.0] * 7)
)
LOSSES = replace(PLAIN, loss_factors=(0.2, *[0.02] * 7))


def over(hz, settings, source, *names):
    """Amplitudes [output, frequency] of the nominal drive."""
    answers = [output_of(name, settings) for name in names]
    return abs(transfer(np.array(hz), nominal(settings), settings, source, *answers))[0]


def test_a_mode_that_does_not_swing_has_its_slower_root():
    """All times equal: each mode has zeta = omega tau/2, the highest two above 1."""
    settings = replace(PLAIN, link_damping=(5e-3,) * 8)
    omega = nominal(PLAIN).modes.omega[0]
    zeta = omega * 5e-3 / 2
    slow = omega * (zeta - np.sqrt(np.maximum(zeta**2 - 1, 0.0)))
    slow[zeta < 1] = omega[zeta < 1]
    frequency, ratio = poles_of(nominal(settings), settings)
    assert (zeta > 1).sum() == 2
    np.testing.assert_allclose(frequency[0], np.sort(slow) / (2 * np.pi), rtol=1e-8)
    known = np.minimum(zeta, 1.0)[np.argsort(slow)]
    np.testing.assert_allclose(ratio[0], known, rtol=1e-8)


def test_poles_of_a_damped_coupling_as_computed_elsewhere():
    frequency, zeta = poles_of(nominal(BY_LINK), BY_LINK)
    np.testing.assert_allclose(
        frequency[0],
        [17.840387, 22.602004, 25.164606, 31.830989,
         43.656530, 62.759099, 87.770139, 152.027399],
        atol=5.1e-7,
    )  # fmt: skip
    known = [0.05229004, 0.00139931, 0, 0, 0.04100728, 4.26e-6, 0.19222732, 0.02444232]
    np.testing.assert_allclose(zeta[0], known, atol=5.1e-9)
    row = tolstat.view(
        "rolling_block", "damping", settings={"link_damping": (1e-3,) * 8}
    ).frame()
    # all times equal: zeta_r = pi f_r tau
    np.testing.assert_allclose(
        row["damping ratio"], np.pi * row["undamped"] * 1e-3, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("settings", "known"),
    [
        (BY_LINK, [0.70540911, 2.9289149, 0.30708833]),
        (LOSSES, [0.62305257, 10.7973297, 0.56258851]),
    ],
)
def test_damping_by_link_as_computed_elsewhere(settings, known):
    found = over([10.0, 20.0, 25.0], settings, loads(33), "12")[0]
    np.testing.assert_allclose(found, known, rtol=1e-7)


MESHES = {
    ("23", 20.0): (52922443, 55081139, 23246326),
    ("34", 22.7): (16176513, 16559918, 46035989),
    ("35", 60.0): (3358413.2, 1906393.1, 17893420),
}


@pytest.mark.parametrize(("mesh", "hz"), MESHES)
def test_mesh_errors_as_computed_elsewhere(mesh, hz):
    source = input_of(f"mesh {mesh}", PLAIN)
    found = over([hz], PLAIN, source, "12", "23", "34")[:, 0]
    np.testing.assert_allclose(found, MESHES[mesh, hz], rtol=2e-8)
    # slowly both sides follow the error as rigid bodies, fast only the link yields
    i, j = (int(end) - 1 for end in mesh)
    down = {"23": range(2, 9), "34": (3, 5, 6), "35": (4, 7, 8)}[mesh]
    Q = nominal(PLAIN).Q[0]
    J_d = Q[list(down)].sum()
    slow, fast = over([1e-2, 1e7], PLAIN, source, mesh)[0]
    rigid = (2 * np.pi * 1e-2) ** 2 * (Q.sum() - J_d) * J_d / Q.sum()
    assert slow == pytest.approx(rigid, rel=1e-6)
    if mesh == "23":
        assert rigid / (2 * np.pi * 1e-2) ** 2 == pytest.approx(169.8529, abs=1e-4)
    assert fast == pytest.approx(PLAIN.stiffnesses[structure.LINKS.index((i, j))])


STRETCHES = {
    22.73: (2.0370096e-6, 2.4445595e-5, 1.0658389e-5),
    25.16: (2.6556302e-6, 1.3789798e-5, 5.0007059e-5),
    31.83: (2.5000746e-5, 6.6377099e-6, 3.3220914e-6),
    62.76: (3.462e-7, 4.545e-7, 3.831e-7),
}


@pytest.mark.parametrize("hz", STRETCHES)
def test_gaps_as_computed_elsewhere(hz):
    """Of 1 N m on both stands of a gap: phi_b - phi_a there."""
    for place, known in enumerate(STRETCHES[hz]):
        apart = np.zeros(9)
        apart[5 + place], apart[6 + place] = -1.0, 1.0
        source = Input("N m", -apart, np.zeros(8))
        answer = Output("rad", apart, np.zeros(8))
        found = transfer(np.array([hz]), nominal(PLAIN), PLAIN, source, answer)
        digits = 5.1e-11 if hz == 62.76 else 5.1e-8 * known
        assert abs(found[0, 0, 0]) == pytest.approx(known, abs=digits)


def test_gaps_are_reciprocal():
    drive, _ = scattered(3)
    hz = np.array([3.0, 22.0, 70.0])
    for settings in (PLAIN, BY_LINK, LOSSES):
        gap = {
            (a, b): transfer(
                hz, drive, settings, input_of(f"tension {a}", settings),
                output_of(b, settings),
            )
            for a in structure.GAPS for b in structure.GAPS
        }  # fmt: skip
        for (a, b), G in gap.items():
            np.testing.assert_allclose(G, gap[b, a], rtol=1e-9)


@pytest.mark.parametrize("settings", [BY_LINK, LOSSES])
def test_any_channel_against_the_matrices_of_nine_masses(settings):
    """Solve (K - w^2 M) phi = L + B^T K_link e with complex stiffnesses."""
    drive, _ = scattered(2)
    hz, rng = np.array([0.5, 20.0, 90.0]), np.random.default_rng(3)
    source = Input("", rng.standard_normal(9), rng.standard_normal(8))
    names = ("58", "32-33", "angle 4", "speed 1")
    answers = [output_of(name, settings) for name in names]
    found = transfer(hz, drive, settings, source, *answers)
    tau, eta = settings.dampings
    rho = rolling_speeds(settings)
    for trial in range(2):
        for i, w in enumerate(2 * np.pi * hz):
            link = drive.C[trial] * (1 + 1j * w * tau + 1j * eta)
            K = B.T @ np.diag(link) @ B - w**2 * np.diag(drive.Q[trial])
            phi = np.linalg.solve(K, source.moments + B.T @ (link * source.errors))
            gamma = B @ phi - source.errors
            known = [
                drive.C[trial, 6] * gamma[6], rho[2] * phi[7] - rho[1] * phi[6],
                phi[3], 1j * w * phi[0],
            ]  # fmt: skip
            np.testing.assert_allclose(found[trial, :, i], known, rtol=1e-9)


def test_an_unbalanced_roll_as_computed_elsewhere():
    per_rpm = 1 / 60 / PLAIN.ratios.i31
    assert 1200 * per_rpm == pytest.approx(53.925482, abs=5.1e-7)

    def size(n):
        return over([n * per_rpm], PLAIN, loads(31), "46")[0, 0]

    assert size(1200.0) == pytest.approx(0.43462346, abs=5.1e-9)
    rough = over(np.arange(850.0, 1701.0) * per_rpm, PLAIN, loads(31), "46")[0]
    assert 850 + rough.argmax() == 1018
    found = minimize_scalar(lambda n: -size(n), bounds=(1010, 1025), method="bounded")
    assert -found.fun == pytest.approx(2.6201178, abs=5.1e-8)
    assert found.x == pytest.approx(1017.976, abs=5.1e-4)


def test_tension_as_torque_at_the_motor():
    """30 N/mm2 in a wire of 5.5 mm."""
    S = 30e6 * np.pi / 4 * 5.5e-3**2
    assert pytest.approx(712.749, abs=5.1e-4) == S
    torque = S * input_of("tension 32-33", PLAIN).moments
    assert torque[6] == pytest.approx(221.003, abs=5.1e-4)
    assert -torque[7] == pytest.approx(315.501, abs=5.1e-4)


def test_rolling_speeds_and_the_cut_at_120_m_s():
    frame = tolstat.view("rolling_block", "combinations").frame()
    by_name = frame.set_index("combination")
    chosen = by_name.loc["0 3 1 1"]
    assert chosen["v31"] == pytest.approx(38.9647363, abs=5.1e-8)
    assert chosen["v34"] == pytest.approx(55.6255014, abs=5.1e-8)
    limit = frame["limit of v34"] / RPM
    assert limit[0] == pytest.approx(1142.977, abs=5.1e-4)
    assert (limit < 1700).sum() == 32
    cut = {"combination": (0, 0, 0, 0)}
    chart = tolstat.view("rolling_block", "campbell", settings=cut)
    line = chart.spans[-2]
    assert line.words == "120 m/s in 34: 1143 rpm" and line.lower == line.upper
    assert line.lower / RPM == pytest.approx(1142.977, abs=5.1e-4)
    at = np.interp(line.lower, chart.at, chart.frame()["rod at 33, 34"])
    assert at == pytest.approx(120.0)


def test_condition_numbers_as_computed_elsewhere():
    frame = tolstat.view("rolling_block", "combinations").frame()
    found = frame.set_index("combination")["condition f8/f1"]
    assert found["0 3 1 1"] == pytest.approx(7.7495963, abs=5.1e-8)
    assert found.min() == pytest.approx(7.0804888, abs=5.1e-8)
    assert found["1 0 0 0"] == found.max() == pytest.approx(20.8738945, abs=5.1e-8)
    assert (found > 10).sum() == 64


def test_masses_that_may_go():
    frame = tolstat.view("rolling_block", "masses").frame()
    known = [25.989893, 116.230337, 136.292151, 59.016232, 61.640444,
             31.830989, 31.830989, 25.164606, 25.164606]  # fmt: skip
    np.testing.assert_allclose(frame["partial frequency"], known, atol=5.1e-7)
    gone = frame[frame["may go"] == "yes"]
    assert gone["mass"].tolist() == ["stage A", "stage B"]
    np.testing.assert_array_equal(np.round(gone["f4 over it"], 2), [0.27, 0.23])
    errors = 100 * frame["error of mode"].dropna()
    np.testing.assert_allclose(errors, [0.46392, 0.05900, 0, 0], atol=5.1e-6)
    every = tolstat.view("rolling_block", "masses", settings={"kept_modes": 8}).frame()
    assert (every["may go"] == "no").all()
    np.testing.assert_allclose(every["error of mode"].dropna(), 0.0, atol=1e-12)


def test_another_gearbox():
    """Ranges are met and the reference is not reduced; q and p as defined."""
    settings = Settings(
        entry_ratios=(0.2, 0.9), exit_ratios=(0.1, 0.6), positions=(3, 1, 5, 2),
        reference=(2, 0, 1, 0), combination=(2, 0, 1, 0),
    )  # fmt: skip
    box = settings.gearbox
    every = [structure.ratios(each, box) for each in box.combinations]
    assert len(set(every)) == 30
    assert min(r.i31 for r in every) == pytest.approx(0.2)
    assert max(r.i31 for r in every) == pytest.approx(0.9)
    assert min(r.i34 for r in every) == pytest.approx(0.1)
    assert max(r.i34 for r in every) == pytest.approx(0.6)
    np.testing.assert_allclose(nominal(settings).Q[0], settings.inertias)
    q = 4.5 ** (1 / 14)
    assert settings.ratios.i31 == pytest.approx(0.2 * q ** (10 + 1))
    assert settings.ratios.i34 == pytest.approx(0.1 * q**10)
    with pytest.raises(ModelError, match="stage B has the positions 0 to 0, not 3"):
        Settings(positions=(3, 1, 5, 2), reference=(0, 0, 0, 0))
    with pytest.raises(ModelError, match="loss_factors: one number for each"):
        Settings(loss_factors=(0.1,))


def test_the_printed_inertias_would_need_another_motor():
    """316..2195 needs Q1 276.275 and all others x 1.011751, which Table 1 excludes."""
    Q = 300.0, 380.0
    most, least = (
        np.array([1.0, (nominal(Settings(combination=c)).Q[0, 1:].sum()) / Q[1]])
        for c in ((0, 0, 0, 0), (1, 3, 3, 3))
    )
    motor, rest = np.linalg.solve([most, least], [2195.0, 316.0])
    assert motor == pytest.approx(276.275, abs=5.1e-4)
    assert rest / Q[1] == pytest.approx(1.0117510, abs=5.1e-8)


def test_the_view_of_a_channel():
    given = {"response_input": "mesh 23", "response_output": "31-32"}
    chart = tolstat.view("rolling_block", "response", settings=given)
    assert chart.curves[0].unit == "m/rad"
    [work] = chart.spans
    assert work.lower == work.upper == pytest.approx(20.0)
    assert work.words == "order 1 at the working speed"

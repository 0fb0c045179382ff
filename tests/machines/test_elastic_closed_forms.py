"""The elastic machine's closed forms and start-up laws against print and quadrature."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh, expm

from tests.machines.elastic import CASES, NINTHS, jerk, matrices, random_machine, solved
from tests.machines.elastic_closed_forms import (
    modal_sum,
    one_mass,
    step_response,
    two_masses,
)
from tolstat.machines.elastic_machine.modes import (
    left_by_start_up,
    modes_of,
    natural_frequencies,
)
from tolstat.machines.elastic_machine.motion import PIECE, acceleration
from tolstat.machines.elastic_machine.start_up import LAWS


def last_digit(answers):
    """Half of the last of 13 significant digits."""
    return 0.5001 * 10.0 ** (np.floor(np.log10(np.abs(answers))) - 12)


@pytest.mark.parametrize("name", CASES)
def test_the_modal_sum_matches_the_paper(name):
    case = CASES[name]
    times, answers = case.times, case.answers
    chain = case.inertia, case.stiffness, case.damping
    t0, eps0 = case.start_up_time, case.eps0
    loads = [(s["time"], s["mass"], s["torque"]) for s in case.load_torque]
    found = modal_sum(times, chain, [(0.0, eps0), (t0, -eps0)], loads)
    assert np.all(np.abs(found - answers) <= last_digit(answers) + 1e-15)


@pytest.mark.parametrize("name", ["one mass", "overdamped"])
def test_one_mass_matches_the_paper(name):
    case = CASES[name]
    times, answers = case.times, case.answers
    found = one_mass(
        times, 0.5, 2000.0, case.damping[0], case.eps0, case.start_up_time, 10.0
    )
    assert np.all(np.abs(found - answers[:, 0]) <= last_digit(answers[:, 0]) + 1e-15)


def test_two_masses_match_the_paper():
    times, answers = CASES["two masses"].times, CASES["two masses"].answers
    found = np.stack(two_masses(times, 2.0, 800.0, 10.0, 1.2), axis=1)
    assert np.all(np.abs(found - answers) <= last_digit(answers) + 1e-15)


def test_two_masses_peak_at_16_thirds_and_rest_after_whole_periods():
    J, c, eps0 = 3.0, 500.0, 7.0
    T = 2 * np.pi / np.sqrt(0.5 * c / J)
    unit = J * eps0 / c
    theta = two_masses(np.linspace(0, T, 200_001), J, c, eps0, 5 * T)
    assert theta[1].min() == pytest.approx(-16 / 3 * unit, rel=1e-12)
    assert two_masses(T / 2, J, c, eps0, T / 2)[1] == pytest.approx(-16 / 3 * unit)
    still = np.abs(two_masses(np.linspace(2 * T, 9 * T, 999), J, c, eps0, 2 * T)).max()
    assert still < 1e-13 * unit


def test_the_modal_sum_is_wrong_for_coupled_damping():
    """A damper on one spring alone: (7) leaves something out, by per cents."""
    case = CASES["two masses"]
    machine = {**case.settings, "damping": [0.0, 10.0], "start_up_law": "constant"}
    times = np.linspace(0, 2, 201)
    exact = solved(machine, times)
    chain = case.inertia, case.stiffness, machine["damping"]
    found = modal_sum(times, chain, [(0.0, case.eps0), (1.2, -case.eps0)])
    off = np.abs(found - exact).max() / np.abs(exact).max()
    assert 0.01 < off < 0.1


def test_one_mass_has_its_first_minimum_and_its_rest():
    J, c, b, eps0, M0 = 0.5, 2000.0, 4.0, 50.0, 10.0
    n, k = b / (2 * J), np.sqrt(c / J)
    k1 = np.sqrt(k * k - n * n)
    t = np.linspace(0, 0.8, 800_001)
    theta = one_mass(t, J, c, b, eps0, 0.8, M0)
    known = -(eps0 + M0 / J) / k**2 * (1 + np.exp(-n * np.pi / k1))
    assert theta.min() == pytest.approx(known, rel=1e-9)
    assert t[theta.argmin()] == pytest.approx(np.pi / k1, abs=2e-6)
    assert one_mass(50.0, J, c, b, eps0, 0.8, M0) == pytest.approx(-M0 / c, rel=1e-12)


@pytest.mark.parametrize("n", [0.0, 3.0, 9.999999, 10.0, 10.000001, 13.0, 4000.0])
def test_the_step_response_is_right_about_critical_damping(n):
    k = 10.0
    for t in (0.0, 1e-4, 0.05, 0.3, 2.0):
        way = expm(t * np.array([[0, 1, 0], [-k * k, -2 * n, 1], [0, 0, 0]]))
        assert step_response(t, n, k) == pytest.approx(way[0, 2], rel=1e-9, abs=1e-17)
    assert step_response(-1.0, n, k) == 0.0
    assert step_response(1e6, max(n, 1.0), k) == pytest.approx(1 / k**2)


def test_modes_of_the_four_masses():
    case = CASES["four masses"]
    chain = (np.array(x) for x in (case.inertia, case.stiffness, case.damping))
    modes = modes_of(*chain)
    known = [16.0097389, 38.16331999, 55.5078848, 67.56076765]
    np.testing.assert_allclose(modes.k, known, rtol=3e-9)
    damping = [0.00800487, 0.01908166, 0.02775394, 0.03378038]
    np.testing.assert_allclose(modes.zeta, damping, atol=5.1e-9)


def test_modes_of_the_two_masses():
    """J = 2, c = 800: shapes, g, gamma and rho as the paper has them."""
    chain = np.array([4.0, 2.0]), np.array([1600.0, 800.0]), np.zeros(2)
    modes, J, c = modes_of(*chain), 2.0, 800.0
    np.testing.assert_allclose(modes.k**2, [0.5 * c / J, 2 * c / J])
    np.testing.assert_allclose(modes.h, [[1, 2], [1, -1]], rtol=1e-14)
    np.testing.assert_allclose(modes.g, [4 * J, J])
    np.testing.assert_allclose(modes.gamma, [3 * c, 6 * c])
    known = np.array([[4 / 3, 8 / 3], [1 / 6, -1 / 6]]) * J / c
    np.testing.assert_allclose(modes.rho, known, rtol=1e-13)


def test_modes_of_any_chain():
    rng = np.random.default_rng(8)
    for _ in range(30):
        m = random_machine(rng, n=int(rng.integers(1, 12)))
        chain = [np.array(m[x]) for x in ("inertia", "stiffness", "damping")]
        I, C, B = matrices(*chain)
        squares, h = eigh(C, I)
        modes = modes_of(*chain)
        np.testing.assert_allclose(modes.k, np.sqrt(squares), rtol=1e-10)
        np.testing.assert_allclose(natural_frequencies(*chain[:2]), modes.k, rtol=1e-12)
        scaled = (h / h[0]).T
        np.testing.assert_allclose(modes.h, scaled, atol=1e-8 * np.abs(scaled).max())
        np.testing.assert_allclose(np.diag(modes.h @ B @ modes.h.T), modes.beta)
        # all modes together give the static error at 1 rad/s2
        static = np.linalg.solve(C, I @ np.ones(len(I)))
        np.testing.assert_allclose(modes.rho.sum(axis=0), static, rtol=1e-10)


def test_slow_modes_beside_fast_ones_keep_their_digits():
    """A soft spring of 1 N m/rad behind one of 1e14."""
    k = natural_frequencies(np.array([1.0, 1.0]), np.array([1e14, 1.0]))
    assert k[0] == pytest.approx(1.0, rel=1e-12)  # the first mass stands still
    assert k[1] == pytest.approx(1e7, rel=1e-12)


def shape(law, s):
    """Integrate f from the independent jerk of a law, omega0 = t0 = 1."""
    return quad(lambda x: jerk(law, x, 1.0, 1.0), 0, s, points=NINTHS[1:-1])[0]


def driven(law, s):
    """F of the pieces of a law, as the equations of motion read them."""
    s = np.asarray(s)
    begins = [0.0, *LAWS[law].knots]
    rows = np.zeros((len(begins), PIECE))
    for i, (row, piece) in enumerate(zip(rows, LAWS[law].pieces, strict=True)):
        row[:3] = i, i + 1, begins[i]
        row[3 : 3 + len(piece)] = piece
        row[7] = LAWS[law].turn
    return acceleration(s, np.searchsorted(begins, s, "right") - 1.0, rows.ravel())


@pytest.mark.parametrize("law", ["polynomial", "trapezoidal", "cycloid"])
def test_the_laws_are_the_integrals_of_their_jerks(law):
    for s in np.linspace(0, 1, 38):
        assert driven(law, s) == pytest.approx(shape(law, s), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_the_laws_reach_the_speed_and_no_greater_acceleration(law):
    f = partial(driven, law)
    assert quad(f, 0, 1, points=NINTHS[1:-1])[0] == pytest.approx(1.0, rel=1e-13)
    s = np.linspace(0, 1, 9 * 2000 + 1)
    assert f(s).max() == pytest.approx(LAWS[law].greatest, rel=1e-8)
    assert f(s).min() >= -1e-15


@pytest.mark.parametrize("law", LAWS)
def test_the_spectra_are_transforms_of_the_laws(law):
    s, weight = np.polynomial.legendre.leggauss(60)
    ends = np.linspace(0, 1, 10)
    points = (ends[:-1, None] + (s + 1) / 18).ravel()
    f = driven(law, points) * np.tile(weight / 18, 9)
    rho = np.array([0.0, 1e-9, 1e-3, 0.3, 1.0, 1.7, 2.0, 5.55, 12.3, 40.0])
    known = [abs((f * np.exp(-2j * np.pi * r * points)).sum()) for r in rho]
    np.testing.assert_allclose(LAWS[law].spectrum(rho), known, atol=1e-13)


def test_the_spectrum_matches_the_paper():
    rho = np.array([0.25, 0.5, 0.75, 1, 1.5, 2.5])
    known = [
        0.900316316157, 0.636619772368, 0.300105438719, 0.0, 0.212206590789,
        0.127323954474,
    ]  # fmt: skip
    np.testing.assert_allclose(LAWS["constant"].spectrum(rho), known, atol=5.1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_the_zeros_are_complete(law):
    rho = np.linspace(0.01, 12.0, 12_000)
    values = LAWS[law].spectrum(rho)
    low, before, behind = values[1:-1], values[:-2], values[2:]
    zero = (low < before) & (low < behind) & (low < 0.01 / rho[1:-1] ** 2)
    dips = rho[1:-1][zero]
    first, distance = LAWS[law].zeros or (99.0, 1.0)
    known = np.arange(first, 11.99, distance)
    np.testing.assert_allclose(dips, known, atol=2e-3)
    assert np.all(LAWS[law].spectrum(known) < 1e-15)


def test_the_residual_of_the_constant_acceleration():
    """2 eps0 |rho| |sin(k t0/2)| of each mode."""
    case = CASES["four masses"]
    chain = (np.array(x) for x in (case.inertia, case.stiffness, case.damping))
    modes, t0 = modes_of(*chain), np.array([0.1, 0.5, 1.3])
    found = left_by_start_up(modes, LAWS["constant"], 10.0, t0)
    for i, t in enumerate(t0):
        known = (
            2 * 10 / t * np.abs(np.sin(modes.k * t / 2))[:, None] * np.abs(modes.rho)
        )
        np.testing.assert_allclose(found[i], known, rtol=1e-11)

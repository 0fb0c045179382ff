"""Frequencies, shapes, frequency response of the rolling block, gearbox and speeds."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import tolstat
from tests.machines import rolling_block_reference as known
from tests.machines.rolling_blocks import FREE, RPM, B, scattered, solved
from tolstat.errors import ModelError
from tolstat.machines.rolling_block import structure as gearbox
from tolstat.machines.rolling_block.channels import (
    Input,
    loads,
    output_of,
    poles_and_zeros,
    transfer,
)
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import (
    antiphase,
    contributions,
    drives,
    mac,
    modes_of,
    nominal,
    tracked,
    unit_shapes,
)
from tolstat.machines.rolling_block.motion import damping_matrix
from tolstat.machines.rolling_block.resonance import (
    forbidden,
    free_gaps,
    free_speeds,
    named_orders,
    speed_margin,
)

SHAFT = Settings()
M12 = output_of("12", SHAFT)


def test_table_1_to_every_printed_digit():
    _, modes = solved()
    hz = modes.omega[0] / (2 * np.pi)
    np.testing.assert_array_equal(np.round(hz, 1), known.TABLE_1_HZ)
    shapes = unit_shapes(modes.phi)[0]
    np.testing.assert_array_equal(np.round(shapes, 3) + 0.0, known.TABLE_1)


def test_nine_decimals_of_the_frequencies_and_six_of_the_shapes():
    _, modes = solved()
    np.testing.assert_allclose(modes.omega[0] / (2 * np.pi), known.HZ, atol=5.1e-10)
    shapes = unit_shapes(modes.phi)[0]
    np.testing.assert_allclose(shapes, known.SHAPES, atol=5.1e-7)


def test_the_scale_moves_no_frequency():
    _, modes = solved()
    drive, scaled = solved(Settings(scale=2.5))
    assert drive.Q.sum() == pytest.approx(2.5 * 680)
    np.testing.assert_allclose(scaled.omega, modes.omega, rtol=1e-12)


def test_the_local_modes_are_swings_of_rolls_against_rolls():
    hz = solved()[1].omega[0] / (2 * np.pi)
    assert hz[2] == pytest.approx(np.sqrt(1e6 / 40) / (2 * np.pi), rel=1e-13)
    assert hz[3] == pytest.approx(np.sqrt(2e6 / 50) / (2 * np.pi), rel=1e-13)


def test_modes_of_scattered_drives_against_scipy():
    drive, modes = scattered(40)
    for Q, C, omega, phi in zip(drive.Q, drive.C, modes.omega, modes.phi, strict=True):
        K = B.T @ np.diag(C) @ B
        squares, _ = scipy.linalg.eigh(K, np.diag(Q))
        np.testing.assert_allclose(omega, np.sqrt(squares[1:]), rtol=1e-11)
        np.testing.assert_allclose(phi.T @ np.diag(Q) @ phi, np.eye(8), atol=1e-12)
        np.testing.assert_allclose(
            K @ phi, np.diag(Q) @ phi * omega**2, atol=1e-9 * abs(K).max()
        )


def test_a_drive_does_not_depend_on_other_drives():
    drive, modes = scattered(211)
    a = contributions(modes, drive.C, {32: 1.0, 33: 1.0})
    H = damping_matrix(modes, drive.C, drive.zeta)
    for rows in (slice(0, 1), slice(7, 8), slice(3, 160), slice(None, None, -1)):
        part = modes_of(drive.Q[rows], drive.C[rows])
        for each, whole in zip(part, modes, strict=True):
            np.testing.assert_array_equal(each, whole[rows])
        of_part = contributions(part, drive.C[rows], {32: 1.0, 33: 1.0})
        np.testing.assert_array_equal(of_part, a[rows])
        np.testing.assert_array_equal(
            damping_matrix(part, drive.C[rows], drive.zeta[rows]), H[rows]
        )


def test_sensitivities_are_shares_of_energy():
    """dlnf/dlnC = C (dphi)^2 / (2 w^2), dlnf/dlnQ = -Q phi^2 / 2; mode 1 as printed."""
    C = [0.134016, 0.144949, 0.027375, 0.054187, 0.010936, 0.010936, 0.058800, 0.058800]
    Q = [-0.223324, -0.003571, -0.001122, -0.015742, -0.017847,
         -0.027336, -0.027336, -0.091860, -0.091860]  # fmt: skip
    step = 1e-5
    deviations = np.zeros((34, 18))
    for column in range(17):
        deviations[2 * column, column] = step
        deviations[2 * column + 1, column] = -step
    drive = drives(deviations, Settings())
    logs = np.log(drive.modes.omega)
    found = (logs[0::2] - logs[1::2]) / (2 * step)
    np.testing.assert_allclose(found[:9, 0], Q, atol=6e-7)
    np.testing.assert_allclose(found[9:, 0], C, atol=6e-7)
    np.testing.assert_allclose(found[:9].sum(axis=0), -0.5, atol=1e-9)
    np.testing.assert_allclose(found[9:].sum(axis=0), 0.5, atol=1e-9)
    nominal_modes = solved()[1]
    shares = nominal(Settings()).C[0, :, None] * nominal_modes.phi_ij[0] ** 2
    np.testing.assert_allclose(
        found[9:], shares / (2 * nominal_modes.omega[0] ** 2), atol=1e-9
    )


def test_stiffer_by_21_per_cent_is_faster_by_10():
    found = tolstat.evaluate(
        "rolling_block", {"stiffness": 0.21}, {"horizon": 0.01, "rtol": 1e-6}
    )
    hz = found.iloc[0][[f"frequency_{r}" for r in range(1, 9)]].to_numpy(float)
    np.testing.assert_allclose(hz, 1.1 * np.array(known.HZ), rtol=1e-10)


def test_modes_are_tracked_where_they_veer():
    """Rolls made lighter until the local mode passes others: likeness tells which."""
    reference = unit_shapes(solved()[1].phi[0])
    deviations = np.zeros((2, 18))
    deviations[1, [7, 8]] = 0.45  # inertias of stands 33 and 34
    drive = drives(deviations, Settings())
    modes = drive.modes
    order, shapes = tracked(modes.phi, reference)
    assert order[0].tolist() == list(range(8))
    np.testing.assert_allclose(shapes[0], reference, atol=1e-12)
    moved = order[1].tolist()
    assert sorted(moved) == list(range(8)) and moved != list(range(8))
    local = moved[2]  # the swing of 33 against 34, now with another number
    assert mac(modes.phi[1:], reference)[0, local, 2] == pytest.approx(1.0, abs=1e-12)
    assert (np.einsum("ir,ir->r", shapes[1], reference) > 0).all()


def test_the_similarity_to_the_reference_of_each_drive():
    """As one by one; nothing is like a shape of which only zeros are known."""
    phi = np.random.default_rng(3).standard_normal((2, 9, 8))
    reference = phi[:, :, ::-1] + 0.1
    reference[1, :, 4] = 0.0
    together = mac(phi, reference)
    for one in range(2):
        np.testing.assert_array_equal(together[one], mac(phi[one], reference[one]))
    assert (together[1, :, 4] == 0).all() and (together[0] > 0).all()


def test_antiphase_as_the_paper_says():
    found = antiphase(solved()[1].phi)[0]
    expected = np.zeros((8, 3), bool)
    expected[1, 1] = expected[5, 1] = True  # 22.7 and 62.8 Hz: 32-33
    expected[2, 2] = expected[3, 0] = True  # 25.2 Hz: 33-34, 31.8 Hz: 31-32
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("stands", known.RESPONSE)
def test_the_frequency_response_as_printed(stands):
    drive, modes = solved()
    a = contributions(modes, drive.C, dict.fromkeys(stands, 1.0))[:, 0]
    np.testing.assert_allclose(a[0], known.CONTRIBUTIONS[stands], atol=5.1e-7)
    assert a.sum() == pytest.approx(len(stands) * 300 / 680, rel=1e-12)
    G = transfer(np.array(known.RESPONSE_HZ), drive, SHAFT, loads(*stands), M12)[0, 0]
    size, phase = np.transpose(known.RESPONSE[stands])
    np.testing.assert_allclose(abs(G), size, atol=5.1e-10)
    np.testing.assert_allclose(np.degrees(np.angle(G)), phase, atol=5.1e-7)
    found = poles_and_zeros(modes.omega[0], a[0])
    np.testing.assert_allclose(found.zeros, known.ZEROS[stands], atol=5.1e-7)
    np.testing.assert_allclose(found.poles, np.delete(known.HZ, [2, 3]), atol=1e-9)
    np.testing.assert_allclose(found.cancelled, known.HZ[2:4], atol=1e-9)


@pytest.mark.parametrize(
    "given", [{1: 1.0}, {31: 1.0}, {34: 0.5, 1: 2.0}, {32: 1, 33: 1}]
)
def test_any_load_any_link_against_the_matrices(given):
    """Scattered drives: solve (K + i w D - w^2 M) phi = L and twist the links."""
    drive, modes = scattered(5)
    hz = np.array([0.5, 19.0, 27.3, 61.0, 140.0])
    H = damping_matrix(modes, drive.C, drive.zeta)
    names = (*known.LINKS, "speed 6")
    source = Input("N m", gearbox.load_vector(given), np.zeros(8))
    answers = [output_of(name, SHAFT) for name in names]
    found = transfer(hz, drive, SHAFT, source, *answers)
    L = np.zeros(9)
    for load, size in given.items():
        L[0 if load == 1 else load - 26] += size if load == 1 else -size
    for trial in range(5):
        K = B.T @ np.diag(drive.C[trial]) @ B
        D = B.T @ H[trial] @ B
        for i, w in enumerate(2 * np.pi * hz):
            phi = np.linalg.solve(K + 1j * w * D - w**2 * np.diag(drive.Q[trial]), L)
            direct = drive.C[trial] * (B @ phi)
            np.testing.assert_allclose(found[trial, :8, i], direct, rtol=1e-8)
            np.testing.assert_allclose(found[trial, 8, i], 1j * w * phi[5], rtol=1e-8)


def test_the_damping_matrix_as_printed():
    drive, modes = solved()
    D = B.T @ damping_matrix(modes, drive.C, drive.zeta)[0] @ B
    assert D[0, 0] == pytest.approx(1159.71456, abs=5.1e-6)
    # computed with 40 digits; the reference prints -445.904242
    assert D[0, 1] == pytest.approx(-445.904246879, abs=5.1e-9)
    assert np.trace(D) == pytest.approx(6029.20197, abs=5.1e-6)
    np.testing.assert_allclose(D.sum(axis=0), 0.0, atol=1e-10)  # the rigid mode: none


def test_zeros_are_where_the_response_vanishes():
    drive, modes = scattered(20)
    for given in ({31: 1.0}, {33: 1.0, 34: 1.0}, {1: 1.0}):
        a = contributions(modes, drive.C, given)
        for trial in range(20):
            for link in (0, 3, 7):
                part = a[trial, link]
                found = poles_and_zeros(modes.omega[trial], part)
                x = (2 * np.pi * found.zeros[:, None] / modes.omega[trial]) ** 2
                terms = part / (1 - x)
                assert (abs(terms.sum(axis=1)) < 1e-6 * abs(terms).max(axis=1)).all()
                # none is missed: SciPy's zeros of the same system, infinite ones aside
                squares = (modes.omega[trial] / (2 * np.pi)) ** 2
                pencil = np.diag([*squares, 0.0])
                pencil[:8, 8], pencil[8, :8] = part * squares, 1.0
                every = scipy.linalg.eigvals(pencil, np.diag([1.0] * 8 + [0.0]))
                real = every[np.isfinite(every)]
                real = real[(abs(real.imag) < 1e-6 * abs(real)) & (real.real > 0)].real
                expected = np.sort(np.sqrt(real[real < 1000.0**2]))
                assert (found.zeros < 1000.0).all()
                np.testing.assert_allclose(found.zeros, expected, rtol=1e-6)


def test_the_link_behind_the_load_has_a_zero_for_each_clamped_frequency():
    """M12 from stand 32: rolls 31 clamped, and stage D with its rolls clamped."""
    drive, modes = scattered(1)
    a = contributions(modes, drive.C, {32: 1.0})[0, 0]
    Q, C = drive.Q[0], drive.C[0]
    K = B.T @ np.diag(C) @ B
    own = [5]  # mass 6
    behind = [4, 7, 8]  # masses 5, 8, 9
    squares = [
        *scipy.linalg.eigvalsh(K[np.ix_(own, own)], np.diag(Q[own])),
        *scipy.linalg.eigvalsh(K[np.ix_(behind, behind)], np.diag(Q[behind])),
    ]
    found = poles_and_zeros(modes.omega[0], a)
    expected = np.sort(np.sqrt(squares)) / (2 * np.pi)
    np.testing.assert_allclose(found.zeros, expected, rtol=1e-7)


def test_manufacturing_lets_the_local_modes_leak():
    found = tolstat.evaluate(
        "rolling_block", {"stiffness_58": [0.0, 0.05], "stiffness_59": [0.0, -0.05]},
        {"horizon": 0.01, "rtol": 1e-6},
    )  # fmt: skip
    drive = drives(np.eye(18)[[15]] * 0.05 - np.eye(18)[[16]] * 0.05, Settings())
    modes = drive.modes
    a = contributions(modes, drive.C, {32: 1.0, 33: 1.0})[0, 0]
    expected = [1.091808663, 0.046250141, 0.029732243, 0, -0.300566342, 0.000269347,
                0.015921509, -0.001062621]  # fmt: skip
    np.testing.assert_allclose(abs(a), np.abs(expected), atol=5.1e-10)
    leaky = found.iloc[1]
    assert leaky["frequency_1"] == pytest.approx(20.116690576, abs=5.1e-10)
    assert leaky["frequency_2"] == pytest.approx(22.682208452, abs=5.1e-10)
    assert leaky["frequency_3"] == pytest.approx(25.203684181, abs=5.1e-10)
    assert leaky["cancellation"] == pytest.approx(0.046250141 / 1.091808663, rel=1e-7)
    assert leaky["leakage"] == pytest.approx(0.029732243 / 1.091808663, rel=1e-7)
    assert found.iloc[0]["cancellation"] == pytest.approx(0.00692, abs=5.1e-6)
    assert found.iloc[0]["leakage"] == pytest.approx(0.0, abs=1e-12)


def test_the_printed_ranges_of_the_gearbox():
    every = [gearbox.ratios(each) for each in gearbox.PAPER.combinations]
    assert len(set(gearbox.PAPER.combinations)) == 128
    assert min(r.i31 for r in every) == pytest.approx(0.1572, abs=5e-13)
    assert max(r.i31 for r in every) == pytest.approx(1.2173, abs=5e-13)
    assert min(r.i34 for r in every) == pytest.approx(0.0778, abs=5e-13)
    assert max(r.i34 for r in every) == pytest.approx(0.5330, abs=5e-13)
    chosen = gearbox.ratios(gearbox.TABLE_1)
    assert chosen.i31 == pytest.approx(0.370882176, abs=5.1e-10)
    assert chosen.i34 == pytest.approx(0.176209991, abs=5.1e-10)


def test_frequencies_and_inertia_over_all_combinations():
    hz, inertia = [], []
    for each in gearbox.PAPER.combinations:
        drive, modes = solved(Settings(combination=each))
        hz.append(modes.omega[0] / (2 * np.pi))
        inertia.append(drive.Q.sum())
    np.testing.assert_allclose(np.min(hz, axis=0), known.LEAST_HZ, atol=5.1e-7)
    np.testing.assert_allclose(np.max(hz, axis=0), known.GREATEST_HZ, atol=5.1e-7)
    np.testing.assert_allclose(np.mean(hz, axis=0), known.MEAN_HZ, atol=5.1e-7)
    by_name = dict(
        zip(gearbox.PAPER.combinations, zip(hz, inertia, strict=True), strict=True)
    )
    np.testing.assert_allclose(by_name[0, 0, 0, 0][0], known.FIRST_HZ, atol=5.1e-7)
    np.testing.assert_allclose(by_name[1, 3, 3, 3][0], known.LAST_HZ, atol=5.1e-7)
    assert by_name[1, 3, 3, 3][1] == min(inertia) == pytest.approx(339.26, abs=5e-3)
    assert by_name[0, 0, 0, 0][1] == max(inertia) == pytest.approx(2196.44, abs=5e-3)


def test_deviations_act_on_reduced_quantities():
    """A ratio reduces what deviates: the same relative deviation afterwards."""
    deviations = np.random.default_rng(1).uniform(-0.1, 0.1, (3, 18))
    settings = Settings(combination=(1, 0, 2, 3))
    then = drives(deviations, Settings())
    now = drives(deviations, settings)
    inertias, stiffnesses = gearbox.reduction(settings.combination)
    np.testing.assert_allclose(now.Q, then.Q * inertias, rtol=1e-14)
    np.testing.assert_allclose(now.C, then.C * stiffnesses, rtol=1e-14)


@pytest.mark.parametrize(("given", "ranges", "total"), FREE)
def test_free_speeds_as_printed(given, ranges, total):
    settings = Settings(**given)
    omega = solved()[1].omega
    orders = list(named_orders(settings).values())
    bounds = forbidden(omega, orders, settings.band)
    begin, end = free_gaps(*bounds, settings.speed_range)
    open_ = (end > begin)[0]
    found = np.stack([begin[0, open_], end[0, open_]], axis=1) / RPM
    np.testing.assert_allclose(found, ranges, atol=5.1e-7)
    width, widest = free_speeds(omega, settings)
    assert width[0] / RPM == pytest.approx(total, abs=5.1e-7)
    assert widest[0] / RPM == pytest.approx(max(b - a for a, b in ranges), abs=1e-6)


@pytest.mark.parametrize("band", [0.01, 0.05, 0.4, 1.5])
def test_free_speeds_against_a_scan(band):
    settings = Settings(
        combination=(1, 2, 0, 3), orders=(1.0, 0.5), rolls=True, band=band,
        meshes=({"teeth": 2, "shaft": "rolls_34"},),
    )  # fmt: skip
    _, modes = scattered(12, settings=settings)
    n = np.linspace(*settings.speed_range, 400_001)
    step = n[1] - n[0]
    ratio = gearbox.ratios(settings.combination)
    orders = [1.0, 0.5, 1 / ratio.i31, 1 / ratio.i34, 2 / ratio.i34]
    total, widest = free_speeds(modes.omega, settings)
    for trial in range(12):
        free = np.ones(len(n), bool)
        margin = np.inf
        for order in orders:
            for w in modes.omega[trial]:
                free &= abs(order * n - w) > band * w
                margin = min(margin, abs(order * settings.working_speed - w) / w)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], free.astype(int), [0]])))
        runs = edges[1::2] - edges[::2]
        assert total[trial] == pytest.approx(free.sum() * step, abs=25 * step)
        longest = runs.max(initial=0) * step
        assert widest[trial] == pytest.approx(longest, abs=3 * step)
        assert speed_margin(modes.omega, settings)[trial] == pytest.approx(margin)


def test_without_a_band_all_speeds_are_free():
    settings = Settings(band=0.0, rolls=True)
    total, _ = free_speeds(solved(settings)[1].omega, settings)
    assert total[0] / RPM == pytest.approx(850.0, rel=1e-12)


def test_the_spread_of_the_frequencies():
    """Means, standard deviations, 5 and 95 % points within the sampling error."""
    trials = 20_000
    _, modes = scattered(trials, seed=11)
    hz = modes.omega / (2 * np.pi)
    sigma = np.array(known.SPREAD_SIGMA)
    mean_error = abs(hz.mean(axis=0) - known.SPREAD_MEAN) / sigma
    assert (mean_error < 4 / np.sqrt(trials)).all()
    assert (abs(hz.std(axis=0) / sigma - 1) < 4 / np.sqrt(2 * trials)).all()
    for q, expected in ((0.05, known.SPREAD_P05), (0.95, known.SPREAD_P95)):
        off = abs(np.quantile(hz, q, axis=0) - expected) / sigma
        assert (off < 4 * 2.11 / np.sqrt(trials)).all()  # normal: 2.11 sigma/sqrt(n)


def test_the_spread_of_cancellation_and_leakage():
    drive, modes = scattered(20_000, seed=5)
    a = abs(contributions(modes, drive.C, {32: 1.0, 33: 1.0})[:, 0])
    cancellation = a[:, 1] / a[:, 0]
    leakage = np.maximum(a[:, 2], a[:, 3]) / a[:, 0]
    assert np.median(cancellation) == pytest.approx(0.0247, rel=0.04)
    assert np.quantile(cancellation, 0.95) == pytest.approx(0.0871, rel=0.04)
    assert np.median(leakage) == pytest.approx(0.0232, rel=0.04)
    assert np.quantile(leakage, 0.95) == pytest.approx(0.0543, rel=0.04)
    nominal_pattern = antiphase(solved()[1].phi)
    kept = np.all(antiphase(modes.phi) == nominal_pattern, axis=(1, 2)).mean()
    assert 0.97 < kept < 0.99


def test_ten_thousand_drives_in_a_second():
    drive, _ = scattered(10_000)
    begun = time.process_time()
    modes_of(drive.Q, drive.C)
    assert time.process_time() - begun < 1.0


def test_the_signs_and_the_length_of_shapes():
    phi = np.array([[3.0, -0.5], [-4.0, -0.5], [0.0, -0.5], [0.0, 0.5]])
    found = unit_shapes(phi)
    np.testing.assert_allclose(found[:, 0], [-0.6, 0.8, 0.0, 0.0])
    np.testing.assert_allclose(found[:, 1], [-0.5, -0.5, -0.5, 0.5])


def test_the_places_of_the_modes():
    """Node of mode 1, its greatest moment; kinetic energies of the three highest."""
    drive, modes = solved()
    phi = modes.phi[0]
    moments = drive.C[0, :, None] * modes.phi_ij[0]
    node = phi[1, 0] / (phi[1, 0] - phi[2, 0])
    assert node == pytest.approx(0.641, abs=5e-4)  # of link 23, from mass 2
    assert moments[1, 0] / moments[0, 0] == pytest.approx(1.040, abs=5e-4)
    assert abs(moments[:, 0]).argmax() == 1
    share = drive.Q[0, :, None] * phi**2
    assert share[[3, 4], 5] == pytest.approx([0.51, 0.39], abs=5e-3)
    assert share[[1, 2], 6] == pytest.approx([0.66, 0.18], abs=5e-3)
    assert share[[1, 2], 7] == pytest.approx([0.27, 0.68], abs=5e-3)


def test_cancellation_of_the_second_mode():
    drive, modes = solved()
    a = [contributions(modes, drive.C, {stand: 1.0})[:, 0] for stand in (32, 33)]
    ratio = -a[1][0, 1] / a[0][0, 1]
    assert ratio == pytest.approx(1.037596, abs=5.1e-7)
    unequal = contributions(modes, drive.C, {32: ratio, 33: 1.0})[0, 0]
    found = poles_and_zeros(modes.omega[0], unequal)
    np.testing.assert_allclose(found.cancelled, np.array(known.HZ)[1:4], atol=1e-9)
    # opposite phases of 32 and 33 in M12: the pairs of Table 1
    opposite = np.flatnonzero(a[0][0] * a[1][0] < -1e-9)
    assert opposite.tolist() == [1, 5]
    # at equal loads a minimum near 22.75 Hz shows with hardly any damping alone
    near = np.linspace(22.6, 22.9, 6001)
    for zeta, seen in ((0.0036, True), (0.0037, False)):
        drive, _ = solved(Settings(damping_ratio=zeta))
        G = abs(transfer(near, drive, SHAFT, loads(32, 33), M12))[0, 0]
        least = (G[1:-1] < G[:-2]) & (G[1:-1] < G[2:])
        assert least.any() == seen


@pytest.mark.parametrize(
    ("length", "amplitudes", "share"),
    [
        (None, [0.382774, 0.214914, 0.165095, 0.000655, 0.008496, 0.000567], 0.0117),
        (10e-3, [0.452568, 0.281521, 0.327050, 0.001206, 0.001069, 0.001114], 0.0021),
        (5e-3, [0.238092, 0.150237, 0.216823, 0.001092, 0.016984, 0.000723], 0.0284),
        (1e-3, [0.048389, 0.030669, 0.047147, 0.000257, 0.005353, 0.000534], 0.0445),
    ],
)
def test_the_modes_left_in_the_shaft_by_a_pulse(length, amplitudes, share):
    """|a_r| 2 |sin(pi f_r T)| of M12 from stand 31, undamped, as printed."""
    drive, modes = solved()
    a = abs(contributions(modes, drive.C, {31: 1.0})[0, 0])
    if length is not None:
        a = a * 2 * abs(np.sin(modes.omega[0] * length / 2))
    np.testing.assert_allclose(np.delete(a, [2, 3]), amplitudes, atol=6e-7)
    assert (a[6] + a[7]) / a.sum() == pytest.approx(share, abs=6e-5)


def test_nearly_equal_orders_all_count():
    close = Settings(orders=(1.0, 1.00000001))
    assert len(named_orders(close)) == 2
    assert list(named_orders(Settings())) == ["order 1"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"combination": (2, 0, 0, 0)}, "stage A has the positions 0 to 1, not 2"),
        ({"combination": (0, 4, 0, 0)}, "stage B has the positions 0 to 3, not 4"),
        ({"combination": (0, 1, 2)}, "3 numbers; 4 are expected"),
        ({"combination": (0, 0, 0.5, 0)}, "a whole number is expected"),
        ({"stiffnesses": (8e6,) * 7}, "7 numbers; 8 are expected"),
        ({"stiffnesses": (8e6,) * 7 + (-1.0,)}, "number 8: it must be above 0"),
        ({"inertias": (1.0,) * 10}, "10 numbers; 9 are expected"),
        ({"delay": (1e-3, 2e-3)}, "one time is expected, or three"),
        ({"delay": 0.5}, "stand 34 enters after 1.5 s, and the horizon is 1 s"),
        ({"pulse_stand": 35}, "it must be at most 34"),
        ({"orders": (0.0,)}, "it must be above 0"),
        ({"response_loads": (32, 35)}, "no load 35; 1 is the motor, 31, 32"),
        ({"response_loads": (32, 32)}, "is given twice"),
        ({"response_link": "13"}, "allowed: 12, 23|did you mean"),
        ({"scale": 0.0}, "it must be above 0"),
    ],
)
def test_wrong_settings(given, words):
    with pytest.raises(ModelError, match=words):
        tolstat.evaluate("rolling_block", None, given)


def test_a_drive_without_stiffness_cannot_exist():
    found = tolstat.evaluate(
        "rolling_block",
        {"stiffness_34": [0.0, -1.0, 0.0, 0.0], "inertia_9": [0.0, 0.0, -1.5, 0.0],
         "damping": [0.0, 0.0, 0.0, -1.1]},
        {"horizon": 0.01, "rtol": 1e-6},
    )  # fmt: skip
    assert found["status"].tolist() == ["done"] + ["cannot exist"] * 3
    assert np.isnan(found["frequency_1"].to_numpy()[1:]).all()


def test_the_pattern_of_an_unsymmetric_drive():
    """The pattern is compared with the nominal drive of these settings."""
    settings = replace(Settings(), inertias=(300, 30, 30, 80, 60, 50, 70, 40, 40))
    given = {"inertias": settings.inertias, "horizon": 0.01, "rtol": 1e-6}
    found = tolstat.evaluate("rolling_block", {"inertia_7": [0.0, -2 / 7]}, given)
    own = antiphase(solved(settings)[1].phi)
    assert found["antiphase_pattern"].iloc[0] == 1.0
    same = (own == antiphase(solved()[1].phi)).all()
    assert found["antiphase_pattern"].iloc[1] == float(same)

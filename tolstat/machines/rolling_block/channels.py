"""Frequency functions of the drive: each input to each output, under any damping.

With elastic twists gamma = B phi - e, where e is the error of a gear mesh in its link,
and gamma = Theta q by the twists of the modes, the paper's equations (1) are

    (s^2 + Theta^T K(s) Theta) q = Phi^T L - s^2 Theta^-1 e,    s = i omega,

with the loads L on the masses. Damping is modal, as in the rest of the model, or by
link, K = C (1 + s tau + i eta): times tau_ij of viscous, factors eta_ij of constant
loss. The rigid mode adds to angles alone.

The paper, "Dynamic analysis": frequency functions at any place, by tension, rolling
force, defects of gears and unbalance. It prints no damping.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block import structure
from tolstat.machines.rolling_block.declarations import LOADS, MOMENT, Settings
from tolstat.machines.rolling_block.modes import Drive, contributions, drives
from tolstat.machines.rolling_block.resonance import named_orders, rolling_speeds
from tolstat.machines.rolling_block.structure import GAPS, LINK_NAMES
from tolstat.model.view import Axis, Chart, Curve, Listing, Picture, Span, bands_of

Complex = NDArray[np.complex128]
_MASSES, _LINKS = np.eye(len(structure.MASSES)), np.eye(len(structure.LINKS))


class Input(NamedTuple):
    """What excites the drive, per unit."""

    unit: str
    moments: Array  # on the masses, float64[mass], N m
    errors: Array  # of the meshes, in the links, float64[link], rad


class Output(NamedTuple):
    """What answers: a sum of angles, of their rates, or of elastic moments."""

    unit: str
    angles: Array  # weights, float64[mass]
    moments: Array  # weights, float64[link]
    rates: bool = False


def stretch(gap: str, settings: Settings) -> Array:
    """Return how the strip in a gap stretches per angle of the masses, m.

    rho_b phi_b - rho_a phi_a with rho_s = d_s/(2 i_s), float64[mass]. A tension of 1 N
    loads the stands by the opposite: it drives a and brakes b.
    """
    rho = dict(zip(structure.STANDS, rolling_speeds(settings), strict=True))
    a, b = map(int, gap.split("-"))
    weights: Array = rho[b] * _MASSES[structure.STANDS[b]]
    weights -= rho[a] * _MASSES[structure.STANDS[a]]
    return weights


def loads(*places: int) -> Input:
    """Return a moment of 1 N m on each place; the motor drives, the rolls brake.

    An unbalanced or eccentric roll is a moment on it that turns with it.
    """
    moments = structure.load_vector(dict.fromkeys(places, 1.0))
    return Input("N m", moments, 0.0 * _LINKS[0])


def input_of(name: str, settings: Settings) -> Input:
    """Return an input by its name: `mesh 23`, `tension 31-32`."""
    kind, _, where = name.partition(" ")
    if kind == "mesh":
        error = _LINKS[structure.LINK_NAMES.index(where)]
        return Input("rad", 0.0 * _MASSES[0], error)
    return Input("N", -stretch(where, settings), 0.0 * _LINKS[0])


def output_of(name: str, settings: Settings) -> Output:
    """Return an output by its name: `12`, a link; `31-32`; `angle 6`, `speed 6`."""
    none = 0.0 * _LINKS[0]
    if name in structure.LINK_NAMES:
        moment = _LINKS[structure.LINK_NAMES.index(name)]
        return Output("N m", 0.0 * _MASSES[0], moment)
    if name in structure.GAPS:
        return Output("m", stretch(name, settings), none)
    kind, _, mass = name.partition(" ")
    rates = kind == "speed"
    return Output("rad/s" if rates else "rad", _MASSES[int(mass) - 1], none, rates)


def transfer(
    frequency: Array, drive: Drive, settings: Settings, source: Input, *seen: Output
) -> Complex:
    """Return outputs per unit of an input, complex128[trial, output, frequency].

    Over the frequency, Hz; an angle of a drive that is not held is infinite at 0 Hz.
    """
    s = 2j * np.pi * frequency
    omega, phi, theta = drive.modes
    # Theta^-1 = diag(1/omega^2) Theta^T C
    still = np.einsum("tlr,tl->tr", theta, drive.C * source.errors) / omega**2
    force = source.moments @ phi
    driven = force[:, :, None] - still[:, :, None] * s**2
    tau, eta = settings.dampings
    if tau is None or eta is None:
        w, zeta = omega[:, :, None], drive.zeta[:, None, None]
        q = driven / (s**2 + 2.0 * zeta * w * s + w * w)
    else:
        lost = s[:, None] * tau + 1j * eta  # [frequency, link]
        q = np.empty(driven.shape, complex)
        for trial, (twist, stiff) in enumerate(zip(theta, drive.C, strict=True)):
            Z = twist.T @ (((1.0 + lost) * stiff)[:, :, None] * twist)
            Z += s[:, None, None] ** 2 * np.eye(len(stiff))
            q[trial] = np.linalg.solve(Z, driven[trial].T[:, :, None])[:, :, 0].T
    outputs = np.empty((len(q), len(seen), len(s)), complex)
    for i, output in enumerate(seen):
        by_angle = output.angles @ phi  # [trial, mode]
        twisted = by_angle + np.einsum("tl,tlr->tr", output.moments * drive.C, theta)
        moved = np.sum(twisted[:, :, None] * q, axis=1)
        moved += np.sum(by_angle * still, axis=1)[:, None]
        rigid = output.angles.sum() * source.moments.sum() / drive.Q.sum(axis=1)
        if rigid.any():
            moved += rigid[:, None] / s**2
        outputs[:, i] = moved * s if output.rates else moved
    return outputs


def poles_of(drive: Drive, settings: Settings) -> tuple[Array, Array]:
    """Return frequency |lambda|/(2 pi), Hz, and damping ratio of each mode, ascending.

    float64[trial, mode]. Times tau_ij of the links count, not factors of loss: these
    have no free vibration. A mode that does not swing has a ratio of 1, and the slower
    of its two roots.
    """
    omega, _, theta = drive.modes
    tau, _ = settings.dampings
    if tau is None:
        return omega / (2 * np.pi), np.broadcast_to(drive.zeta[:, None], omega.shape)
    n = omega.shape[1]
    A = np.zeros((len(omega), 2 * n, 2 * n))
    A[:, :n, n:] = np.eye(n)
    A[:, n:, :n] = -np.eye(n) * (omega * omega)[:, None, :]
    A[:, n:, n:] = -theta.transpose(0, 2, 1) @ ((drive.C * tau)[:, :, None] * theta)
    roots = np.linalg.eigvals(A).astype(complex)
    roots = np.take_along_axis(roots, np.argsort(np.abs(roots), axis=1), axis=1)
    real = roots.imag == 0.0
    slower = np.cumsum(real, axis=1) <= real.sum(axis=1, keepdims=True) / 2
    pole = roots[(roots.imag > 0.0) | (real & slower)].reshape(len(roots), n)
    return np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)


POINTS = 1200
BELOW, BEYOND = 0.2, 1.3  # of the lowest and the highest natural frequency: the axis
NO_PART = 1e-9  # of the contributions of all modes: a smaller one is none


class PolesAndZeros(NamedTuple):
    """Of the undamped response of one drive, Hz."""

    poles: Array  # ascending
    cancelled: Array  # natural frequencies without response in the link
    zeros: Array  # ascending; where the link is at rest


def poles_and_zeros(omega: Array, a: Array) -> PolesAndZeros:
    """Return where an undamped response is infinite, and where it is zero.

    Of omega[mode], rad/s, of one drive, and a[mode], N m, the contributions of its
    modes to the moment of one link. Zeros that no real frequency meets are left out.
    """
    takes_part = np.abs(a) > NO_PART * np.sum(np.abs(a))
    # x = (f/f_ref)^2 and its poles, of the order of 1
    reference = np.exp(np.mean(np.log(omega)))
    poles, part = (omega[takes_part] / reference) ** 2, a[takes_part]
    numerator = np.zeros(1)
    for r, size in enumerate(part):
        others = np.delete(poles, r)
        numerator = np.polyadd(numerator, size * np.poly(others) / np.prod(-others))
    # A moment does not jump in a link that is links away from the load: the sums of
    # a_r x_r, a_r x_r^2, ... vanish, and with each of them the highest power of x
    moment = part
    while len(numerator) > 1:
        moment = moment * poles
        if abs(np.sum(moment)) > NO_PART * np.sum(np.abs(moment)):
            break
        numerator = numerator[1:]
    roots = np.roots(numerator)
    real = np.abs(roots.imag) < 1e-9 * np.abs(roots)
    on_the_axis = np.sort(roots.real[real & (roots.real > 0)])
    f, zeros = omega / (2 * np.pi), np.sqrt(on_the_axis) * reference / (2 * np.pi)
    return PolesAndZeros(f[takes_part], f[~takes_part], zeros)


def _loads(settings: Settings) -> dict[str, tuple[int, ...]]:
    """Return response_loads in words: each by itself, then all of them at once."""
    places = settings.response_loads
    choices = [(load,) for load in places] + ([places] if len(places) > 1 else [])
    words = {1: "motor"}
    return {
        " + ".join(words.get(load, str(load)) for load in those): those
        for those in choices
    }


def frequencies(drive: Drive) -> Array:
    """Return the axis, Hz, with the peaks of the first where they are finite."""
    omega = drive.modes.omega[0] / (2 * np.pi)
    even = np.geomspace(BELOW * omega[0], BEYOND * omega[-1], POINTS)
    return np.unique(np.append(even, omega)) if drive.zeta[0] > 0 else even


def response(deviations: Array, settings: Settings) -> Chart:
    """Return amplitude and phase of the output per unit of the input."""
    drive = drives(deviations, settings)
    frequency = frequencies(drive)
    name, link = settings.response_output, settings.response_link
    answer = output_of(link if name == MOMENT else name, settings)
    title = f"stretch {name}" if name in GAPS else name
    title = f"M{link}" if name == MOMENT else title
    sources = {words: loads(*on) for words, on in _loads(settings).items()}
    denominator = "loads" if len(sources) > 1 or "motor" not in sources else "motor"
    if settings.response_input != LOADS:
        denominator = settings.response_input
        sources = {denominator: input_of(denominator, settings)}
    amplitudes, phases = [], []
    for words, source in sources.items():
        G = transfer(frequency, drive, settings, source, answer)[:, 0]
        size, angle = np.abs(G), np.angle(G[0])
        unit = f"{answer.unit}/{'/'.join(source.unit.split())}"
        unit = "1" if source.unit == answer.unit else unit
        of_one = f"{title} over the {'load' if denominator == 'loads' else denominator}"
        amplitudes.append(Curve(words, unit, "|G|", of_one, size[0], shown=unit))
        phases.append(Curve(f"phase, {words}", "rad", "arg G", "", angle, shown="deg"))
    spreads = bands_of(words, unit, size[1:])  # of the last: all at once
    turns = settings.working_speed / (2 * np.pi)
    works = {
        name: order * turns
        for name, order in named_orders(settings).items()
        if frequency[0] <= order * turns <= frequency[-1]
    }
    words = f"{title} over {denominator}: amplitude"
    return Chart.of(
        Axis("frequency", "Hz", "Hz", logarithmic=True),
        frequency,
        Picture(words, *amplitudes, *spreads, logarithmic=True),
        Picture("Phase", *phases),
        spans=tuple(Span(f, f, f"{w} at the working speed") for w, f in works.items()),
    )


def poles(deviations: Array, settings: Settings) -> Listing:
    """Return poles, zeros and modes that do not reach the link, without damping."""
    drive = drives(deviations[:1], settings)
    omega = drive.modes.omega[0]
    rows: list[tuple[str, str, float, float]] = []
    link = LINK_NAMES.index(settings.response_link)
    for words, those in _loads(settings).items():
        a = contributions(drive.modes, drive.C, dict.fromkeys(those, 1.0))[:, link]
        lines = poles_and_zeros(omega, a[0])
        parts = dict(zip((omega / (2 * np.pi)).tolist(), a[0].tolist(), strict=True))
        of_load = [(f, "pole", parts[f]) for f in lines.poles.tolist()]
        of_load += [(f, "does not reach", 0.0) for f in lines.cancelled.tolist()]
        of_load += [(f, "zero", np.nan) for f in lines.zeros.tolist()]
        rows += [(words, kind, f, part) for f, kind, part in sorted(of_load)]
    load, kind, frequency, part = map(np.array, zip(*rows, strict=True))
    return Listing.of(
        f"where M{settings.response_link} is infinite or zero, or is not reached",
        ("load", "1", "", load),
        ("what", "1", "", kind),
        ("frequency", "Hz", "Hz", frequency),
        ("static part a_r", "1", "1", part),
    )


def damping(deviations: Array, settings: Settings) -> Listing:
    """Return frequency and damping ratio of each mode, modal or by link."""
    drive = drives(deviations[:1], settings)
    frequency, zeta = poles_of(drive, settings)
    undamped = drive.modes.omega[0] / (2 * np.pi)
    return Listing.of(
        "a mode, ascending; loss factors have no free vibration and do not count",
        ("mode", "1", "count", np.arange(1, len(undamped) + 1)),
        ("frequency", "Hz", "Hz", frequency[0]),
        ("damping ratio", "1", "%", zeta[0]),
        ("undamped", "Hz", "Hz", undamped),
    )

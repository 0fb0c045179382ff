"""Random rolling torques, beats of near modes, and pulses that travel with the rod.

The paper: spectra of random loads, advantage 4 of the method; "Modelling":
beats of 3 to 5 Hz, and delays of 3 to 10 ms from stand to stand.
"""

from itertools import combinations

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.rolling_block import channels
from tolstat.machines.rolling_block.declarations import SPECTRUM, Settings
from tolstat.machines.rolling_block.modes import Drive, contributions, drives, moments
from tolstat.machines.rolling_block.resonance import rolling_speeds
from tolstat.machines.rolling_block.structure import LINK_NAMES, STANDS
from tolstat.model.view import Axis, Chart, Curve, Listing, Picture, Span, bands_of

KINDS = "independent", "one torque"  # of the stands
UNDAMPED = 1e-9
DOUBLED = 2.0 ** np.arange(-1, 24)  # half widths of a peak: panels of the integral
NODES = 16  # in each panel
A_PERIOD = 64  # times in the shortest period, for peaks
ZOOMS = 4
POINTS, PERIODS = 2001, 6  # of pulses: the lowest mode's, where the horizon permits
LENGTHS = (1e-3, 5e-3, 10e-3)  # s, the paper's range; and a step, which never ends


def density(frequency: Array, settings: Settings) -> Array:
    """Return the one-sided density of the torque on each stand, (N m)^2/Hz."""
    if settings.torque_spectrum:
        f, S = ([row[key] for row in settings.torque_spectrum] for key in SPECTRUM)
        return np.asarray(np.interp(frequency, f, S, right=0.0))
    corner = settings.torque_corner or np.inf
    return settings.torque_density / (1.0 + (frequency / corner) ** 2)


def spectra(frequency: Array, drive: Drive, settings: Settings) -> tuple[Array, Array]:
    """Return densities of all moments, (N m)^2/Hz, float64[link, frequency].

    Of torques that are independent from stand to stand, and of one torque on all.
    """
    links = [channels.output_of(name, settings) for name in LINK_NAMES]
    G = np.array(
        [
            channels.transfer(frequency, drive, settings, channels.loads(s), *links)[0]
            for s in STANDS
        ]
    )
    S = density(frequency, settings)
    return np.sum(np.abs(G) ** 2, axis=0) * S, np.abs(G.sum(axis=0)) ** 2 * S


def deviations_of(drive: Drive, settings: Settings) -> tuple[Array, Array]:
    """Return the standard deviations of the moments, N m, float64[link], as `spectra`.

    The integral has panels that grow with the distance from each peak. Raises
    ModelError if a mode has no damping: random torques swing it without end.
    """
    (omega, _, theta), (tau, eta) = drive.modes, settings.dampings
    peak, zeta = omega[0] / (2 * np.pi), np.broadcast_to(drive.zeta[0], omega[0].shape)
    if tau is not None and eta is not None:
        shares = drive.C[0][:, None] * (theta[0] / omega[0]) ** 2  # of the energy
        zeta = 0.5 * (omega[0] * (tau @ shares) + eta @ shares)
    if zeta.min() < UNDAMPED:
        raise ModelError("random torques: a mode has no damping; give each link some")
    widths = np.outer(DOUBLED, peak * zeta)
    corners = [row["frequency"] for row in settings.torque_spectrum]
    edges = np.concatenate([(peak - widths).ravel(), (peak + widths).ravel(), [0.0]])
    edges = np.unique(np.append(np.maximum(edges, 0.0), [*corners, *peak]))
    x, weight = np.polynomial.legendre.leggauss(NODES)
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    nodes = (middle[:, None] + half[:, None] * x).ravel()
    share = (half[:, None] * weight).ravel()
    both = spectra(nodes, drive, settings)
    return np.sqrt(both[0] @ share), np.sqrt(both[1] @ share)


def torques(deviations: Array, settings: Settings) -> Chart:
    """Return the density of the moment in response_link under random torques."""
    drive = drives(deviations[:1], settings)
    frequency, link = channels.frequencies(drive), settings.response_link
    curves = [
        Curve(words, "N^2 m^2 s", "S", f"M{link}", S[LINK_NAMES.index(link)])
        for words, S in zip(KINDS, spectra(frequency, drive, settings), strict=True)
    ]
    axis = Axis("frequency", "Hz", "Hz", logarithmic=True)
    return Chart(axis, frequency, tuple(curves))


def rms(deviations: Array, settings: Settings) -> Listing:
    """Return the standard deviation of each moment under random torques."""
    both = deviations_of(drives(deviations[:1], settings), settings)
    return Listing.of(
        "rms of the moment in a link: torques independent, or one on all stands",
        ("link", "1", "", np.array(LINK_NAMES)),
        *((kind, "N m", "N m", sigma) for kind, sigma in zip(KINDS, both, strict=True)),
    )


def beats(deviations: Array, settings: Settings) -> Listing:
    """Return beats of pairs of modes in response_link after a step on pulse_stand."""
    drive = drives(deviations[:1], settings)
    a = contributions(drive.modes, drive.C, {settings.pulse_stand: 1.0})[0]
    size = np.abs(a[LINK_NAMES.index(settings.response_link)])
    f = drive.modes.omega[0] / (2 * np.pi)
    pairs = list(combinations(range(len(f)), 2))
    r, q = np.array(sorted(pairs, key=lambda pair: f[pair[1]] - f[pair[0]])).T
    difference, ends = f[q] - f[r], np.sort([size[r], size[q]], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = ends[0] / ends[1]
        lasting = difference / (np.pi * drive.zeta[0] * (f[r] + f[q]))
    return Listing.of(
        "two modes, nearest first; depth: lesser over greater amplitude",
        ("mode", "1", "count", r + 1),
        ("and mode", "1", "count", q + 1),
        ("beat", "Hz", "Hz", difference),
        ("depth", "1", "%", depth),
        ("beats before 1/e", "1", "1", lasting),
    )


def travelling(drive: Drive, settings: Settings) -> list[tuple[float, Array]]:
    """Return the steps of a pulse that each stand takes as the rod brings it, N m.

    For `modes.moments`: when, and the contributions of 1 N m. Stand s takes it at the
    sum of the delays, or of stand_distance over the speed behind each stand before.
    """
    begins = list(settings.entries)
    if settings.stand_distance is not None:
        speeds = settings.working_speed * rolling_speeds(settings)
        passing = settings.stand_distance / speeds[:-1]
        begins = [0.0, *np.cumsum(passing).tolist()]
    steps = []
    for stand, begin in zip(STANDS, begins, strict=True):
        a = contributions(drive.modes, drive.C, {stand: 1.0})
        steps += [(begin, a), (begin + settings.pulse_length, -a)]
    return steps


def residual(drive: Drive, settings: Settings) -> Array:
    """Return what the pulse leaves of each mode without damping, N m.

    |sum over s of a_s exp(-i omega t_s)| 2 |sin pi f T|, float64[trial, link, mode].
    """
    omega = drive.modes.omega[:, None, :]
    total = sum(a * np.exp(-1j * omega * t) for t, a in travelling(drive, settings))
    return np.asarray(np.abs(total))  # the end of each pulse is among the steps


def peaks(drive: Drive, settings: Settings) -> Array:
    """Return the largest moment of each link of one drive within the horizon, N m."""
    steps = travelling(drive, settings)
    step = 2 * np.pi / drive.modes.omega[0, -1] / A_PERIOD
    time = np.arange(0.0, settings.horizon, step)
    size_scanned = np.abs(moments(time, drive.modes.omega, drive.zeta, steps)[0])
    best = []
    for link, top in enumerate(time[size_scanned.argmax(axis=1)]):
        of_link, width = [(t, a[:, link : link + 1]) for t, a in steps], step
        for _ in range(ZOOMS):
            close = np.linspace(max(top - width, 0.0), top + width, A_PERIOD)
            size = np.abs(moments(close, drive.modes.omega, drive.zeta, of_link)[0, 0])
            top, width = close[size.argmax()], width / (A_PERIOD / 4)
        best.append(size.max())
    return np.array(best)


def travel(deviations: Array, settings: Settings) -> Listing:
    """Return peak moments of a travelling pulse, and what it leaves of each mode."""
    drive = drives(deviations[:1], settings)
    residuals = settings.pulse_moment * residual(drive, settings)[0].round(12)
    top = settings.pulse_moment * peaks(drive, settings)
    modes = ((f"mode {r}", "N m", "N m", M) for r, M in enumerate(residuals.T, 1))
    return Listing.of(
        "a link: its peak, then what the pulse leaves of each mode without damping",
        ("link", "1", "", np.array(LINK_NAMES)),
        ("peak", "N m", "N m", top),
        *modes,
    )


def pulses(deviations: Array, settings: Settings) -> Chart:
    """Return the moment in response_link after the pulse, after others, and a step.

    The last curve is that of the pulse which travels from stand to stand.
    """
    drive = drives(deviations, settings)
    omega, zeta, link_name = drive.modes.omega, drive.zeta, settings.response_link
    length, size = settings.pulse_length, settings.pulse_moment
    end = min(settings.horizon, PERIODS * 2 * np.pi / float(omega[0, 0]))
    time = np.linspace(0.0, end, POINTS)
    row, moment_name = LINK_NAMES.index(link_name), f"M{link_name}"
    link = slice(row, row + 1)
    a = size * contributions(drive.modes, drive.C, {settings.pulse_stand: 1.0})[:, link]
    lengths = {moment_name: length, **{f"{1e3 * t:g} ms": t for t in LENGTHS}}
    after = {name: [(0.0, a[:1]), (t, -a[:1])] for name, t in lengths.items()}
    after["step"] = [(0.0, a[:1])]
    moving = travelling(drive, settings)
    after["travelling"] = [(t, size * part[:1, link]) for t, part in moving]
    curves = [
        Curve(
            name, "N m", moment_name, "a pulse",
            moments(time, omega[:1], zeta[:1], steps)[0, 0], shown="N m",
        )
        for name, steps in after.items()
    ]  # fmt: skip
    steps = [(0.0, a[1:]), (length, -a[1:])]
    opened = bands_of(
        moment_name, "N m", moments(time, omega[1:], zeta[1:], steps)[:, 0]
    )
    title = f"{moment_name}: {1e3 * length:g} ms on stand {settings.pulse_stand}"
    return Chart.of(
        Axis("time", "s", "s"),
        time,
        Picture(title, curves[0], *opened),
        Picture(f"{moment_name} after other pulses", *curves[1:]),
        spans=(Span(0.0, min(length, end), "the pulse"),),
    )

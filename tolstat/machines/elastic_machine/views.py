"""Views of a chain: its histories, spectrum, residual vibration and modes."""

from dataclasses import replace

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.elastic_machine import motion
from tolstat.machines.elastic_machine.declarations import Settings, description_of
from tolstat.machines.elastic_machine.frequency_functions import first_mode, response
from tolstat.machines.elastic_machine.modes import (
    Modes,
    left_by,
    left_by_start_up,
    modes_of,
)
from tolstat.machines.elastic_machine.motion import HEAD, PIECE, Chain
from tolstat.machines.elastic_machine.parameters import (
    build,
    deflected_at_start_up,
    programme_of,
    rows_of,
)
from tolstat.machines.elastic_machine.start_up import LAWS, Law
from tolstat.machines.elastic_machine.trials import Trials, simulated
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Listing,
    Mark,
    Offer,
    Panel,
    Span,
    bands_of,
    peaks_of,
)

MOST_SHOWN = 4  # masses in one picture of a history; all are in the data
MANY = 100  # trials with deviations, for bands
RULE = 5.0, 10.0  # periods of the first mode that the paper recommends
LONGEST = 200.0  # most periods in the start-up that a spectrum shows
LOOKED = 3.0  # periods after the longest start-up
POINTS = 40  # start-ups integrated, beside the closed form


def chart_of(time: Array, trials: Trials, settings: Settings) -> Chart:
    """Return the motion of the first trial; the residual starts after a gap."""
    theta, marks = trials.solution.history[0].T, trials.events.marks[0]
    machine = rows_of(trials.chains, trials.programme, trials.events, settings)[0]
    n = len(settings.inertia)
    ended = float(marks[int(machine[0])])
    first = HEAD + 3 * n
    steps = first + PIECE * int(machine[1])
    chain = Chain(*machine[HEAD:first].reshape(3, n))
    phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
    over = phase >= machine[0]
    static, found = np.empty((n, len(time))), np.empty((3 * n, len(time)))
    motion.static_deflection(phase, machine[steps:], static)
    motion.loads(over, theta, static, chain, found)
    found[n : 2 * n, ~over] = np.nan
    phi0__ = motion.acceleration(time, phase, machine[first:steps])

    responses = description_of(settings, deflected_at_start_up(settings)).responses
    watched = tuple(map(Curve.of, responses, found))
    programmed = Curve(
        "acceleration", "rad/s^2", "phi0''", "of the programmed shaft", phi0__
    )  # fmt: skip
    # of many masses some, from the first to the last
    shown = np.unique(np.linspace(0, n - 1, min(n, MOST_SHOWN)).round().astype(int))
    error, residual, torque = ([watched[i * n + s] for s in shown] for i in range(3))
    panels = (
        Panel.of("Dynamic errors", *error),
        Panel.of("Residual after start-up", *residual),
        Panel.of("Spring torques", *torque),
        Panel.of("Programmed motion", programmed),
    )
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*watched, programmed),
        marks=peaks_of(watched, time, words=""),
        spans=(
            Span(
                0.0, ended, "programmed motion" if settings.braking_time else "start-up"
            ),
        ),
        panels=panels,
    )


def zeros_of(law: Law, longest: float) -> Array:
    """Return the zeros of lambda, up to so many periods in the start-up."""
    if not law.zeros:
        return np.array([])
    first, distance = law.zeros
    return np.arange(first, longest * (1.0 + 1e-9), distance)


def off_zeros(longest: float) -> Array:
    """Return periods in the start-up without zeros, for a logarithmic axis."""
    return 0.005 + 0.01 * np.arange(int(100.0 * longest), dtype=np.float64)


def spectrum(deviations: Array, settings: Settings) -> Chart:
    """Return lambda(rho), rho the periods in the start-up, with the modes on it."""
    chains, n = build(deviations, settings), len(settings.inertia)
    law, printed = settings.law, LAWS["constant"]
    own = modes_of(*chains[:3]).k[0] * chains.t0[0] / (2.0 * np.pi)
    longest = min(max(RULE[1], 1.1 * own[-1]), LONGEST)
    drawn = own[own <= longest]
    beyond = f"; {len(own) - len(drawn)} have more periods" if len(drawn) < n else ""
    rho = off_zeros(longest)
    zeros = zeros_of(law, longest)

    def curve(name: str, words: str, values: Array, at: Array | None = None) -> Curve:
        points = at is not None
        return Curve(name, "1", "lambda", words, values, at, "1", points)

    curves = [
        curve("lambda", f"share of the final speed: {law.sentence}", law.spectrum(rho))
    ]
    if law is not printed:
        values = printed.spectrum(rho)
        curves.append(curve("constant", "the same: constant acceleration", values))
    words = f"of this trial{beyond}"
    curves.append(curve("modes", words, law.spectrum(drawn), drawn))
    if len(zeros):
        curves.append(curve("zeros", "zeros of lambda", 0.0 * zeros, zeros))
    above_zero = [each for each in curves if each.name != "zeros"]
    return Chart(
        Axis("periods in the start-up", "1", "1"),
        rho,
        tuple(curves),
        panels=(
            Panel.of(f"Spectrum: {law.sentence}", *curves),
            Panel.of("", *above_zero, logarithmic=True),
        ),
    )


def residual(deviations: Array, settings: Settings) -> Chart:
    """Return the vibration of the last mass after start-ups of any length.

    In closed form, the sum of the amplitudes of all modes, without damping. Points: the
    residual integrated, with damping. Both without load.
    """
    if settings.final_speed == 0:
        raise ModelError("final_speed = 0: there is no start-up to leave a vibration")
    chains = build(deviations, settings)
    law, omega0 = settings.law, settings.final_speed
    modes = modes_of(chains.J, chains.c, chains.b)
    T_1 = 2.0 * np.pi / modes.k[0, 0]
    t0 = T_1 * off_zeros(RULE[1])

    def left(machine: int, t0: Array) -> Array:
        one = Modes(*(each[machine] for each in modes))
        of_last: Array = left_by_start_up(one, law, omega0, t0)[:, :, -1].sum(axis=1)
        return of_last

    at, integrated = residual_integrated(deviations[0], settings, T_1)
    zeros = T_1 * zeros_of(law, RULE[1])

    def curve(name: str, words: str, values: Array, at: Array | None = None) -> Curve:
        return Curve(name, "rad", "theta", words, values, at, points=at is not None)

    curves = [
        curve("undamped", "modes added up, undamped", left(0, t0)),
        curve("integrated", "with damping", integrated, at),
    ]
    if len(zeros):
        curves.append(curve("zeros of mode 1", "undamped", 0.0 * zeros, zeros))
    marks: tuple[Mark, ...] = ()
    if t0[0] <= (own := chains.t0[0]) <= t0[-1]:
        here = float(left(0, np.array([own]))[0])
        marks = (Mark("undamped", float(own), here, "as set"),)
    others = [left(i, t0) for i in range(1, len(chains.J))]
    bands = bands_of("undamped", "rad", np.array(others))
    of_many = f"{len(others)} machines" if others else ""
    above_zero: list[Curve | Band] = [*curves[:2], *bands]
    return Chart(
        Axis("start-up time", "s"),
        t0,
        tuple(curves),
        bands,
        marks,
        spans=(Span(RULE[0] * T_1, RULE[1] * T_1, "5 to 10 periods of mode 1"),),
        panels=(
            Panel.of(f"Residual {len(settings.inertia)}", *above_zero, *curves[2:]),
            Panel.of(of_many, *above_zero, logarithmic=True),
        ),
    )


def residual_integrated(
    machine: Array, settings: Settings, T_1: float
) -> tuple[Array, Array]:
    """Return start-up times, s, and the residual of the last mass, rad, no load."""
    n = len(settings.inertia)
    t0 = T_1 * np.linspace(0.25, RULE[1], POINTS)
    alone = replace(
        settings, load_torque=(), braking_time=0.0, start_up_time=T_1,
        horizon=(RULE[1] + LOOKED) * T_1,
    )  # fmt: skip
    deviations = np.tile(machine[: 3 * n + 1], (POINTS, 1))
    deviations[:, 3 * n] = t0 - T_1
    return t0, simulated(deviations, alone).solution.peak[:, 2 * n - 1]


def listed(deviations: Array, settings: Settings) -> Listing:
    """Return the modes of a trial."""
    chains = build(deviations, settings)
    modes = modes_of(chains.J[0], chains.c[0], chains.b[0])
    law, n = settings.law, len(modes.k)
    periods = modes.k * chains.t0[0] / (2.0 * np.pi)
    last = modes.rho[:, -1]
    begin, end, f, turn = (each[0] for each in programme_of(chains, settings))
    pieces = np.column_stack([begin, end, f, turn])
    return Listing.of(
        "a mode; damping as if classical; residual at the end of the motion",
        ("mode", "1", "count", np.arange(1.0, n + 1.0)),
        ("frequency", "Hz", "", modes.k / (2.0 * np.pi)),
        ("damping ratio", "1", "", modes.zeta),
        ("periods in the start-up", "1", "1", periods),
        ("lambda", "1", "1", law.spectrum(periods)),
        (f"share of static error {n}", "1", "", last / last.sum()),
        (f"residual {n}", "rad", "", left_by(modes, pieces)[:, -1]),
        *((f"shape {s}", "1", "1", shape) for s, shape in enumerate(modes.h.T, 1)),
    )


OFFERS = (
    Offer("spectrum", "spectrum of the start-up law, with the modes", spectrum),
    Offer(
        "residual",
        "residual vibration after start-ups of any length, without load",
        residual,
        MANY,
    ),
    Offer("response", "frequency functions of the last mass", response),
    Offer("first_mode", "what the first mode alone misses of each mass", first_mode),
    Offer("modes", "natural frequencies, damping and shapes", listed),
)

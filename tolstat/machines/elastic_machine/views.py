"""Views of a chain: its histories, spectrum, residual vibration and modes."""

from dataclasses import replace

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.elastic_machine import motion, parameters
from tolstat.machines.elastic_machine.declarations import Settings, description_of
from tolstat.machines.elastic_machine.frequency_functions import first_mode, response
from tolstat.machines.elastic_machine.modes import (
    Modes,
    left_by,
    left_by_start_up,
    modes_of,
)
from tolstat.machines.elastic_machine.motion import HEAD, PIECE, Chain
from tolstat.machines.elastic_machine.start_up import LAWS, Law
from tolstat.machines.elastic_machine.trials import Trials, simulated
from tolstat.model import view
from tolstat.model.view import Axis, Chart, Curve, Listing, Offer, Picture, Span

MOST_SHOWN = 4  # masses in one picture of a history; all are in the data
MANY = 100  # trials with deviations, for bands
RULE = 5.0, 10.0  # periods of the first mode that the paper recommends
LONGEST = 200.0  # most periods in the start-up that a spectrum shows
LOOKED = 3.0  # periods after the longest start-up
POINTS = 40  # start-ups integrated, beside the closed form


def chart_of(time: Array, trials: Trials, settings: Settings) -> Chart:
    """Return the motion of the first trial; the residual starts after a gap."""
    theta, marks = trials.solution.history[0].T, trials.programme.marks[0]
    machine = parameters.rows_of(trials.chains, trials.programme, settings)[0]
    n = len(settings.inertia)
    end_time = float(marks[int(machine[0])])
    first = HEAD + 3 * n
    steps = first + PIECE * int(machine[1])
    chain = Chain(*machine[HEAD:first].reshape(3, n))
    phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
    ended = phase >= machine[0]
    static, load_values = np.empty((n, len(time))), np.empty((3 * n, len(time)))
    motion.static_deflection(phase, machine[steps:], static)
    motion.loads(ended, theta, static, chain, load_values)
    load_values[n : 2 * n, ~ended] = np.nan
    phi0__ = motion.acceleration(time, phase, machine[first:steps])

    deflected = parameters.deflected_at_start_up(settings)
    responses = description_of(settings, deflected).responses
    watched = tuple(map(Curve.of, responses, load_values))
    programmed = Curve(
        "acceleration", "rad/s^2", "phi0''", "of the programmed shaft", phi0__
    )  # fmt: skip
    # of many masses some, from the first to the last
    selected = np.unique(np.linspace(0, n - 1, min(n, MOST_SHOWN)).round().astype(int))
    error, residual, torque = ([watched[i * n + s] for s in selected] for i in range(3))
    panels = (
        view.Panel.of("Dynamic errors", *error),
        view.Panel.of("Residual after start-up", *residual),
        view.Panel.of("Spring torques", *torque),
        view.Panel.of("Programmed motion", programmed),
    )
    words = "programmed motion" if settings.braking_time else "start-up"
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*watched, programmed),
        marks=view.peaks_of(watched, time, words=""),
        spans=(Span(0.0, end_time, words),),
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
    chains = parameters.build(deviations, settings)
    law, printed = settings.law, LAWS["constant"]
    periods = modes_of(*chains[:3]).k[0] * chains.t0[0] / (2.0 * np.pi)
    longest = min(max(RULE[1], 1.1 * periods[-1]), LONGEST)
    inside = periods[periods <= longest]
    n_beyond = len(periods) - len(inside)
    beyond = f"; {n_beyond} have more periods" if n_beyond else ""
    rho, zeros = off_zeros(longest), zeros_of(law, longest)

    def curve(name: str, words: str, values: Array, x: Array | None = None) -> Curve:
        return Curve(name, "1", "lambda", words, values, x, "1", x is not None)

    share = law.spectrum(rho)
    curves = [curve("lambda", f"share of the final speed: {law.sentence}", share)]
    if law is not printed:
        words = "the same: constant acceleration"
        curves.append(curve("constant", words, printed.spectrum(rho)))
    share = law.spectrum(inside)
    curves.append(curve("modes", f"of this trial{beyond}", share, inside))
    above_zero = tuple(curves)
    if len(zeros):
        curves.append(curve("zeros", "zeros of lambda", 0.0 * zeros, zeros))
    return Chart.of(
        Axis("periods in the start-up", "1", "1"),
        rho,
        Picture(f"Spectrum: {law.sentence}", *curves),
        Picture("", *above_zero, logarithmic=True),
    )


def residual(deviations: Array, settings: Settings) -> Chart:
    """Return the vibration of the last mass after start-ups of any length.

    In closed form, the sum of the amplitudes of all modes, without damping. Points: the
    residual integrated, with damping. Both without load.
    """
    if settings.final_speed == 0:
        raise ModelError("final_speed = 0: there is no start-up to leave a vibration")
    chains = parameters.build(deviations, settings)
    law, omega0 = settings.law, settings.final_speed
    modes = modes_of(chains.J, chains.c, chains.b)
    T_1 = 2.0 * np.pi / modes.k[0, 0]
    t0 = T_1 * off_zeros(RULE[1])

    def amplitude(machine: int, t0: Array) -> Array:
        mode = Modes(*(values[machine] for values in modes))
        return np.asarray(left_by_start_up(mode, law, omega0, t0)[:, :, -1].sum(axis=1))

    def curve(name: str, words: str, values: Array, x: Array | None = None) -> Curve:
        return Curve(name, "rad", "theta", words, values, x, points=x is not None)

    start_ups, integrated = residual_integrated(deviations[0], settings, T_1)
    undamped = curve("undamped", "modes added up, undamped", amplitude(0, t0))
    damped = curve("integrated", "with damping", integrated, start_ups)
    zeros = T_1 * zeros_of(law, RULE[1])
    none = curve("zeros of mode 1", "undamped", 0.0 * zeros, zeros)
    marks: tuple[view.Mark, ...] = ()
    if t0[0] <= (start_up := chains.t0[0]) <= t0[-1]:
        value = float(amplitude(0, np.array([start_up]))[0])
        marks = (view.Mark("undamped", float(start_up), value, "as set"),)
    others = [amplitude(i, t0) for i in range(1, len(chains.J))]
    bands = view.bands_of("undamped", "rad", np.array(others))
    of_many = f"{len(others)} machines" if others else ""
    title = f"Residual {len(settings.inertia)}"
    return Chart.of(
        Axis("start-up time", "s"),
        t0,
        Picture(title, undamped, damped, *bands, *([none] if len(zeros) else [])),
        Picture(of_many, undamped, damped, *bands, logarithmic=True),
        marks=marks,
        spans=(Span(RULE[0] * T_1, RULE[1] * T_1, "5 to 10 periods of mode 1"),),
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
    chains = parameters.build(deviations, settings)
    modes = modes_of(chains.J[0], chains.c[0], chains.b[0])
    law, n = settings.law, len(modes.k)
    periods = modes.k * chains.t0[0] / (2.0 * np.pi)
    last = modes.rho[:, -1]
    programme = parameters.programme_of(chains, settings)
    pieces = np.column_stack([values[0] for values in programme[:4]])
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

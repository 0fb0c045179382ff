"""The ring as a model: deviations of ring, tool and cut in, responses out."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.arrays import Array, Truths
from tolstat.errors import ModelError
from tolstat.machines.ring import declarations, parameters, views
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.flutter import flutter_speed
from tolstat.machines.ring.linear import growth_rate, ring_eigenvalues, static_depth
from tolstat.machines.ring.mechanism import mechanism_of
from tolstat.machines.ring.motion import cutting_forces
from tolstat.machines.ring.parameters import Rings
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description
from tolstat.model.mechanism import Mechanism
from tolstat.model.settings import make
from tolstat.moving import Accuracy, Solution, System, integrate
from tolstat.status import Status

FASTEST = 1e6  # rad/s, of a spectrum
DEPTH, TRAVEL, *ROLLERS = range(4)  # rows with extremes
OUT = 4  # the row timed above zero, where forces have a kink: -t_R
G = 9.81  # m/s2
FRAMES = 240  # of an animation


class Ring(Model):
    """A ring that turns on two supports while a tool module cuts it."""

    name = "ring"
    title = "turning of a ring on two supports: cutting forces, loss of cut, chatter"
    settings = declarations.Settings
    failures = declarations.FAILURES
    views = views.OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Asked) -> Description:
        return declarations.description_of(settings)

    def impossible(self, deviations: Array, settings: Asked) -> dict[str, Truths]:
        return {declarations.IMPOSSIBLE: ~parameters.exist(deviations, settings)}

    def evaluate(self, deviations: Array, settings: Asked) -> Outcome:
        rings = parameters.build(deviations, settings)
        return outcome_of(rings, simulated(rings, settings), settings)

    def history(self, deviations: Array, settings: Asked, step: float) -> History:
        time = sample_times(settings.duration, step)
        rings = parameters.build(deviations[None, :], settings)
        solution = simulated(rings, settings, time)
        chart = views.chart_of(time, rings, solution.history[0], settings)
        return History(chart, outcome_of(rings, solution, settings))

    def mechanism(self, deviations: Array, settings: Asked) -> Mechanism:
        time = np.linspace(0.0, settings.duration, FRAMES)
        rings = parameters.build(deviations[None, :], settings)
        states = simulated(rings, settings, time).history[0]
        chart = views.chart_of(time, rings, states, settings)
        return mechanism_of(chart, states, rings, settings)


class Spectrum(NamedTuple):
    """The ring alone at each speed."""

    eigenvalues: NDArray[np.complex128]  # [speed, 4 (N - 1)], 1/s, as ring_eigenvalues
    frequency: Array  # [speed], omega_1, the lowest |Im|, rad/s; 0 also if overdamped
    growth: Array  # [speed], tau_1, the greatest Re, 1/s


def spectrum(speeds: ArrayLike, settings: Mapping[str, Any] | None = None) -> Spectrum:
    """Return natural frequencies and growth of the nominal ring over its speed.

    Without force and tool. Above 2 sqrt nu, where the lowest frequency is zero, no
    measurement validates it: hoop tension, left out unless `hoop` is set, keeps a real
    ring from it.

    Parameters
    ----------
    speeds : float64[speed]
        rad/s, zero and below too.
    settings : mapping, optional
        Of the ring, SI, by name: radius, thickness, support_angle, ring_damping,
        harmonics, hoop, ...; the others take their defaults.

    Raises
    ------
    ModelError
        If a setting is wrong, or a speed is not a number.

    References
    ----------
    A. I. Polunin (2012), Figs. 3 and 4.
    """
    chosen = make(Ring(), settings)
    Omega = np.atleast_1d(np.asarray(speeds, np.float64))
    if Omega.ndim != 1 or not (np.abs(Omega) <= FASTEST).all():
        raise ModelError(
            f"speeds: numbers in a row are expected, rad/s, at most {FASTEST:g}"
        )
    rings = parameters.nominal(chosen, len(Omega))
    values = ring_eigenvalues(rings, Omega, chosen.hoop)
    return Spectrum(values, np.abs(values.imag).min(axis=1), values.real.max(axis=1))


def simulated(rings: Rings, settings: Asked, samples: Array | None = None) -> Solution:
    """Integrate rings from the engagement on; states at the sample times, s.

    They are a, b, a', b' of harmonics 2 to N, X, X'.
    """
    # only a simulation needs the compiler
    from tolstat.machines.ring.compiled import rates

    machines = parameters.rows_of(rings, settings.hoop)
    scale = parameters.scale_of(settings)
    system = System(rates, scale, n_extremes=4, n_above=1, crossings=(OUT,))
    start = np.zeros((len(machines), len(scale)))
    marks = np.tile([0.0, settings.duration], (len(machines), 1))
    accuracy = Accuracy(settings.rtol, settings.step)
    return integrate(system, start, machines, marks, accuracy, samples=samples)


def outcome_of(rings: Rings, solution: Solution, settings: Asked) -> Outcome:
    """Return the responses in the order of `description_of`, and the failures."""
    least, greatest = solution.least[:, DEPTH], solution.greatest[:, DEPTH]
    rest = static_depth(rings, settings.hoop)
    # each roller bears half the ring, and holds until it would pull with more
    dead_load = rings.pi_chi * G / np.cos(rings.alpha)
    columns = [
        least,
        greatest,
        parameters.depth_of_cut(rings, solution.states[:, -1], settings.duration),
        *((rest, rings.t_R0 - rest) if settings.rests else ()),
        rings.t_R0 - least,
        # a sum of steps may exceed the duration by a rounding
        np.minimum(solution.above[:, 0] / settings.duration, 1.0),
        solution.peak[:, TRAVEL],
        *(ends[:, i] for i in ROLLERS for ends in (solution.least, solution.greatest)),
        solution.greatest[:, ROLLERS].max(axis=1) / dead_load,
        # the forces rise with the depth
        *cutting_forces(greatest, rings),
    ]
    if not settings.hoop:
        root = np.sqrt(rings.nu)
        onset = flutter_speed(rings.alpha, settings.support_angle, settings.harmonics)
        columns += [2.0 * root, onset * root]
    if settings.rests:
        columns.append(growth_rate(rings, rest, settings.hoop))
    no_rest = (solution.status == Status.DONE) & np.isnan(rest) & settings.rests
    responses = np.stack(columns, axis=1)
    failed = {declarations.NO_REST: no_rest}
    return Outcome(responses, solution.status, solution.steps, failed)

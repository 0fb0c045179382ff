"""The stand as a model: deviations of its parts in, responses of its trials out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.stand.carriage import initial_position
from tolstat.machines.stand.declarations import (
    CONTRIBUTORS,
    DESCRIPTION,
    RESPONSES,
    SHARE,
)
from tolstat.machines.stand.history import LOADS, chart_of
from tolstat.machines.stand.motion import Loads, Moment, Powers, State, motion
from tolstat.machines.stand.parameters import Parameters, build
from tolstat.machines.stand.parts import CONDITIONS, faults, parts_of
from tolstat.machines.stand.settings import Settings
from tolstat.model.contract import History, Model, Outcome, closer, sample_times
from tolstat.model.description import Description
from tolstat.moving import Accuracy, Solution, integrate
from tolstat.status import Status

Array = NDArray[np.float64]

# parts so far off that the start-up releases more than the drive puts in
NO_SHARE = "loses too much"

# marks of a trial
START, STEADY, WINDOW, END = range(4)


class Stand(Model):
    """Drive of the carriage of a KhPT-75 cold pilger mill."""

    name = "stand"
    title = "KhPT-75 cold pilger mill: carriage driven by two parallel crank-rod chains"
    settings = Settings
    integrates = True
    failures = (*CONDITIONS, NO_SHARE)
    conditions = CONDITIONS
    assumptions = (
        "Dormand-Prince 5(4), the yaw rate linearly damped in it, with a step of its "
        "own for each machine; rtol bounds the error of each step on each state's "
        "scale, max_step its length.",
        "Parts are rigid, or springs without mass; peak loads are elastic forces.",
        "Friction and the contact with the guides are smooth functions, as in the "
        "paper; the guides touch at one angle.",
        "The rolling force does not depend on the pass; nothing wears or heats up.",
    )

    def describe(self, settings: Settings) -> Description:
        """List contributors and responses; the settings do not change them.

        Parameters
        ----------
        settings : Settings
            Not used.

        Returns
        -------
        Description
            With units, symbols and equation numbers.
        """
        return DESCRIPTION

    def impossible(
        self, deviations: Array, settings: Settings
    ) -> dict[str, NDArray[np.bool_]]:
        """Tell which machines cannot be built.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, in the order of `describe`.
        settings : Settings
            Drive, and where guides are touched.
        """
        by_name = named(deviations)
        return faults(parts_of(by_name, settings), by_name)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        """Simulate one machine for each row of deviations.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, relative ones as fractions, in the order of `describe`.
        settings : Settings
            Variant, drive, speed, window, tolerance.

        Returns
        -------
        Outcome
            The responses, NaN where a trial failed; status and steps.
        """
        p = machines_of(deviations, settings)
        return outcome_of(simulated(p, settings), p, settings)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        """Simulate one machine and tell how it moved.

        Parameters
        ----------
        deviations : float64[contributor]
            SI, in the order of `describe`.
        settings : Settings
            Variant, drive, speed, window, tolerance.
        step : float
            Time between two samples, s.

        Returns
        -------
        History
            Of all of the run, from standstill.
        """
        p = machines_of(deviations[None, :], settings)
        marks = marks_of(settings)
        time = sample_times(float(marks[END]), step)
        solution = simulated(p, settings, time)
        phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
        moved = motion(Moment(time, phase), State(*solution.history[0].T), p)
        window = (float(marks[WINDOW]), float(marks[END]))
        chart = chart_of(time, solution.history[0], moved, window, float(p.delta[0]))
        return History(chart, outcome_of(solution, p, settings))

    def tightened(self, settings: Settings) -> Settings:
        """Return settings whose rtol is a thousand times smaller.

        Parameters
        ----------
        settings : Settings
            Not changed.
        """
        tight: Settings = closer(settings)
        return tight


def machines_of(deviations: Array, settings: Settings) -> Parameters:
    """Build machines from deviations[trial, contributor]."""
    return build(named(deviations), settings)


def named(deviations: Array) -> dict[str, Array]:
    """Return deviations[trial, contributor] by name."""
    return {c.name: deviations[:, i] for i, c in enumerate(CONTRIBUTORS)}


def simulated(
    p: Parameters, settings: Settings, samples: Array | None = None
) -> Solution:
    """Integrate machines over the whole run, with their states at the sample times."""
    # only a machine that is simulated needs the compiler
    from tolstat.machines.stand.compiled import SYSTEM

    return integrate(
        SYSTEM,
        start_of(p, settings),
        np.stack(p, axis=1),
        np.tile(marks_of(settings), (len(p.m), 1)),
        Accuracy(settings.rtol, settings.max_step),
        watch_from=WINDOW,
        samples=samples,
    )


def outcome_of(solution: Solution, p: Parameters, settings: Settings) -> Outcome:
    """Arrange the responses as `describe` lists them."""
    with np.errstate(invalid="ignore"):
        responses = responses_of(solution, p, settings)
    table = np.stack([responses[r.name] for r in RESPONSES], axis=1)
    failed = solution.status != Status.DONE
    shares = np.stack([responses[r.name] for r in RESPONSES if r.range == SHARE])
    return Outcome(
        np.where(failed[:, None], np.nan, table),
        solution.status,
        solution.steps,
        {NO_SHARE: ~failed & ((shares < 0) | (shares > 1)).any(axis=0)},
    )


def marks_of(settings: Settings) -> Array:
    """Return start, end of start-up, start and end of the window, s."""
    turn = 2 * np.pi / settings.crank_speed
    window = settings.start_up + settings.settle * turn
    return np.array([0.0, settings.start_up, window, window + settings.cycles * turn])


def start_of(p: Parameters, settings: Settings) -> Array:
    """Return float64[trial, state]: leftmost position, at rest, (10), (11)."""
    phi, x, sin_alpha = initial_position(p.l1, p.l2, p.r_1, p.r_2)
    still = np.zeros_like(phi)
    with np.errstate(invalid="ignore"):
        yaw = still if settings.variant == "equalized" else np.arcsin(sin_alpha)
    start = State(
        phi31=phi, phi32=phi, x=x, alpha=yaw,
        phi31_=still, phi32_=still, x_=still, alpha_=still,
    )  # fmt: skip
    return np.stack(start, axis=1)


def responses_of(
    solution: Solution, p: Parameters, settings: Settings
) -> dict[str, Array]:
    """Turn what the integrator found into the responses, by name, SI."""
    marks = marks_of(settings)

    def stored(mark: int) -> Array:
        moment = Moment(np.full(len(p.m), marks[mark]), np.full(len(p.m), float(mark)))
        return motion(moment, State(*solution.states[:, mark].T), p).stored

    run = Powers(*solution.quadratures[:, END].T)
    energy = Powers(*(solution.quadratures[:, END] - solution.quadratures[:, WINDOW]).T)
    greatest, least = Loads(*solution.greatest.T), Loads(*solution.least.T)
    peak = Loads(*np.maximum(solution.greatest, -solution.least).T)
    lost = sum(energy[1:])
    residual = energy.drive - (stored(END) - stored(WINDOW)) - lost
    # a time that is summed step by step may pass the window by some ulps
    jammed = np.minimum(solution.above[:, 0] / (marks[END] - marks[WINDOW]), 1.0)
    return {
        "extra_loss": energy.guide / energy.drive,
        "extra_loss_run": run.guide / run.drive,
        **{f"{name}_energy": getattr(energy, name) for name in Powers._fields},
        "energy_residual": residual / energy.drive,
        **{name: getattr(peak, load) for name, load in LOADS.items()},
        "rod_tension_1": np.maximum(greatest.rod_1, 0.0),
        "rod_tension_2": np.maximum(greatest.rod_2, 0.0),
        "rod_compression_1": np.maximum(-least.rod_1, 0.0),
        "rod_compression_2": np.maximum(-least.rod_2, 0.0),
        "jam_share": jammed,
    }

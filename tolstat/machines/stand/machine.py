"""The stand as a model: deviations of its parts in, responses of its trials out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.integrator.integrate import Accuracy, integrate
from tolstat.integrator.trials import Found
from tolstat.machines.description import Description, Outcome
from tolstat.machines.stand import parameters
from tolstat.machines.stand.declarations import CONTRIBUTORS, DESCRIPTION, RESPONSES
from tolstat.machines.stand.motion import Loads, Moment, Powers, State, motion
from tolstat.machines.stand.settings import Settings
from tolstat.status import Status

Array = NDArray[np.float64]

# marks of a trial
START, STEADY, WINDOW, END = range(4)


class Stand:
    """Drive of the carriage of a KhPT-75 cold pilger mill."""

    name = "stand"
    title = "KhPT-75 cold pilger mill: carriage driven by two parallel crank-rod chains"
    settings = Settings

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
        # only a machine that is simulated needs the compiler
        from tolstat.machines.stand.compiled import SYSTEM

        by_name = {c.name: deviations[:, i] for i, c in enumerate(CONTRIBUTORS)}
        p = parameters.build(by_name, settings)
        found = integrate(
            SYSTEM,
            start_of(p, settings),
            np.stack(p, axis=1),
            np.tile(marks_of(settings), (len(deviations), 1)),
            Accuracy(settings.rtol, settings.max_step),
            watch_from=WINDOW,
        )
        with np.errstate(invalid="ignore"):
            responses = responses_of(found, p, settings)
        table = np.stack([responses[r.name] for r in RESPONSES], axis=1)
        failed = found.status != Status.DONE
        return Outcome(
            np.where(failed[:, None], np.nan, table), found.status, found.steps
        )


def marks_of(settings: Settings) -> Array:
    """Return start, end of start-up, start and end of the window, s."""
    turn = 2 * np.pi / settings.crank_speed
    window = settings.start_up + settings.settle * turn
    return np.array([0.0, settings.start_up, window, window + settings.cycles * turn])


def start_of(p: parameters.Parameters, settings: Settings) -> Array:
    """Return float64[trial, state]: leftmost position, at rest, (10), (11)."""
    phi, x, sin_alpha = parameters.initial_position(p.l1, p.l2, p.r_1, p.r_2)
    still = np.zeros_like(phi)
    with np.errstate(invalid="ignore"):
        yaw = still if settings.variant == "equalized" else np.arcsin(sin_alpha)
    return np.stack(State(phi, phi, x, yaw, still, still, still, still), axis=1)


def responses_of(
    found: Found, p: parameters.Parameters, settings: Settings
) -> dict[str, Array]:
    """Turn what the integrator found into the responses, by name, SI."""
    marks = marks_of(settings)

    def stored(mark: int) -> Array:
        moment = Moment(np.full(len(p.m), marks[mark]), np.full(len(p.m), float(mark)))
        return motion(moment, State(*found.states[:, mark].T), p).stored

    run = Powers(*found.quadratures[:, END].T)
    energy = Powers(*(found.quadratures[:, END] - found.quadratures[:, WINDOW]).T)
    greatest, least = Loads(*found.greatest.T), Loads(*found.least.T)
    peak = Loads(*np.maximum(found.greatest, -found.least).T)
    lost = sum(energy[1:])
    residual = energy.drive - (stored(END) - stored(WINDOW)) - lost
    return {
        "extra_loss": energy.guide / energy.drive,
        "extra_loss_run": run.guide / run.drive,
        **{f"{name}_energy": getattr(energy, name) for name in Powers._fields},
        "energy_residual": residual / energy.drive,
        "rod_force_1": peak.rod_1,
        "rod_force_2": peak.rod_2,
        "rod_tension_1": np.maximum(greatest.rod_1, 0.0),
        "rod_tension_2": np.maximum(greatest.rod_2, 0.0),
        "rod_compression_1": np.maximum(-least.rod_1, 0.0),
        "rod_compression_2": np.maximum(-least.rod_2, 0.0),
        "shaft_9_moment": peak.shaft_9,
        "shaft_12_moment": peak.shaft_12,
        "mesh_force_0": peak.mesh_0,
        "mesh_force_1": peak.mesh_1,
        "mesh_force_2": peak.mesh_2,
        "drive_moment": peak.drive_moment,
        "yaw": peak.yaw,
        "jam_share": found.above[:, 0] / (marks[END] - marks[WINDOW]),
    }

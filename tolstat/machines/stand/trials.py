"""Trials: stands integrated over the whole run, and their responses."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import RESPONSES, Settings
from tolstat.machines.stand.motion import Loads, Powers, State, motion
from tolstat.machines.stand.parameters import Parameters, initial_position
from tolstat.model.contract import Outcome
from tolstat.model.description import SHARE
from tolstat.moving import Accuracy, Moment, Solution, integrate
from tolstat.status import Status

# marks of a trial
START, STEADY, WINDOW, END = range(4)

# parts deviate so much that the start-up releases more energy than the drive gives
NO_SHARE = "loses too much"


def simulated(
    p: Parameters, settings: Settings, samples: Array | None = None
) -> Solution:
    """Integrate trials over the whole run, with their states at the sample times."""
    # only a simulation needs the compiler
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
    """Return the responses in the order of `describe`."""
    with np.errstate(invalid="ignore"):
        responses = responses_of(solution, p, settings)
    table = np.stack([responses[r.name] for r in RESPONSES], axis=1)
    shares = table[:, [r.range == SHARE for r in RESPONSES]]
    too_much = ((shares < 0) | (shares > 1)).any(axis=1)
    done = solution.status == Status.DONE
    return Outcome(table, solution.status, solution.steps, {NO_SHARE: done & too_much})


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
    """Return the responses by name, SI, from a solution."""
    marks = marks_of(settings)

    def stored(mark: int) -> Array:
        moment = Moment(np.full(len(p.m), marks[mark]), np.full(len(p.m), float(mark)))
        return motion(moment, State(*solution.states[:, mark].T), p).stored

    run = Powers(*solution.quadratures[:, END].T)
    energy = Powers(*(solution.quadratures[:, END] - solution.quadratures[:, WINDOW]).T)
    greatest, least = Loads(*solution.greatest.T), Loads(*solution.least.T)
    lost = sum(energy[1:])
    residual = energy.drive - (stored(END) - stored(WINDOW)) - lost
    # a time that is summed step by step may exceed the window by some ulps
    jammed = np.minimum(solution.above[:, 0] / (marks[END] - marks[WINDOW]), 1.0)
    return {
        "extra_loss": energy.guide / energy.drive,
        "extra_loss_run": run.guide / run.drive,
        **{f"{name}_energy": values for name, values in energy._asdict().items()},
        "energy_residual": residual / energy.drive,
        **Loads(*solution.peak.T)._asdict(),
        "rod_tension_1": np.maximum(greatest.rod_force_1, 0.0),
        "rod_tension_2": np.maximum(greatest.rod_force_2, 0.0),
        "rod_compression_1": np.maximum(-least.rod_force_1, 0.0),
        "rod_compression_2": np.maximum(-least.rod_force_2, 0.0),
        "jam_share": jammed,
    }

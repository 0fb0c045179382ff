"""The rolling block as a model: deviations of its parts in, responses out."""

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block import declarations, modes, motion
from tolstat.machines.rolling_block.channels import NO_PART
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Drive
from tolstat.machines.rolling_block.resonance import free_speeds, speed_margin
from tolstat.machines.rolling_block.structure import LINK_NAMES, STATIC_SHARES
from tolstat.machines.rolling_block.views import OFFERS, chart_of
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description
from tolstat.moving import Solution
from tolstat.status import Status


class RollingBlock(Model):
    """Torsional drive of a reducing-sizing block with a switched gearbox."""

    name = "rolling_block"
    title = "drive of a wire-rod rolling block: nine masses, gearbox of 128 ratios"
    settings = Settings
    failures = declarations.FAILURES
    views = OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Settings) -> Description:
        return declarations.DESCRIPTION

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        return {declarations.CANNOT_EXIST: ~modes.exist(deviations)}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        drive = modes.drives(deviations, settings)
        return outcome_of(drive, *motion.both(drive, settings), settings)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        drive = modes.drives(deviations[None, :], settings)
        time = sample_times(settings.horizon, step)
        loaded, pulsed = motion.both(drive, settings, time)
        chart = chart_of(time, drive, loaded, pulsed, settings)
        return History(chart, outcome_of(drive, loaded, pulsed, settings))


def modal_answers(drive: Drive, settings: Settings) -> dict[str, Array]:
    """Return what follows from frequencies and shapes, by name."""
    omega, phi, _ = drive.modes
    a = modes.contributions(drive.modes, drive.C, {32: 1.0, 33: 1.0})[:, 0]
    main = np.abs(a[:, 0])
    local = np.maximum(np.abs(a[:, 2]), np.abs(a[:, 3]))
    pattern = modes.antiphase(modes.nominal(settings).modes.phi)
    total, widest = free_speeds(omega, settings)
    frequencies = omega.T / (2 * np.pi)
    return {
        **{f"frequency_{r}": f for r, f in enumerate(frequencies, start=1)},
        "cancellation": np.abs(a[:, 1]) / main,
        "leakage": np.where(local > NO_PART * main, local, 0.0) / main,
        "antiphase_pattern": 1.0 * np.all(modes.antiphase(phi) == pattern, axis=(1, 2)),
        "free_speed_range": total,
        "widest_free_range": widest,
        "speed_margin": speed_margin(omega, settings),
    }


def outcome_of(
    drive: Drive, loaded: Solution, pulsed: Solution, settings: Settings
) -> Outcome:
    """Return the responses in the order of `describe`.

    Of drives followed while the loads of the stands step, and after a pulse.
    """
    answers = modal_answers(drive, settings)
    for ij, share, peak, after in zip(
        LINK_NAMES, STATIC_SHARES, loaded.peak.T, pulsed.peak.T, strict=True
    ):
        answers[f"amplification_{ij}"] = peak / share
        answers[f"moment_peak_{ij}"] = peak * settings.total_load
        answers[f"pulse_peak_{ij}"] = after * settings.pulse_moment
    table = np.stack(
        [answers[response.name] for response in declarations.RESPONSES], axis=1
    )
    status = np.where(loaded.status == Status.DONE, pulsed.status, loaded.status)
    return Outcome(table, status, loaded.steps + pulsed.steps)

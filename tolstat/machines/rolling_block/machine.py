"""The rolling block as a model: deviations of its parts in, responses out."""

from collections.abc import Mapping
from dataclasses import replace

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block import declarations, parameters, trials
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.views import OFFERS, chart_of
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


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

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return {declarations.CANNOT_EXIST: ~parameters.exist(deviations)}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        drive = parameters.drives(deviations, settings)
        loaded = trials.followed(drive, trials.load_steps(settings), settings)
        pulsed = trials.followed(drive, trials.pulse(settings), settings)
        return trials.outcome_of(drive, loaded, pulsed, settings)

    def tightened(self, settings: Settings) -> Settings | None:
        """Return settings of the second method, which shares no step with the first."""
        tight: Settings | None = super().tightened(settings)
        return tight and replace(tight, runge_kutta=True)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        drive = parameters.drives(deviations[None, :], settings)
        time = sample_times(settings.horizon, step)
        loaded = trials.followed(drive, trials.load_steps(settings), settings, time)
        pulsed = trials.followed(drive, trials.pulse(settings), settings, time)
        n = drive.C.shape[1]
        chart = chart_of(
            time,
            settings.total_load * drive.C * loaded.history[0, :, :n],
            settings.pulse_moment * drive.C * pulsed.history[0, :, :n],
            settings,
        )
        return History(chart, trials.outcome_of(drive, loaded, pulsed, settings))

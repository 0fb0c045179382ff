"""The rolling block as a model: deviations of its parts in, responses out."""

from collections.abc import Mapping
from dataclasses import replace

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block import parameters, trials
from tolstat.machines.rolling_block.declarations import DESCRIPTION, Settings
from tolstat.machines.rolling_block.views import OFFERS, chart_of
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


class RollingBlock(Model):
    """Torsional drive of a reducing-sizing block with a switched gearbox."""

    name = "rolling_block"
    title = "drive of a wire-rod rolling block: nine masses, gearbox of 128 ratios"
    settings = Settings
    failures = parameters.FAILURES
    views = OFFERS
    assumptions = (
        "Nine masses on eight springs without mass, reduced to the motor shaft; upper "
        "and lower rolls of a stand are one mass, the rod between stands has no "
        "stiffness, as in the paper.",
        "Inertias and stiffnesses are identified from the paper's Table 1, which does "
        "not determine their common scale.",
        "Every elastic mode has the same damping ratio; the paper prints none.",
        "The gearbox is the least one that meets the printed ranges of ratios and the "
        "printed number of combinations; teeth and stage ratios are not printed.",
        "Amplification is the greatest elastic moment over the static one from the "
        "first load to the horizon, the loads stepping, a quarter on each stand.",
        "The motion is linear between two steps of the load and solved exactly. Audits "
        "use a second method, Dormand-Prince 5(4), as does runge_kutta = true.",
    )

    def describe(self, settings: Settings) -> Description:
        return DESCRIPTION

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return {parameters.CANNOT_EXIST: ~parameters.exist(deviations)}

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

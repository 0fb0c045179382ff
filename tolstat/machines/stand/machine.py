"""The stand as a model: deviations of its parts in, responses of its trials out."""

from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.stand import declarations, trials
from tolstat.machines.stand.declarations import Settings
from tolstat.machines.stand.parameters import build, faults
from tolstat.machines.stand.statics import loads, loops, self_stress
from tolstat.machines.stand.views import OFFERS, chart_of
from tolstat.model.contract import History, Model, Outcome, Spreads, sample_times
from tolstat.model.description import Description, StudyNumber


class Stand(Model):
    """Drive of the carriage of a KhPT-75 cold pilger mill."""

    name = "stand"
    title = "KhPT-75 cold pilger mill: carriage driven by two parallel crank-rod chains"
    settings = Settings
    failures = declarations.FAILURES
    views = OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Settings) -> Description:
        return declarations.description_of(settings)

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return faults(deviations, settings)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        p = build(deviations, settings)
        return trials.outcome_of(trials.simulated(p, settings), p, settings)

    def numbers(
        self, settings: Settings, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        numbers: list[StudyNumber] = []
        if settings.l <= settings.r + settings.h:  # cannot be mounted
            return ()
        for touched, guides in ((False, "free"), (True, "touched")):
            stand = loops(settings, np.pi / 2, touched=touched)
            words = f"degree of static indeterminacy, guides {guides}"
            degree = len(self_stress(stand))
            numbers.append(StudyNumber(f"degree_{guides}", "1", degree, words, "count"))
        for name, dN in loads(stand).items():
            load = float(dN[stand.members.index("rod_1")])
            if load and name in spreads and not name.endswith("_2"):
                per, shown_per = ("rad", "mrad") if "angle" in name else ("m", "mm")
                words = "in rod 1, guides touched, crank at 90 deg"
                number = (f"load_{name}", f"N/{per}", load, words, f"kN/{shown_per}")
                numbers.append(StudyNumber(*number))
        return tuple(numbers)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        p = build(deviations[None, :], settings)
        marks = trials.marks_of(settings)
        time = sample_times(float(marks[declarations.END]), step)
        solution = trials.simulated(p, settings, time)
        phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
        moved = trials.moved(time, phase, solution.history[0], p)
        window = (float(marks[declarations.WINDOW]), float(marks[declarations.END]))
        chart = chart_of(time, solution.history[0], moved, window, float(p.delta[0]))
        return History(chart, trials.outcome_of(solution, p, settings))

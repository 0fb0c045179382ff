"""A model whose parts have means anywhere within ranges, at their worst.

Two cases of each response: with all means where they make it least, and where they make
it largest. Parts scatter about these means as the study says.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.spread import Spread
from tolstat.model.checked import described, simulate
from tolstat.model.contract import History, Model, Spreads, TrialResults
from tolstat.model.description import StudyNumber
from tolstat.model.in_cases import Condition, ModelInCases, answers_of
from tolstat.model.view import Offer
from tolstat.status import Status

Ranges = Mapping[str, tuple[float, float]]  # of means, SI, by contributor
WORDS = "means at their worst"
SIDES = Condition("least", WORDS, {}), Condition("largest", WORDS, {})


class AtWorstMeans(ModelInCases):
    """A model at the worst means of its parts, on both sides of each response."""

    def __init__(self, base: Model, shifts: Array) -> None:
        super().__init__(base, SIDES)
        self.shifts = shifts  # float64[side, response, contributor], SI

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is made again in another process."""
        return AtWorstMeans, (self.base, self.shifts)

    def numbers(
        self, settings: Any, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        """Return the numbers of each response at its worst means."""
        contributors, responses = described(self.base, settings)
        numbers = list[StudyNumber]()
        for condition, shifts in zip(self.conditions, self.shifts, strict=True):
            for response, shift in zip(responses, shifts, strict=True):
                ends = zip(contributors, shift.tolist(), strict=True)
                moved = _moved(spreads, {part.name: (x, x, x, 0.0) for part, x in ends})
                numbers += [
                    number._replace(
                        name=condition.of(number.name), of=condition.of(number.of)
                    )
                    for number in self.base.numbers(
                        settings, moved, independent=independent
                    )
                    if number.of == response.name
                ]
        return tuple(numbers)

    def warnings(self, settings: Any, spreads: Spreads) -> tuple[str, ...]:
        """Return the warnings of the model, of what parts reach at any mean."""
        contributors, _ = described(self.base, settings)
        shifts = np.concatenate(self.shifts)
        lower, upper = shifts.min(axis=0).tolist(), shifts.max(axis=0).tolist()
        ends = zip(contributors, lower, upper, strict=True)
        wide = _moved(
            spreads, {part.name: (low, up, 0.0, 0.0) for part, low, up in ends}
        )
        return self.base.warnings(settings, wide)

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return the history of a trial at the means of its study."""
        chart = self.base.history(deviations, settings, step).chart
        return History(chart, self.evaluate(deviations[None, :], settings))

    @property
    def views(self) -> tuple[Offer, ...]:  # type: ignore[override]
        """The views of its model, at the means of its study."""
        return tuple(self.base.views)

    def _builds(self, deviations: Array, settings: Any) -> Iterator[tuple[Array, Any]]:
        """Yield deviations at each of the means."""
        for shift in np.unique(np.concatenate(self.shifts), axis=0):
            yield deviations + shift, settings

    def _answers(self, deviations: Array, settings: Any) -> Iterator[TrialResults]:
        """Yield the answers of both sides; each response at means of its own."""
        for shifts in self.shifts:
            of_trial: TrialResults | None = None
            distinct, which = np.unique(shifts, axis=0, return_inverse=True)
            for number, shift in enumerate(distinct):
                answers = answers_of(self.base, deviations + shift, settings)
                if of_trial is None:
                    of_trial = answers
                    continue
                mine = which.ravel() == number
                responses = np.where(mine, answers.responses, of_trial.responses)
                done = of_trial.status == Status.DONE
                status = np.where(done, answers.status, of_trial.status)
                steps = of_trial.steps
                if steps is not None and answers.steps is not None:
                    steps = steps + answers.steps
                output = {**answers.output, **of_trial.output}
                of_trial = TrialResults(responses, status, steps, output)
            assert of_trial is not None  # there is a response
            yield of_trial


def _moved(spreads: Spreads, shifts: Mapping[str, tuple[float, ...]]) -> Spreads:
    """Return spreads to which shifts of their numbers are added, by contributor."""
    return {
        name: Spread._make(np.add(spread, shifts[name]).tolist())
        for name, spread in spreads.items()
    }


def at_worst_means(
    model: Model, settings: Any, ranges: Ranges, middle: Mapping[str, float]
) -> AtWorstMeans:
    """Return a model at the worst means of its parts.

    Parameters
    ----------
    model : Model
        With means as its study has them.
    settings : object
        Of the model.
    ranges : mapping of str to tuple of float
        How far each mean may move, SI.
    middle : mapping of str to float
        Deviations in the middle of those of the study, SI: about them one mean after
        another moves, to find the end that makes a response least or largest. Exact
        where the response rises or falls with each part.
    """
    contributors, responses = described(model, settings)
    names = [contributor.name for contributor in contributors]
    start = np.array([middle.get(name, 0.0) for name in names])
    places = [names.index(name) for name in ranges]
    rows = np.tile(start, (1 + 2 * len(places), 1))
    ends = np.array([*ranges.values()])
    for number, place in enumerate(places):
        rows[1 + 2 * number : 3 + 2 * number, place] += ends[number]
    values = simulate(model, rows, settings).responses
    # [part, (not moved, lower end, upper end), response]
    moved = values[1:].reshape(len(places), 2, len(responses))
    still = np.broadcast_to(values[0], (len(places), 1, len(responses)))
    effects = np.concatenate([still, moved], axis=1)
    choices = np.concatenate([np.zeros((len(places), 1)), ends], axis=1)
    shifts = np.zeros((2, len(responses), len(names)))
    for side, sign in enumerate((1.0, -1.0)):
        aims = np.where(np.isfinite(effects), sign * effects, np.inf)
        best = aims.argmin(axis=1)  # [part, response]
        shifts[side][:, places] = np.take_along_axis(choices, best, axis=1).T
    return AtWorstMeans(model, shifts)

"""A model in cases is a model: the same units, judged in several conditions.

Contributors are those of the model. Each response exists once in each case, as
`play_at_cold`; a trial is done if it is done in all cases.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.names import IN_CASE
from tolstat.model.checked import complete, described, impossible
from tolstat.model.contract import History, Model, Outcome, Spreads, TrialResults
from tolstat.model.description import Description, StudyNumber
from tolstat.model.mechanism import Mechanism
from tolstat.model.view import Chart, Offer, View
from tolstat.model.wrapped import Wrapped
from tolstat.status import Status, words_of


class Condition(NamedTuple):
    """A case: its name, and the settings that it changes."""

    name: str
    words: str  # the changes, as they are written
    # by setting, SI; of a table by name, such as links, only the rows that change
    changes: Mapping[str, Any]

    def of(self, name: str) -> str:
        """Return the name of a response, a number or a view in this case."""
        return f"{name}{IN_CASE}{self.name}"

    def settings(self, settings: Any) -> Any:
        """Return settings as they are in this case."""
        changes = {}
        for name, value in self.changes.items():
            before = getattr(settings, name)
            if isinstance(value, Mapping):
                rows = {key: {**before[key], **row} for key, row in value.items()}
                value = {**before, **rows}
            changes[name] = value
        return replace(settings, **changes)


class ModelInCases(Wrapped):
    """A model whose trials are evaluated once in each case."""

    def __init__(self, base: Model, conditions: tuple[Condition, ...]) -> None:
        super().__init__(base)
        self.conditions = conditions
        # of the settings that were last asked for, as a case may take long to settle
        self._settled: tuple[Any, tuple[Any, ...]] = None, ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is made again in another process."""
        return ModelInCases, (self.base, self.conditions)

    def describe(self, settings: Any) -> Description:
        """Return the contributors, and each response in each case."""
        contributors, responses = described(self.base, settings)
        return Description(
            contributors,
            tuple(
                replace(
                    response,
                    name=condition.of(response.name),
                    sentence=", ".join(filter(None, words)),
                )
                for response in responses
                for condition in self.conditions
                for words in [(response.sentence, condition.words)]
            ),
        )

    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the responses of all cases; a trial ends as it first fails."""
        answers = [*self._answers(deviations, settings)]
        status = answers[0].status
        for answer in answers[1:]:
            status = np.where(status == Status.DONE, answer.status, status)
        steps = [answer.steps for answer in answers if answer.steps is not None]
        responses = np.stack([answer.responses for answer in answers], axis=2)
        return Outcome(
            responses.reshape(len(deviations), -1),
            status,
            np.sum(steps, axis=0) if steps else None,
            output=dict(
                item for answer in reversed(answers) for item in answer.output.items()
            ),
        )

    def impossible(self, deviations: Array, settings: Any) -> Mapping[str, Truths]:
        """Return which trials cannot be built in one of the cases."""
        status = np.zeros(len(deviations), np.int64)
        for trials, case in self._builds(deviations, settings):
            other = impossible(self.base, trials, case)
            status = np.where(status == 0, other, status)
        codes = words_of(self.failures)
        return {codes[code]: status == code for code in np.unique(status[status > 0])}

    def numbers(
        self, settings: Any, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        """Return the numbers of each case."""
        return tuple(
            number._replace(
                name=condition.of(number.name), of=number.of and condition.of(number.of)
            )
            for condition, case in self._cases(settings)
            for number in self.base.numbers(case, spreads, independent=independent)
        )

    def warnings(self, settings: Any, spreads: Spreads) -> tuple[str, ...]:
        """Return the warnings of all cases, with its name where not all have one."""
        by_case = {
            condition.name: self.base.warnings(case, spreads)
            for condition, case in self._cases(settings)
        }
        first, *others = by_case.values()
        common = [words for words in first if all(words in rest for rest in others)]
        return (
            *common,
            *(
                f"Case {name}: {words}"
                for name, warnings in by_case.items()
                for words in warnings
                if words not in common
            ),
        )

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return the histories of all cases in one chart, over the first one's axis."""
        charts = [
            _renamed(self.base.history(deviations, case, step).chart, condition)
            for condition, case in self._cases(settings)
        ]
        first = charts[0]
        chart = replace(
            first,
            curves=tuple(
                curve
                if curve.at is None and np.array_equal(chart.at, first.at)
                else curve._replace(at=chart.at if curve.at is None else curve.at)
                for chart in charts
                for curve in chart.curves
            ),
            marks=tuple(mark for chart in charts for mark in chart.marks),
            regions=tuple(region for chart in charts for region in chart.regions),
            panels=tuple(panel for chart in charts for panel in chart.panels),
            bands=(),  # they have no axis of their own
        )
        return History(chart, self.evaluate(deviations[None, :], settings))

    def mechanism(self, deviations: Array, settings: Any) -> Mechanism:
        """Return the mechanism of a trial in the first case, which it names."""
        condition, case = next(self._cases(settings))
        mechanism = self.base.mechanism(deviations, case)
        words = f"Case {condition.name}: {condition.words}."
        return replace(mechanism, sentence=f"{words} {mechanism.sentence}".rstrip())

    @property
    def views(self) -> tuple[Offer, ...]:  # type: ignore[override]
        """The views of its model, in each case."""
        return tuple(
            offer._replace(
                name=condition.of(offer.name),
                sentence=f"{offer.sentence}, {condition.words}",
                function=partial(_view, offer, condition),
            )
            for offer in self.base.views
            for condition in self.conditions
        )

    def _builds(self, deviations: Array, settings: Any) -> Iterator[tuple[Array, Any]]:
        """Yield deviations and settings with which trials have to be possible."""
        for _, case in self._cases(settings):
            yield deviations, case

    def _answers(self, deviations: Array, settings: Any) -> Iterator[TrialResults]:
        """Yield the answers of each case."""
        for _, case in self._cases(settings):
            yield answers_of(self.base, deviations, case)

    def _cases(self, settings: Any) -> Iterator[tuple[Condition, Any]]:
        """Yield each case with its settings."""
        before, cases = self._settled
        if before is not settings:
            cases = tuple(case.settings(settings) for case in self.conditions)
            self._settled = settings, cases
        yield from zip(self.conditions, cases, strict=True)


def answers_of(model: Model, deviations: Array, settings: Any) -> TrialResults:
    """Return the answers of trials that can be built; see `complete`."""
    outcome = model.evaluate(deviations, settings)
    return complete(model, outcome, len(deviations), settings)


def _view(offer: Offer, condition: Condition, deviations: Array, settings: Any) -> View:
    """Return a view of a model in a case."""
    return offer.function(deviations, condition.settings(settings))


def _renamed(chart: Chart, condition: Condition) -> Chart:
    """Return a chart with the names of a case."""
    names = condition.of
    return replace(
        chart,
        curves=tuple(c._replace(name=names(c.name)) for c in chart.curves),
        marks=tuple(mark._replace(curve=names(mark.curve)) for mark in chart.marks),
        regions=tuple(area._replace(name=names(area.name)) for area in chart.regions),
        panels=tuple(
            panel._replace(
                title=f"{panel.title}, {condition.words}".removeprefix(", "),
                names=tuple(
                    names(name)
                    for name in panel.names
                    if name not in {band.name for band in chart.bands}
                ),
                right=tuple(map(names, panel.right)),
            )
            for panel in chart.panels
        ),
    )

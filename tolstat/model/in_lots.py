"""A model of parts in lots: means of lots deviate, and parts about them.

The mean of a lot is a contributor, NAME_lot. All parts of NAME in one unit are of one
lot, units are of many lots.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.arrays import Array, Truths
from tolstat.deviations.names import LOT, expand
from tolstat.deviations.spread import Spread
from tolstat.errors import ModelError
from tolstat.model.checked import described
from tolstat.model.contract import History, Model, Outcome, Spreads
from tolstat.model.description import Description, StudyNumber
from tolstat.model.view import Offer, View
from tolstat.model.wrapped import Wrapped

if TYPE_CHECKING:
    from tolstat.model.mechanism import Mechanism  # seldom needed


class Lot(NamedTuple):
    """The lot of some parts."""

    name: str
    parts: tuple[str, ...]


class ModelInLots(Wrapped):
    """A model whose parts come from lots."""

    def __init__(self, base: Model, lots: tuple[Lot, ...]) -> None:
        super().__init__(base)
        self.lots = lots

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is made again in another process."""
        return ModelInLots, (self.base, self.lots)

    def describe(self, settings: Any) -> Description:
        """Return contributors, lots behind them, and responses."""
        contributors, responses = described(self.base, settings)
        parts = {part.name: part for part in contributors}
        lots = []
        for lot in self.lots:
            words = f"mean of the lot of {', '.join(lot.parts)}"
            mean = replace(parts[lot.parts[0]], name=lot.name, sentence=words)
            lots.append(replace(mean, symbol="", size=None, gear=None, part=""))
        return Description((*contributors, *lots), responses)

    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the outcome of parts about the means of their lots."""
        return self.base.evaluate(self._parts(deviations, settings), settings)

    def impossible(self, deviations: Array, settings: Any) -> Mapping[str, Truths]:
        """Return which trials cannot be built."""
        return self.base.impossible(self._parts(deviations, settings), settings)

    def numbers(
        self, settings: Any, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        """Return the numbers of the model, of parts of all lots."""
        return self.base.numbers(
            settings, self._spreads(spreads), independent=independent
        )

    def warnings(self, settings: Any, spreads: Spreads) -> tuple[str, ...]:
        """Return the warnings of the model, of parts of all lots."""
        return self.base.warnings(settings, self._spreads(spreads))

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return the history of a trial."""
        parts = self._parts(deviations[None, :], settings)[0]
        return self.base.history(parts, settings, step)

    def mechanism(self, deviations: Array, settings: Any) -> "Mechanism":
        """Return the mechanism of a trial."""
        parts = self._parts(deviations[None, :], settings)[0]
        return self.base.mechanism(parts, settings)

    @property
    def views(self) -> tuple[Offer, ...]:  # type: ignore[override]
        """The views of its model."""

        def seen(offer: Offer) -> Offer:
            def view(deviations: Array, settings: Any) -> View:
                return offer.function(self._parts(deviations, settings), settings)

            return offer._replace(function=view)

        return tuple(map(seen, self.base.views))

    def _parts(self, deviations: Array, settings: Any) -> Array:
        """Return the deviations of parts, float64[trial, contributor], SI."""
        names = [part.name for part in described(self.base, settings).contributors]
        parts = deviations[:, : len(names)].copy()
        for lot, mean in zip(self.lots, deviations[:, len(names) :].T, strict=True):
            for name in lot.parts:
                parts[:, names.index(name)] += mean
        return parts

    def _spreads(self, spreads: Spreads) -> Spreads:
        """Return the spreads of parts of all lots together."""
        lots = {lot.name for lot in self.lots}
        together = {name: s for name, s in spreads.items() if name not in lots}
        for lot in self.lots:
            if (mean := spreads.get(lot.name)) is None:
                continue
            for name in lot.parts:
                part = together.get(name, Spread(0.0, 0.0, 0.0, 0.0))
                together[name] = Spread(
                    part.lower + mean.lower,
                    part.upper + mean.upper,
                    part.mean + mean.mean,
                    hypot(part.sigma, mean.sigma),
                )
        return together


def in_lots(entries: Iterable[str], model: Model, settings: Any) -> Model:
    """Return a model with the lots that entries of a study name, if any.

    An entry NAME_lot is one if NAME is a contributor, or several without their number,
    and the model has no contributor NAME_lot.
    """
    names = [part.name for part in described(model, settings).contributors]
    lots = list[Lot]()
    for entry in entries:
        if not entry.endswith(LOT) or entry in names:
            continue
        try:
            parts = expand(entry.removesuffix(LOT), names)
        except ModelError:
            continue  # refused where deviations are read
        lots.append(Lot(entry, tuple(parts)))
    return ModelInLots(model, tuple(lots)) if lots else model

"""The contract: what a model must say and may say."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import Spread
from tolstat.errors import ModelError
from tolstat.lanes.digest import Place, digest
from tolstat.model.description import Description, StudyNumber
from tolstat.model.view import Chart, Offer, View

MOST_SAMPLES = 2_000_000  # of a history
TIGHTER, LEAST_RTOL = 1000.0, 1e-12  # of an audit: below, rounding decides
NOTHING_FAILED: Mapping[str, Truths] = {}


class Outcome(NamedTuple):
    """What a block of trials yields.

    Attributes
    ----------
    responses : float64[trial, response]
        SI; whatever in failed trials.
    status : int64[trial] or None
        As the integrator found it, values of `tolstat.status.Status`; None where
        nothing is integrated: then trials whose responses are finite are done.
    steps : int64[trial] or None
        Integration steps; None where nothing is integrated.
    failed : mapping of str to bool[trial]
        Trials without an answer, by a word of `Model.failures`.
    """

    responses: Array
    status: NDArray[np.int64] | None = None
    steps: NDArray[np.int64] | None = None
    failed: Mapping[str, Truths] = NOTHING_FAILED


class Answers(NamedTuple):
    """A checked outcome.

    Attributes
    ----------
    responses : float64[trial, response]
        SI; NaN in failed trials.
    status : int64[trial]
        How each ended: one of `tolstat.status.words_of`.
    steps : int64[trial] or None
        None where nothing is integrated, 0 where steps are not counted.
    """

    responses: Array
    status: NDArray[np.int64]
    steps: NDArray[np.int64] | None

    @classmethod
    def joined(cls, answers: Sequence[Answers]) -> Answers:
        """Put answers one after the other."""
        steps = [each.steps for each in answers if each.steps is not None]
        return cls(
            np.concatenate([each.responses for each in answers]),
            np.concatenate([each.status for each in answers]),
            np.concatenate(steps) if steps else None,
        )


class History(NamedTuple):
    """How one trial moved, and what it answered.

    Attributes
    ----------
    chart : Chart
        Curves over time; NaN after a failure. Marks are peaks to within a sample, the
        span the time over which responses are taken.
    outcome : Outcome
        The same trial's responses, bit for bit as `evaluate` finds them.
    """

    chart: Chart
    outcome: Outcome


@dataclass(frozen=True)
class NoSettings:
    """Settings of a model that has none."""


class Model(ABC):
    """A model: what deviates, what is answered, what can be shown.

    A custom model inherits from this class and has a name, `describe` and `evaluate`;
    the rest is optional. One that integrates has a setting `rtol`, its tolerance: steps
    are stored, and some trials are audited with a thousandth of it.

    Attributes
    ----------
    name, title : str
        How it is called in study files, and in words.
    settings : type
        A frozen dataclass whose fields are declared with `tolstat.setting`.
    assumptions : tuple of str
        Sentences on what its answers rest on, for reports.
    failures : mapping of str to str
        Why a trial may have no answer, beside the integrator's reasons: a word for the
        status, and the sentence that has to hold.
    views : tuple of Offer
        What it can show; a model with a `history` also has a view of that name.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    settings: ClassVar[type] = NoSettings
    assumptions: ClassVar[tuple[str, ...]] = ()
    failures: ClassVar[Mapping[str, str]] = {}
    views: ClassVar[tuple[Offer, ...]] = ()

    @abstractmethod
    def describe(self, settings: Any) -> Description:
        """List contributors and responses, which may depend on the settings."""

    @abstractmethod
    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Answer one trial for each row of deviations[trial, contributor], SI."""

    def impossible(self, deviations: Array, settings: Any) -> Mapping[str, Truths]:
        """Tell which trials of deviations[trial, contributor] cannot be built, SI.

        They are not evaluated: a trial ends with the first word that holds for it.

        Returns
        -------
        mapping of str to bool[trial]
            By a word of `failures`.
        """
        return NOTHING_FAILED

    def tightened(self, settings: Any) -> Any | None:
        """Return settings that integrate more precisely, for audits; None without."""
        if not self.integrates:
            return None
        return replace(settings, rtol=max(settings.rtol / TIGHTER, LEAST_RTOL))

    def numbers(
        self, settings: Any, spreads: Mapping[str, Spread], *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        """Return numbers of the study, shown beside those of its trials.

        Parameters
        ----------
        settings : object
            Of all trials.
        spreads : mapping of str to Spread
            Tolerance, mean and sigma by contributor that deviates, SI.
        independent : bool
            Whether these deviate independently of each other.
        """
        return ()

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Tell how the trial of deviations[contributor] moved, seen every `step` s.

        Raises
        ------
        ModelError
            If it does not move.
        """
        raise ModelError(f"model '{self.name}' does not move: it has no histories")

    def view(self, name: str, deviations: Array, settings: Any) -> View:
        """Show one of `views`.

        Parameters
        ----------
        name : str
            Of the view.
        deviations : float64[trial, contributor]
            SI: the unit that is shown, then as many others as its offer wants.
        settings : object
            Of all of them.
        """
        raise ModelError(f"model '{self.name}' has no views")

    @property
    def source_digest(self) -> str:
        """Digest of the code that decides the bits of its trials."""
        roots = [Place(Path(__file__).with_name("checked.py"), "simulate")]
        for kind in type(self).__mro__:
            if kind is Model:
                break
            with suppress(TypeError):  # typed in, not in a file
                if found := inspect.getsourcefile(kind):
                    name, _, _ = kind.__qualname__.partition(".")
                    roots.append(Place(Path(found), name))
        return digest(*roots, f"statuses: {[*self.failures]}")

    @property
    def moves(self) -> bool:
        """Whether it has histories."""
        return type(self).history is not Model.history

    @property
    def integrates(self) -> bool:
        """Whether it has an integration tolerance, the setting `rtol`."""
        return "rtol" in getattr(self.settings, "__dataclass_fields__", {})


def sample_times(horizon: float, step: float) -> Array:
    """Return the times at which a history is seen, for `Model.history`.

    Parameters
    ----------
    horizon : float
        How long it is, s.
    step : float
        About how far apart two of them are, s.

    Raises
    ------
    ModelError
        If there are more than anybody looks at.
    """
    if not horizon / step <= MOST_SAMPLES:
        raise ModelError(
            f"a history of {horizon:g} s, seen every {step:g} s, has more than "
            f"{MOST_SAMPLES} points; give a longer step"
        )
    return np.linspace(0.0, horizon, 1 + round(horizon / step))

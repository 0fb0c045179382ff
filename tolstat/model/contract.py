"""The contract: the required and the optional parts of a model, and a guard around it.

In the guard, failures of a model's own code name the model, and harm no other.
"""

from __future__ import annotations

import inspect
import os
import sys
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from threading import current_thread, main_thread
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.errors import ModelError, TolstatError, told
from tolstat.integrator.problem import Accuracy
from tolstat.lanes.digest import digest
from tolstat.model.description import Description, StudyNumber
from tolstat.model.view import Chart, Offer

if TYPE_CHECKING:
    from tolstat.deviations.spread import Spread  # it imports SciPy
    from tolstat.model.mechanism import Mechanism  # seldom needed

STEP = 1e-4  # s, between two points of a history
MOST_SAMPLES = 2_000_000  # of a history
Spreads = Mapping[str, "Spread"]  # by contributor that deviates
NOTHING_FAILED: Mapping[str, Truths] = {}
NO_OUTPUT: Mapping[int, str] = {}


class Outcome(NamedTuple):
    """What a block of trials yields."""

    responses: Array  # [trial, response], SI; any value in failed trials
    # [trial], `tolstat.status.Status`, as the integrator found it; None where nothing
    # is integrated: then trials whose responses are finite are done
    status: NDArray[np.int64] | None = None
    steps: NDArray[np.int64] | None = None  # [trial], of integration, if any
    failed: Mapping[str, Truths] = NOTHING_FAILED  # by a word of `Model.failures`
    # by row, of failed trials: what they printed last, or why they failed
    output: Mapping[int, str] = NO_OUTPUT


class TrialResults(NamedTuple):
    """A checked outcome."""

    responses: Array  # [trial, response], SI; NaN in failed trials
    status: NDArray[np.int64]  # [trial], one of `tolstat.status.words_of`
    steps: NDArray[np.int64] | None  # [trial]; None where nothing is integrated
    output: Mapping[int, str] = NO_OUTPUT  # by row: see `Outcome`

    @classmethod
    def joined(cls, answers: Sequence[TrialResults]) -> TrialResults:
        """Put answers one after the other."""
        steps = [answer.steps for answer in answers if answer.steps is not None]
        firsts = accumulate((len(answer.status) for answer in answers), initial=0)
        return cls(
            np.concatenate([answer.responses for answer in answers]),
            np.concatenate([answer.status for answer in answers]),
            np.concatenate(steps) if steps else None,
            {
                first + row: text
                for first, answer in zip(firsts, answers, strict=False)
                for row, text in answer.output.items()
            },
        )

    def first(self, trials: int) -> TrialResults:
        """Return the answers of the first trials."""
        return TrialResults(
            self.responses[:trials],
            self.status[:trials],
            None if self.steps is None else self.steps[:trials],
            {row: text for row, text in self.output.items() if row < trials},
        )


class History(NamedTuple):
    """The motion of one trial, and its outcome."""

    # curves over time; NaN after a failure. Marks are peaks to within a sample; the
    # span is the time over which responses are taken
    chart: Chart
    outcome: Outcome  # of the same trial, bit for bit as `evaluate` finds it


class OtherProcesses(Protocol):
    """The part of a model that is evaluated in other processes."""

    longest: float  # s, that a trial may last; 0 while that is not known
    stopping: Callable[[], bool]  # once true, trials that have not ended are left

    def learn(self, seconds: float) -> None:
        """Note how long a trial took, if it is not known how long it may last."""

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns there; ModelError if its process ends."""


@dataclass(frozen=True)
class NoSettings:
    """Settings of a model that has none."""


class Model(ABC):
    """A model: contributors, responses, and views.

    A custom model inherits from this class and has a name, `describe` and `evaluate`;
    the rest is optional. One that integrates has a setting `rtol`, its tolerance: steps
    are stored, and some trials are audited with a thousandth of it. An audit also takes
    a quarter of a setting `max_step`, the longest step in s, at most, and sets
    `runge_kutta`, the setting of a second method, which shares no step with the first.
    """

    name: ClassVar[str]  # how it is called in study files
    title: ClassVar[str] = ""
    settings: ClassVar[type] = NoSettings  # a frozen dataclass of `tolstat.setting`
    assumptions: ClassVar[tuple[str, ...]] = ()  # one sentence each
    # why a trial may have no answer, beside the integrator's reasons: a word for the
    # status, and the sentence that has to hold
    failures: ClassVar[Mapping[str, str]] = {}
    views: ClassVar[tuple[Offer, ...]] = ()  # and "history", if it moves
    # whether it is evaluated in processes of its own, so that a crash, a hang or a leak
    # costs its trial alone; and whether they evaluate one row at a time: so the trial
    # is known at once, else blocks are split until it is
    isolated: ClassVar[bool] = False
    row_by_row: ClassVar[bool] = False
    # whether a run is refused whose nominal trial fails for a reason of `failures`
    needs_nominal: ClassVar[bool] = False

    @abstractmethod
    def describe(self, settings: Any) -> Description:
        """Return contributors and responses, which may depend on the settings."""

    @abstractmethod
    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the outcome of the trials of deviations[trial, contributor], SI."""

    def impossible(self, deviations: Array, settings: Any) -> Mapping[str, Truths]:
        """Return which trials of deviations[trial, contributor], SI, cannot be built.

        They are passed to neither `evaluate` nor `history` nor views. A trial ends with
        the first word that is true for it.

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
        longest: Any = getattr(settings, "max_step", None)
        limited = isinstance(longest, float)
        finer = Accuracy(settings.rtol, longest if limited else np.inf).tightened()
        changes: dict[str, Any] = {"rtol": finer.rtol}
        if limited:
            changes["max_step"] = finer.max_step
        if all(getattr(settings, name) == value for name, value in changes.items()):
            return None
        if hasattr(settings, "runge_kutta"):
            changes["runge_kutta"] = True
        return replace(settings, **changes)

    def numbers(
        self, settings: Any, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        """Return numbers of the study, shown beside those of its trials.

        `spreads` are tolerance, mean and sigma, SI, by contributor that deviates;
        `independent` tells whether these deviate independently of each other.
        """
        return ()

    def warnings(self, settings: Any, spreads: Spreads) -> tuple[str, ...]:
        """Return warnings that stand before the verdicts of a study, a sentence each.

        `spreads` are those of `numbers`, but from end to end of what parts reach:
        practically none is beyond.
        """
        return ()

    def preload(self) -> None:  # noqa: B027
        """Import and compile what `evaluate` needs, where trials are isolated.

        It is called once, in the process from which worker processes are forked: one
        that follows a crash has all of it at once.
        """

    def notes(self) -> tuple[str, ...]:
        """Return what its trials have shown of it, a sentence each, for the run."""
        return ()

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return the history of deviations[contributor], SI, one point every `step` s.

        Raises
        ------
        ModelError
            If it does not move.
        """
        raise self.fault("it does not move and has no histories")

    def mechanism(self, deviations: Array, settings: Any) -> Mechanism:
        """Return points and lines of deviations[contributor], SI, for an animation.

        Raises
        ------
        ModelError
            If it has none.
        """
        raise self.fault("it has no points and lines to animate")

    @property
    def source_digest(self) -> str:
        """The digest of the code that decides the bits of its trials."""
        roots = [Path(__file__).with_name("checked.py")]
        for kind in type(self).__mro__:
            if kind is Model:
                break
            with suppress(TypeError):  # typed in, not in a file
                if file := inspect.getsourcefile(kind):
                    roots.append(Path(file))
        return digest(*roots, f"statuses: {[*self.failures]}")

    def fault(self, problem: str) -> ModelError:
        """Return an error that names the model, and the fault."""
        return ModelError(f"model '{self.name}': {problem}")

    @property
    def unwrapped(self) -> Model:
        """The model itself, without the cases and lots of a study."""
        return self

    @property
    def isolation(self) -> OtherProcesses | None:
        """The part of it that is evaluated in other processes, if there is one."""
        return None

    def called(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function of it returns, called where it is evaluated."""
        if part := self.isolation:
            return part.call(function, self, *arguments)
        return function(self, *arguments)

    @property
    def audits_steps(self) -> bool:
        """Whether an audit shortens its longest step, or takes another method."""
        overridden = type(self).tightened is not Model.tightened
        fields = getattr(self.settings, "__dataclass_fields__", {})
        return overridden or "max_step" in fields or "runge_kutta" in fields

    @property
    def moves(self) -> bool:
        """Whether it has histories."""
        return type(self).history is not Model.history

    @property
    def animates(self) -> bool:
        """Whether it has a mechanism to animate."""
        return type(self).mechanism is not Model.mechanism

    @property
    def integrates(self) -> bool:
        """Whether tolstat's integrator solves it, with the setting `rtol`."""
        return "rtol" in getattr(self.settings, "__dataclass_fields__", {})


def sample_times(horizon: float, step: float) -> Array:
    """Return the times of a history, for `Model.history`.

    The history is `horizon` s long, with a point about every `step` s. More than
    MOST_SAMPLES points are refused.
    """
    if not horizon / step <= MOST_SAMPLES:
        raise ModelError(
            f"a history of {horizon:g} s with a point every {step:g} s has more than "
            f"{MOST_SAMPLES} points; give a longer step"
        )
    return np.linspace(0.0, horizon, 1 + round(horizon / step))


STREAMS = {"stdout": 1, "stderr": 2}  # of the process, with their descriptors


@contextmanager
def guarded(model: Model, function: str) -> Iterator[None]:
    """Name the model, the fault and its line, where the model's own code fails."""
    streams = {name: getattr(sys, name) for name in STREAMS}
    try:  # a model may leave the working directory, which all threads share
        with chdir(".") if current_thread() is main_thread() else nullcontext():
            yield
    except (TolstatError, KeyboardInterrupt):
        raise
    except BaseException as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise model.fault(
            f"{function} fails: {told(error)} "
            f"({Path(last.filename).name}, line {last.lineno})"
        ) from error
    finally:
        broken = [name for name, stream in streams.items() if _mended(name, stream)]
    if broken:
        raise model.fault(f"{function} closes or breaks sys.{broken[0]}; leave it open")


def _mended(name: str, before: Any) -> bool:
    """Mend a stream of the process that is closed or broken; return whether it was."""
    if not hasattr(before, "write") or _open(getattr(sys, name)):
        return False
    if not _open(before):  # closed, but not its descriptor
        encoding = getattr(before, "encoding", None)
        before = os.fdopen(STREAMS[name], "w", encoding=encoding, closefd=False)
    setattr(sys, name, before)
    return True


def _open(stream: Any) -> bool:
    return hasattr(stream, "write") and not getattr(stream, "closed", False)

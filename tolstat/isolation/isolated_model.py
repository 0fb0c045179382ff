"""A model that is evaluated in other processes: a crash costs its trial alone."""

import io
import os
import pickle
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.isolation import worker
from tolstat.isolation.endings import Ended
from tolstat.isolation.processes import Processes
from tolstat.model.checked import complete
from tolstat.model.contract import NO_OUTPUT, Model, Outcome, TrialResults, guarded
from tolstat.model.description import Description
from tolstat.model.view import Offer, View
from tolstat.model.wrapped import Wrapped
from tolstat.status import Status

Load = Callable[[], Model]
LEAST, TIMES = 60.0, 50  # longest trial: so many seconds, so many nominal trials
UNKNOWN = 3600.0  # s, for the first trial, where no limit is known
SLACK = 10  # times as long as the fastest block may a block take, beside the limit
FEW = 32  # rows that may take as long as one, while none has been evaluated
AGAIN = 3  # times a trial is repeated whose process was killed by another
# methods of a model that another process calls; of the first, those of tolstat are
# called here
DECLARED, EVALUATED = ("impossible", "numbers", "warnings"), ("history", "mechanism")
MOST_MODELS = 4  # that have processes at once

_processes: OrderedDict[tuple[int, bytes], Processes] = OrderedDict()
_lock = Lock()


class Isolated(Wrapped):
    """A model whose trials, histories and views are evaluated in other processes.

    Parameters
    ----------
    base : Model
        The model.
    load : callable
        Returns the model in another process; it can be pickled.
    longest : float
        Longest time of a trial, s; 0 for 50 times the first one, and 60 s at least.
    """

    def __init__(self, base: Model, load: Load, longest: float = 0.0) -> None:
        super().__init__(base)
        self.load, self.longest = load, longest
        self.stopping: Callable[[], bool] = lambda: False
        self._digest = ""  # of the code that its processes have to load
        self._described: tuple[Any, Description] | None = None  # settings, and theirs
        vars(self).update({name: partial(self._declared, name) for name in DECLARED})
        vars(self).update({name: partial(self._called, name) for name in EVALUATED})

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is made again in another process."""
        return Isolated, (self.base, self.load, self.longest)

    @property
    def unwrapped(self) -> Model:
        """The model itself: processes belong to it."""
        return self

    @property
    def source_digest(self) -> str:
        """The digest of the model: processes change no bit."""
        return self.base.source_digest

    def describe(self, settings: Any) -> Description:
        """Return the contributors and responses of the model."""
        if self._described is None or self._described[0] is not settings:
            self._described = settings, self._declared("describe", settings)
        return self._described[1]

    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the outcome of trials; one whose process ends has failed.

        A stop hands back those that have ended; the others have not run.
        """
        return Outcome(**self._evaluated(deviations, settings)._asdict())

    @property
    def views(self) -> tuple[Offer, ...]:  # type: ignore[override]
        """The views of the model."""

        def isolated(offer: Offer) -> Offer:
            def view(deviations: Array, settings: Any) -> View:
                arguments = self, offer.name, deviations, settings
                view: View = self.call(worker.viewed, *arguments)
                return view

            return offer._replace(function=view)

        return tuple(map(isolated, self.base.views))

    @property
    def isolation(self) -> "Isolated":
        """The model itself."""
        return self

    def learn(self, seconds: float) -> None:
        """Note how long a trial took, if it is not known how long it may last."""
        self.longest = self.longest or max(LEAST, TIMES * seconds)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns in another process; ModelError if it ends."""
        return self._result(function.__name__, packed(function, *arguments))

    def _declared(self, name: str, *arguments: Any, **options: Any) -> Any:
        """Return what a method declares that evaluates nothing.

        Code of tolstat is called here: an FMU is known by its description.
        """
        method = getattr(self.base, name)
        if method.__module__.partition(".")[0] == "tolstat":
            return method(*arguments, **options)
        return self._called(name, *arguments, **options)

    def _called(self, name: str, *arguments: Any, **options: Any) -> Any:
        """Return what a method of the model returns in another process."""
        request = packed(worker.called, self, name, arguments, options)
        return self._result(name, request)

    def _result(self, name: str, request: bytes) -> Any:
        """Return the result of a request; ModelError if its process ends.

        It is repeated as a trial is where another may have killed the process.
        """
        longest = max(self.longest, LEAST) if self.longest else UNKNOWN
        for repeated in count():
            try:
                with self._processes().worker() as process:
                    return process.call(request, longest).result()
            except Ended as ended:
                if not ended.killed or repeated == AGAIN:
                    words = f"{name}: its process {ended.words}"
                    raise self.fault(words) from None

    def _evaluated(self, deviations: Array, settings: Any) -> TrialResults:
        """Return the answers of trials.

        A trial has failed only if it fails alone in a fresh process: else it would
        depend on the trials before it.
        """
        processes, answers = self._processes(), list[TrialResults]()
        todo = [Part(0, len(deviations))]
        while todo:
            part = todo.pop()
            rows = deviations[part.first : part.stop]
            request = packed(worker.rows_evaluated, self, rows, settings)
            try:
                with processes.worker(fresh=part.repeated > 0) as process:
                    fresh, began = process.fresh, time.perf_counter()
                    longest = self._longest_block(len(rows))
                    process.call(request, longest, self.stopping).result()
                    outcomes, ended = process.outcomes(), None
            except Ended as error:
                outcomes, ended = error.outcomes, error
            if outcomes:
                over = len(outcomes) if self.row_by_row else len(rows)
                with guarded(self, "evaluate"):
                    answers.append(complete(self, _joined(outcomes), over, settings))
                part = part._replace(first=part.first + over)
            if ended is None:
                seconds = (time.perf_counter() - began) / len(rows)
                self.learn(seconds)
                processes.pace = min(processes.pace, seconds)
            elif ended.stopped:
                missing = len(deviations) - part.first
                answers.append(self._unanswered(missing, Status.NOT_RUN, settings))
                break
            elif part.is_guilty(ended, fresh=fresh and not outcomes):
                status = Status.TOOK_TOO_LONG if ended.late else Status.CRASHED
                output = {0: ended.words}
                answers.append(self._unanswered(1, status, settings, output))
            elif part.first < part.stop:
                todo += part.repeated_after(ended, by_row=self.row_by_row)
        return TrialResults.joined(answers)

    def _longest_block(self, rows: int) -> float:
        """Return how long a row may be under way, s, or the rows that are one call."""
        longest = self.longest or UNKNOWN
        if self.row_by_row or rows == 1:
            return longest
        pace = self._processes().pace
        return longest + rows * (SLACK * pace if pace < np.inf else longest / FEW)

    def _unanswered(
        self,
        trials: int,
        status: Status,
        settings: Any,
        output: Mapping[int, str] = NO_OUTPUT,
    ) -> TrialResults:
        """Return the answers of trials that have none."""
        return TrialResults(
            np.full((trials, len(self.describe(settings).responses)), np.nan),
            np.full(trials, status.value),
            np.zeros(trials, np.int64) if self.integrates else None,
            output,
        )

    def _processes(self) -> Processes:
        """Return the processes of this model; ModelError if its source has changed."""
        self._digest = self._digest or self.source_digest
        processes = processes_of(self.load)
        if processes.digest() != self._digest:
            processes.close()
            if processes.digest() != self._digest:
                raise self.fault("its source has changed since it was loaded")
        return processes


def processes_of(load: Load) -> Processes:
    """Return the processes that have loaded a model; of a few models they are kept."""
    key = os.getpid(), pickle.dumps(load)
    with _lock:
        processes = _processes.setdefault(key, Processes(load))
        _processes.move_to_end(key)
        if len(_processes) > MOST_MODELS:
            _processes.popitem(last=False)[1].close()
    return processes


class Part(NamedTuple):
    """Rows of a block that are evaluated together."""

    first: int
    stop: int
    repeated: int = 0  # how often, in a fresh process each time

    def is_guilty(self, ended: Ended, *, fresh: bool) -> bool:
        """Return whether it is a trial that fails by itself."""
        alone = self.stop - self.first == 1
        return alone and fresh and not (ended.killed and self.repeated < AGAIN)

    def repeated_after(self, ended: Ended, *, by_row: bool) -> list["Part"]:
        """Return the parts that are evaluated instead, after its process has ended.

        The last one is the next.
        """
        first, stop, repeated = self
        if stop - first == 1:
            return [Part(first, stop, repeated + 1)]
        if by_row:  # those before its first row are over
            return [Part(first + 1, stop), Part(first, first + 1, 1)]
        if ended.late:  # halves would wait again and again
            return [Part(row, row + 1) for row in reversed(range(first, stop))]
        middle = (first + stop) // 2
        return [Part(middle, stop), Part(first, middle)]


def _joined(outcomes: Sequence[Outcome]) -> Outcome:
    """Return outcomes of one row each as one; the first that is none as it is."""
    for outcome in outcomes:
        if not isinstance(outcome, Outcome) or len(outcomes) == 1:
            return outcome

    def column(values: list[Any]) -> Any:
        return None if values[0] is None else np.concatenate(values)

    words = dict.fromkeys(word for outcome in outcomes for word in outcome.failed)
    no = np.zeros(1, bool)
    return Outcome(
        np.concatenate([outcome.responses for outcome in outcomes]),
        column([outcome.status for outcome in outcomes]),
        column([outcome.steps for outcome in outcomes]),
        {word: column([o.failed.get(word, no) for o in outcomes]) for word in words},
        {row: o.output[0] for row, o in enumerate(outcomes) if 0 in o.output},
    )


class _Packer(pickle.Pickler):
    """The model of a worker process is there already."""

    def reducer_override(self, obj: Any) -> Any:
        return (worker.the_model, ()) if isinstance(obj, Isolated) else NotImplemented


def packed(*values: Any) -> bytes:
    """Return a request for a worker process: a function and its arguments."""
    function, *arguments = values
    buffer = io.BytesIO()
    _Packer(buffer, pickle.HIGHEST_PROTOCOL).dump((function, arguments))
    return buffer.getvalue()

"""A worker process: it evaluates what it is sent, until its sender is gone."""

import mmap
import os
import pickle
import socket
import struct
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import TolstatError, told
from tolstat.isolation import channel
from tolstat.model.checked import complete, evaluated
from tolstat.model.contract import Answers, Model, Outcome, guarded
from tolstat.operating_system import buffer_lines, limit_data, private_data

E = TypeVar("E", bound=BaseException)
OUT_OF_MEMORY = 71  # exit code
LONGEST_LOG = 1 << 20  # bytes of output, which start again at the next row then
MARK = struct.Struct("qd")  # of a row: its number, and when it began


class Clock:
    """Memory shared with the parent: the row under way, and when it began."""

    def __init__(self, descriptor: int) -> None:
        self._memory = mmap.mmap(descriptor, MARK.size)

    def begin(self, row: int) -> None:
        """Note that a row begins now."""
        MARK.pack_into(self._memory, 0, row, time.monotonic())

    def read(self) -> tuple[int, float]:
        """Return the row under way, and when it began."""
        row, began = MARK.unpack_from(self._memory, 0)
        return row, began

    def close(self) -> None:
        """Give the memory back."""
        self._memory.close()


class Reply(NamedTuple):
    """What a request has returned or raised, and how much memory is in use."""

    value: Any
    error: BaseException | None
    data: int  # bytes of private memory

    def result(self) -> Any:
        """Return the value, or raise the error."""
        if self.error:
            raise self.error
        return self.value


_model: Model | None = None  # of this process
_clock: Clock | None = None


def the_model() -> Model | None:
    """Return the model of this process: in requests it stands for the model."""
    return _model


def serve(model: Model, requests: socket.socket, clock: Clock, growth: int) -> None:
    """Carry out requests; memory may grow by so many bytes."""
    global _model, _clock
    _model, _clock = model, clock
    buffer_lines()
    limit_data(private_data() + growth)
    while (request := channel.receive(requests)) is not None:
        _start_log()
        clock.begin(0)
        value, failure = None, None
        try:
            function, arguments = pickle.loads(request)
            value = function(*arguments)
        except TolstatError as error:
            failure = error
            if _cause(error, MemoryError):
                os._exit(OUT_OF_MEMORY)
            if left := _cause(error, SystemExit):
                _exit(left)
        except MemoryError:
            os._exit(OUT_OF_MEMORY)
        except SystemExit as error:
            _exit(error)
        try:
            reply = pickle.dumps(Reply(value, failure, private_data()))
        except Exception as error:
            failure = model.fault(f"its answer cannot leave its process: {told(error)}")
            reply = pickle.dumps(Reply(None, failure, private_data()))
        channel.send(requests, reply)


def rows_evaluated(model: Model, deviations: Array, settings: Any) -> Answers:
    """Return the answers of trials, one row after another if the model wants that."""
    deviations.flags.writeable = False  # as where nothing is isolated
    if not model.row_by_row:
        return evaluated(model, deviations, settings)
    assert _clock
    outcomes = list[Outcome]()
    with guarded(model, "evaluate"):
        for number in range(len(deviations)):
            if number:
                _start_log(LONGEST_LOG)
                _clock.begin(number)
            outcomes.append(model.evaluate(deviations[number : number + 1], settings))
    with guarded(model, "evaluate"):
        return complete(model, _joined(outcomes), len(deviations), settings)


def _joined(outcomes: Sequence[Outcome]) -> Outcome:
    """Return outcomes of one row each as one; the first that is none as it is."""
    for outcome in outcomes:
        if not isinstance(outcome, Outcome):
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


def viewed(model: Model, name: str, deviations: Array, settings: Any) -> Any:
    """Return a view of a model."""
    views: dict[str, Callable[..., Any]] = {v.name: v.function for v in model.views}
    with guarded(model, name):
        return views[name](deviations, settings)


def called(model: Model, name: str, arguments: Sequence[Any], options: Any) -> Any:
    """Return what a method of a model returns."""
    with guarded(model, name):
        return getattr(model, name)(*arguments, **options)


def _start_log(longest: int = 0) -> None:
    """Begin the output of this process again, if it is longer."""
    if os.fstat(1).st_size > longest:
        os.ftruncate(1, 0)
        os.lseek(1, 0, os.SEEK_SET)


def _exit(error: SystemExit) -> None:
    """End this process as `sys.exit` would, with its code or message."""
    code = 0 if error.code is None else error.code
    if not isinstance(code, int):
        print(code, file=sys.stderr)
        code = 1
    for text in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # a model may have closed it
            text.flush()
    os._exit(code & 0xFF)


def _cause(error: BaseException | None, kind: type[E]) -> E | None:
    """Return the error of a kind that an error is, or comes from."""
    while error is not None:
        if isinstance(error, kind):
            return error
        error = error.__cause__
    return None

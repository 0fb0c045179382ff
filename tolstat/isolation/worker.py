"""A worker process: it evaluates what it is sent, until its sender is gone."""

import os
import pickle
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

from tolstat.arrays import Array
from tolstat.errors import TolstatError, told
from tolstat.isolation import channel
from tolstat.model.contract import Model, guarded
from tolstat.operating_system import buffer_lines, limit_data, private_data

E = TypeVar("E", bound=BaseException)
OUT_OF_MEMORY = 71  # exit code
LONGEST_LOG = 1 << 20  # bytes of output, which start again at the next row then


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
_answers = -1  # descriptor of a file that the parent reads, also after a crash


def the_model() -> Model | None:
    """Return the model of this process: in requests it stands for the model."""
    return _model


def serve(model: Model, requests: socket.socket, answers: int, growth: int) -> None:
    """Carry out requests; memory may grow by so many bytes."""
    global _model, _answers
    _model, _answers = model, answers
    buffer_lines()
    limit_data(private_data() + growth)
    while (request := channel.receive(requests)) is not None:
        _start_log()
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
            reply = _pickled(model, Reply(value, failure, private_data()))
        except TolstatError as error:
            reply = pickle.dumps(Reply(None, error, private_data()))
        channel.send(requests, reply)


def rows_evaluated(model: Model, deviations: Array, settings: Any) -> None:
    """Append the outcome of trials to the file of answers.

    One row after another if the model wants that: those of a process that ends count.
    """
    deviations.flags.writeable = False  # as where nothing is isolated
    together = 1 if model.row_by_row else len(deviations)
    with guarded(model, "evaluate"):
        for first in range(0, len(deviations), together):
            if first:
                _start_log(LONGEST_LOG)
            outcome = model.evaluate(deviations[first : first + together], settings)
            channel.append(_answers, _pickled(model, outcome))


def viewed(model: Model, name: str, deviations: Array, settings: Any) -> Any:
    """Return a view of a model."""
    views: dict[str, Callable[..., Any]] = {v.name: v.function for v in model.views}
    with guarded(model, name):
        return views[name](deviations, settings)


def called(model: Model, name: str, arguments: Sequence[Any], options: Any) -> Any:
    """Return what a method of a model returns."""
    with guarded(model, name):
        return getattr(model, name)(*arguments, **options)


def _pickled(model: Model, value: Any) -> bytes:
    try:
        return pickle.dumps(value)
    except Exception as error:
        raise model.fault(
            f"its answer cannot leave its process: {told(error)}"
        ) from error


def _start_log(longest: int = 0) -> None:
    """Begin the output of this process again, if it is longer."""
    if os.fstat(1).st_size > longest:
        os.ftruncate(1, 0)


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

"""Blocks sent to other processes: models go by name, and their source is compared."""

import io
import os
import pickle
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

from tolstat import catalogue
from tolstat.errors import LostError, ModelError, TolstatError, told
from tolstat.execution.workers.local_blocks import Block, Evaluated, Mismatch, evaluate
from tolstat.model.contract import Model, TrialResults
from tolstat.operating_system import processors
from tolstat.store.provenance import decisive, provenance

_loading = threading.Lock()
_loaded: dict[str, Model] = {}  # custom models of this process, by FILE.py:NAME


class Parcel(NamedTuple):
    """A call for another process, and the versions that it needs there."""

    content: bytes  # the function and its arguments, pickled
    # what decides the bits of the numbers: processor, compiler, versions
    decisive: dict[str, str]


class Processes:
    """Other processes, behind any executor: a pool, MPI, a cluster.

    An executor may say by `number` or `num_workers` how many blocks run at once, and
    may have `refuse(mismatch)`, which stops the use of a worker.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    @property
    def number(self) -> int:
        """How many blocks run at once."""
        names = "number", "num_workers"
        sizes = (getattr(self._executor, name, 0) for name in names)
        return next(filter(None, sizes), None) or processors()

    def submit(self, block: Block) -> Future[Any]:
        """Let a process evaluate a block."""
        parcel = packed(partial(evaluate, block))
        with _lost_processes():
            future = self._executor.submit(carried_out, parcel)
        if isinstance(future, Future):
            return future
        raise self._broken(future, "a Future")

    def answer(self, future: Future[Any], block: Block) -> Evaluated | Mismatch:
        """Return the answer of a finished block, if it fits the block.

        After a `Mismatch` another worker has to evaluate it. A ModelError blames the
        model, a LostError says that workers are lost.
        """
        with _lost_processes():
            outcome = future.result()
        match outcome:
            case Mismatch(who, reasons):
                if not hasattr(self._executor, "refuse"):
                    raise _lost(f"{who}: {'; '.join(reasons)}")
                self._executor.refuse(outcome)
                return outcome
            case (TrialResults(responses, status) as answers, float() as seconds):
                shape = block.shape
                shapes = getattr(responses, "shape", 0), getattr(status, "shape", 0)
                if shapes == (shape, shape[:1]):
                    return Evaluated(answers, seconds)
        raise self._broken(outcome, f"the answers of {len(block.deviations)} trials")

    def close(self, *, wait: bool) -> None:
        """Leave the executor as it is: its caller shuts it down."""

    def _broken(self, reply: object, expected: str) -> LostError:
        executor, kind = type(self._executor).__name__, type(reply).__name__
        return _lost(f"{executor} returns {kind}, not {expected}")


@contextmanager
def _lost_processes() -> Iterator[None]:
    """Raise LostError, whatever an executor raises if its processes are lost."""
    try:
        yield
    except TolstatError:
        raise
    except (Exception, SystemExit) as error:
        raise _lost(told(error)) from error


def _lost(reason: str) -> LostError:
    return LostError(f"a worker process: {reason}")


class _Packer(pickle.Pickler):
    """Models go by name, file and digest of their source; cases by value."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, Model) and obj.unwrapped is obj and obj.isolation is None:
            source = _source_of(obj)
            _loaded[source] = obj  # threads of this process have it already
            return _model_of, (obj.name, source, obj.source_digest)
        return NotImplemented


def packed(call: Callable[[], Any]) -> Parcel:
    """Pack a call for another process."""
    buffer = io.BytesIO()
    _Packer(buffer, pickle.HIGHEST_PROTOCOL).dump(call)
    return Parcel(buffer.getvalue(), decisive(provenance()))


def carried_out(parcel: Parcel) -> Any:
    """Return the result of a call made here; a `Mismatch` if bits could differ."""
    present = decisive(provenance())
    reasons = [
        f"its {fact} is {present.get(fact, 'unknown')}, the run needs {value}"
        for fact, value in parcel.decisive.items()
        if present.get(fact) != value
    ]
    try:
        call = pickle.loads(parcel.content)
    except TolstatError as error:
        reasons.append(str(error))
    if reasons:
        return Mismatch(f"{socket.gethostname()}, process {os.getpid()}", (*reasons,))
    return call()


def _source_of(model: Model) -> str:
    """Return where others find a model; empty for an installed one."""
    source = catalogue.place_of(model)
    if source == catalogue.ANY:
        raise catalogue.lost(model)
    return catalogue.resolved(source) if source else ""


def _model_of(name: str, source: str, digest: str) -> Model:
    """Return a model by its name; refuse another source."""
    with _loading:  # of two threads one loads it
        if source and source not in _loaded:
            _loaded[source] = catalogue.load(source)
        model = _loaded[source] if source else catalogue.find(name)
    if model.source_digest != digest:
        raise ModelError(
            f"its source of model '{name}' is {model.source_digest}, the run "
            f"needs {digest}"
        )
    return model

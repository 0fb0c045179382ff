"""Any executor of other processes, MPI's among them, as one that evaluates machines."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any

from tolstat.errors import LostError, TolstatError
from tolstat.execution.workers.cluster import Cluster
from tolstat.execution.workers.crew import Workers
from tolstat.execution.workers.remote_blocks import Otherwise, carried_out, packed


class Elsewhere(Executor):
    """Processes that are asked whether they would come to the same bits.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        Of other processes: `mpi4py.futures.MPIPoolExecutor`, `ProcessPoolExecutor`.
        Who gives it dismisses it.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    @property
    def number(self) -> int | None:
        """How many blocks run at once, where the executor says it."""
        return getattr(self._executor, "num_workers", None)

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Let a process call a function of tolstat."""
        ours: Future[Any] = Future()
        parcel = packed(partial(fn, *args, **kwargs))
        try:
            theirs = self._executor.submit(carried_out, parcel)
        except RuntimeError as error:  # it is broken, or dismissed
            raise _lost(f"{type(error).__name__}: {error}") from error
        ours.add_done_callback(lambda each: each.cancelled() and theirs.cancel())
        theirs.add_done_callback(partial(_deliver, ours))
        return ours


def _deliver(ours: Future[Any], theirs: Future[Any]) -> None:
    """Take what came of a block."""
    if theirs.cancelled() or not ours.set_running_or_notify_cancel():
        return
    error = theirs.exception()
    if isinstance(error, TolstatError):
        ours.set_exception(error)
    elif error:
        ours.set_exception(_lost(f"{type(error).__name__}: {error}"))
    elif isinstance(found := theirs.result(), Otherwise):
        ours.set_exception(_lost(f"{found.who}: {'; '.join(found.reasons)}"))
    else:
        ours.set_result(found)


def _lost(why: str) -> LostError:
    return LostError(f"a process that evaluates: {why}")


def crew_of(workers: int | None, executor: Executor | None) -> Workers:
    """Return who evaluates: threads of this process, or another's executor."""
    if executor is not None and not isinstance(executor, Cluster):
        executor = Elsewhere(executor)
    return Workers(workers, executor=executor)

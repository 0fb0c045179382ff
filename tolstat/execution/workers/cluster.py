"""A Dask cluster as an executor: its workers evaluate, this process alone writes."""

from __future__ import annotations

import logging
import threading
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any

from tolstat.errors import BrokenError, LostError, StudyError, TolstatError
from tolstat.execution.workers.remote_blocks import Mismatch

Call = Callable[[], Any]

CONNECT = 10.0  # s, for a scheduler to answer
PATIENCE = 60.0  # s, without any worker that can be used
LOOK_AGAIN = 1.0  # s, between two looks at who is there


class Cluster(Executor):
    """The workers of a Dask scheduler.

    A block goes to them as deviations that were drawn here, and the name of a model;
    a block of a worker that is lost is evaluated again by another one. A worker of
    another source, processor or version is named and not used.

    Parameters
    ----------
    address : str
        Of the scheduler, such as "tcp://HOST:8786".

    Raises
    ------
    StudyError
        If Dask is not installed.
    BrokenError
        If no scheduler answers there.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise StudyError(
                f"a cluster needs Dask: pip install 'tolstat[cluster]' ({error})"
            ) from None
        # what matters of its losses is said in one sentence, without its tracebacks
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL + 1)
        try:
            self._client = Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            why = str(error) or type(error).__name__
            raise BrokenError(
                f"no Dask scheduler answers at {address}: {why}; "
                "`dask scheduler` starts one, `dask worker ADDRESS` its workers"
            ) from error
        self.address = address
        self._refused: set[str] = set()
        self._there: dict[str, int] = {}  # threads of each worker
        self._sent: dict[Future[Any], tuple[Call, Any, list[str]]] = {}
        self._lock, self._closed = threading.RLock(), threading.Event()
        self._look()
        threading.Thread(target=self._watch, daemon=True).start()

    @property
    def number(self) -> int:
        """How many blocks run at once, as things are."""
        with self._lock:
            return max(1, sum(self._there[each] for each in self._usable))

    @property
    def _usable(self) -> list[str]:
        """Workers that are there and have not refused."""
        return [each for each in self._there if each not in self._refused]

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Let a worker call a function."""
        ours: Future[Any] = Future()
        ours.set_running_or_notify_cancel()  # it may run from now on
        self._send(ours, partial(fn, *args, **kwargs))
        return ours

    def _send(self, ours: Future[Any], call: Call) -> None:
        with self._lock:
            where = self._usable if self._refused else []
            try:
                theirs = self._client.submit(
                    _on_worker, call, pure=False, workers=where or None
                )
            except Exception as error:  # whatever Dask raises where it is closed
                ours.set_exception(self._lost(f"{type(error).__name__}: {error}"))
                return
            self._sent[ours] = call, theirs, where
        theirs.add_done_callback(partial(self._deliver, ours))

    def _deliver(self, ours: Future[Any], theirs: Any) -> None:
        """Take what came of a block; what a worker refused goes to another one."""
        with self._lock:
            if ours not in self._sent or self._sent[ours][1] is not theirs:
                return  # sent again meanwhile
            call, *_ = self._sent.pop(ours)
        try:
            found = theirs.result()
            if isinstance(found, Mismatch):
                self._refuse(found)
                if self._look():
                    self._send(ours, call)
                    return
                raise self._lost("none of its workers can be used")
        except TolstatError as error:
            ours.set_exception(error)
        except BaseException as error:
            ours.set_exception(self._lost(f"{type(error).__name__}: {error}"))
        else:
            ours.set_result(found)

    def _refuse(self, found: Mismatch) -> None:
        """Name a worker that is not used."""
        with self._lock:
            if found.who in self._refused:
                return
            self._refused.add(found.who)
        warnings.warn(
            f"worker {found.who} is not used: {'; '.join(found.reasons)}",
            RuntimeWarning,
            stacklevel=2,
        )

    def _look(self) -> bool:
        """Look who is there; tell whether one of them can be used."""
        try:
            there = dict(self._client.nthreads())
        except Exception:  # whatever Dask raises where the scheduler is gone
            there = {}
        with self._lock:
            self._there = there
            return bool(self._usable)

    def _watch(self) -> None:
        """Send again what only lost workers may do; give up where none is left."""
        since = time.monotonic()
        while not self._closed.wait(LOOK_AGAIN):
            usable = self._look()
            since = time.monotonic() if usable else since
            with self._lock:
                sent = list(self._sent.items())
                for ours, (call, _, where) in sent if usable else ():
                    if where and not self._there.keys() & set(where):
                        self._send(ours, call)
                if time.monotonic() - since <= PATIENCE:
                    continue
                self._sent = {}
            for ours, _ in sent:
                why = f"it has had no worker for {PATIENCE:.0f} s"
                ours.set_exception(self._lost(why))

    def _lost(self, why: str) -> LostError:
        return LostError(
            f"the cluster at {self.address}: {why}; `dask worker {self.address}` "
            "starts a worker"
        )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster; what of ours still runs there is given up."""
        self._closed.set()
        with self._lock:
            self._sent.clear()
        self._client.close(timeout=CONNECT)


def _on_worker(call: Call) -> Any:
    """Call a function on a worker of a cluster; a mismatch bears its address."""
    from distributed import get_worker

    found = call()
    if isinstance(found, Mismatch):
        return found._replace(who=get_worker().address)
    return found

"""A Dask cluster as an executor: its workers evaluate, this process alone writes."""

import logging
import re
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any

from tolstat.errors import BrokenError, LostError, StudyError
from tolstat.execution.workers.local_blocks import Mismatch

ADDRESS = re.compile(r"tcp://([^/:\s]+|\[[0-9a-fA-F:.%]+\]):[0-9]{1,5}")
CONNECT = 10.0  # s, for a scheduler to answer
PATIENCE = 60.0  # s, without any worker that can be used
LOOK_AGAIN = 1.0  # s, between two checks for workers


class Cluster(Executor):
    """The workers of a Dask scheduler.

    A block is sent as deviations, sampled here, and the name of a model. If a worker is
    lost, another one evaluates its block again. A worker with another source, processor
    or version is named and not used.

    Parameters
    ----------
    address : str
        Of the scheduler, such as "tcp://HOST:8786".

    Raises
    ------
    StudyError
        If Dask is not installed, or the address is of another form.
    BrokenError
        If no scheduler answers there.
    """

    def __init__(self, address: str) -> None:
        if not ADDRESS.fullmatch(address):
            raise StudyError(
                f"cluster {address!r}: expected the address of a Dask scheduler, "
                "tcp://HOST:PORT, such as tcp://localhost:8786"
            )
        try:
            from distributed import Client
        except ImportError as error:
            raise StudyError(
                f"a cluster needs Dask: pip install 'tolstat[cluster]' ({error})"
            ) from None
        # a loss is reported in one sentence, without Dask's tracebacks
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL + 1)
        try:
            self._client = Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            reason = str(error) or type(error).__name__
            raise BrokenError(
                f"no Dask scheduler answers at {address}: {reason}; "
                "`dask scheduler` starts one, `dask worker ADDRESS` its workers"
            ) from error
        self.address = address
        self._refused: set[str] = set()
        self._usable: dict[str, int] = {}  # threads of each worker that can be used
        self._looked = self._seen = time.monotonic()  # the latter with such a worker
        self._look()

    def _look(self) -> None:
        """Look for workers; LostError once none could be used for a minute."""
        try:
            threads = self._client.nthreads()
        except Exception:  # Dask raises anything if the scheduler is gone
            threads = {}
        self._usable = {k: n for k, n in threads.items() if k not in self._refused}
        self._looked = time.monotonic()
        if self._usable:
            self._seen = self._looked
        elif self._looked - self._seen > PATIENCE:
            raise self._lost(f"it has had no worker for {PATIENCE:.0f} s")

    @property
    def number(self) -> int:
        """How many blocks run at once now."""
        if time.monotonic() - self._looked > LOOK_AGAIN:
            self._look()
        return max(1, sum(self._usable.values()))

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Let a worker call a function; Dask calls it again where one is lost."""
        chosen: dict[str, Any] = {}
        if self._refused and self._usable:  # others, should these leave
            chosen = {"workers": [*self._usable], "allow_other_workers": True}
        executor = self._client.get_executor(pure=False, **chosen)
        future: Future[Any] = executor.submit(_on_worker, partial(fn, *args, **kwargs))
        return future

    def refuse(self, mismatch: Mismatch) -> None:
        """Name a worker that is no longer used; LostError if none is left."""
        if mismatch.who not in self._refused:
            self._refused.add(mismatch.who)
            warnings.warn(
                f"worker {mismatch.who} is not used: {'; '.join(mismatch.reasons)}",
                RuntimeWarning,
                stacklevel=2,
            )
        self._look()
        if not self._usable:
            raise self._lost("none of its workers can be used")

    def _lost(self, reason: str) -> LostError:
        return LostError(
            f"the cluster at {self.address}: {reason}; `dask worker {self.address}` "
            "starts a worker"
        )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, and give up blocks that still run there."""
        self._client.close(timeout=CONNECT)


def _on_worker(call: Callable[[], Any]) -> Any:
    """Call a function on a worker of a cluster; a mismatch gets its address."""
    from distributed import get_worker

    outcome = call()
    if isinstance(outcome, Mismatch):
        return outcome._replace(who=get_worker().address)
    return outcome

"""The processes of one model: a nursery, and the workers that it forks."""

import math
import pickle
import select
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from threading import Lock
from typing import Any

from tolstat.errors import LostError
from tolstat.isolation import channel
from tolstat.isolation.endings import Ended, how_it_ended, with_tail
from tolstat.isolation.nursery_process import Nursery
from tolstat.isolation.worker import Reply
from tolstat.operating_system import memory_file

LOOK_AGAIN = 0.05  # s, between two looks at what a worker has answered
REPLACED = 500 << 20  # bytes of growth after which another worker takes over
STARTS = 4  # further ones of a nursery that is killed


class WorkerProcess:
    """A worker that a nursery has forked."""

    def __init__(self, nursery: Nursery) -> None:
        self._nursery = nursery
        with ExitStack() as stack:
            self._answers = stack.enter_context(memory_file())
            self._log = stack.enter_context(tempfile.TemporaryFile("a+b", buffering=0))
            self._files = stack.pop_all()
        self._channel, other = socket.socketpair()
        with other:
            descriptors = [file.fileno() for file in (other, self._answers, self._log)]
            self.number = nursery.start(descriptors)
        self.fresh, self.grown = True, False
        self._first_data = 0

    def call(
        self,
        request: bytes,
        longest: float,
        stopping: Callable[[], bool] = lambda: False,
    ) -> Reply:
        """Return the reply to a request, or raise `Ended`.

        Rows that are one call may be under way for the longest time, s.
        """
        self.fresh = False
        self._answers.seek(0)  # its end, where a worker appends
        self._answers.truncate()
        with suppress(ConnectionError):  # it has ended: nothing is to be read
            channel.send(self._channel, request)
        size, began = 0, time.monotonic()
        while not select.select([self._channel], [], [], LOOK_AGAIN)[0]:
            now, before = time.monotonic(), size
            size = self._answers.tell()
            if size > before:  # the next rows have begun
                began = now
            elif now - began > longest:
                raise self._ended(late=longest)
            if stopping():
                raise self._ended(stopped=True)
        message = channel.receive(self._channel)
        if message is None:
            raise self._ended()
        reply: Reply = pickle.loads(message)
        self._first_data = self._first_data or reply.data
        self.grown = reply.data - self._first_data > REPLACED
        return reply

    def outcomes(self) -> list[Any]:
        """Return what `rows_evaluated` has evaluated, in order."""
        self._answers.seek(0)
        return [*map(pickle.loads, channel.appended(self._answers.read()))]

    def _ended(self, *, late: float = 0.0, stopped: bool = False) -> Ended:
        """End the process, and return how it has ended."""
        status = self.end()
        words = f"longer than {late:.3g} s" if late else how_it_ended(status)
        words = with_tail(words, self._log)
        killed = not late and status == -9
        return Ended(words, self.outcomes(), late > 0, stopped, killed)

    def end(self) -> int:
        """End the process; return its exit code, or minus the signal that ended it."""
        self._channel.close()
        return self._nursery.end(self.number)

    def close(self) -> None:
        """Give up its files."""
        self._channel.close()
        self._files.close()


class Processes:
    """A nursery, and its workers that are idle."""

    def __init__(self, load: Callable[[], Any]) -> None:
        self._load = load
        self._nursery: Nursery | None = None
        self._idle: list[WorkerProcess] = []
        self._lock = Lock()
        self.pace = math.inf  # s a trial, of the fastest block

    def digest(self) -> str:
        """Return the digest of the model that they have loaded."""
        return self._running().digest

    @contextmanager
    def worker(self, *, fresh: bool = False) -> Iterator[WorkerProcess]:
        """Yield a worker for one request; a fresh one has carried out none."""
        with self._lock:
            process = self._idle.pop() if self._idle and not fresh else None
        process = process or self._new()
        try:
            yield process
        except BaseException as error:
            if not isinstance(error, Ended):
                process.end()
            process.close()
            raise
        if process.grown:
            process.end()
            process.close()
        else:
            with self._lock:
                self._idle.append(process)

    def _new(self) -> WorkerProcess:
        for _ in range(STARTS):
            with suppress(LostError):  # it was killed: another one
                return WorkerProcess(self._running())
        return WorkerProcess(self._running())

    def _running(self) -> Nursery:
        with self._lock:
            if self._nursery is None or self._nursery.broken:
                self._forget()
                self._nursery = Nursery(self._load)
            return self._nursery

    def _forget(self) -> None:
        for process in self._idle:
            process.close()
        self._idle = []
        if self._nursery:
            self._nursery.close()
            self._nursery = None

    def close(self) -> None:
        """End all processes that are idle, and their nursery."""
        with self._lock:
            self._forget()

"""The processes of one model: a nursery, and the workers that it forks."""

import math
import os
import pickle
import select
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from threading import Lock
from typing import Any

from tolstat.errors import LostError
from tolstat.isolation import channel
from tolstat.isolation.channel import LENGTH
from tolstat.isolation.nursery import START
from tolstat.isolation.worker import MARK, OUT_OF_MEMORY, Clock, Reply
from tolstat.operating_system import send_descriptors, signal_name

LOOK_AGAIN = 0.05  # s, between two looks at the clock of a worker
GROWTH = 4 << 30  # bytes that the memory of a worker may grow by
REPLACED = 500 << 20  # bytes of growth after which another worker takes over
TAIL = 2000  # bytes of the output of a trial
COMMAND = (
    "import sys; sys.path[:] = {path}; "
    "from tolstat.isolation.nursery import main; main({number})"
)


class Ended(Exception):
    """A worker has ended before it answered.

    Attributes
    ----------
    row : int
        The row that was under way.
    late : bool
        Whether it was ended because it took too long.
    killed : bool
        Whether anyone may have killed it: the model is not at fault for sure.
    words : str
        How it ended, and the tail of its output.
    """

    def __init__(self, row: int, words: str, *, late: bool, killed: bool) -> None:
        super().__init__(words)
        self.row, self.words, self.late, self.killed = row, words, late, killed


class WorkerProcess:
    """A worker that a nursery has forked."""

    def __init__(self, nursery: "Nursery") -> None:
        self._nursery = nursery
        with ExitStack() as stack:
            shared, self._log = (
                stack.enter_context(tempfile.TemporaryFile(buffering=0))
                for _ in range(2)
            )
            self._files = stack.pop_all()
        shared.truncate(MARK.size)
        self._clock = Clock(shared.fileno())
        self._channel, other = socket.socketpair()
        with other:
            descriptors = [file.fileno() for file in (other, shared, self._log)]
            self.number = nursery.start(descriptors)
        self.fresh, self.grown = True, False
        self._first_data = 0

    def call(self, request: bytes, longest: float) -> Reply:
        """Return the reply to a request, or raise `Ended`.

        A row may be under way for the longest time, s.
        """
        self.fresh = False
        self._clock.begin(0)
        with suppress(ConnectionError):  # it has ended: nothing is to be read
            channel.send(self._channel, request)
        while not select.select([self._channel], [], [], LOOK_AGAIN)[0]:
            _, began = self._clock.read()
            if time.monotonic() - began > longest:
                raise self._ended(late=longest)
        message = channel.receive(self._channel)
        if message is None:
            raise self._ended()
        reply: Reply = pickle.loads(message)
        self._first_data = self._first_data or reply.data
        self.grown = reply.data - self._first_data > REPLACED
        return reply

    def _ended(self, late: float = 0.0) -> Ended:
        """End the process, and return how it has ended."""
        row, _ = self._clock.read()
        status = self.end()
        if late:
            words = f"longer than {late:.3g} s"
        elif status == OUT_OF_MEMORY:
            words = "out of memory"
        elif status < 0:
            words = f"ended by {signal_name(-status)}"
        else:
            words = f"ended with exit code {status}"
        output = self._tail()
        words = f"{words}\n{output}" if output else words
        killed = not late and status == -9
        return Ended(row, words, late=late > 0, killed=killed)

    def _tail(self) -> str:
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - TAIL))
        data = self._log.read(TAIL)
        return data.decode("utf-8", "replace").strip()

    def end(self) -> int:
        """End the process; return its exit code, or minus the signal that ended it."""
        self._channel.close()
        return self._nursery.end(self.number)

    def close(self) -> None:
        """Give up memory and files."""
        self._channel.close()
        self._clock.close()
        self._files.close()


class Nursery:
    """A process that has loaded a model and forks workers of it."""

    def __init__(self, load: Callable[[], Any]) -> None:
        self._control, other = socket.socketpair()
        self._lock, self.broken = Lock(), False
        with other:
            code = COMMAND.format(path=sys.path, number=other.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", code],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for its starter
            )
        with suppress(ConnectionError):
            channel.send_object(self._control, (load, GROWTH))
        answer = channel.receive(self._control)
        if answer is None:
            self.close()
            raise LostError("a worker process: it ends while it loads the model")
        if error := pickle.loads(answer):
            self.close()
            raise error

    def start(self, descriptors: list[int]) -> int:
        """Fork a worker with these files; return its number."""
        return self._ask(START, descriptors)

    def end(self, number: int) -> int:
        """End a worker; return how it has ended, SIGKILL where that is unknown."""
        try:
            return self._ask(number)
        except LostError:
            return -9

    def _ask(self, number: int, descriptors: list[int] | None = None) -> int:
        with self._lock:
            try:
                send_descriptors(self._control, LENGTH.pack(number), descriptors or [])
                data = self._control.recv(LENGTH.size)
            except OSError:
                data = b""
            if len(data) < LENGTH.size:
                self.broken = True
                raise LostError("a worker process: the process that forks it has ended")
        answer: int = LENGTH.unpack(data)[0]
        return answer

    def close(self) -> None:
        """End it and all its workers."""
        self.broken = True
        self._control.close()
        self._process.wait()


class Processes:
    """A nursery, and its workers that are idle."""

    def __init__(self, load: Callable[[], Any]) -> None:
        self._load = load
        self._nursery: Nursery | None = None
        self._idle: list[WorkerProcess] = []
        self._lock = Lock()
        self.pace = math.inf  # s a trial, of the fastest block

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
        with self._lock:
            if self._nursery is None or self._nursery.broken:
                self._forget()
                self._nursery = Nursery(self._load)
            nursery = self._nursery
        try:
            return WorkerProcess(nursery)
        except LostError:  # it was killed: another one
            return self._new()

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

"""The nursery as its starter has it: it is started, asked for workers, and ended."""

import pickle
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from threading import Lock
from typing import Any

from tolstat.errors import LostError, ModelError
from tolstat.isolation import channel
from tolstat.isolation.channel import LENGTH
from tolstat.isolation.endings import how_it_ended, with_tail
from tolstat.isolation.nursery import START
from tolstat.operating_system import send_descriptors

GROWTH = 4 << 30  # bytes that the memory of a worker may grow by
COMMAND = (
    "import sys; sys.path[:] = {path}; "
    "from tolstat.isolation.nursery import main; main({number})"
)


class Nursery:
    """A process that has loaded a model and forks workers of it.

    Raises
    ------
    ModelError
        If the process ends while it loads the model.
    LostError
        If another process has killed it.
    """

    def __init__(self, load: Callable[[], Any]) -> None:
        self._control, other = socket.socketpair()
        self._lock, self.broken = Lock(), False
        with other, tempfile.TemporaryFile(buffering=0) as log:
            code = COMMAND.format(path=sys.path, number=other.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", code],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,  # Ctrl-C is for its starter
            )
            other.close()
            with suppress(ConnectionError):
                channel.send_object(self._control, (load, GROWTH))
            answer = channel.receive(self._control)
            if answer is None:
                self.close()
                status = self._process.returncode
                words = (
                    f"the model cannot be loaded: its process {how_it_ended(status)}"
                )
                kind = LostError if status == -9 else ModelError  # anyone may kill it
                raise kind(with_tail(words, log))
        error, digest = pickle.loads(answer)
        self.digest: str = digest  # of the model
        if error:
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

"""A block of trials, its answer, and threads of this process that evaluate it."""

import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, NamedTuple

from tolstat.arrays import Array
from tolstat.model.checked import simulate
from tolstat.model.contract import Model, TrialResults


class Block(NamedTuple):
    """Trials with the same settings, to be evaluated together."""

    model: Model
    deviations: Array  # float64[trial, contributor], SI
    settings: Any

    @property
    def shape(self) -> tuple[int, int]:
        """Trials and responses of its answers."""
        return len(self.deviations), len(self.model.describe(self.settings).responses)


class Evaluated(NamedTuple):
    """The answers of a block, and how long it took, s."""

    answers: TrialResults
    seconds: float


class Mismatch(NamedTuple):
    """A process whose numbers could differ in bits; it has evaluated nothing."""

    who: str  # its name
    reasons: tuple[str, ...]  # what differs there


def evaluate(block: Block) -> Evaluated:
    """Return the answers of a block, evaluated here."""
    began = time.perf_counter()
    answers = simulate(block.model, block.deviations, block.settings)
    return Evaluated(answers, time.perf_counter() - began)


class Threads:
    """Daemon threads: at its exit Python waits for those of the standard library.

    Compiled code cannot be interrupted: after Ctrl-C a thread may spend minutes on a
    trial that is no longer needed.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None]
        self._tasks = SimpleQueue()
        self._threads = [Thread(target=self._work, daemon=True) for _ in range(number)]
        for thread in self._threads:
            thread.start()

    def submit(self, block: Block) -> Future[Evaluated]:
        """Let a thread evaluate a block."""
        return self.call(evaluate, block)

    def answer(self, future: Future[Evaluated], block: Block) -> Evaluated:
        """Return the answer of a finished block."""
        return future.result()

    def call(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Let a thread call a function."""
        future: Future[Any] = Future()
        self._tasks.put((future, partial(function, *arguments)))
        return future

    def _work(self) -> None:
        while task := self._tasks.get():
            future, call = task
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(call())
                except BaseException as error:
                    future.set_exception(error)
            del task, future, call  # results are not kept while waiting for more

    def close(self, *, wait: bool) -> None:
        """End the threads; what has not begun is cancelled."""
        with suppress(Empty):
            while task := self._tasks.get_nowait():
                task[0].cancel()
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads if wait else ():
            thread.join()

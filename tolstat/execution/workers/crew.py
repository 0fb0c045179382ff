"""Blocks of trials on the workers of an executor: threads here, or other processes."""

import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, chdir, contextmanager, suppress
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any

from tolstat.arrays import Array
from tolstat.errors import LostError, TolstatError, told
from tolstat.execution.workers.remote_blocks import Mismatch, carried_out, packed
from tolstat.model.checked import simulate
from tolstat.model.contract import Answers, Model
from tolstat.study.given_points import Case

LOOK_AGAIN = 0.1  # s, between two checks whether to stop
GRACE = 1.0  # s, for running blocks to end; a compilation takes longer
AHEAD = 2  # blocks for each worker, so that none waits for the writer
LASTING = 0.5  # s, of a block: long ones keep lanes busy, short ones show progress
FIRST_BLOCK = 32  # trials, while their duration is unknown
GROWTH = 8  # times the last block, at most
LEAST = 8  # trials of a block, unless fewer are left


class Interrupted(Exception):
    """The caller has stopped the run."""


class Workers(AbstractContextManager["Workers"]):
    """Threads, or any executor of other processes, that evaluate trials.

    Parameters
    ----------
    number : int, optional
        How many blocks run at once; by default one for each worker of the executor, or
        processor.
    stopping : callable
        Called ten times a second; once true, no block starts any more.
    executor : concurrent.futures.Executor, optional
        Of other processes: a `Cluster`, `mpi4py.futures.MPIPoolExecutor`,
        `ProcessPoolExecutor`. By default threads of this process: compiled code
        releases the GIL, so it is compiled once. The results do not depend on it. The
        caller shuts it down.
    block : int, optional
        Trials of every block; by default blocks grow to last about half a second.
    """

    def __init__(
        self,
        number: int | None = None,
        stopping: Callable[[], bool] = lambda: False,
        *,
        executor: Executor | None = None,
        block: int | None = None,
    ) -> None:
        self.stopping = stopping
        self._given, self._fixed = number, block
        self._own = None if executor else Threads(number or processors())
        self._executor = executor

    @property
    def number(self) -> int:
        """How many blocks run at once; a cluster grows and shrinks."""
        there = (getattr(self._executor, name, 0) for name in ("number", "num_workers"))
        return self._given or next(filter(None, there), None) or processors()

    def _submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Let a worker call a function of tolstat."""
        if self._executor is None:
            assert self._own
            return self._own.submit(function, *arguments)
        parcel = packed(partial(function, *arguments))
        with _processes():
            future = self._executor.submit(carried_out, parcel)
        if isinstance(future, Future):
            return future
        raise self._broken(future, "a Future")

    def _broken(self, found: object, expected: str) -> LostError:
        called, kind = type(self._executor).__name__, type(found).__name__
        return _lost(f"{called} returns {kind}, not {expected}")

    def _result(self, future: Future[Any], shape: tuple[int, int]) -> Any:
        """Return answers[shape] of a worker; None if another one has to repeat them."""
        if self._executor is None:
            return future.result()
        with _processes():
            found = future.result()
        match found:
            case Mismatch(who, reasons):
                if not hasattr(self._executor, "refuse"):
                    raise _lost(f"{who}: {'; '.join(reasons)}")
                self._executor.refuse(found)
                return None
            case (Answers(responses, status, _), float()):
                shapes = [getattr(each, "shape", 0) for each in (responses, status)]
                if shapes == [shape, shape[:1]]:
                    return found
        raise self._broken(found, f"the answers of {shape[0]} trials")

    def blocks(
        self, model: Model, cases: Sequence[Case], deviations: Array
    ) -> Iterator[list[tuple[int, Answers]]]:
        """Evaluate trials in blocks, and yield each block when it is finished.

        Each block of deviations[trial, contributor], SI, comes with the number of its
        first trial. When stopping, running blocks get a second to finish.
        """
        left = sum(case.stop - case.first for case in cases)
        size = BlockSize(self.number, self._fixed)
        todo = list(reversed(cases))
        running: dict[Future[tuple[Answers, float]], Case] = {}
        patience = math.inf
        columns = len(model.describe(cases[0].settings).responses) if cases else 0
        try:
            while True:
                size.workers = self.number
                while (
                    todo and len(running) < AHEAD * self.number and not self.stopping()
                ):
                    case = todo.pop()
                    stop = min(case.first + size.of(left), case.stop)
                    if stop < case.stop:
                        todo.append(case._replace(first=stop))
                    left -= stop - case.first
                    rows = deviations[case.first : stop]
                    future = self._submit(_timed, model, rows, case.settings)
                    running[future] = case._replace(stop=stop)
                if not running:
                    return
                if not any(each.done() for each in running):  # `wait` misses cancelled
                    wait(running, LOOK_AGAIN, return_when=FIRST_COMPLETED)
                finished = []
                for future in [each for each in running if each.done()]:
                    block = running.pop(future)
                    shape = block.stop - block.first, columns
                    if found := self._result(future, shape):
                        outcome, seconds = found
                        size.learn(len(outcome.responses), seconds)
                        finished.append((block.first, outcome))
                    else:
                        todo.append(block)
                        left += block.stop - block.first
                if finished:
                    yield finished
                if self.stopping():
                    patience = min(patience, time.monotonic() + GRACE)
                    for future in list(running):
                        if future.cancel():
                            del running[future]
                if time.monotonic() > patience:
                    return
        finally:
            for future in running:
                future.cancel()

    def simulate(self, model: Model, deviations: Array, settings: Any) -> Answers:
        """Return the answers of trials with the same settings.

        At least one row of deviations[trial, contributor], SI; `Interrupted` if the
        workers stop before all are finished.
        """
        return self.simulate_cases(
            model, [Case(0, len(deviations), settings)], deviations
        )

    def simulate_cases(
        self, model: Model, cases: Sequence[Case], deviations: Array
    ) -> Answers:
        """Return the answers of trials with each case's settings; see `simulate`."""
        with chdir("."):  # a model may leave it
            found = [b for some in self.blocks(model, cases, deviations) for b in some]
        outcomes = [each for _, each in sorted(found, key=lambda block: block[0])]
        if sum(len(each.responses) for each in outcomes) < len(deviations):
            raise Interrupted
        return Answers.joined(outcomes)

    def here(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a long function returns, here; `Interrupted` if stopped.

        Its thread then ends by itself.
        """
        thread = Threads(1)
        future = thread.submit(function, *arguments)
        thread.shutdown(wait=False)
        while not future.done():
            wait([future], LOOK_AGAIN)
            if self.stopping():
                raise Interrupted
        return future.result()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Shut the workers down; a stop does not wait for a compilation."""
        if self._own:
            wait = kind is None and not self.stopping()
            self._own.shutdown(wait=wait, cancel_futures=True)


class BlockSize:
    """Number of trials in the next block, so that it lasts half a second."""

    def __init__(self, workers: int, fixed: int | None) -> None:
        self.workers = workers
        self._fixed = fixed
        self._next = FIRST_BLOCK

    def of(self, left: int) -> int:
        """Return the size of the next block: all workers end at about the same time."""
        if self._fixed:
            return self._fixed
        return min(self._next, max(FIRST_BLOCK, math.ceil(left / (2 * self.workers))))

    def learn(self, trials: int, seconds: float) -> None:
        """Note how long a block of so many trials lasted, s."""
        wanted = trials * LASTING / max(seconds, 1e-6)
        self._next = max(LEAST, int(min(wanted, GROWTH * max(trials, self._next))))


def _timed(model: Model, deviations: Array, settings: Any) -> tuple[Answers, float]:
    """Return the answers of a block on a worker, and its duration, s."""
    began = time.perf_counter()
    return simulate(model, deviations, settings), time.perf_counter() - began


@contextmanager
def _processes() -> Iterator[None]:
    """Raise LostError, whatever an executor raises if its processes are lost."""
    try:
        yield
    except TolstatError:
        raise
    except (Exception, SystemExit) as error:
        raise _lost(told(error)) from error


def _lost(why: str) -> LostError:
    return LostError(f"a worker process: {why}")


def processors() -> int:
    """Return the number of processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


class Threads(Executor):
    """Daemon threads: at its exit Python waits for those of the standard library.

    Compiled code cannot be interrupted: after Ctrl-C a thread may spend minutes on a
    trial that is no longer needed.
    """

    def __init__(self, number: int) -> None:
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None]
        self._tasks = SimpleQueue()
        self._threads = [Thread(target=self._work, daemon=True) for _ in range(number)]
        for thread in self._threads:
            thread.start()

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Let a thread call a function."""
        future: Future[Any] = Future()
        self._tasks.put((future, partial(fn, *args, **kwargs)))
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

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Shut the threads down."""
        with suppress(Empty):
            while cancel_futures and (task := self._tasks.get_nowait()):
                task[0].cancel()
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads if wait else ():
            thread.join()

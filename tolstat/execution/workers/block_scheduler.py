"""Blocks of trials: their sizes, how many are under way, and when to stop."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, chdir
from typing import Any

from tolstat.arrays import Array
from tolstat.execution.workers.local_blocks import Block, Mismatch, Threads
from tolstat.model.contract import Model, TrialResults
from tolstat.operating_system import processors
from tolstat.status import ran_in_order
from tolstat.store.run_writer import Stoppable
from tolstat.study.given_points import Case

LOOK_AGAIN = 0.1  # s, between two checks whether to stop
PATIENCE = 1.0  # s after a stop, in which planning and writing may end
GRACE = 1.0  # s, for running blocks to end, and for isolated ones to hand theirs back
AHEAD = 2  # blocks for each worker, so that none waits for the writer
LASTING = 0.5  # s, of a block: long ones keep lanes busy, short ones show progress
FIRST_BLOCK = 32  # trials, while their duration is unknown
GROWTH = 8  # times the last block, at most
FEWEST = 8  # trials of a block, unless fewer are left, or lanes have none


class Interrupted(Exception):
    """The caller has stopped the run."""


class Workers(Stoppable, AbstractContextManager["Workers"]):
    """Workers that evaluate trials in blocks.

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
        self._stopped_at = 0.0  # 0 if nothing has looked since
        self._patience = math.inf  # until then running blocks get time to finish
        self._number, self._block = number, block
        if executor:
            from tolstat.execution.workers.remote_blocks import Processes  # seldom

            self._pool: Threads | Processes = Processes(executor)
        else:
            self._pool = Threads(number or processors())

    @property
    def number(self) -> int:
        """How many blocks run at once; a cluster grows and shrinks."""
        return self._number or self._pool.number

    def blocks(
        self,
        model: Model,
        cases: Sequence[Case],
        deviations: Array,
        late: Callable[[], bool] = lambda: False,
    ) -> Iterator[list[tuple[int, TrialResults]]]:
        """Evaluate trials in blocks, and yield each block when it is finished.

        Each block of deviations[trial, contributor], SI, comes with the number of its
        first trial. When stopping, running blocks get a second to finish; then isolated
        ones hand back what has ended. Once it is late, they get as long as they take.
        """
        remaining = sum(case.stop - case.first for case in cases)
        size = BlockSize(self.number, self._block, model.row_by_row)
        if part := model.isolation:
            part.stopping = lambda: time.monotonic() > self._patience
        todo = list(reversed(cases))
        running: dict[Future[Any], tuple[Case, Block]] = {}
        try:
            while True:
                size.workers = self.number
                over = self.stopping() or late()
                while todo and len(running) < AHEAD * self.number and not over:
                    case = todo.pop()
                    stop = min(case.first + size.next(remaining), case.stop)
                    if stop < case.stop:
                        todo.append(case._replace(first=stop))
                    remaining -= stop - case.first
                    block = Block(model, deviations[case.first : stop], case.settings)
                    future = self._pool.submit(block)
                    running[future] = case._replace(stop=stop), block
                    over = self.stopping()
                if not running:
                    return
                # `wait` misses those that an executor has cancelled
                if not any(future.done() for future in running):
                    wait(running, LOOK_AGAIN, return_when=FIRST_COMPLETED)
                finished = []
                for future in [future for future in running if future.done()]:
                    case, block = running.pop(future)
                    outcome = self._pool.answer(future, block)
                    ran = 0
                    if not isinstance(outcome, Mismatch):
                        size.learn(case.stop - case.first, outcome.seconds)
                        if ran := ran_in_order(outcome.answers.status):
                            finished.append((case.first, outcome.answers.first(ran)))
                    if rest := case.stop - case.first - ran:
                        todo.append(case._replace(first=case.first + ran))
                        remaining += rest
                if finished:
                    yield finished
                if self.stopping():
                    self._patience = min(self._patience, time.monotonic() + GRACE)
                if over or self.stopping():
                    for future in list(running):
                        if future.cancel():
                            del running[future]
                if time.monotonic() > self._patience + (GRACE if part else 0.0):
                    return
        finally:
            for future in running:
                future.cancel()

    def simulate(self, model: Model, deviations: Array, settings: Any) -> TrialResults:
        """Return the answers of trials with the same settings.

        At least one row of deviations[trial, contributor], SI; `Interrupted` if the
        workers stop before all are finished.
        """
        return self.simulate_cases(
            model, [Case(0, len(deviations), settings)], deviations
        )

    def simulate_cases(
        self, model: Model, cases: Sequence[Case], deviations: Array
    ) -> TrialResults:
        """Return the answers of trials with each case's settings; see `simulate`."""
        with chdir("."):  # a model may leave it
            outcomes = dict(
                block
                for finished in self.blocks(model, cases, deviations)
                for block in finished
            )
        answers = [outcomes[first] for first in sorted(outcomes)]
        if sum(len(block.status) for block in answers) < len(deviations):
            raise Interrupted
        return TrialResults.joined(answers)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a long function returns, here; `Interrupted` if stopped.

        Its thread then ends by itself: what it computes is lost, so it must write no
        file.
        """
        thread = Threads(1)
        try:
            with chdir("."):  # a model may leave it, at once
                future = thread.call(function, *arguments)
                while not future.done():
                    wait([future], LOOK_AGAIN)
                    if not future.done():
                        self.check()
        finally:
            thread.close(wait=False)
        return future.result()

    def check(self) -> None:
        """Raise `Interrupted` if the workers stop, and have for `PATIENCE`.

        So a small run is planned and written all the same, and can be resumed.
        """
        if not self.stopping():
            return
        self._stopped_at = self._stopped_at or time.monotonic()
        if time.monotonic() - self._stopped_at > PATIENCE:
            raise Interrupted

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Release the workers; a stop does not wait for a compilation."""
        self._pool.close(wait=kind is None and not self.stopping())


class BlockSize:
    """Number of trials in the next block, so that it lasts half a second."""

    def __init__(self, workers: int, fixed: int | None, by_row: bool = False) -> None:
        self.workers = workers
        self._fixed = fixed
        self._fewest, self._next = (1, 1) if by_row else (FEWEST, FIRST_BLOCK)

    def next(self, remaining: int) -> int:
        """Return the size of the next block: all workers end at about the same time."""
        if self._fixed:
            return self._fixed
        share = math.ceil(remaining / (2 * self.workers))
        return min(self._next, max(FIRST_BLOCK, share))

    def learn(self, trials: int, seconds: float) -> None:
        """Note how long a block of so many trials lasted, s."""
        size = trials * LASTING / max(seconds, 1e-6)
        self._next = max(self._fewest, int(min(size, GROWTH * max(trials, self._next))))

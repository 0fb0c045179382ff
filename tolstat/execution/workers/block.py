"""A block of trials: the message to a worker, its answer, and what workers share."""

import time
from concurrent.futures import Future
from typing import Any, NamedTuple, Protocol

from tolstat.arrays import Array
from tolstat.model.checked import simulate
from tolstat.model.contract import Answers, Model


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

    answers: Answers
    seconds: float


class Mismatch(NamedTuple):
    """A process whose numbers could differ in bits; it has evaluated nothing."""

    who: str  # its name
    reasons: tuple[str, ...]  # what differs there


class Pool(Protocol):
    """Workers of one kind: threads, processes, an executor of a cluster."""

    @property
    def number(self) -> int:
        """How many blocks run at once now."""

    def submit(self, block: Block) -> Future[Any]:
        """Let a worker evaluate a block."""

    def answer(self, future: Future[Any], block: Block) -> Evaluated | Mismatch:
        """Return the answer of a finished block.

        After a `Mismatch` another worker has to evaluate it. A ModelError blames the
        model, a LostError says that workers are lost.
        """

    def close(self, *, wait: bool) -> None:
        """Release the workers, and wait for their blocks or not."""


def evaluate(block: Block) -> Evaluated:
    """Return the answers of a block, evaluated here."""
    began = time.perf_counter()
    answers = simulate(block.model, block.deviations, block.settings)
    return Evaluated(answers, time.perf_counter() - began)

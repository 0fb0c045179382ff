"""How a trial ended: the words of tables, frames and run files."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """How a trial ended; `NOT_RUN` is what a run file starts with."""

    NOT_RUN = 0
    DONE = 1
    TOO_MANY_STEPS = 2
    STEP_TOO_SMALL = 3
    NOT_FINITE = 4

    @property
    def word(self) -> str:
        """The status as it is printed: "done", "too many steps", ..."""
        return self.name.lower().replace("_", " ")


WORDS: tuple[str, ...] = tuple(status.word for status in Status)

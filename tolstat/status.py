"""How a trial ended: the words of tables, frames and run files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray


class Status(IntEnum):
    """How a trial ended; `NOT_RUN` is what a run file starts with."""

    NOT_RUN = 0
    DONE = 1
    TOO_MANY_STEPS = 2
    STEP_TOO_SMALL = 3
    NOT_FINITE = 4
    CRASHED = 5  # its process ended
    TOOK_TOO_LONG = 6  # its process was ended

    @property
    def word(self) -> str:
        """The status as it is printed: "done", "too many steps", ..."""
        return self.name.lower().replace("_", " ")


def ran_in_order(status: NDArray[np.integer[Any]]) -> int:
    """Return how many of the first trials have run, up to one that has not."""
    not_run = (status == Status.NOT_RUN).nonzero()[0]
    return int(not_run[0]) if len(not_run) else len(status)


FIRST_OWN = 100  # failures of a model have numbers from here to 255


def words_of(failures: Iterable[str] = ()) -> dict[int, str]:
    """Return the word of each status that a trial of a model can have.

    Those of `Status` first, then those of `Model.failures`: why a trial may have no
    answer.
    """
    of_model = {FIRST_OWN + i: word for i, word in enumerate(failures)}
    return {**{int(status): status.word for status in Status}, **of_model}


def status_words(
    status: NDArray[np.integer[Any]], words: Mapping[int, str]
) -> pd.Categorical[str]:
    """Return the word of each int[trial] status; `words` are those of `words_of`."""
    import numpy as np
    import pandas as pd

    places = np.zeros(256, np.int64)
    places[list(words)] = np.arange(len(words))
    return pd.Categorical.from_codes(places[status].tolist(), pd.Index(words.values()))

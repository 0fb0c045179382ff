"""How trials ended, as a column of words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd


def status_words(
    status: NDArray[np.integer[Any]], words: Mapping[int, str]
) -> pd.Categorical[str]:
    """Return the word of each status.

    Parameters
    ----------
    status : int[trial]
        Keys of `words`.
    words : mapping of int to str
        Of every status that a trial of the machine can have.
    """
    import pandas as pd

    places = np.zeros(256, np.int64)
    places[list(words)] = np.arange(len(words))
    return pd.Categorical.from_codes(places[status].tolist(), pd.Index(words.values()))

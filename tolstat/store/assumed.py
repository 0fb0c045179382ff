"""What a study says of a deviation, kept with the run."""

from __future__ import annotations

from typing import NamedTuple


class Assumed(NamedTuple):
    """What was assumed of a deviation.

    Attributes
    ----------
    tolerance : tuple of float
        Its ends, SI.
    words : str
        Its distribution.
    batch : str
        The batch whose parts are all as this one; empty for a part of its own.
    """

    tolerance: tuple[float, float]
    words: str
    batch: str

"""Arrays in a page: base64 of their bytes."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def packed(values: ArrayLike, kind: str) -> str:
    """Return an array as text: base64 of values of a kind, "<f4" or "<i2"."""
    array: Any = np.ascontiguousarray(values, kind)
    return base64.b64encode(array.tobytes()).decode()

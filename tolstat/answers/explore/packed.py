"""Arrays in a page: base64 of their bytes."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def packed(values: ArrayLike, kind: str) -> dict[str, str]:
    """Return an array of a kind, "f8", "f4" or "i2", as a script reads it."""
    array: Any = np.ascontiguousarray(values, f"<{kind}")
    return {"type": kind, "base64": base64.b64encode(array.tobytes()).decode()}

"""The answers of two runs compared."""

from __future__ import annotations

import numpy as np


def same(one, other):
    assert one.complete and other.complete
    for name in one.frame().columns:
        if name != "status":
            np.testing.assert_array_equal(one.column(name), other.column(name))
    np.testing.assert_array_equal(one.status, other.status)
    assert str(one.diagnostics) == str(other.diagnostics)

"""Two runs compared, and a stop after some trials."""

from __future__ import annotations

import numpy as np


class Enough:
    """Stops a run once so many of its trials are over."""

    def __init__(self, trials):
        self.trials, self.over = trials, 0

    def __call__(self):
        return self.over >= self.trials

    def tell(self, progress):
        self.over = progress.over


def same(one, other, but=""):
    """Everything but times and names."""
    for name in (*one.units, "status"):
        np.testing.assert_array_equal(one.column(name), other.column(name))
    for found in (
        "nominal_values",
        "diagnostics",
        "stopped",
        "notes",
        "limits",
        "study",
    ):
        alike = repr(getattr(one, found)) == repr(getattr(other, found))
        assert alike or found == but, found
    assert repr(one.audited) == repr(other.audited)
    return True

"""The permitted zone of a deviation."""

from __future__ import annotations

from typing import NamedTuple


class Tolerance(NamedTuple):
    """The permitted zone of a deviation, in the SI unit of its contributor."""

    lower: float
    upper: float

    @property
    def middle(self) -> float:
        """Middle of the zone, the aim of a centred process."""
        return 0.5 * (self.lower + self.upper)

    @property
    def nearest(self) -> float:
        """The deviation in the zone that is nearest to zero."""
        return min(max(0.0, self.lower), self.upper)

    @property
    def half(self) -> float:
        """Half the width of the zone."""
        return 0.5 * (self.upper - self.lower)

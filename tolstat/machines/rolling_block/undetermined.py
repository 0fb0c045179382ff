"""What a table of modes leaves open."""

from __future__ import annotations

from tolstat.machines.rolling_block.fitting import Fit
from tolstat.machines.rolling_block.table import Flags
from tolstat.machines.rolling_block.topology import LINK_NAMES, MASSES

OPEN = 1.0 / 3.0  # standard deviation, of itself: three of them reach down to nothing
UNKNOWNS = (*(f"Q{i + 1}" for i in range(len(MASSES))), *(f"C{n}" for n in LINK_NAMES))


def open_unknowns(fit: Fit, counts: Flags) -> str:
    """Name the unknowns of one drive that some numbers do not determine.

    Parameters
    ----------
    fit, counts : Fit, bool[1, 1 + mass, mode]
        The drive, and these numbers.
    """
    spread = fit.spread(counts)[0]
    return ", ".join(
        name for name, each in zip(UNKNOWNS, spread, strict=True) if each > OPEN
    )

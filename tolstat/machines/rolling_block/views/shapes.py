"""Mode shapes, the paper's Table 1, one picture for each mode."""

from __future__ import annotations

import numpy as np

from tolstat.machines.rolling_block.modes import tracked, unit_shapes
from tolstat.machines.rolling_block.views.seen import Seen, bands
from tolstat.model.view import Axis, Band, Chart, Curve, Level, Panel


def mode_shapes(seen: Seen) -> Chart:
    """Chart the shapes over the number of the mass, as points: the drive branches.

    Parameters
    ----------
    seen : Seen
        Bands are of the modes that are alike, whatever number they have: modes veer.
    """
    first = unit_shapes(seen.modes.phi[0])
    hz = seen.modes.omega[0] / (2 * np.pi)
    others = np.empty((0, *first.shape))
    if len(seen.others):
        _, others = tracked(seen.modes.phi[seen.others], first)
    curves, panels = [], []
    spreads: list[Band] = []
    for r, frequency in enumerate(hz):
        name = f"mode {r + 1}"
        curves.append(
            Curve(
                name, "1", f"phi{r + 1}", f"{frequency:.3f} Hz", first[:, r],
                points=True,
            )
        )  # fmt: skip
        opened = bands(name, "1", others[:, :, r])
        spreads += opened
        names = (name, *(band.name for band in opened))
        panels.append(Panel(f"{frequency:.2f} Hz", names, levels=(Level(0.0, ""),)))
    return Chart(
        Axis("mass", "1", "1"),
        np.arange(1.0, len(first) + 1),
        tuple(curves),
        bands=tuple(spreads),
        panels=tuple(panels),
    )

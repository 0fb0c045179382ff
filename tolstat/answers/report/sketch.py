"""How one of the worst machines moved, as a small picture in a row of a table."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

from tolstat.render.picture import COLOURS
from tolstat.store.stored_diagnostics import Sketch

WIDTH, HEIGHT = 190, 55
MOST_POINTS = 380  # of a curve: two for each unit of its width


def sketch(of: Sketch, trial: int) -> Markup:
    """Draw the stored curves of a machine.

    Written as SVG here: fifty pictures of a line need no drawing library.

    Parameters
    ----------
    of : Sketch
        Its stored curves.
    trial : int
        Its number, for those who do not see the picture.
    """
    start, length = float(of.at[0]), float(np.ptp(of.at)) or 1.0
    values = np.concatenate(list(of.curves.values()))
    values = values[np.isfinite(values)]
    low, high = (values.min(), values.max()) if len(values) else (0.0, 1.0)
    tall = float(high - low) or 1.0

    def place(at: float) -> float:
        return WIDTH * (at - start) / length

    shades = [
        f'<rect x="{place(a):.1f}" width="{place(b) - place(a):.1f}" '
        f'height="{HEIGHT}" fill="currentColor" opacity="0.06"/>'
        for a, b in of.spans
    ]
    lines = []
    for curve, colour in zip(of.curves.values(), COLOURS, strict=False):
        chosen = [i for i in _outline(curve) if np.isfinite(curve[i])]
        points = " ".join(
            f"{place(float(of.at[i])):.1f},"
            f"{HEIGHT - 1 - (HEIGHT - 2) * (float(curve[i]) - low) / tall:.1f}"
            for i in chosen
        )
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" '
            'stroke-width="1"/>'
        )
    words = ", ".join(of.curves)
    over = of.axis.partition(",")[0]
    return Markup(
        f'<svg role="img" aria-label="{escape(f"Trial {trial}: {words} over {over}")}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}">{"".join(shades)}{"".join(lines)}</svg>'
    )


def _outline(curve: NDArray[np.float32]) -> list[int]:
    """Choose points of a curve: the least and the largest of each stretch."""
    if len(curve) <= MOST_POINTS:
        return list(range(len(curve)))
    found: list[int] = []
    known = np.nan_to_num(curve)
    for stretch in np.array_split(np.arange(len(curve)), MOST_POINTS // 2):
        of = known[stretch]
        found += sorted({int(stretch[of.argmin()]), int(stretch[of.argmax()])})
    return found

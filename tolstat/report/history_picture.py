"""How one machine moved, drawn."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tolstat.machines.description import Curve, History
from tolstat.report.numbers import in_engineering_unit
from tolstat.report.picture import COLOURS, factor, level, styled
from tolstat.units.conversion import engineering_unit


def draw_history(history: History, title: str) -> Figure:
    """Draw the histories of one machine, one above the other.

    Parameters
    ----------
    history : History
        As a model returns it.
    title : str
        Which machine.

    Returns
    -------
    Figure
        A page: the window over which responses are taken is shaded, each peak in it is
        marked where it falls.
    """
    curves = {curve.name: curve for curve in history.curves}
    with styled():
        figure = Figure(figsize=(8.0, 1.75 * len(history.panels) + 0.8))
        figure.set_layout_engine("constrained")
        every = figure.subplots(len(history.panels), 1, sharex=True, squeeze=False)
        for axes, panel in zip(every[:, 0], history.panels, strict=True):
            axes.set_title(panel.title)
            axes.axvspan(*history.window, color="#f2f2f2", zorder=0)
            shown = [curves[name] for name in panel.curves]
            lines = _draw(axes, history, shown, 0)
            for value, words in panel.levels:
                line = level(axes, value * factor(shown[0].unit), words)
                lines += [line] if words else []
            if panel.right:
                right = axes.twinx()
                right.grid(visible=False)
                right.spines["right"].set_visible(True)
                further = [curves[name] for name in panel.right]
                lines += _draw(right, history, further, len(shown))
            # above the picture, on the line of its title, where it covers nothing
            legend = axes.legend(
                handles=lines, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4,
                borderaxespad=0.1, handlelength=1.4, columnspacing=1.2,
            )  # fmt: skip
            legend.set_in_layout(False)
        every[-1, 0].set_xlabel("time, s (shaded: over which responses are taken)")
        every[0, 0].set_xlim(0.0, history.time[-1])
        figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _draw(
    axes: Axes, history: History, curves: list[Curve], first: int
) -> list[Line2D]:
    """Draw curves of one unit, with their peaks; the legend says how high those are."""
    unit = curves[0].unit
    axes.set_ylabel(engineering_unit(unit))
    scale = factor(unit)
    peaks = {peak.curve: peak for peak in history.peaks}
    lines = []
    for curve, colour in zip(curves, COLOURS[first:], strict=False):
        name = curve.name.replace("_", " ")
        (line,) = axes.plot(history.time, scale * curve.values, color=colour)
        if curve.name in peaks:
            _, time, value = peaks[curve.name]
            axes.plot(time, scale * value, "o", color=colour, markersize=4)
            peak = f"{in_engineering_unit(value, unit)} {engineering_unit(unit)}"
            name += f": peak {peak}"
        line.set_label(name)
        lines.append(line)
    if not any(np.ptp(curve.values) > 0 for curve in curves):
        axes.set_ylim(-1, 1)  # nothing moves: no axis of rounding errors
    return lines

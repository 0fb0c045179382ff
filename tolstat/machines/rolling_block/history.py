"""How one drive twisted: elastic moments over time, under loads and a pulse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.declarations import RESPONSES
from tolstat.machines.rolling_block.settings import Settings
from tolstat.machines.rolling_block.topology import LINK_NAMES, STANDS
from tolstat.model.view import Axis, Chart, Curve, Mark, Panel, Span

Array = NDArray[np.float64]

KINDS = ("moment_peak", "pulse_peak")
PAIRS = ("Motor side", "To C and D", "Spindles of C", "Spindles of D")


def chart_of(time: Array, loaded: Array, pulsed: Array, settings: Settings) -> Chart:
    """Chart the moments of a drive.

    Parameters
    ----------
    time : float64[time]
        s.
    loaded, pulsed : float64[time, link]
        N m: while the loads step, and after the pulse.
    settings : Settings
        When loads step, and where the pulse acts.

    Returns
    -------
    Chart
        Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    curves, marks = [], []
    for kind, moments in zip(KINDS, (loaded, pulsed), strict=True):
        for ij, moment in zip(LINK_NAMES, moments.T, strict=True):
            said = words[f"{kind}_{ij}"]
            sentence = said.sentence.removeprefix("peak ")
            curves.append(
                Curve(
                    said.name, said.unit, f"M{ij}", sentence, moment, shown=said.shown
                )
            )
            if np.isfinite(moment).all():
                top = int(np.abs(moment).argmax())
                at, value = float(time[top]), float(moment[top])
                marks.append(Mark(said.name, at, value, "peak"))
    ends = settings.entries[-1], min(settings.pulse_length, settings.horizon)
    stands = ", ".join(map(str, STANDS))
    shaded = (
        Span(0.0, ends[0], f"loads: stands {stands} enter"),
        Span(0.0, ends[1], "pulse: while it lasts"),
    )
    pairs = tuple(zip(LINK_NAMES[::2], LINK_NAMES[1::2], strict=True))
    panels = [
        Panel(
            f"{pair}, {what}",
            tuple(f"{kind}_{ij}" for ij in links),
            spans=(span,) if span.upper else (),
        )
        for kind, what, span in zip(KINDS, ("loads", "pulse"), shaded, strict=True)
        for pair, links in zip(PAIRS, pairs, strict=True)
    ]
    return Chart(
        Axis("time", "s", "s"),
        time,
        tuple(curves),
        marks=tuple(marks),
        panels=tuple(panels),
    )

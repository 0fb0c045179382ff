"""How one drive twisted: elastic moments over time, under loads and a pulse."""

from __future__ import annotations

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.topology import LINK_NAMES, STANDS
from tolstat.model.view import Axis, Chart, Curve, Panel, Span, peaks_of

KINDS = ("moment_peak", "pulse_peak")
PAIRS = ("Motor side", "To C and D", "Spindles of C", "Spindles of D")


def chart_of(time: Array, loaded: Array, pulsed: Array, settings: Settings) -> Chart:
    """Chart the moments, N m, [time, link]: loads stepping, and after the pulse.

    Returns
    -------
    Chart
        Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    curves = [
        Curve.of(words[f"{kind}_{ij}"], moment)
        for kind, moments in zip(KINDS, (loaded, pulsed), strict=True)
        for ij, moment in zip(LINK_NAMES, moments.T, strict=True)
    ]
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
        marks=peaks_of(curves, time),
        panels=tuple(panels),
    )

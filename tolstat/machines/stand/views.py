"""Views of a stand: curves over time, and their pictures."""

from __future__ import annotations

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import RESPONSES
from tolstat.machines.stand.motion import Motion, State
from tolstat.model.view import Axis, Chart, Curve, Level, Panel, Span, peaks_of

POWERS = {
    "drive": "power of the drive on gear 13",
    "slide": "lost to friction under the weight",
    "guide": "lost to friction at the side guides",
    "roll": "power of rolling",
    "spin": "lost to friction against yawing",
    "damping": "lost in rods, meshes and shafts",
    "contact": "power of the guides against yawing",
}


def chart_of(
    time: Array, states: Array, moved: Motion, window: tuple[float, float], delta: float
) -> Chart:
    """Return the chart of a motion; the first two panels are the paper's Figs. 2 and 3.

    Loads are signed.
    """
    y = State(*states.T[: len(State._fields)])
    words = {response.name: response for response in RESPONSES}
    loads = [Curve.of(words[n], load) for n, load in moved.loads._asdict().items()]
    powers = [
        Curve(f"{power}_power", "W", "P", sentence, getattr(moved.powers, power))
        for power, sentence in POWERS.items()
    ]
    guides = (Level(delta, "guides touched"), Level(-delta, ""))
    losses = ("slide_power", "guide_power", "spin_power", "damping_power")
    return Chart(
        Axis("time", "s", "s"),
        time,
        (
            Curve("crank_position_1", "rad", "phi31", "angle of wheel 7", y.phi31),
            Curve("crank_position_2", "rad", "phi32", "angle of wheel 8", y.phi32),
            Curve("position", "m", "x", "position of the carriage", y.x),
            Curve("speed", "m/s", "x'", "speed of the carriage", y.x_),
            *loads,
            *powers,
        ),
        marks=peaks_of(loads, time, least=window[0]),
        spans=(Span(*window, "over which responses are taken"),),
        panels=(
            Panel("Moment of shaft 9", ("shaft_9_moment",)),
            Panel("Rod forces (tension is positive)", ("rod_force_1", "rod_force_2")),
            Panel("Yaw of the carriage", ("yaw",), levels=guides),
            Panel("Carriage", ("position",), right=("speed",)),
            Panel("Power", ("drive_power", "roll_power")),
            Panel("Losses", losses),
        ),
    )

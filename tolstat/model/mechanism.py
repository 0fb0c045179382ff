"""A mechanism in motion, as data: points and lines over frames, forces as bars."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.model.view import Axis, Curve

MOST_FRAMES = 400
MOST_POINTS = 400


class Line(NamedTuple):
    """A line through some points of a mechanism, in their order: a rod, a carriage."""

    name: str
    points: tuple[int, ...]  # a closed line ends with its first point
    colour: str = "first"  # its role in a figure: "first" to "sixth"
    joints: bool = False  # whether its points are drawn as dots


@dataclass(frozen=True)
class Mechanism:
    """A mechanism of one trial, frame by frame; numbers are SI.

    Deviations are too small to be seen: a picture draws what points are off their
    `reference` many times too large, and says how many times.

    Attributes
    ----------
    axis : Axis
        Along which it moves: time, or the angle of a crank.
    at : float64[frame]
        Where on the axis.
    points : float64[frame, point, 2]
        To the right and up; NaN in frames without an answer, which are left out.
    lines : tuple of Line
        Through these points.
    ground : tuple of float64[corner, 2]
        Lines that never move, such as a bearing.
    bars : tuple of Curve
        Forces and moments, a value for each frame, with the colours of their lines.
    reference : float64[frame, point, 2] or None
        Points of a machine without deviations and deflections; None: those of the
        nominal trial.
    sentence : str
        What is seen.
    """

    axis: Axis
    at: Array
    points: Array
    lines: tuple[Line, ...]
    ground: tuple[Array, ...] = ()
    bars: tuple[Curve, ...] = ()
    reference: Array | None = None
    sentence: str = ""

    @property
    def fault(self) -> str:
        """What is wrong with its arrays and lines; empty if nothing is."""
        return next(self._faults(), "")

    def _faults(self) -> Iterator[str]:
        """Yield what is wrong."""
        frames, n = len(self.at), MOST_FRAMES
        shape = np.shape(self.points)
        if not 1 <= frames <= n or np.ndim(self.at) != 1:
            yield f"a mechanism has 1 to {n} frames, not {frames}"
        if len(shape) != 3 or shape[0] != frames or shape[2] != 2:
            yield f"points are [frame, point, 2] of {frames} frames, not {[*shape]}"
            return
        if not 1 <= shape[1] <= MOST_POINTS:
            yield f"a mechanism has 1 to {MOST_POINTS} points, not {shape[1]}"
        if self.reference is not None and np.shape(self.reference) != shape:
            yield f"its reference is {[*np.shape(self.reference)]}, not {[*shape]}"
        for line in self.lines:
            if not line.points or not {*line.points} <= {*range(shape[1])}:
                yield f"line {line.name} joins points that it does not have"
        for corners in self.ground:
            if np.ndim(corners) != 2 or np.shape(corners)[1] != 2:
                yield f"ground is [corner, 2], not {[*np.shape(corners)]}"
        for bar in self.bars:
            if np.shape(bar.values) != (frames,):
                yield f"{bar.name} has {len(bar.values)} values for {frames} frames"

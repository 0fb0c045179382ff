"""Vector loops as lines, while the first link that is an angle makes a turn."""

from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Truths
from tolstat.machines.dimension_chain.algebras import Roundings
from tolstat.machines.dimension_chain.loops import Loops
from tolstat.model.mechanism import Line, Mechanism
from tolstat.model.view import Axis

FRAMES = 180  # of a turn
COLOURS = "first", "second", "third", "fourth", "fifth", "sixth"


def mechanism_of(loops: Loops, links: Mapping[str, float]) -> Mechanism:
    """Return the loops of one trial with these links, SI.

    A link that is the angle of a direction turns once, from its size on. Places where
    the loops do not close have no points.
    """
    axis, turn = Axis("position", "1"), np.zeros(1)
    sentence = "The vector loops, each from its first point."
    if loops.turning:
        driver = loops.turning[0]
        axis = Axis(driver, "rad", "deg")
        turn = links[driver] + np.linspace(0.0, 2 * np.pi, FRAMES, endpoint=False)
        turn = (turn + np.pi) % (2 * np.pi) - np.pi  # half a turn to either side
        sentence += f" {driver} makes a turn."
    by_frame = {name: np.full(len(turn), value) for name, value in links.items()}
    if loops.turning:
        by_frame[driver] = turn
    algebra = loops.solved(Roundings(by_frame))
    places, lines = [np.zeros((2, len(turn)))], list[Line]()
    for vectors in loops.vectors(algebra).values():
        start = 0
        for i, (name, vector) in enumerate(vectors, start=1):
            end = len(places) if i < len(vectors) else 0
            colour = COLOURS[len(lines) % len(COLOURS)]
            lines.append(Line(name, (start, end), colour, joints=True))
            if end:
                places.append(places[start] + vector)
            start = end
    points = np.moveaxis(np.array(places), 2, 0)
    closed: Truths = np.all(np.isfinite(points), axis=(1, 2))
    points = np.where(closed[:, None, None], points, np.nan)
    return Mechanism(axis, turn, points, tuple(lines), sentence=sentence)

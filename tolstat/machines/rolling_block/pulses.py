"""Moments after rectangular pulses on a stand, in closed form."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.frequency_response import contributions
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.seen import Seen
from tolstat.machines.rolling_block.topology import LINK_NAMES
from tolstat.machines.rolling_block.transient import moments
from tolstat.model.view import Axis, Chart, Curve, Panel, Span, bands_of

POINTS = 2001
PERIODS = 6  # of the lowest mode are drawn, where the horizon is not shorter
LENGTHS = (1e-3, 5e-3, 10e-3)  # s, the paper's range; and a step, which never ends


def pulses(seen: Seen) -> Chart:
    """Chart the moments of all links after the pulse, and of one link after others."""
    settings, drive = seen.settings, seen.drive
    shown = settings.response_link
    length = settings.pulse_length
    end = min(settings.horizon, PERIODS * 2 * np.pi / float(seen.modes.omega[0, 0]))
    time = np.linspace(0.0, end, POINTS)
    load = {settings.pulse_stand: settings.pulse_moment}
    a = contributions(seen.modes, drive.C, load)
    first = Modes(*(each[:1] for each in seen.modes))

    def followed(*ends: float) -> Array:
        """Return the moments of the first drive under a load that ends, or never."""
        steps = [(0.0, a[:1]), *((end, -a[:1]) for end in ends)]
        found: Array = moments(time, first, drive.zeta[:1], steps)[0]
        return found

    links = [
        Curve(f"M{ij}", "N m", f"M{ij}", "after the pulse", moment, shown="N m")
        for ij, moment in zip(LINK_NAMES, followed(length), strict=True)
    ]
    one = LINK_NAMES.index(shown)
    others = [
        Curve(
            f"{1e3 * each:g} ms", "N m", f"M{shown}", "pulse of this length",
            followed(each)[one], shown="N m",
        )
        for each in LENGTHS
    ]  # fmt: skip
    stays = followed()[one]
    step = Curve("step", "N m", f"M{shown}", "load that stays", stays, shown="N m")
    others.append(step)

    spread = Modes(*(each[seen.others] for each in seen.modes))
    of_others = a[seen.others, one : one + 1]
    opened = bands_of(
        f"M{shown}",
        "N m",
        moments(
            time,
            Modes(spread.omega, spread.phi, spread.phi_ij[:, one : one + 1]),
            drive.zeta[seen.others],
            [(0.0, of_others), (length, -of_others)],
        )[:, 0],
    )
    names = [each.name for each in links]
    tolerances = tuple(band.name for band in opened)
    stand = settings.pulse_stand
    panels = [
        Panel(f"{1e3 * length:g} ms on stand {stand}: gearbox", tuple(names[:4])),
        Panel("Spindles", tuple(names[4:])),
        Panel(f"M{shown} after other pulses", tuple(each.name for each in others)),
    ]
    if opened:
        panels.insert(2, Panel(f"M{shown}, tolerances", (f"M{shown}", *tolerances)))
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*links, *others),
        bands=opened,
        spans=(Span(0.0, min(length, end), "the pulse"),),
        panels=tuple(panels),
    )

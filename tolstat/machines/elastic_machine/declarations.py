"""Contributors and responses of the elastic machine: names, units, words."""

from __future__ import annotations

import math

from tolstat.machines.elastic_machine.parameters import deflected_at_start_up
from tolstat.machines.elastic_machine.settings import Settings
from tolstat.model.description import Contributor, Description, Response

POSITIVE = (0.0, math.inf)


def spring(s: int) -> str:
    """Return the paper's index of the spring before mass s: 01, 12, ... 9,10."""
    return f"{s - 1}{s}" if s < 10 else f"{s - 1},{s}"


def description_of(settings: Settings) -> Description:
    """List contributors and responses: so many of each as there are masses and steps.

    A mass that nothing deflects when the start-up ends has no dynamic factor.
    """
    masses = range(1, len(settings.inertia) + 1)
    deflected = deflected_at_start_up(settings)
    return Description(
        (
            *(Contributor(f"inertia_{s}", "1", f"J_{s}", f"moment of inertia of mass {s}", "I in (7)") for s in masses),
            *(Contributor(f"stiffness_{s}", "1", f"c_{spring(s)}", f"stiffness of the spring before mass {s}", "C in (7)") for s in masses),
            *(Contributor(f"damping_{s}", "1", f"b_{spring(s)}", f"damping of the spring before mass {s}", "B in (7)") for s in masses),
            Contributor("start_up_time", "s", "t0", "start-up time; the final speed is held", "(3), (4)"),
            *(
                Contributor(f"load_torque_{i}", "N m", f"M_{i}", f"step of the load torque on mass {step['mass']} at {step['time']:g} s", "M_r in (7)", shown="N m")
                for i, step in enumerate(settings.load_torque, start=1)
            ),
        ),
        (
            *(Response(f"error_{s}", "rad", f"|theta_{s}|", f"peak dynamic error of mass {s}: its twist against the programmed motion", "(7)", range=POSITIVE) for s in masses),
            *(Response(f"residual_{s}", "rad", f"|theta_{s} - C^-1 M|", f"peak of what is left after start-up beside the static twist of mass {s}", "(18)", range=POSITIVE) for s in masses),
            *(Response(f"torque_peak_{s}", "N m", f"|c_{spring(s)} (theta_{s} - theta_{s - 1})|", f"peak elastic torque of the spring before mass {s}", "(7)", shown="N m", range=POSITIVE) for s in masses),
            *(Response(f"dynamic_factor_{s}", "1", f"K_{s}", f"peak dynamic error of mass {s} over its static one at the greatest acceleration", "(7)", shown="1", range=POSITIVE) for s in deflected),
            *(Response(f"frequency_{s}", "Hz", f"k_{s}/2pi", f"natural frequency {s} without damping", "I, C in (7)", range=POSITIVE) for s in masses),
        ),
    )  # fmt: skip

"""Settings, contributors and responses of the elastic machine."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from tolstat.errors import ModelError
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.model.description import POSITIVE, Contributor, Description, Response
from tolstat.model.settings import column, setting

MOST_MASSES = 1000  # their modes take a second for each trial
LOAD = ({"time": 0.1, "mass": 4, "torque": -4.0},)
LOAD_COLUMNS = {
    "time": column("time of the step", unit="s", at_least=0.0),
    "mass": column("number of the mass, 1 next to the shaft", like=1, at_least=1),
    "torque": column("step of the torque, positive with the motion", unit="N m"),
}


@dataclass(frozen=True)
class Settings:
    """Settings of the elastic machine, SI; each has a sentence.

    Raises
    ------
    ModelError
        If the chain's lists differ in length, a load torque acts on a missing mass or
        after the horizon, the start-up does not end within the horizon, or nothing
        moves the machine.
    """

    # fmt: off
    inertia: tuple[float, ...] = setting((0.8, 0.6, 0.5, 0.3), "moment of inertia of each mass, from the programmed shaft outwards", unit="kg m^2", above=0.0, count=(1, MOST_MASSES))
    stiffness: tuple[float, ...] = setting((1200.0, 900.0, 700.0, 500.0), "stiffness of the spring before each mass, the first on the programmed shaft", unit="N m/rad", above=0.0)
    damping: tuple[float, ...] = setting((1.2, 0.9, 0.7, 0.5), "damping of the spring before each mass", unit="N m s/rad", at_least=0.0)
    start_up_law: str = setting("constant", "acceleration of the programmed shaft: constant, as in the paper; smooth: polynomial, trapezoidal jerk, cycloid", choices=tuple(LAWS))
    final_speed: float = setting(10.0, "speed omega0 of the programmed shaft after start-up; a deviation of the start-up time does not change it, eps0 = omega0/t0", unit="rad/s")
    start_up_time: float = setting(0.5, "start-up time t0", unit="s", above=0.0)
    load_torque: tuple[Mapping[str, Any], ...] = setting(LOAD, "steps of the load torque, each from its time to the end; [] for none", columns=LOAD_COLUMNS)
    horizon: float = setting(2.0, "simulated time, from t = 0", unit="s", above=0.0)
    rtol: float = setting(1e-8, "integration tolerance, relative to each state's scale", above=0.0)
    max_step: float = setting(1e-2, "longest integration step", unit="s", above=0.0)
    # fmt: on

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        n = len(self.inertia)
        for name in ("stiffness", "damping"):
            if (found := len(getattr(self, name))) != n:
                raise ModelError(
                    f"{name} has {found} numbers, inertia has {n}: every mass has one "
                    "of each (damping: 0 for none). The defaults have four masses"
                )
        for i, step in enumerate(self.load_torque, start=1):
            where = f"load_torque, row {i}"
            if step["mass"] > n:
                masses = "1 mass" if n == 1 else f"{n} masses"
                raise ModelError(
                    f"{where}: mass = {step['mass']} does not exist, inertia lists "
                    f"{masses}; load_torque = [] for no load"
                )
            if not step["time"] < self.horizon:
                raise ModelError(
                    f"{where}: time = {step['time']:g} s is not before the horizon of "
                    f"{self.horizon:g} s; enlarge the horizon"
                )
        if not self.start_up_time < self.horizon:
            raise ModelError(
                f"start_up_time = {self.start_up_time:g} s does not end before the "
                f"horizon of {self.horizon:g} s; enlarge the horizon"
            )
        if self.final_speed == 0 and not any(s["torque"] for s in self.load_torque):
            raise ModelError(
                "final_speed = 0 and no load torque: nothing moves the machine"
            )


def spring(s: int) -> str:
    """Return the paper's index of the spring before mass s: 01, 12, ... 9,10."""
    return f"{s - 1}{s}" if s < 10 else f"{s - 1},{s}"


def description_of(settings: Settings, deflected: Collection[int]) -> Description:
    """Return contributors and responses, as many as there are masses and steps.

    A mass that is not `deflected` when the start-up ends has no dynamic factor.
    """
    masses = range(1, len(settings.inertia) + 1)
    return Description(
        (
            *(Contributor(f"inertia_{s}", "1", f"J_{s}", f"moment of inertia of mass {s}", "I in (7)") for s in masses),
            *(Contributor(f"stiffness_{s}", "1", f"c_{spring(s)}", f"stiffness of the spring before mass {s}", "C in (7)") for s in masses),
            *(Contributor(f"damping_{s}", "1", f"b_{spring(s)}", f"damping of the spring before mass {s}", "B in (7)") for s in masses),
            Contributor("start_up_time", "s", "t0", "start-up time; the final speed stays the same", "(3), (4)"),
            *(
                Contributor(f"load_torque_{i}", "N m", f"M_{i}", f"step of the load torque on mass {step['mass']} at {step['time']:g} s", "M_r in (7)", shown="N m")
                for i, step in enumerate(settings.load_torque, start=1)
            ),
        ),
        (
            *(Response(f"error_{s}", "rad", f"|theta_{s}|", f"peak dynamic error of mass {s}: its twist against the programmed motion", "(7)", range=POSITIVE) for s in masses),
            *(Response(f"residual_{s}", "rad", f"|theta_{s} - C^-1 M|", f"peak residual twist of mass {s} after start-up, beside the static twist", "(18)", range=POSITIVE) for s in masses),
            *(Response(f"torque_peak_{s}", "N m", f"|c_{spring(s)} (theta_{s} - theta_{s - 1})|", f"peak elastic torque of the spring before mass {s}", "(7)", shown="N m", range=POSITIVE) for s in masses),
            *(Response(f"dynamic_factor_{s}", "1", f"K_{s}", f"peak dynamic error of mass {s} over its static one at the greatest acceleration", "(7)", shown="1", range=POSITIVE) for s in deflected),
            *(Response(f"frequency_{s}", "Hz", f"k_{s}/2pi", f"natural frequency {s} without damping", "I, C in (7)", range=POSITIVE) for s in masses),
        ),
    )  # fmt: skip

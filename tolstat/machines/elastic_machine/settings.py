"""What a study may choose about the elastic machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tolstat.errors import ModelError
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.model.settings import column, setting

MOST_MASSES = 1000  # their modes take a second a machine
LOAD = ({"time": 0.1, "mass": 4, "torque": -4.0},)


@dataclass(frozen=True)
class Settings:
    """Settings of the elastic machine, SI; what each means stands in its sentence.

    Raises
    ------
    ModelError
        If the chain's lists differ in length, a load torque acts on a mass that is not
        there or after the horizon, the start-up does not end within the horizon, or
        nothing moves the machine.
    """

    inertia: tuple[float, ...] = setting(
        (0.8, 0.6, 0.5, 0.3),
        "moment of inertia of each mass, from the programmed shaft outwards",
        unit="kg m^2",
        above=0.0,
        count=(1, MOST_MASSES),
    )
    stiffness: tuple[float, ...] = setting(
        (1200.0, 900.0, 700.0, 500.0),
        "stiffness of the spring before each mass, the first on the programmed shaft",
        unit="N m/rad",
        above=0.0,
    )
    damping: tuple[float, ...] = setting(
        (1.2, 0.9, 0.7, 0.5),
        "damping of these springs",
        unit="N m s/rad",
        at_least=0.0,
    )
    start_up_law: str = setting(
        "constant",
        "acceleration of the programmed shaft: constant as the paper has it; smooth: "
        "polynomial, trapezoidal jerk, cycloid",
        choices=tuple(LAWS),
    )
    final_speed: float = setting(
        10.0,
        "speed omega0 of the programmed shaft after start-up; held when the start-up "
        "time deviates, eps0 = omega0/t0",
        unit="rad/s",
    )
    start_up_time: float = setting(0.5, "start-up time t0", unit="s", above=0.0)
    load_torque: tuple[Mapping[str, Any], ...] = setting(
        LOAD,
        "steps of the load torque, each lasting from its time on; [] for none",
        columns={
            "time": column("when it steps", unit="s", at_least=0.0),
            "mass": column("on which mass, 1 next to the shaft", like=1, at_least=1),
            "torque": column("by how much, positive with the motion", unit="N m"),
        },
    )
    horizon: float = setting(2.0, "how long one looks, from t = 0", unit="s", above=0.0)
    rtol: float = setting(
        1e-8, "integration tolerance, relative to each state's scale", above=0.0
    )
    max_step: float = setting(1e-2, "longest integration step", unit="s", above=0.0)

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        n = len(self.inertia)
        for name in ("stiffness", "damping"):
            if (found := len(getattr(self, name))) != n:
                raise ModelError(
                    f"{name} has {found} numbers, inertia has {n}: every mass has an "
                    "inertia, a spring towards the programmed shaft, and its damping "
                    "(0 for none); what a study leaves out is of the four masses of "
                    "the default"
                )
        for i, step in enumerate(self.load_torque, start=1):
            where = f"load_torque, row {i}"
            if step["mass"] > n:
                masses = "1 mass" if n == 1 else f"{n} masses"
                raise ModelError(
                    f"{where}: mass = {step['mass']} is not there, inertia lists "
                    f"{masses}; load_torque = [] for no load"
                )
            if not step["time"] < self.horizon:
                raise ModelError(
                    f"{where}: time = {step['time']:g} s is not before the horizon of "
                    f"{self.horizon:g} s: it would do nothing; look longer"
                )
        if not self.start_up_time < self.horizon:
            raise ModelError(
                f"start_up_time = {self.start_up_time:g} s does not end before the "
                f"horizon of {self.horizon:g} s: nothing would be left for the "
                "residual vibration; look longer"
            )
        if self.final_speed == 0 and not any(s["torque"] for s in self.load_torque):
            raise ModelError(
                "final_speed = 0 and no load torque: nothing moves the machine"
            )

    @property
    def law(self) -> int:
        """Number of the start-up law among all."""
        return list(LAWS).index(self.start_up_law)

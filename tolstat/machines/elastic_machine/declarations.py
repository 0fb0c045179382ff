"""Settings, contributors and responses of the elastic machine."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from tolstat.errors import ModelError
from tolstat.machines.elastic_machine.start_up import LAWS, Law, of_table
from tolstat.model.description import POSITIVE, Contributor, Description, Response
from tolstat.model.settings import column, setting

MOST_MASSES = 1000  # their modes take a second for each trial
LOAD = ({"time": 0.1, "mass": 4, "torque": -4.0},)
LOAD_COLUMNS = {
    "time": column("time of the step", unit="s", at_least=0.0),
    "mass": column("number of the mass, 1 next to the shaft", like=1, at_least=1),
    "torque": column("step of the torque, positive with the motion", unit="N m"),
}
TABLE_COLUMNS = {
    "time": column("time of the point", unit="s", at_least=0.0),
    "acceleration": column("phi0'' there", unit="rad/s^2"),
}


@dataclass(frozen=True)
class Settings:
    """Settings of the elastic machine, SI; each has a sentence.

    Raises ModelError if the chain's lists differ in length, a load torque acts on a
    missing mass or after the horizon, the start-up does not end within the horizon, or
    nothing moves the machine.
    """

    # fmt: off
    inertia: tuple[float, ...] = setting((0.8, 0.6, 0.5, 0.3), "moment of inertia of each mass, from the programmed shaft outwards", unit="kg m^2", above=0.0, count=(1, MOST_MASSES))
    stiffness: tuple[float, ...] = setting((1200.0, 900.0, 700.0, 500.0), "stiffness of the spring before each mass, the first on the programmed shaft", unit="N m/rad", above=0.0)
    damping: tuple[float, ...] = setting((1.2, 0.9, 0.7, 0.5), "damping of the spring before each mass", unit="N m s/rad", at_least=0.0)
    start_up_law: str = setting("constant", "acceleration of the programmed shaft: constant, as in the paper; smooth: polynomial, trapezoidal jerk, cycloid; that of a table", choices=(*LAWS, "table"))
    acceleration: tuple[Mapping[str, Any], ...] = setting((), "points of the table: straight lines between them, a jump where a time is repeated, 0 outside; its last time replaces start_up_time", columns=TABLE_COLUMNS)
    final_speed: float = setting(10.0, "speed omega0 of the programmed shaft after start-up; a deviation of the start-up time does not change it, eps0 = omega0/t0", unit="rad/s")
    start_up_time: float = setting(0.5, "start-up time t0", unit="s", above=0.0)
    braking_start: float = setting(1.0, "when braking begins, t_B", unit="s", at_least=0.0)
    braking_time: float = setting(0.0, "braking time t_b, from final_speed to rest by the start-up law; 0 for no braking", unit="s", at_least=0.0)
    load_torque: tuple[Mapping[str, Any], ...] = setting(LOAD, "steps of the load torque, each from its time to the end; [] for none", columns=LOAD_COLUMNS)
    horizon: float = setting(2.0, "simulated time, from t = 0", unit="s", above=0.0)
    runge_kutta: bool = setting(False, "whether the motion is integrated by Runge-Kutta and not solved exactly, as in audits")
    rtol: float = setting(1e-8, "tolerance of that integration, relative to each state's scale", above=0.0)
    max_step: float = setting(1e-2, "its longest step", unit="s", above=0.0)
    # fmt: on

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        n = len(self.inertia)
        for name in ("stiffness", "damping"):
            if (count := len(getattr(self, name))) != n:
                raise ModelError(
                    f"{name} has {count} numbers, inertia has {n}: every mass has one "
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
        self._check_motion()
        if self.speed == 0 and not any(s["torque"] for s in self.load_torque):
            raise ModelError(
                "final_speed = 0 and no load torque: nothing moves the machine"
            )

    def _check_motion(self) -> None:
        """Refuse a programmed motion that is none, or does not end in time."""
        times = [row["time"] for row in self.acceleration]
        table = self.by_table
        if table and (len(times) < 2 or times[-1] <= 0.0 or times != sorted(times)):
            raise ModelError(
                'start_up_law = "table" takes two or more rows of acceleration, their '
                "times ascending and the last above 0 s"
            )
        if not table and times:
            raise ModelError(
                'acceleration is given: it counts with start_up_law = "table" alone'
            )
        if table and self.braking_time:
            raise ModelError(
                "braking_time: a table brakes by its own rows; leave braking_time at 0"
            )
        t0, end = self.nominal_start_up, self.braking_start + self.braking_time
        name = "acceleration, last time" if table else "start_up_time"
        if not t0 < self.horizon:
            raise ModelError(
                f"{name} = {t0:g} s does not end before the horizon of "
                f"{self.horizon:g} s; enlarge the horizon"
            )
        if self.braking_time and not t0 <= self.braking_start < end < self.horizon:
            raise ModelError(
                f"braking lasts from {self.braking_start:g} s to {end:g} s: it must "
                f"begin after the start-up ({t0:g} s) and end before the horizon "
                f"({self.horizon:g} s)"
            )

    @property
    def by_table(self) -> bool:
        """Whether a table gives the programmed acceleration."""
        return self.start_up_law == "table"

    @property
    def law(self) -> Law:
        """The start-up law."""
        return of_table(self.acceleration) if self.by_table else LAWS[self.start_up_law]

    @property
    def nominal_start_up(self) -> float:
        """Its duration t0, s."""
        last = self.acceleration[-1]["time"] if self.by_table else self.start_up_time
        return float(last)

    @property
    def speed(self) -> float:
        """What multiplies f of the law: phi0'' = speed/t0 f, rad/s."""
        return self.nominal_start_up if self.by_table else self.final_speed


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
            *(Contributor(f"load_torque_{i}", "N m", f"M_{i}", f"step of the load torque on mass {step['mass']} at {step['time']:g} s", "M_r in (7)", size=step["torque"], shown="N m") for i, step in enumerate(settings.load_torque, start=1)),
            *([Contributor("braking_time", "s", "t_b", "braking time, from the same speed", "(19)")] if settings.braking_time else ()),
        ),
        (
            *(Response(f"error_{s}", "rad", f"|theta_{s}|", f"peak dynamic error of mass {s}: its twist against the programmed motion", "(7)", range=POSITIVE) for s in masses),
            *(Response(f"residual_{s}", "rad", f"|theta_{s} - C^-1 M|", f"peak residual twist of mass {s} after start-up and braking, beside the static twist", "(18)", range=POSITIVE) for s in masses),
            *(Response(f"torque_peak_{s}", "N m", f"|c_{spring(s)} (theta_{s} - theta_{s - 1})|", f"peak elastic torque of the spring before mass {s}", "(7)", shown="N m", range=POSITIVE) for s in masses),
            *(Response(f"dynamic_factor_{s}", "1", f"K_{s}", f"peak dynamic error of mass {s} over its static one at the greatest acceleration", "(7)", shown="1", range=POSITIVE) for s in deflected),
            *(Response(f"frequency_{s}", "Hz", f"k_{s}/2pi", f"natural frequency {s} without damping", "I, C in (7)", range=POSITIVE) for s in masses),
        ),
    )  # fmt: skip


ASSUMPTIONS = (
    "The motion is linear between two events and solved exactly. Audits use a second method, Dormand-Prince 5(4); so do chains of more than 32 masses, and runge_kutta = true.",
    "The drive follows the programmed motion under any load; the final speed is reached exactly.",
    "Springs are linear and have no mass; damping is proportional to their rate of twist, and need not be classical; there is no backlash.",
    "The machine is at rest and without load before t = 0.",
    "Peak torques are elastic ones, without damping.",
)  # fmt: skip
IMPOSSIBLE, TOO_LONG = "cannot exist", "still starting at the horizon"
NO_REFERENCE = "no static error"
FAILURES = {
    IMPOSSIBLE: "inertias, stiffnesses and the start-up time are above 0, damping not below",
    TOO_LONG: "the start-up ends before the horizon and before braking, which ends before the horizon",
    NO_REFERENCE: "acceleration and load do not balance at the end of the start-up",
}

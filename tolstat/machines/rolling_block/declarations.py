"""Settings, contributors and responses of the rolling block."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.rolling_block import structure
from tolstat.model.description import (
    POSITIVE,
    SHARE,
    Contributor,
    Description,
    Response,
)
from tolstat.model.settings import column, setting
from tolstat.units.grammar import Range

RPM = 2 * np.pi / 60

SHAFTS = ("motor", "rolls_31", "rolls_34")
MESH = {
    "teeth": column("number of teeth of the gear", like=1, at_least=1),
    "shaft": column("shaft of the gear", like="motor", choices=SHAFTS),
}
SPECTRUM = {
    "frequency": column("frequency", unit="Hz", at_least=0.0),
    "density": column("one-sided density", unit="N^2 m^2 s", at_least=0.0),
}
LOADS, MOMENT = "loads", "moment"  # as named by response_loads, response_link

# identified from Table 1 of the paper; their common scale is an assumption
INERTIAS = (300.0, 30.0, 30.0, 80.0, 60.0, 50.0, 50.0, 40.0, 40.0)
STIFFNESSES = (8e6, 8e6, 7e6, 7e6, 2e6, 2e6, 1e6, 1e6)


@dataclass(frozen=True)
class Settings:
    """Settings of the rolling block, SI; each has a sentence."""

    # fmt: off
    combination: structure.Combination = setting(structure.TABLE_1, "positions (a, b, c, d) of the gearbox stages, from 0 on: a 0 or 1, the others 0 to 3 in the paper; that of Table 1 if not given", at_least=0, count=(4, 4))
    entry_ratios: Range = setting(Range(*structure.PAPER.entry), "motor over roll speed of stands 31, 32: least and greatest of all combinations", unit="1", above=0.0)
    exit_ratios: Range = setting(Range(*structure.PAPER.exit), "the same of stands 33, 34", unit="1", above=0.0)
    positions: structure.Combination = setting(structure.PAPER.positions, "numbers of positions of the stages A, B, C, D", at_least=1, at_most=16, count=(4, 4))
    reference: structure.Combination = setting(structure.TABLE_1, "combination at which inertias and stiffnesses hold", at_least=0, count=(4, 4))
    roll_diameters: tuple[float, ...] = setting((0.230, 0.230, 0.156, 0.156), "diameters of the rolls 31 to 34; the paper: 205 to 230 mm, 142 to 156 mm", unit="m", above=0.0, count=(4, 4))
    rolling_speed_limit: float = setting(120.0, "greatest rolling speed, in the last stand", unit="m/s", above=0.0)
    inertias: tuple[float, ...] = setting(INERTIAS, "Q1 ... Q9 at the reference combination, reduced to the motor shaft", unit="kg m^2", above=0.0, count=(9, 9))
    stiffnesses: tuple[float, ...] = setting(STIFFNESSES, "C12, C23, C34, C35, C46, C47, C58, C59 there, reduced to that shaft", unit="N m/rad", above=0.0, count=(8, 8))
    scale: float = setting(1.0, "factor on all inertias and stiffnesses, which Table 1 does not determine", above=0.0)
    damping_ratio: float = setting(0.02, "damping ratio of every elastic mode", unit="1", at_least=0.0)
    link_damping: tuple[float, ...] = setting((), "views response, damping, torques: times tau of the links 12 ... 59, M = C (theta + tau theta'), instead of damping_ratio", unit="s", at_least=0.0, count=(8, 8))
    loss_factors: tuple[float, ...] = setting((), "views response, torques: loss factors eta of the links, C (1 + i eta), instead of damping_ratio", at_least=0.0, count=(8, 8))
    motor: str = setting("matched", "motor moment while loads step: it steps with them, or stays", choices=("matched", "free"))
    delay: tuple[float, ...] = setting((0.0,), "delay of the load from stand to stand, 31 first: one time for all, or three", unit="s", at_least=0.0, count=(1, 3))
    total_load: float = setting(35_950.293, "total load of the four stands, a quarter each, at the motor shaft: 3200 kW at 850 rpm", unit="N m", above=0.0)
    pulse_stand: int = setting(31, "stand on which the pulse acts, 31 to 34", at_least=31, at_most=34)
    pulse_length: float = setting(5e-3, "duration of the pulse", unit="s", above=0.0)
    pulse_moment: float = setting(89.8757, "moment of the pulse, at the motor shaft; 1 % of the static load of a stand", unit="N m", above=0.0)
    horizon: float = setting(1.0, "simulated time of loads and pulse", unit="s", above=0.0)
    orders: tuple[float, ...] = setting((1.0,), "excitations per turn of the motor", above=0.0)
    rolls: bool = setting(False, "whether the rolls also excite, with the orders 1/i31 and 1/i34")
    meshes: tuple[dict[str, Any], ...] = setting((), "gears that also excite, once per tooth", columns=MESH)
    speed_range: Range = setting(Range(850 * RPM, 1700 * RPM), "speed range of the motor", unit="rad/s", above=0.0)
    working_speed: float = setting(1200 * RPM, "working speed of the motor", unit="rad/s", above=0.0)
    band: float = setting(0.05, "a speed resonates where an excitation is nearer to a natural frequency than this share of it", unit="1", at_least=0.0)
    response_loads: tuple[int, ...] = setting((32, 33), "loads of the view response, each alone and all at once: 31 to 34, or 1 for the motor", at_least=1, count=(1, 5))
    response_input: str = setting(LOADS, "input of the view response: loads are response_loads, 1 N m each; a mesh has an error of 1 rad at the motor shaft, a tension is 1 N", choices=(LOADS, *(f"mesh {ij}" for ij in structure.MESHES), *(f"tension {gap}" for gap in structure.GAPS)))
    response_output: str = setting(MOMENT, "output of the view response: the moment in response_link, the stretch of the strip in a gap, angle or speed of a mass", choices=(MOMENT, *structure.GAPS, *(f"{kind} {i}" for kind in ("angle", "speed") for i in range(1, 10))))
    response_link: str = setting("12", "link of the views response and pulses", choices=structure.LINK_NAMES)
    stand_distance: float | None = setting(None, "view travel: distance between stands; own: the pulse follows delay", unit="m", above=0.0, presets={"own": None})
    torque_density: float = setting(1.0, "views torques, rms: one-sided density of the random torque on each stand, at the motor shaft", unit="N^2 m^2 s", above=0.0)
    torque_corner: float | None = setting(None, "corner of its spectrum, 1/(1 + (f/corner)^2)", unit="Hz", above=0.0, presets={"white": None})
    torque_spectrum: tuple[dict[str, Any], ...] = setting((), "its spectrum as points instead, 0 behind the last", columns=SPECTRUM)
    speed_gain: float = setting(40.0, "view regulator, assumed as all of it: gain K_p over the least inertia of all combinations", unit="1/s", above=0.0)
    integral_time: float = setting(0.1, "its integral time T_i", unit="s", above=0.0)
    speed_lag: float = setting(0.015, "its filter of the speed, T_f", unit="s", above=0.0)
    torque_lag: float = setting(0.015, "lag of the motor's torque, T_t", unit="s", above=0.0)
    notch_frequency: float | None = setting(None, "centre of its notch; own: the first mode of each combination, 15 to 25 Hz", unit="Hz", above=0.0, presets={"own": None})
    notch_damping: float = setting(0.5, "damping z of the notch", above=0.0)
    notch_depth: float = setting(0.25, "depth d of the notch; the paper: at least 12 dB", above=0.0)
    kept_modes: int = setting(4, "view masses: how many of the lowest modes are wanted", at_least=1, at_most=8)
    runge_kutta: bool = setting(False, "whether the motion is integrated by Runge-Kutta and not solved exactly, as in audits")
    rtol: float = setting(1e-9, "tolerance of that integration, relative to the twists of the static load", above=0.0)
    # fmt: on

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        for key in ("combination", "reference"):
            values = getattr(self, key)
            for stage, value, n in zip("ABCD", values, self.positions, strict=True):
                if value >= n:
                    raise ModelError(
                        f"{key} = {list(values)}: stage {stage} has the positions 0 to "
                        f"{n - 1}, not {value}"
                    )
        for key in ("link_damping", "loss_factors"):
            if len(getattr(self, key)) not in (0, len(structure.LINKS)):
                raise ModelError(
                    f"{key}: one number for each of the {len(structure.LINKS)} links "
                    "is expected, or none"
                )
        if len(self.delay) == 2:
            raise ModelError(
                "delay: one time is expected, or three: from 31 to 32, to 33, to 34"
            )
        if self.entries[-1] >= self.horizon:
            raise ModelError(
                f"delay: stand 34 enters after {self.entries[-1]:g} s, and the horizon "
                f"is {self.horizon:g} s; enlarge the horizon"
            )
        for load in self.response_loads:
            if load not in structure.LOADS:
                raise ModelError(
                    f"response_loads: no load {load}; 1 is the motor, "
                    f"{', '.join(map(str, structure.STANDS))} are the stands"
                )
        if len(set(self.response_loads)) < len(self.response_loads):
            raise ModelError("response_loads: a load is given twice")

    @property
    def gearbox(self) -> structure.Gearbox:
        """Ranges of ratios, positions of the stages, reference combination."""
        return structure.Gearbox(
            self.entry_ratios, self.exit_ratios, self.positions, self.reference
        )

    @property
    def every_combination(self) -> list[Settings]:
        """The settings with each combination of the gearbox."""
        return [replace(self, combination=c) for c in self.gearbox.combinations]

    @property
    def name(self) -> str:
        """The combination in words."""
        return " ".join(map(str, self.combination))

    @property
    def ratios(self) -> structure.Ratios:
        """Motor speed over the speed of shafts, at the combination."""
        return structure.ratios(self.combination, self.gearbox)

    @property
    def dampings(self) -> tuple[Array | None, Array | None]:
        """Times and loss factors of the links; None where damping is modal."""
        if not (self.link_damping or self.loss_factors):
            return None, None
        none = (0.0,) * len(structure.LINKS)
        return np.array(self.link_damping or none), np.array(self.loss_factors or none)

    @property
    def entries(self) -> tuple[float, ...]:
        """When each stand, 31 first, takes its load, s."""
        delays = self.delay * 3 if len(self.delay) == 1 else self.delay
        return tuple(accumulate(delays, initial=0.0))


_C = Contributor
_R = Response

JOINED = {
    ij: f"{structure.MASSES[i]} to {structure.MASSES[j]}"
    for ij, (i, j) in zip(structure.LINK_NAMES, structure.LINKS, strict=True)
}
CONTRIBUTORS = (
    *(_C(f"inertia_{i}", "1", f"Q{i}", f"moment of inertia: {mass}", "(1)", part="inertias") for i, mass in enumerate(structure.MASSES, start=1)),
    *(_C(f"stiffness_{ij}", "1", f"C{ij}", f"torsional stiffness: {joined}", "(1)", part="stiffnesses") for ij, joined in JOINED.items()),
    _C("damping", "1", "zeta", "damping ratio of every elastic mode", "modal damping", part="damping"),
)  # fmt: skip

RESPONSES = (
    *(_R(f"frequency_{r}", "Hz", f"f{r}", f"natural frequency {r}, ascending, without the rigid mode", "(1)", shown="Hz", range=POSITIVE) for r in range(1, len(JOINED) + 1)),
    *(_R(f"amplification_{ij}", "1", f"K{ij}", f"peak moment over the static one: {joined}", "max |M_ij| / M_ij,static", shown="1", range=POSITIVE) for ij, joined in JOINED.items()),
    *(_R(f"moment_peak_{ij}", "N m", f"|M{ij}|", f"peak elastic moment, loads stepping: {joined}", "(2)", range=POSITIVE) for ij, joined in JOINED.items()),
    *(_R(f"pulse_peak_{ij}", "N m", f"|M{ij}|", f"peak elastic moment, pulse on a stand: {joined}", "(2)", shown="N m", range=POSITIVE) for ij, joined in JOINED.items()),
    _R("cancellation", "1", "|a2/a1|", "contribution of mode 2 to M12 over that of mode 1, loads on 32 and 33", "Fig. 4", range=POSITIVE),
    _R("leakage", "1", "|a3,4/a1|", "larger contribution of the local modes 3, 4 to M12 over that of mode 1, loads on 32 and 33", "Fig. 4", range=POSITIVE),
    _R("antiphase_pattern", "1", "", "1 if stands swing in antiphase where they do in the nominal drive, else 0", "Table 1", shown="count", range=SHARE),
    _R("free_speed_range", "rad/s", "", "total width of the speed ranges without resonance", "Fig. 5", shown="rpm", range=POSITIVE),
    _R("widest_free_range", "rad/s", "", "width of the widest range of speeds without resonance", "Fig. 5", shown="rpm", range=POSITIVE),
    _R("speed_margin", "1", "", "distance of the working speed from the nearest resonance, as a share of the natural frequency", "Fig. 5", range=POSITIVE),
)  # fmt: skip

DESCRIPTION = Description(CONTRIBUTORS, RESPONSES)

ASSUMPTIONS = (
    "Nine masses on eight springs without mass, reduced to the motor shaft; upper and lower rolls of a stand are one mass, the rod between stands has no stiffness, as in the paper.",
    "Inertias and stiffnesses are identified from the paper's Table 1, which does not determine their common scale.",
    "Every elastic mode has the same damping ratio; the paper prints none.",
    "The gearbox is the least one that meets the printed ranges of ratios and the printed number of combinations; teeth and stage ratios are not printed.",
    "Amplification is the greatest elastic moment over the static one from the first load to the horizon, the loads stepping, a quarter on each stand.",
    "The motion is linear between two steps of the load and solved exactly. Audits use a second method, Dormand-Prince 5(4), as does runge_kutta = true.",
)  # fmt: skip
CANNOT_EXIST = "cannot exist"
FAILURES = {
    CANNOT_EXIST: "each inertia and stiffness is above 0, the damping not below; their deviations are above -100 %"
}

"""What a study may choose about the ring."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tolstat.errors import ModelError
from tolstat.machines.ring.harmonics import nu_of
from tolstat.model.settings import setting
from tolstat.units.grammar import Range

PAPER_INNER_RADIUS = 3.0  # m, of the table, where a study names no radius
NAMED_LOBES = 12  # harmonics of out-of-roundness that have settings
# what a view may vary: nominal values that are above zero
VARIED = (
    "support_angle",
    "radius",
    "width",
    "thickness",
    "youngs_modulus",
    "density",
    "ring_damping",
    "tool_angle",
    "tool_stiffness",
    "tool_mass",
    "tool_damping",
    "depth",
    "feed",
    "cutting_force",
)


def amplitude(k: int) -> str:
    """Name the k-th harmonic of out-of-roundness."""
    return f"out_of_roundness_{k}"


def phase(k: int) -> str:
    """Name its phase."""
    return f"out_of_roundness_{k}_phase"


@dataclass(frozen=True)
class Cut:
    """What is cut, by what: ring, supports, tool and force, SI."""

    inner_radius: float | None = setting(
        None,
        "inner radius: the middle line lies half the thickness, deviations included, "
        f"outwards; paper: {PAPER_INNER_RADIUS:g} m, where radius is not given",
        unit="m",
        above=0.0,
        presets={"paper": None},
    )
    radius: float | None = setting(
        None,
        "radius r of the middle line, whatever the thickness, instead of inner_radius",
        unit="m",
        above=0.0,
        presets={"by inner_radius": None},
    )
    thickness: float = setting(0.1, "thickness h of the ring", unit="m", above=0.0)
    width: float = setting(1.0, "width of the ring", unit="m", above=0.0)
    youngs_modulus: float = setting(
        2.1e11, "Young's modulus E; steel", unit="Pa", above=0.0
    )
    density: float = setting(7800.0, "density; steel", unit="kg/m^3", above=0.0)
    ring_damping: float = setting(
        1e-4, "internal friction K_T of the ring (Voigt)", unit="s", at_least=0.0
    )
    support_angle: float = setting(
        math.radians(80.0),
        "angle 2 alpha between the supports, below 180 deg",
        unit="rad",
        above=0.0,
    )
    tool_angle: float = setting(
        math.pi,
        "where the tool stands; 180 deg is the middle between the supports",
        unit="rad",
    )
    tool_stiffness: float = setting(
        5e5, "stiffness K_C of the tool module", unit="N/m", above=0.0
    )
    tool_mass: float = setting(
        100.0, "mass m_c of the tool module", unit="kg", above=0.0
    )
    tool_damping: float = setting(
        1e-4, "viscous damping of the tool module", unit="N s/m", at_least=0.0
    )
    speed: float = setting(
        0.5, "angular speed Omega of the ring", unit="rad/s", above=0.0
    )
    depth: float = setting(2e-3, "depth of cut t_R0 as set", unit="m", above=0.0)
    feed: float = setting(0.05, "feed S, mm a turn of the ring", above=0.0)
    cutting_force: float = setting(
        1.0, "scale of both cutting forces: material, wear", unit="1", at_least=0.0
    )
    force_exponent: float = setting(
        0.9, "exponent of the depth in the radial force", above=0.0
    )
    radial_coefficient: float = setting(
        243.0, "coefficient C of the radial force", at_least=0.0
    )
    radial_feed_exponent: float = setting(0.6, "exponent of the feed in it")
    radial_speed_exponent: float = setting(-0.3, "exponent of the cutting speed in it")
    tangential_coefficient: float = setting(
        300.0, "coefficient C of the tangential force", at_least=0.0
    )
    tangential_depth_exponent: float = setting(
        1.0, "exponent of the depth in it", above=0.0
    )
    tangential_feed_exponent: float = setting(0.75, "exponent of the feed in it")
    tangential_speed_exponent: float = setting(
        -0.15, "exponent of the cutting speed in it"
    )


RESTS = 0.8  # of the speed at which the lowest frequency is zero


@dataclass(frozen=True)
class Asked(Cut):
    """How the ring is reckoned, and what is shown of it, SI.

    Raises
    ------
    ModelError
        If two radii are given, the ring has no hole, the supports lie opposite each
        other, or a nominal out-of-roundness is of a harmonic that is not counted.
    """

    out_of_roundness_harmonics: tuple[int, ...] = setting(
        tuple(range(1, NAMED_LOBES + 1)),
        "harmonics k of the blank that may be out of round, each a contributor; only "
        f"those up to {NAMED_LOBES} have a nominal value of their own",
        at_least=1,
        at_most=1000,
        count=(1, 100),
    )
    harmonics: int = setting(
        6, "harmonics N of the ring's deflection", at_least=2, at_most=40
    )
    hoop: bool = setting(
        False,
        "whether the tension of the spinning ring is counted; the paper leaves it out",
    )
    duration: float = setting(
        3.0, "how long is cut, from the engagement on", unit="s", above=0.0
    )
    rtol: float = setting(
        1e-6, "integration tolerance, relative to each state's scale", above=0.0
    )
    max_step: float = setting(5e-3, "longest integration step", unit="s", above=0.0)
    speed_range: Range = setting(
        Range(0.0, 60.0), "speeds that views show", unit="rad/s", at_least=0.0
    )
    varied: str = setting(
        "support_angle",
        "what the views vary beside the speed",
        choices=VARIED,
    )
    varied_by: tuple[float, ...] = setting(
        (0.5, 1.0, 1.5), "its values, times the nominal one", above=0.0, count=(1, 8)
    )

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        if self.radius is not None and self.inner_radius is not None:
            raise ModelError(
                "radius and inner_radius are both given: the radius of the middle line "
                "is either set, or follows from the inner radius and the thickness"
            )
        if not self.middle_radius > 0.5 * self.thickness:
            raise ModelError(
                f"thickness = {self.thickness:g} m with radius = "
                f"{self.middle_radius:g} m: a ring has an inner radius above 0"
            )
        if not self.support_angle < math.pi:
            raise ModelError(
                f"support_angle = {self.support_angle:.6g} rad: it must be below 180 "
                "deg; there the supports no longer keep the ring from moving sideways"
            )
        lobes = self.out_of_roundness_harmonics
        if len(set(lobes)) < len(lobes):
            raise ModelError(
                f"out_of_roundness_harmonics = {list(lobes)}: each harmonic once"
            )
        for k in range(1, NAMED_LOBES + 1):
            if k not in lobes and (
                self.nominal(amplitude(k)) or self.nominal(phase(k))
            ):
                raise ModelError(
                    f"{amplitude(k)} or its phase is given, but {k} is not in "
                    f"out_of_roundness_harmonics = {list(lobes)}"
                )

    def nominal(self, name: str) -> float:
        """Return the nominal value of a contributor; 0 of lobes without a setting."""
        if name == "radius":
            return self.middle_radius
        if name not in vars(self) and name.startswith("out_of_roundness_"):
            return 0.0
        return float(getattr(self, name))

    @property
    def rests(self) -> bool:
        """Whether the ring has a static depth, with room for what deviates."""
        sizes = ("youngs_modulus", "density", "width", "thickness", "radius")
        E, rho, w, h, r = (np.array(self.nominal(name)) for name in sizes)
        nu = float(nu_of(E, rho, w, h, r))
        return self.hoop or self.speed < RESTS * 2.0 * math.sqrt(nu)

    @property
    def step(self) -> float:
        """Longest step, s: max_step, or what the fastest lobes of the blank permit."""
        return min(
            self.max_step, 1.0 / (max(self.out_of_roundness_harmonics) * self.speed)
        )

    @property
    def middle_radius(self) -> float:
        """Radius of the middle line of the nominal ring, m."""
        if self.radius is not None:
            return self.radius
        return self.inner_radius_given + 0.5 * self.thickness

    @property
    def inner_radius_given(self) -> float:
        """Inner radius, or the paper's, m."""
        return PAPER_INNER_RADIUS if self.inner_radius is None else self.inner_radius


def _lobes() -> list[tuple[str, type, Any]]:
    """Declare amplitude and phase of each harmonic of out-of-roundness."""
    declared: list[tuple[str, type, Any]] = []
    for k in range(1, NAMED_LOBES + 1):
        words = "run-out" if k == 1 else f"out-of-roundness with {k} lobes"
        size = setting(0.0, f"{words} of the blank, amplitude e_{k}", unit="m")
        shift = setting(0.0, f"its phase psi_{k}", unit="rad")
        declared += [(amplitude(k), float, size), (phase(k), float, shift)]
    return declared


# written out, these would be twenty-four declarations alike
Settings = dataclasses.make_dataclass(
    "Settings",
    _lobes(),
    bases=(Asked,),
    namespace={"__module__": __name__, "__doc__": "Settings of the ring, SI."},
    frozen=True,
)

"""What a study may choose about a planetary gear."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

from tolstat.machines.planetary.design import EXAMPLES, MOST_SATELLITES, design_of
from tolstat.machines.planetary.scheme import SCHEMES
from tolstat.machines.planetary.synthesis import ORDERS
from tolstat.machines.planetary.wanted import MOST_TEETH, STEEPEST
from tolstat.model.settings import setting
from tolstat.units.grammar import Range

BALANCED = {"balanced": None}


@dataclass(frozen=True)
class Settings:
    """Settings of a planetary gear, SI; what each means stands in its sentence.

    Raises
    ------
    ModelError
        If there is no such gear.
    """

    scheme: str = setting(
        "AI",
        "meshes 1-2 and 3-4: A external, I internal; wheel 4 stands still",
        choices=tuple(SCHEMES),
    )
    teeth: tuple[int, ...] = setting(
        EXAMPLES["AI"],
        "teeth of wheels 1, 2, 3, 4",
        at_least=5,
        at_most=MOST_TEETH,
        count=(4, 4),
    )
    satellites: int = setting(
        3, "satellites, equally spaced, all alike", at_least=2, at_most=MOST_SATELLITES
    )
    module: float = setting(
        2.5e-3, "normal module of wheels 1 and 2", unit="m", above=0.0
    )
    module_ratio: float = setting(
        1.0, "module of wheels 1 and 2 over that of 3 and 4", at_least=0.1, at_most=10.0
    )
    helix_2: float | None = setting(
        None,
        "helix angle of wheels 1, 2; balanced: from the teeth, or from helix_3",
        unit="rad",
        at_least=0.0,
        at_most=1.0,
        presets=BALANCED,
    )
    helix_3: float | None = setting(
        None,
        "helix angle of wheels 3, 4; balanced: from the teeth, or from helix_2",
        unit="rad",
        at_least=0.0,
        at_most=1.0,
        presets=BALANCED,
    )
    pressure_angle: float = setting(
        radians(20), "normal pressure angle", unit="rad", above=0.0, at_most=radians(40)
    )
    addendum: float = setting(
        1.0,
        "how far teeth of wheels 2, 3 stand out, in modules, when satellites are kept "
        "from touching; 0 as in the source",
        at_least=0.0,
        at_most=2.0,
    )
    torque: float = setting(500.0, "torque on wheel 1", unit="N m", at_least=1e-6)
    mesh_stiffness: float = setting(
        4e8, "stiffness of one satellite, as mesh 1-2 feels it", unit="N/m", above=0.0
    )
    position_at: str = setting(
        "mesh",
        "where position errors are told: along mesh 1-2, or at pins of the carrier, "
        "which the mesh feels |1 - D| times (AA, II) or 1 + D times (AI)",
        choices=("mesh", "pin"),
    )
    wanted_ratio: float | None = setting(
        None,
        "view designs: wanted ratio; own: that of the teeth",
        presets={"own": None},
    )
    ratio_tolerance: float = setting(
        0.01,
        "view designs: how far the ratio may be off",
        unit="1",
        at_least=0.0,
        at_most=1.0,
    )
    z1: Range = setting(
        Range(17, 90), "view designs: teeth of wheel 1", at_least=5, at_most=MOST_TEETH
    )
    z2: Range = setting(
        Range(17, 60), "view designs: teeth of wheel 2", at_least=5, at_most=MOST_TEETH
    )
    z3: Range = setting(
        Range(17, 60), "view designs: teeth of wheel 3", at_least=5, at_most=MOST_TEETH
    )
    z4: Range = setting(
        Range(17, 130), "view designs: teeth of wheel 4", at_least=5, at_most=MOST_TEETH
    )
    helix: Range = setting(
        Range(radians(8), radians(30)),
        "view designs: helix angles of both rims",
        unit="rad",
        at_least=0.0,
        at_most=STEEPEST,
    )
    order: str = setting(
        "ratio_error", "view designs: what comes first", choices=ORDERS
    )

    def __post_init__(self) -> None:
        """Refuse gears that do not exist."""
        design_of(self)

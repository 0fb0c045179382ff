"""Settings, contributors and responses of a planetary gear."""

from dataclasses import dataclass
from math import radians

from tolstat.machines.planetary.scheme import EXAMPLES, MOST_SATELLITES, SCHEMES, Design
from tolstat.model.description import Contributor, Description, Gear, Response
from tolstat.model.settings import setting
from tolstat.units.grammar import Range

BALANCED = {"balanced": None}
MOST_TEETH = 10_000
STEEPEST = radians(86)  # helix angle
ORDERS = ("teeth", "ratio_error", "size", "balance")


@dataclass(frozen=True)
class Settings:
    """Settings of a planetary gear, and of the view that lists others, SI."""

    # fmt: off
    scheme: str = setting("AI", "meshes 1-2 and 3-4: A external, I internal; wheel 4 stands still", choices=tuple(SCHEMES))
    teeth: tuple[int, ...] = setting(EXAMPLES["AI"], "teeth of wheels 1, 2, 3, 4", at_least=5, at_most=MOST_TEETH, count=(4, 4))
    satellites: int = setting(3, "satellites, equally spaced, all alike", at_least=2, at_most=MOST_SATELLITES)
    module: float = setting(2.5e-3, "normal module of wheels 1 and 2", unit="m", above=0.0)
    module_ratio: float = setting(1.0, "module of wheels 1 and 2 over that of 3 and 4", at_least=0.1, at_most=10.0)
    helix_2: float | None = setting(None, "helix angle of wheels 1, 2; balanced: from the teeth, or from helix_3", unit="rad", at_least=0.0, at_most=radians(60), presets=BALANCED)
    helix_3: float | None = setting(None, "helix angle of wheels 3, 4; balanced: from the teeth, or from helix_2", unit="rad", at_least=0.0, at_most=radians(60), presets=BALANCED)
    pressure_angle: float = setting(radians(20), "normal pressure angle", unit="rad", above=0.0, at_most=radians(40))
    addendum: float = setting(1.0, "addendum of wheels 2, 3, in modules, to check that satellites do not touch; 0 as in the source", at_least=0.0, at_most=2.0)
    torque: float = setting(500.0, "torque on wheel 1", unit="N m", at_least=1e-6)
    mesh_stiffness: float = setting(4e8, "stiffness of one satellite, at mesh 1-2", unit="N/m", above=0.0)
    position_at: str = setting("mesh", "where position errors are measured: along mesh 1-2, or at pins of the carrier, which act on the mesh |1 - D| times (AA, II) or 1 + D times (AI)", choices=("mesh", "pin"))
    wanted_ratio: float | None = setting(None, "view designs: wanted ratio; own: that of the teeth", presets={"own": None})
    ratio_tolerance: float = setting(0.01, "view designs: permitted relative error of the ratio", unit="1", at_least=0.0)
    z1: Range = setting(Range(17, 90), "view designs: teeth of wheel 1", at_least=5, at_most=MOST_TEETH)
    z2: Range = setting(Range(17, 60), "view designs: teeth of wheel 2", at_least=5, at_most=MOST_TEETH)
    z3: Range = setting(Range(17, 60), "view designs: teeth of wheel 3", at_least=5, at_most=MOST_TEETH)
    z4: Range = setting(Range(17, 130), "view designs: teeth of wheel 4", at_least=5, at_most=MOST_TEETH)
    helix: Range = setting(Range(radians(8), radians(30)), "view designs: helix angles of both rims", unit="rad", at_least=0.0, at_most=STEEPEST)
    order: str = setting("ratio_error", "view designs: sort order", choices=ORDERS)
    # fmt: on


_C = Contributor
_R = Response


def description_of(settings: Settings, design: Design) -> Description:
    """Return contributors and responses: a position error for each satellite."""
    k = settings.satellites
    F = design.F
    spacing = Gear(design.dw2, "pitch") if settings.position_at == "mesh" else None
    where = "along mesh 1-2, tooth spacing included" if spacing else "at its pin"
    contributors = (
        _C("helix_error_2", "rad", "db2", "helix angle of wheel 2 of all satellites", "axial forces", part="helix angles", shown="mrad"),
        _C("helix_error_3", "rad", "db3", "helix angle of wheel 3 of all satellites", "axial forces", part="helix angles", shown="mrad"),
        *(_C(f"position_error_{j}", "m", f"e{j}", f"position of satellite {j}, {where}; above 0 takes more load", "load sharing", gear=spacing, part="satellite positions") for j in range(1, k + 1)),
        _C("centre_distance", "m", "da", "centre distance of both pairs", "backlash", design.a),
        *(_C(f"tooth_thickness_{n}", "m", f"E{n}", f"thickness of the teeth of wheel {n} at the pitch circle, transverse", "backlash", part="tooth thicknesses") for n in (1, 2, 3, 4)),
    )  # fmt: skip
    responses = (
        _R("residual_axial_force", "N", "F_a", "mean residual axial force on a satellite; above 0: of wheel 2", "2T/dw2 tan(b2 + db2) - 2T/dw3 tan(b3 + db3)"),
        _R("load_sharing_factor", "1", "K_gamma", "largest force on a satellite over the mean", "k max F_j / F", "1", (1.0, float(k))),
        _R("satellite_force_max", "N", "max F_j", "largest tangential force of a satellite in mesh 1-2", "sum of c max(0, X + e_j) = F", range=(F / k, k * (F / k))),
        _R("unloaded_satellites", "1", "k_0", "satellites without load", "X + e_j <= 0", "count", (0.0, k - 1.0)),
        _R("backlash", "rad", "j_phi1", "play of wheel 1 with carrier and wheel 4 fixed, both meshes together; below 0 the teeth jam", "(jt12 + D jt34) / rw1"),
    )  # fmt: skip
    return Description(contributors, responses)


ASSUMPTIONS = (
    "Satellites are equal springs that push and cannot pull; all other members are rigid, and none floats. The torque acts in one direction.",
    "Wheels have no profile shift; where a helix angle is given, wheels 3, 4 have the shift that makes them coaxial with 1 and 2.",
    "The residual axial force is that of a satellite with an equal share of load.",
    "The backlash is that of one satellite; satellites whose positions differ take as much from it. Teeth of nominal thickness have none.",
    "Undercut, interference and strength of the teeth are not checked, nor is friction.",
)  # fmt: skip
NO_TOOTH, NO_MESH = "no tooth left", "does not mesh"
FAILURES = {
    NO_TOOTH: "the thickness of a tooth deviates by less than half a pitch",
    NO_MESH: "helix angles are below 90 deg, the centre distance deviates by less than the depth of a tooth, the position of a satellite by less than half a pitch",
}

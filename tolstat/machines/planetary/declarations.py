"""Contributors and responses of a planetary gear: names, units, words."""

from __future__ import annotations

from tolstat.machines.planetary.design import Design
from tolstat.machines.planetary.settings import Settings
from tolstat.model.description import Contributor, Description, Gear, Response

_C = Contributor
_R = Response


def description_of(settings: Settings, design: Design) -> Description:
    """List what deviates and what is answered: a position error for each satellite."""
    k = settings.satellites
    F = design.F
    spacing = Gear(design.dw2, "pitch") if settings.position_at == "mesh" else None
    where = "along mesh 1-2, tooth spacing included" if spacing else "at its pin"
    contributors = (
        _C("helix_error_2", "rad", "db2", "helix angle of wheel 2 of all satellites", "axial forces", part="helix angles", shown="mrad"),
        _C("helix_error_3", "rad", "db3", "helix angle of wheel 3 of all satellites", "axial forces", part="helix angles", shown="mrad"),
        *(
            _C(f"position_error_{j}", "m", f"e{j}", f"position of satellite {j}, {where}; above 0 takes more load", "load sharing", gear=spacing, part="satellite positions")
            for j in range(1, k + 1)
        ),
        _C("centre_distance", "m", "da", "centre distance of both pairs", "backlash", design.a),
        *(
            _C(f"tooth_thickness_{n}", "m", f"E{n}", f"thickness of the teeth of wheel {n} at the pitch circle, transverse", "backlash", part="tooth thicknesses")
            for n in (1, 2, 3, 4)
        ),
    )  # fmt: skip
    responses = (
        _R("residual_axial_force", "N", "F_a", "axial force left on a satellite, the mean of all; above 0: of wheel 2", "2T/dw2 tan(b2 + db2) - 2T/dw3 tan(b3 + db3)"),
        _R("load_sharing_factor", "1", "K_gamma", "largest force on a satellite over the mean", "k max F_j / F", "1", (1.0, float(k))),
        _R("satellite_force_max", "N", "max F_j", "largest tangential force of a satellite in mesh 1-2", "sum of c max(0, X + e_j) = F", range=(F / k, k * (F / k))),
        _R("unloaded_satellites", "1", "k_0", "satellites that carry nothing", "X + e_j <= 0", "count", (0.0, k - 1.0)),
        _R("backlash", "rad", "j_phi1", "play of wheel 1, carrier and wheel 4 fixed, both meshes together; below 0 teeth jam for sure", "(jt12 + D jt34) / rw1"),
    )  # fmt: skip
    return Description(contributors, responses)

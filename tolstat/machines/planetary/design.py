"""The nominal gear of the settings; a gear that cannot exist is refused."""

import math

from tolstat.errors import ModelError
from tolstat.machines.planetary import scheme as schemes
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.scheme import SCHEMES, Design

ROUNDING = 1e-12  # a smaller gap is a touch
MOST_SHIFT = 2.0  # of the centre distance of wheels 3 and 4, in modules


def design_of(settings: Settings) -> Design:
    """Return the gear that the settings describe.

    Wheels 1 and 2 have no profile shift. Wheels 3 and 4 have none either where both
    helix angles come from the balance; where an angle is given, they have the shift
    that makes them coaxial. Raises ModelError if it cannot be coaxial, has no helix
    angles, satellites touch, or cannot be assembled.
    """
    scheme = SCHEMES[settings.scheme]
    z1, z2, z3, z4 = settings.teeth
    _check_rings(settings)
    i, D = (f(scheme, z1, z2, z3, z4) for f in (schemes.ratio, schemes.diameter_ratio))
    if i == 0:
        why = f"z1 z3 = z2 z4 = {z2 * z4}: wheel 1 would never turn"
        raise _refused(settings, f"{why}; give {_other_teeth(settings)}")
    b2, b3 = _helix_angles(settings, D)
    both_given = settings.helix_2 is not None and settings.helix_3 is not None
    dw2 = settings.module * z2 / math.cos(b2)
    dw1, dw3 = dw2 * z1 / z2, dw2 / D
    design = Design(
        scheme, i, D, b2, b3, dw1, dw2, dw3, dw3 * z4 / z3,
        a=(dw1 + scheme.s12 * dw2) / 2,
        alpha12=math.atan(math.tan(settings.pressure_angle) / math.cos(b2)),
        alpha34=_pressure_angle(settings, b2, b3, dw3),
        unbalance=float(schemes.unbalance(b2, b3, D)) if both_given else 0.0,
        F=2 * settings.torque / dw1,
    )  # fmt: skip
    _check_satellites(settings, design)
    return design


def _refused(settings: Settings, why: str) -> ModelError:
    """Return an error that names the gear."""
    teeth = list(settings.teeth)
    return ModelError(f"scheme {settings.scheme}, teeth = {teeth}: {why}")


def _other_teeth(settings: Settings) -> str:
    """Return other teeth that are possible."""
    example = list(schemes.EXAMPLES[settings.scheme])
    return (
        f"other teeth: {example} with 3 satellites and module_ratio 1, or any that "
        "tolstat.machines.planetary.designs finds"
    )


def _check_rings(settings: Settings) -> None:
    """Refuse rings that are not larger than the wheels inside them."""
    z1, z2, z3, z4 = settings.teeth
    scheme = SCHEMES[settings.scheme]
    for sign, ring, inside, has, needs in (
        (scheme.s12, 1, 2, z1, z2),
        (scheme.s34, 4, 3, z4, z3),
    ):
        if sign < 0 and has <= needs:
            raise _refused(
                settings,
                f"wheel {ring} is a ring around wheel {inside} and needs more teeth "
                f"than its {needs}, not {has}; give {_other_teeth(settings)}",
            )


def _helix_angles(settings: Settings, D: float) -> tuple[float, float]:
    """Return the helix angles of the settings, or of the balance."""
    b2, b3 = settings.helix_2, settings.helix_3
    if b2 is not None:
        return b2, math.atan(math.tan(b2) / D) if b3 is None else b3
    if b3 is not None:
        return math.atan(math.tan(b3) * D), b3
    mr, (z1, z2, z3, z4) = settings.module_ratio, settings.teeth
    helices = schemes.balanced(SCHEMES[settings.scheme], mr, z1, z2, z3, z4)
    if math.isnan(helices.b2):
        raise _refused(
            settings,
            "no helix angles balance wheels that are coaxial without profile shift: "
            f"kap = cos b2 / cos b3 = {helices.kap:.6g} and sin b2 / sin b3 = "
            f"{mr * z2 / z3:.6g} ask for sin^2 b3 = {helices.square:.6g}. Give helix_2 "
            "or helix_3, for which wheels 3 and 4 are shifted, another module_ratio, "
            f"or {_other_teeth(settings)}",
        )
    return float(helices.b2), float(helices.b3)


def _pressure_angle(settings: Settings, b2: float, b3: float, dw3: float) -> float:
    """Return the transverse pressure angle of wheels 3 and 4, shifted or not."""
    z1, z2, z3, z4 = settings.teeth
    scheme, m3 = SCHEMES[settings.scheme], settings.module / settings.module_ratio
    # one lead at the pitch cylinder and at the reference cylinder, d3 = m3 z3 / cos b
    sin_b = m3 * z3 * math.tan(b3) / dw3
    d3 = m3 * z3 / math.sqrt(1 - sin_b**2) if sin_b < 1 else math.inf
    shift = (dw3 - d3) / 2 * (z4 + scheme.s34 * z3) / z3 / m3
    tan_alpha = math.tan(settings.pressure_angle)
    cos_alpha = d3 / dw3 / math.hypot(1, tan_alpha * d3 / (m3 * z3))
    if abs(shift) > MOST_SHIFT or cos_alpha >= 1:
        fits = (z4 + scheme.s34 * z3) / (z1 + scheme.s12 * z2)
        fits *= math.cos(b2) / math.cos(b3)
        raise _refused(
            settings,
            f"helix angles of {math.degrees(b2):.4g} and {math.degrees(b3):.4g} deg "
            "leave wheels 3 and 4 not coaxial with 1 and 2: wheel 3 would need a pitch "
            f"circle of {1e3 * dw3:.5g} mm and has one of {1e3 * d3:.5g} mm, more than "
            f"profile shift makes up ({MOST_SHIFT:g} modules in the centre distance). "
            f"Give other helix angles, or module_ratio = {fits:.4f}, which needs none",
        )
    return math.acos(cos_alpha)


def profile_shift(z: int, module: float, b: float, alpha: float, a: float) -> float:
    """Return the sum of two profile shifts, in modules; their difference with a ring.

    By involute geometry, of the sum (difference) z of their teeth; normal module, m,
    helix angle at the reference cylinder, normal pressure angle, centre distance, m.
    """
    alpha_t = math.atan(math.tan(alpha) / math.cos(b))
    working = math.acos(
        min(module * z / (2 * math.cos(b)) * math.cos(alpha_t) / a, 1.0)
    )
    inv = math.tan(working) - working - math.tan(alpha_t) + alpha_t
    return z * inv / (2 * math.tan(alpha))


def shift_34(settings: Settings, design: Design) -> float:
    """Return x4 + x3, or x4 - x3 of a ring, that makes wheels 3 and 4 coaxial."""
    (_, _, z3, z4), m3 = settings.teeth, settings.module / settings.module_ratio
    b = math.asin(m3 * z3 * math.tan(design.b3) / design.dw3)
    z, alpha = z4 + design.scheme.s34 * z3, settings.pressure_angle
    return profile_shift(z, m3, b, alpha, design.a)


def _check_satellites(settings: Settings, design: Design) -> None:
    """Refuse satellites that touch each other, or cannot all be assembled.

    Neighbours have room if 2a sin(pi/k) > max(da2, da3), tips included.
    """
    k, high = settings.satellites, 2 * settings.addendum * settings.module
    widest = max(design.dw2 + high, design.dw3 + high / settings.module_ratio)

    def between(n: int) -> float:
        return 2 * design.a * math.sin(math.pi / n)

    touch = (1 + ROUNDING) * widest
    have_room = [n for n in range(2, schemes.MOST_SATELLITES + 1) if between(n) > touch]
    if k not in have_room:
        most = f"at most {have_room[-1]} have" if have_room else "not even two have"
        raise _refused(
            settings,
            f"{k} satellites touch: they are {1e3 * between(k):.5g} mm apart and "
            f"{1e3 * widest:.5g} mm wide with their addendum; {most} room",
        )
    dividend, divisor = schemes.assembly(design.scheme, k, *settings.teeth)
    if dividend % divisor:
        sign = "-" if design.scheme.s12 == design.scheme.s34 else "+"
        can = [str(n) for n in have_room if dividend % (divisor // k * n) == 0]
        raise _refused(
            settings,
            f"{k} equal satellites cannot be put in: z1 z3 {sign} z2 z4 = {dividend} "
            f"is no multiple of satellites gcd(z2, z3) = {divisor}; of the numbers "
            f"that have room {', '.join(can) or 'none'} can",
        )

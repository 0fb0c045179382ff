"""Frequency functions (8), (9); what the first mode misses of (13) and (19)."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import modes_of, of_springs
from tolstat.machines.elastic_machine.parameters import build
from tolstat.machines.elastic_machine.trials import simulated
from tolstat.model.view import Axis, Chart, Curve, Listing, Picture

POINTS = 2000  # of a diagram
SAMPLES = 40_000  # of a motion, whose peaks a parabola refines
ABOVE = 1.3  # times the highest natural frequency, where a diagram ends


def frequency_functions(
    J: Array, c: Array, b: Array, omega: Array
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return e_sr and sigma_s of one chain, (8) and (9), for any damping.

    e = (C + j omega B - omega^2 I)^-1: the twist of mass s by a torque on mass r,
    rad/(N m), complex128[frequency, mass, mass]. sigma = e I 1: less the twist of mass
    s by phi0'', s2, complex128[frequency, mass]. omega in rad/s.
    """
    w = omega[:, None, None]
    dynamic = of_springs(c) + 1j * w * of_springs(b) - w * w * np.diag(J)
    e: Any = np.linalg.inv(dynamic)
    return e, e @ J


def response(deviations: Array, settings: Settings) -> Chart:
    """Return the frequency functions of the last mass."""
    chains, n = build(deviations, settings), len(settings.inertia)
    J, c, b = (values[0] for values in chains[:3])
    highest = ABOVE * modes_of(J, c, b).k[-1]
    omega = highest * np.arange(1, POINTS + 1) / POINTS
    e, sigma = frequency_functions(J, c, b, omega)
    size, sizes = np.abs(e[:, n - 1]), np.abs(sigma[:, n - 1])
    torques = [
        Curve(f"e_{n}{r}", "rad/N/m", "", f"torque on mass {r}", size[:, r - 1])
        for r in dict.fromkeys((n, 1))
    ]
    curve = Curve(f"sigma_{n}", "s^2", "", "by the programmed acceleration", sizes)
    return Chart.of(
        Axis("frequency", "Hz"),
        omega / (2.0 * np.pi),
        Picture(f"Twist of mass {n} by torques", *torques, logarithmic=True),
        Picture(f"Twist of mass {n} by acceleration", curve, logarithmic=True),
    )


def peak_between(values: Array) -> Array:
    """Return the largest size of sampled values[sample, mass], by parabolas."""
    size = np.abs(values)
    top = np.clip(size.argmax(axis=0), 1, len(size) - 2)
    a, m, b = (np.take_along_axis(size, top[None] + i, axis=0)[0] for i in (-1, 0, 1))
    bend = a - 2.0 * m + b
    rise = (b - a) ** 2 / np.where(bend < 0.0, -8.0 * bend, np.inf)
    return np.asarray(np.maximum(m + rise, size.max(axis=0)))


def missed(deviations: Array, settings: Settings) -> Array:
    """Return max |theta - theta^(1)|/max |theta| of each mass, no load, (13), (19).

    theta^(1) is the first mode alone, which is a mass on one spring.
    """
    n = len(settings.inertia)
    chains = build(deviations, settings)
    modes = modes_of(*(values[0] for values in chains[:3]))
    k, zeta = float(modes.k[0]), float(modes.zeta[0])
    alone = replace(settings, load_torque=())
    first = replace(
        alone, inertia=(1.0,), stiffness=(k * k,), damping=(2.0 * zeta * k,)
    )
    times = np.linspace(0.0, settings.horizon, SAMPLES + 1)
    rest = deviations[0, 3 * n + 1 + len(settings.load_torque) :]
    motion = [deviations[0, 3 * n], *rest]  # start-up and braking times
    all_modes = simulated(np.array([[*deviations[0, : 3 * n], *motion]]), alone, times)
    part = simulated(np.array([[0.0, 0.0, 0.0, *motion]]), first, times)
    theta = all_modes.solution.history[0, :, :n]
    of_first = part.solution.history[0, :, :1] * k * k * modes.rho[0]
    return np.asarray(peak_between(theta - of_first) / peak_between(theta))


def first_mode(deviations: Array, settings: Settings) -> Listing:
    """Return what the first mode alone misses of each mass."""
    if settings.speed == 0:
        raise ModelError("final_speed = 0: there is no programmed motion")
    n = len(settings.inertia)
    rho = modes_of(*(values[0] for values in build(deviations, settings)[:3])).rho
    return Listing.of(
        "a mass; shares of its largest error, without load",
        ("mass", "1", "count", np.arange(1.0, n + 1.0)),
        ("missed", "1", "1", missed(deviations, settings)),
        ("missed statically", "1", "1", 1.0 - rho[0] / rho.sum(axis=0)),
    )

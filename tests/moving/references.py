"""The gallery's models by SciPy: DOP853 with events, or a closed form."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm


def by_modes(
    modes, exits, mode, y, end, *, watch=None, breaks=(), jump=None, scale=1.0
):
    """Integrate mode after mode: {mode: rates}, {mode: [(event, direction, next)]}.

    `watch` maps modes to a quantity, of which the greatest and least are returned with
    the states and the times of the changes. The next mode None ends the motion.
    """
    t, greatest, least, changes = 0.0, -np.inf, np.inf, []
    stops = sorted({*(b for b in breaks if b < end), end})
    while t < end:
        events = []
        for event, direction, _ in exits.get(mode, ()):

            def crossing(t, y, event=event):
                return event(t, y)

            crossing.terminal, crossing.direction = True, direction
            events.append(crossing)
        stop = min(s for s in stops if s > t + 1e-15)
        done = solve_ivp(
            modes[mode], (t, stop), y, "DOP853", events=events or None,
            rtol=1e-12, atol=1e-13 * np.asarray(scale), dense_output=watch is not None,
        )  # fmt: skip
        if watch is not None:
            times = np.unique(np.linspace(done.t[:-1], done.t[1:], 9).ravel())
            high, low = extremes(watch[mode], done.sol, times)
            greatest, least = max(greatest, high), min(least, low)
        t, y = done.t[-1], done.y[:, -1].copy()
        if done.status == 1:
            hit = next(i for i, times in enumerate(done.t_events) if len(times))
            following = exits[mode][hit][2]
            y = jump(mode, following, y) if jump else y
            mode = following
            changes.append(t)
            if mode is None:
                break
            # behind the event, so that it is not found again
            dt = min(1e-13 * max(1.0, t), end - t)
            y, t = y + dt * np.asarray(modes[mode](t, y)), t + dt
    return y, greatest, least, changes


def extremes(quantity, solution, times):
    """Return the greatest and the least value, refined between samples."""
    values = quantity(times, solution(times))
    results = []
    for sign in (1.0, -1.0):
        i = int(np.argmax(sign * values))
        fine = np.linspace(times[max(i - 2, 0)], times[min(i + 2, len(times) - 1)], 401)
        finer = sign * quantity(fine, solution(fine))
        results.append(sign * max(finer.max(), sign * values[i]))
    return results


def ball(drop, e, g=9.81):
    t, v, count = np.sqrt(2.0 * drop / g), e * np.sqrt(2.0 * drop * g), 1
    while v > 1e-9 and t + 2.0 * v / g <= 3.0:
        t, v, count = t + 2.0 * v / g, e * v, count + 1
    return v * (3.0 - t) - g * (3.0 - t) ** 2 / 2.0, count


def stop(m, k, g, ks, bs):
    def force(t, y):
        return ks * (-g - y[0]) - bs * y[1]

    def free(t, y):
        return [y[1], -k * y[0] / m, 0.0]

    def hit(t, y):
        return [y[1], (force(t, y) - k * y[0]) / m, bs * y[1] ** 2]

    def gap(t, y):
        return y[0] + g

    modes = {"free": free, "hit": hit, "left": free}
    exits = {
        "free": [(gap, -1, "hit")],
        "hit": [(force, -1, "left")],
        "left": [(gap, 1, "free")],
    }
    watch = dict.fromkeys(modes, lambda t, y: 0.0 * y[0]) | {"hit": force}
    y, greatest, _, _ = by_modes(modes, exits, "free", [0.1, 0, 0], 2.0, watch=watch)
    return greatest, y[2]


def motor(J, f):
    t1 = J / f / 0.02 * np.log(12 / 10)
    t2 = t1 + J / f / 0.12 * np.log(100 / 10)
    return t2, 200 - 100 * np.exp(-0.12 * f / J * (6.0 - t1))


def linear(m, c, b, pieces):
    """Exact motion under straight pieces of force (begin, end, from, to): x, |x|."""
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1, :3] = -c / m, -b / m, 1.0 / m
    y, x = np.zeros(2), []
    for begin, end, first, last in pieces:
        step = expm(A * (end - begin) / 2000)
        state = np.array([*y, first, (last - first) / (end - begin)])
        for _ in range(2000):
            x.append(state[0])
            state = step @ state
        y = state[:2]
    return np.array([*x, y[0]])


def greatest_of(x):
    """Return the greatest of even samples, by the parabola through it."""
    i = int(np.argmax(x))
    if not 0 < i < len(x) - 1:
        return x[i]
    return x[i] - (x[i + 1] - x[i - 1]) ** 2 / (8 * (x[i - 1] - 2 * x[i] + x[i + 1]))


def cam(m, k, c, b):
    from runs.gallery.cam import LIFTS

    turn = 2 * np.pi / 157.0
    edges = np.append(np.arange(0, 0.12, turn / 12), 0.12)
    lift = LIFTS[np.arange(len(edges)) % 12].astype(float)
    share = (edges[-1] - edges[-2]) / (turn / 12)
    lift[-1] = lift[-2] + share * (lift[-1] - lift[-2])
    pieces = [*zip(edges[:-1], edges[1:], k * lift[:-1], k * lift[1:], strict=True)]
    x = linear(m, k + c, b, pieces)
    forces = [
        np.linspace(*piece[2:], 2001) - k * x[2000 * i : 2000 * i + 2001]
        for i, piece in enumerate(pieces)
    ]
    return (max(map(greatest_of, forces)),)


def pulses(m, c, b, F):
    e = [0, 0.3, 0.305, 0.9, 0.905, 1.5, 1.505, 2.0]
    force = [F * (i % 2) for i in range(7)]
    x = linear(m, c, b, [*zip(e[:-1], e[1:], force, force, strict=True)])
    return (greatest_of(np.abs(x)),)


def shock(m, c, b, f):
    from runs.gallery.shock import LOADS, TIMES

    F = f * np.array(LOADS)
    x = linear(m, c, b, [*zip(TIMES[:-1], TIMES[1:], F[:-1], F[1:], strict=True)])
    return (greatest_of(np.abs(x)),)


def belt(m, k, F):
    def friction(s):
        return F * (1 + 0.5 * np.exp(-np.abs(s) / 0.05))

    def stick(t, y):
        return [0.1, 0.0, 0.0]

    def slip(t, y):
        s = y[1] - 0.1
        return [y[1], (friction(s) - k * y[0]) / m, -friction(s) * s]

    def jump(before, after, y):
        return np.array([y[0], 0.1 if after == "stick" else y[1] - 1e-12, y[2]])

    modes = {"stick": stick, "slip": slip}
    exits = {
        "stick": [(lambda t, y: k * y[0] - 1.5 * F, 1, "slip")],
        "slip": [(lambda t, y: y[1] - 0.1, 1, "stick")],
    }
    watch = dict.fromkeys(modes, lambda t, y: k * y[0])
    start = [0.0, 0.0, 0.0]
    y, high, _, _ = by_modes(modes, exits, "slip", start, 10, watch=watch, jump=jump)
    return high, y[2]


def gear(m, k, g, b, T):
    def rates(force, free):
        def of(t, y):
            load = T * (1 + 3 * np.cos(300 * t))
            return [y[1], (load - force(t, y)) / m, free]

        return of

    force = {
        "upper": lambda t, y: k * (y[0] - g) + b * y[1],
        "lower": lambda t, y: k * (y[0] + g) + b * y[1],
        "free": lambda t, y: 0.0 * y[0],
    }
    modes = {name: rates(F, float(name == "free")) for name, F in force.items()}

    def above(t, y):
        return y[0] - g

    def below(t, y):
        return y[0] + g

    exits = {
        "upper": [(above, -1, "free")],
        "lower": [(below, 1, "free")],
        "free": [(above, 1, "upper"), (below, -1, "lower")],
    }
    y, high, _, _ = by_modes(
        modes, exits, "upper", [6e-5, 0, 0], 0.3, watch=force, scale=[1e-4, 0.1, 0.1]
    )
    return high, y[2]


def pendulum(l, s, k, b):
    def moment(t, y):
        return k * (-s - y[0]) - b * y[1]

    modes = {
        "free": lambda t, y: [y[1], -9.81 / l * np.sin(y[0])],
        "hit": lambda t, y: [y[1], -9.81 / l * np.sin(y[0]) + moment(t, y)],
    }
    exits = {
        "free": [(lambda t, y: y[0] + s, -1, "hit")],
        "hit": [(lambda t, y: y[0] + s, 1, "free")],
    }
    watch = {"free": lambda t, y: 0.0 * y[0], "hit": moment}
    _, high, low, _ = by_modes(modes, exits, "free", [1.0, 0.0], 5.0, watch=watch)
    return (max(high, -low),)


def brake(m, F):
    a = F / m + 0.5
    return 200.0 / a, F * 200.0 / a, 20.0 / a


def clutch(J1, J2, T):
    def slip(t, y):
        return [(5 - T) / J1, (T - 0.05 * y[1]) / J2, T * (y[0] - y[1])]

    exits = {"slip": [(lambda t, y: y[0] - y[1], -1, None)]}
    y, _, _, (locked,) = by_modes(
        {"slip": slip}, exits, "slip", [100 + 5 / J1, 0, 0], 3.0
    )
    speed = 100 + (y[1] - 100) * np.exp(-0.05 / (J1 + J2) * (3.0 - locked))
    return speed, y[2], 1.0 + locked


def servo(m, kp, ki, kd):
    x = v = area = 0.0
    last, highest, largest = 1e-3, 0.0, 0.0
    for _ in range(100):
        error = 1e-3 - x
        wish = kp * error + ki * area + kd * (error - last) / 1e-3
        F = min(max(wish, -15.0), 15.0)
        area, last, largest = area + 1e-3 * error, error, max(largest, abs(F))
        a, turn = F / m, -v / (F / m) if F else -1.0
        for s in (1e-3, *([turn] if 0 < turn < 1e-3 else [])):
            highest = max(highest, x + v * s + 0.5 * a * s * s)
        x, v = x + v * 1e-3 + 0.5 * a * 1e-6, v + a * 1e-3
    return highest, largest


def flight(v0, angle, c):
    def rates(t, y):
        v = np.hypot(y[2], y[3])
        return [y[2], y[3], -c * v * y[2], -9.81 - c * v * y[3]]

    start = [0.0, 0.0, v0 * np.cos(angle), v0 * np.sin(angle)]
    exits = {"flies": [(lambda t, y: y[1], -1, None)]}
    y, _, _, (landed,) = by_modes({"flies": rates}, exits, "flies", start, 10.0)
    return y[0], landed


def thermostat(P, C, G):
    t, T, on, energy, warmest = 0.0, 15.0, True, 0.0, 15.0
    while t < 3600.0:
        limit, goal = (5.0 + P / G, 20.5) if on else (5.0, 19.5)
        dt = min(C / G * np.log((T - limit) / (goal - limit)), 3600.0 - t)
        energy += P * dt * on
        T = limit + (T - limit) * np.exp(-G / C * dt)
        t, on, warmest = t + dt, not on, max(warmest, T)
    return energy, warmest


def cylinder(m, A, stroke, Q):
    def contact(t, y):
        return 1e7 * (y[0] - stroke) + 2e4 * y[1]

    def rates(force):
        def of(t, y):
            drop = 20e5 - y[2]
            turbulent = np.sign(drop) * np.sqrt(np.abs(drop) / 1e6)
            flow = Q * np.where(np.abs(drop) > 1e4, turbulent, drop / 1e5)
            a = ((y[2] - 1e5) * A - 500.0 * y[1] - force(t, y)) / m
            return [y[1], a, 1e9 * (flow - A * y[1]) / (1e-4 + A * y[0])]

        return of

    force = {"free": lambda t, y: 0.0 * y[0], "hit": contact}
    force["left"] = force["free"]

    def gap(t, y):
        return y[0] - stroke

    exits = {
        "free": [(gap, 1, "hit")],
        "hit": [(contact, -1, "left")],
        "left": [(gap, -1, "free")],
    }
    _, high, _, changes = by_modes(
        {name: rates(F) for name, F in force.items()}, exits, "free", [0, 0, 1e5], 0.45,
        watch=force, scale=[1.0, 1.0, 1e5],
    )  # fmt: skip
    return high, changes[0]


def chain(m, k, b):
    def force(t, y):
        x, v = (np.concatenate([0.0 * y[:1], y[i : i + 5]]) for i in (0, 5))
        return k * np.diff(x, axis=0) + b * np.diff(v, axis=0)

    def rates(push):
        def of(t, y):
            F = force(t, y)
            return [*y[5:], *((np.array([*F[1:], push]) - F) / m)]

        return of

    pushed = {"on": rates(1000.0), "off": rates(0.0)}
    watch = dict.fromkeys(pushed, lambda t, y: force(t, y)[0])
    exits = {"on": [(lambda t, y: t - 0.002, 1, "off")]}
    start, scale = np.zeros(10), np.repeat([1e-3, 1.0], 5)
    _, high, low, _ = by_modes(
        pushed, exits, "on", start, 0.05, watch=watch, scale=scale
    )
    return (max(high, -low),)


def four_bar(crank, coupler, rocker, base, J, T):
    """The rocker's angle by complex numbers, and its slope by differences of it."""

    def angle(a):
        joint = crank * np.exp(1j * a) - base
        far = np.abs(joint)
        bend = np.arccos((rocker**2 + far**2 - coupler**2) / (2 * rocker * far))
        return np.angle(joint) % (2 * np.pi) - bend

    def ratio(a):  # differences of the eighth order
        h = 0.02
        weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
        return sum(
            w * (angle(a + i * h) - angle(a - i * h)) / h
            for i, w in enumerate(weights, 1)
        )

    def rates(way):
        return lambda t, y: [y[1], (2.0 - way * T * ratio(y[0])) / J]

    modes = {1: rates(1.0), -1: rates(-1.0)}
    exits = {way: [(lambda t, y: ratio(y[0]), 0, -way)] for way in modes}
    swing = dict.fromkeys(modes, lambda t, y: angle(y[0]))
    first = int(np.sign(ratio(0.0)))
    _, high, _, _ = by_modes(modes, exits, first, [0.0, 20.0], 1.0, watch=swing)
    speed = dict.fromkeys(modes, lambda t, y: y[1])
    _, _, low, _ = by_modes(modes, exits, first, [0.0, 20.0], 1.0, watch=speed)
    return high, low

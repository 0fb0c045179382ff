"""Motions with events, integrated phase by phase by SciPy."""

from __future__ import annotations

from scipy.integrate import solve_ivp


def event(function, direction):
    """An event of SciPy that ends the phase."""

    def found(t, y):
        return function(t, y)

    found.terminal, found.direction = True, direction
    return found


def by_phases(phases, start, y):
    """Integrate phase after phase: name -> (rates, {next phase: (event, jump)})."""
    t, name = 0.0, start
    while t < END:
        rates, exits = phases[name]
        events = [each for each, _ in exits.values()]
        found = solve_ivp(
            rates, (t, END), y, "DOP853", events=events, rtol=1e-12, atol=1e-13,
            max_step=0.05,
        )  # fmt: skip
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 1:
            hit = next(i for i, times in enumerate(found.t_events) if len(times))
            name, (_, jump) = list(exits.items())[hit]
            y = jump(y)
    return y


def same(y):
    return y


END = 12.0  # s

"""Crossings: a step ends where a quantity that decides a branch changes its sign.

A force that acts on one side only has a kink where it begins; a relay or a stop has a
jump. A step over either has a low order. So each quantity that a system names has a
side, 1 or -1, which the rates read and which is constant over a step. The quantity is
evaluated at the start, middle and end of every step that the error permits, and at the
vertex of the parabola through these values: a short visit to the other side can pass
undetected between them. Where it leaves its side, the step is tried again and ends at
the first crossing on its dense output. Behind it the side changes, the state may jump,
the first stage is evaluated again, and the march continues with the former step.

Values below `ROUNDING` of the quantity's size are zero. A quantity that touches zero
and returns at once gets its former side back. If it cannot leave zero on either side,
both sides lead back to it: the quantity slides, or bounces lower and lower. Then its
side is 0 until its value differs from zero: the rates say what holds it. The side is
also 0, at once, where the rates of a quantity at zero jump and those of side 0 hold it:
a part that stops sticks if friction at rest can hold it.

Dry friction of a part that slips or sticks: Coulomb's law.
"""

import numpy as np

from tolstat.arrays import Array
from tolstat.integrator import problem
from tolstat.integrator.peaks import look, vertex_of
from tolstat.lanes.compiled import compiled

ROUNDING = 1e-12  # of the largest size in the trial: smaller values are zero
NEAR_ZERO = 1e-3  # of that: the search for a crossing ends
LOOKS = 40  # evaluations for one crossing: each halves the interval, but for one
PROBE = 1e-3  # of the next step: how far the rates are followed from zero
HELD = 0.01  # change of a quantity that is held, over the change on its side
JUMPED = 1e-6  # relative change of a rate that jumps
BACK = 8  # evaluations next to a start at zero, each at a quarter of the distance

# what `lanes.returned` says of a quantity
LEFT = 0.0  # it has left zero since its side changed
AT_ZERO = 1.0  # its side changed there
RETURNED = 2.0  # then it got its former side back


@compiled(within=True)
def aim_at_crossing(h, t_new, clock):
    """Return the step and the time after it: to the crossing, if one was found."""
    t, step, target = clock[problem.TIME], clock[problem.STEP], clock[problem.TARGET]
    short = (clock[problem.AFTER] > 0.0) & (step < target - t)
    return np.where(short, step, h), np.where(short, t + step, t_new)


@compiled(within=True)
def _values(i, lanes, step):
    """Return a quantity at the start, middle and end of the step, and what is zero."""
    number = step.crossings[i]
    row = len(lanes.y) + len(lanes.quadratures) + number
    a, b = step.k[0][row], step.k[6][row]
    m = step.watched_middle[number]
    largest = np.maximum(np.abs(a), np.maximum(np.abs(m), np.abs(b)))
    return a, m, b, ROUNDING * np.maximum(lanes.size[i], largest)


@compiled()
def _first_of(watch, t, h, permitted, i, lanes, step):
    """Return the fraction of the step at which one quantity first leaves its side.

    Parameters
    ----------
    watch
        See `problem.System`.
    t, h : vector
        Start of the step and its length, s.
    permitted : mask
        The lanes to be searched.
    i : int
        Number of the crossing.
    lanes, step : Lanes, Step
        With the rates at both ends, and the watched quantities in the middle.

    Returns
    -------
    vector
        2 if it does not; 0 if it starts at zero and is never on its side.
    """
    number = step.crossings[i]
    a, m, b, zero = _values(i, lanes, step)
    side = lanes.side[i]
    permitted = permitted & (side != 0.0)
    starts_at_zero = lanes.returned[i] > LEFT
    a, m, b = side * a, side * m, side * b  # above 0: on its side

    # a visit to the other side and back; from zero, one to its own side
    theta, vertex = vertex_of(a, m, b)
    behind = ~starts_at_zero & (vertex < -zero)
    visit = behind | (starts_at_zero & (vertex > zero) & (m < -zero))
    visit = visit & permitted & (theta > 0.0) & (theta < 1.0)
    between, value = 0.5 + 0.0 * h, m
    if np.any(visit):
        theta = np.where(visit, theta, 0.5)
        inner = side * look(watch, t, h, theta, number, lanes, step)
        visit = visit & (np.where(starts_at_zero, inner, -inner) > zero)
        between, value = np.where(visit, theta, between), np.where(visit, inner, m)

    # the crossing lies between lower and upper
    early = ~starts_at_zero & (value < -zero)
    to_its_side = starts_at_zero & visit
    lower, f_lower = np.where(early, 0.0, between), np.where(early, a, value)
    upper = np.where(early, between, np.where(to_its_side, 0.5, 1.0))
    f_upper = np.where(early, value, np.where(to_its_side, m, b))
    returns = permitted & starts_at_zero & (value <= zero) & (np.minimum(m, b) < -zero)
    upper = np.where(returns, between, upper)
    for _ in range(BACK):
        if not np.any(returns):
            break
        nearer = 0.25 * upper
        theta = np.where(returns, nearer, 0.5)
        inner = side * look(watch, t, h, theta, number, lanes, step)
        leaves = returns & (inner > zero)
        lower = np.where(leaves, nearer, lower)
        f_lower = np.where(leaves, inner, f_lower)
        returns = returns & ~leaves
        upper = np.where(returns, nearer, upper)
        f_upper = np.where(returns, inner, f_upper)
    crosses = permitted & ~returns & (f_upper < -zero)

    # interpolate, truncate, project: never more than one look above bisection
    # (I. F. D. Oliveira, R. H. C. Takahashi, ACM Trans. Math. Softw. 47 (2020) 5)
    f_lower = np.maximum(f_lower, 0.0)
    root, looking, width = upper, crosses, upper - lower
    truncation, radius = 0.2 / width, width
    for _ in range(LOOKS):
        if not np.any(looking):
            break
        width, middle = upper - lower, 0.5 * (lower + upper)
        falsi = (lower * f_upper - upper * f_lower) / (f_upper - f_lower)
        falsi = np.where(crosses, falsi, middle)
        step_back = np.minimum(truncation * width * width, np.abs(middle - falsi))
        trial = falsi + np.copysign(step_back, middle - falsi)
        most = np.maximum(radius - 0.5 * width, 0.0)
        offset = np.minimum(np.maximum(trial - middle, -most), most)
        root = np.where(looking, middle + offset, root)
        radius = 0.5 * radius
        f = side * look(watch, t, h, np.where(crosses, root, 0.5), number, lanes, step)
        past = f < 0.0
        upper, f_upper = np.where(past, root, upper), np.where(past, f, f_upper)
        lower, f_lower = np.where(past, lower, root), np.where(past, f_lower, f)
        looking = looking & (np.abs(f) > NEAR_ZERO * zero)
    root = np.where(looking, upper, root)
    return np.where(returns, 0.0, np.where(crosses, root, 2.0))


@compiled()
def first_crossing(watch, t, h, permitted, lanes, step):
    """Return the fraction of the step at the first crossing; 2 if there is none.

    That of each quantity is stored in `step.theta`. Other arguments as of `_first_of`.
    """
    smallest = lanes.clock[problem.SMALLEST]
    # a step of the least length ends at the crossing
    looked_at = permitted & (h > 2.0 * smallest)
    first = 2.0 + 0.0 * h
    for i in range(len(step.crossings)):
        theta = _first_of(watch, t, h, looked_at, i, lanes, step)
        # so does a step that ends less than that behind it
        theta = np.where(h - h * theta > smallest, theta, 2.0)
        step.theta[i] = theta
        first = np.minimum(first, theta)
    return first


@compiled()
def choose_sides(watch, lanes, step):
    """Choose the sides where a trial or a phase begins; copy all to the moment."""
    sides, sizes, returned = lanes.side, lanes.size, lanes.returned
    begins = lanes.clock[problem.EVENT] == problem.MARK_REACHED
    for _ in range(2):  # a quantity may depend on the side of another
        for i in range(len(step.crossings)):
            step.moment[problem.SIDES + i] = sides[i]
        watch(step.moment, lanes.y, lanes.p, step.filled_middle)
        for i in range(len(step.crossings)):
            value = step.watched_middle[step.crossings[i]]
            sizes[i] = np.where(begins, np.maximum(sizes[i], np.abs(value)), sizes[i])
            clear = np.abs(value) > ROUNDING * sizes[i]
            chosen = begins & (clear | (sizes[i] == 0.0))
            sides[i] = np.where(chosen, np.copysign(1.0, value), sides[i])
            returned[i] = np.where(chosen, np.where(clear, LEFT, AT_ZERO), returned[i])
    for i in range(len(step.crossings)):
        step.moment[problem.SIDES + i] = sides[i]


@compiled(within=True)
def _hold(held, value, i, lanes):
    """Raise the size of a quantity that is held at a value: it stays zero there."""
    grown = np.maximum(lanes.size[i], 2.0 / ROUNDING * np.abs(value))
    lanes.size[i] = np.where(held, grown, lanes.size[i])


@compiled()
def _change_from_zero(rates, watch, side, i, lanes, step):
    """Return the change of a quantity in a short time with a side, and its value."""
    moment, number = step.moment, step.crossings[i]
    t, d = lanes.clock[problem.TIME], PROBE * lanes.clock[problem.STEP]
    moment[problem.TIME], moment[problem.SIDES + i] = t, side
    watch(moment, lanes.y, lanes.p, step.filled_middle)
    value = step.watched_middle[number]
    rates(moment, lanes.y, lanes.p, step.k[1])
    for n in range(len(lanes.y)):
        step.middle[n] = lanes.y[n] + d * step.k[1][n]
    moment[problem.TIME] = t + d
    watch(moment, step.middle, lanes.p, step.filled_middle)
    moment[problem.TIME] = t
    return step.watched_middle[number] - value, value


@compiled()
def hold_at_zero(rates, watch, lanes, step):
    """Give side 0 to quantities at zero where the rates with that side hold them.

    `step.k[1]` has the rates with the sides as they are. Return whether it was used.
    """
    clock = lanes.clock
    K1, K2 = step.k[0], step.k[1]
    jump = clock[problem.EVENT] == problem.MARK_REACHED
    for n in range(len(lanes.y)):
        least = JUMPED * (np.abs(K1[n]) + np.abs(K2[n]))
        jump = jump | (np.abs(K2[n] - K1[n]) > least)
    runs = clock[problem.PHASE] >= 0.0
    jump = jump & (clock[problem.EVENT] != problem.NOTHING) & runs
    used = False
    for i in range(len(step.crossings)):
        side = lanes.side[i]
        may = jump & (lanes.returned[i] == AT_ZERO) & (side != 0.0)
        if not np.any(may):
            continue
        used = True
        moving, _ = _change_from_zero(rates, watch, side, i, lanes, step)
        at_rest, value = _change_from_zero(rates, watch, 0.0 * side, i, lanes, step)
        held = may & (np.abs(at_rest) < HELD * np.abs(moving))
        _hold(held, value, i, lanes)
        lanes.side[i] = step.moment[problem.SIDES + i] = np.where(held, 0.0, side)
    return used


@compiled()
def take_jump(lanes, step):
    """Take over states and sides in `step.jumped`, where the state jumps."""
    clock, y, n = lanes.clock, lanes.y, len(lanes.y)
    jumps = clock[problem.JUMP] > 0.0
    for i in range(n):
        y[i] = np.where(jumps, step.jumped[i], y[i])
    sides, returned = lanes.side, lanes.returned
    for i in range(len(step.crossings)):
        side = np.where(jumps, step.jumped[n + i], sides[i])
        returned[i] = np.where(side != sides[i], RETURNED, returned[i])
        value = step.watched_middle[step.crossings[i]]
        _hold(jumps & (side == 0.0), value, i, lanes)
        sides[i] = step.moment[problem.SIDES + i] = side
    clock[problem.JUMP] = 0.0


@compiled()
def change_sides(accepted, aimed, first, lanes, step):
    """Change the sides of quantities that cross zero at the end of the step.

    Parameters
    ----------
    accepted, aimed : mask
        The lanes whose step is taken, and those whose step ends at a crossing: what
        only decays to zero keeps its side.
    first : vector
        The fraction of the step at the first crossing.
    lanes : Lanes
        Their sides are changed in place.
    step : Step
        With the quantities at its start, middle and end.

    Returns
    -------
    tuple of mask
        Lanes with another side, and those of them at which the state may jump.
    """
    changed, arrived = accepted & (first < 0.0), accepted & (first < 0.0)
    sides, sizes, returned = lanes.side, lanes.size, lanes.returned
    for i in range(len(step.crossings)):
        a, m, b, zero = _values(i, lanes, step)
        side, was = sides[i], returned[i]
        sizes[i] = np.where(accepted, zero / ROUNDING, sizes[i])
        held = side == 0.0
        has_left = (was == LEFT) | (side * m > zero) | (side * b > zero)
        behind = (side * b < -zero) | (aimed & (side * b <= zero))
        crosses = accepted & ~held & has_left & behind
        released = accepted & held & (np.abs(b) > zero)
        back = (first == 0.0) & (step.theta[i] == 0.0)
        stays = back & (was == RETURNED)

        new = np.where(crosses | back, -side, side)
        new = np.where(released, np.copysign(1.0, b), new)
        sides[i] = np.where(stays, 0.0, new)
        _hold(stays, a, i, lanes)
        was = np.where(accepted & has_left | released, LEFT, was)
        was = np.where(crosses, AT_ZERO, was)
        returned[i] = np.where(back, RETURNED, was)
        changed = changed | crosses | back | released
        arrived = arrived | crosses | back
    return changed, arrived


@compiled(within=True)
def go_on(h, first, accepted, max_step, clock):
    """Set the next step: to the crossing, or behind it the step before it.

    Parameters
    ----------
    h, first : vector
        The step, s, and the fraction of it at the crossing.
    accepted : mask
        The lanes whose step is taken.
    max_step : float
        The longest step, s.
    clock : rows
        With the step of the controller; changed in place.
    """
    again, crosses, after = first == 0.0, first < 1.0, clock[problem.AFTER]
    resumed = np.minimum(np.maximum(clock[problem.STEP], after), max_step)
    next_step = np.where(accepted, resumed, clock[problem.STEP])
    short = np.maximum(h * first, 2.0 * clock[problem.SMALLEST])
    clock[problem.STEP] = np.where(again, h, np.where(crosses, short, next_step))
    aimed = np.where(crosses, np.maximum(after, h), 0.0)
    clock[problem.AFTER] = np.where(again, after, aimed)


@compiled(within=True)
def dry_friction(slips: Array, grips: Array, load: Array, sliding: Array) -> Array:
    """Return the force of dry friction on a part, N.

    The part sticks while its sliding speed stays at zero and the friction at rest
    exceeds the load. Otherwise it slips, or begins to: the way that the load pulls.

    Parameters
    ----------
    slips : vector
        Side of the crossing of the sliding speed: 1, -1, or 0 at rest.
    grips : vector
        Side of the crossing of the greatest friction at rest, less the size of `load`.
    load : vector
        Force that would move the part if there were no friction, N. While the part
        sticks, its friction is minus this force.
    sliding : vector
        Size of the friction while it slips, N.
    """
    way = np.where(slips == 0.0, np.copysign(1.0, load), slips)
    return np.where((slips == 0.0) & (grips > 0.0), -load, -sliding * way)

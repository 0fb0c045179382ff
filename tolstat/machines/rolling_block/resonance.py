"""Speeds of the motor with and without resonance; the paper's Fig. 5."""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RPM, Settings
from tolstat.machines.rolling_block.modes import drives
from tolstat.machines.rolling_block.structure import STANDS
from tolstat.model.view import Axis, Band, Chart, Curve, Listing, Panel, Span, bands_of
from tolstat.statistics.intervals.shares import proportion
from tolstat.units.grammar import Range

POINTS = 851  # of a range of speeds: one each rpm of the paper's
LAST = list(STANDS).index(34)  # the stand in which the rolling speed is limited
NEAR = 0.85  # modes within this ratio of an excitation are in its picture


def rolling_speeds(settings: Settings) -> Array:
    """Return the rolling speed over the motor's, m, float64[stand]: pi d_s/(2 pi i_s).

    The motor's speed is in rad/s; the rod's slip ahead of the rolls is ignored.
    """
    _, _, i31, i34 = settings.ratios
    per_turn = np.array([i31, i31, i34, i34])
    return np.asarray(np.array(settings.roll_diameters) / (2.0 * per_turn))


def fastest(settings: Settings) -> float:
    """Return the motor's speed at the limit of the rolling speed, rad/s."""
    return float(settings.rolling_speed_limit / rolling_speeds(settings)[LAST])


def named_orders(settings: Settings) -> dict[str, float]:
    """Return the excitations by name, and their number per turn of the motor."""
    _, _, i31, i34 = settings.ratios
    turns = {"motor": 1.0, "rolls_31": 1.0 / i31, "rolls_34": 1.0 / i34}
    orders = {f"order {str(n).removesuffix('.0')}": n for n in settings.orders}
    if settings.rolls:
        orders |= {"rolls 31, 32": 1.0 / i31, "rolls 33, 34": 1.0 / i34}
    for mesh in settings.meshes:
        name = f"{mesh['teeth']} teeth, {mesh['shaft'].replace('_', ' ')}"
        orders[name] = mesh["teeth"] * turns[mesh["shaft"]]
    return orders


def forbidden(omega: Array, orders: list[float], band: float) -> tuple[Array, Array]:
    """Return the speeds at which an excitation is within the band of a frequency.

    Of natural frequencies omega[trial, mode], rad/s; `orders`, excitations per turn of
    the motor; and `band`, a share of the natural frequency. Returns lower and upper
    ends of the motor's speed, rad/s, float64[trial, order and mode]: forbidden, too.
    """
    critical = np.concatenate([omega / order for order in orders], axis=1)
    return critical * (1.0 - band), critical * (1.0 + band)


def free_gaps(lower: Array, upper: Array, within: Range) -> tuple[Array, Array]:
    """Return the gaps between forbidden ranges, begin and end, float64[trial, gap].

    Ascending, rad/s; a gap whose end is below its begin is none.
    """
    rank = np.argsort(lower, axis=1)
    starts = np.take_along_axis(lower, rank, axis=1)
    reached = np.maximum.accumulate(np.take_along_axis(upper, rank, axis=1), axis=1)
    begin = np.insert(np.maximum(reached, within.lower), 0, within.lower, axis=1)
    n = starts.shape[1]
    return begin, np.insert(np.minimum(starts, within.upper), n, within.upper, axis=1)


def free_speeds(omega: Array, settings: Settings) -> tuple[Array, Array]:
    """Return the widths of speeds without resonance, of omega[trial, mode], rad/s.

    Of all free ranges, and of the widest, float64[trial], rad/s; 0 where there are
    none.
    """
    orders = list(named_orders(settings).values())
    resonant = forbidden(omega, orders, settings.band)
    begin, end = free_gaps(*resonant, settings.speed_range)
    widths = np.maximum(end - begin, 0.0)
    # one by one: the sum is the same in any block
    return np.cumsum(widths, axis=1)[:, -1], np.max(widths, axis=1)


def speed_margin(omega: Array, settings: Settings) -> Array:
    """Return how far the working speed is from the nearest of omega[trial, mode].

    min over orders and modes of |order n/60 - f_r| / f_r; 1: of the frequency.
    """
    nearest = np.full(len(omega), np.inf)
    for order in named_orders(settings).values():
        distance = np.abs(order * settings.working_speed - omega) / omega
        nearest = np.minimum(nearest, np.min(distance, axis=1))
    return nearest


def campbell(deviations: Array, settings: Settings) -> Chart:
    """Return frequencies, excitations and the fraction of trials that resonate."""
    omega = drives(deviations, settings).modes.omega
    n = np.linspace(*settings.speed_range, POINTS)
    orders = named_orders(settings)

    def curve(name: str, symbol: str, words: str, values: Array) -> Curve:
        return Curve(name, "Hz", symbol, words, values, shown="Hz")

    modes: list[Curve] = []
    spreads: list[Band] = []
    for r, f in enumerate(omega.T / (2 * np.pi), start=1):
        even = np.repeat(f[:, None], POINTS, axis=1)
        modes.append(curve(f"mode {r}", f"f{r}", f"natural frequency {r}", even[0]))
        spreads += bands_of(f"mode {r}", "Hz", even[1:])
    turns = {name: order * n / (2 * np.pi) for name, order in orders.items()}
    excitations = [curve(name, "", "excitation", f) for name, f in turns.items()]
    lower, upper = forbidden(omega, list(orders.values()), settings.band)
    begin, end = free_gaps(lower[:1], upper[:1], settings.speed_range)
    free = [(b, e) for b, e in zip(begin[0], end[0], strict=True) if e > b]
    counted = others_or_first(omega)
    hits = np.zeros(POINTS)
    for low, high in zip(lower[counted], upper[counted], strict=True):
        hits += np.any((n >= low[:, None]) & (n <= high[:, None]), axis=0)
    machines = len(lower[counted])
    words = "fraction of trials that resonate"
    share = Curve("resonating", "1", "P", words, hits / machines, shown="%")
    title, interval = "Whether the drive resonates", []
    if len(omega) > 1:
        title = f"Fraction of {machines} trials that resonate"
        interval = [Band("95 % interval", "1", *ends_of(hits, machines), of=share.name)]
    work = Span(settings.working_speed, settings.working_speed, "working speed")
    alike: dict[float, str] = {}  # stands by their speed
    for stand, speed in zip(STANDS, rolling_speeds(settings).tolist(), strict=True):
        alike[speed] = f"{alike[speed]}, {stand}" if speed in alike else f"{stand}"
    rolling = [
        Curve(f"rod at {stands}", "m/s", "v", "rolling speed", speed * n)
        for speed, stands in alike.items()
    ]
    limit, top = settings.rolling_speed_limit, fastest(settings)
    words = f"{limit:g} m/s in 34: {top / RPM:.0f} rpm"
    cut = [Span(top, top, words)] if n[0] <= top < n[-1] else []
    return Chart(
        Axis("motor speed", "rad/s", "rpm"),
        n,
        (*modes, *excitations, *rolling, share),
        bands=(*spreads, *interval),
        spans=(*(Span(b, e, "without resonance") for b, e in free), *cut, work),
        panels=(
            *_frequency_panels(modes, excitations, spreads),
            Panel.of(title, share, *interval),
            Panel.of("Rolling speed", *rolling),
        ),
    )


def others_or_first(omega: Array) -> slice:
    """Return the drives of which a fraction is taken: the first if it is alone."""
    return slice(min(1, len(omega) - 1), None)


def ends_of(counts: Array, machines: int) -> tuple[Array, Array]:
    """Return lower and upper ends of the intervals of fractions, from counts."""
    ends = [proportion(int(count), machines) for count in counts]
    return np.array([e.lower for e in ends]), np.array([e.upper for e in ends])


def _frequency_panels(
    modes: list[Curve], excitations: list[Curve], spreads: list[Band]
) -> list[Panel]:
    """Return each excitation with the modes that it meets, or nearly so."""
    panels = []
    for curve in excitations:
        least, most = NEAR * curve.values.min(), curve.values.max() / NEAR
        met = {m.name: m for m in modes if least <= m.values[0] <= most}
        opened = [band for band in spreads if band.of in met]
        if met:
            words = f"Modes near {curve.name}"
            panels.append(Panel.of(words, curve, *met.values(), *opened))
    separate = Panel.of("Excitations and modes without resonance", *excitations, *modes)
    return panels or [separate]


def resonances(deviations: Array, settings: Settings) -> Listing:
    """Return where excitations meet natural frequencies, within the motor's speeds.

    The last column is the share of the others, or whether the drive alone does.
    """
    omega = drives(deviations, settings).modes.omega
    orders = named_orders(settings)
    lower, upper = forbidden(omega, list(orders.values()), settings.band)
    n_modes, within = omega.shape[1], settings.speed_range
    meets = (upper[0] >= within.lower) & (lower[0] <= within.upper)
    # order by order, mode by mode
    pairs = np.flatnonzero(meets)[np.argsort(lower[0, meets])]
    order, mode = np.divmod(pairs, n_modes)
    turns = np.array(list(orders.values()))[order]
    work, counted = settings.working_speed, others_or_first(omega)
    hit = (lower[counted][:, pairs] <= work) & (work <= upper[counted][:, pairs])
    interval = ends_of(hit.sum(axis=0), len(hit))
    names = ("from, 95 %", "to, 95 %") if len(omega) > 1 else ()
    return Listing.of(
        "excitation and mode, and the speeds to keep away from",
        ("excitation", "1", "", np.array(list(orders))[order]),
        ("mode", "1", "count", mode + 1),
        ("frequency", "Hz", "Hz", omega[0, mode] / (2 * np.pi)),
        ("critical speed", "rad/s", "rpm", omega[0, mode] / turns),
        ("from", "rad/s", "rpm", lower[0, pairs]),
        ("to", "rad/s", "rpm", upper[0, pairs]),
        ("meets at the working speed", "1", "%", hit.mean(axis=0)),
        *((name, "1", "%", ends) for name, ends in zip(names, interval, strict=False)),
    )

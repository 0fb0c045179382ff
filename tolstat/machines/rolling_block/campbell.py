"""Frequencies and excitations over the speed of the motor, the paper's Fig. 5."""

from __future__ import annotations

import numpy as np

from tolstat.machines.rolling_block.resonance import forbidden, free_gaps, named_orders
from tolstat.machines.rolling_block.seen import Seen
from tolstat.model.view import Axis, Band, Chart, Curve, Listing, Panel, Span, bands_of
from tolstat.statistics.intervals.proportions import proportion

POINTS = 851  # of a range of speeds: one each rpm of the paper's
SURE = "95 % interval"
NEAR = 0.85  # modes that an excitation misses by less are drawn with it


def campbell(seen: Seen) -> Chart:
    """Chart frequencies, excitations and the share of machines that resonate."""
    settings, omega = seen.settings, seen.modes.omega
    n = np.linspace(*settings.speed_range, POINTS)
    orders = named_orders(settings)
    hz = omega / (2 * np.pi)
    modes = [
        Curve(
            f"mode {r + 1}", "Hz", f"f{r + 1}", f"natural frequency {r + 1}",
            np.full(POINTS, hz[0, r]), shown="Hz",
        )
        for r in range(hz.shape[1])
    ]  # fmt: skip
    excitations = [
        Curve(name, "Hz", "", "excitation", order * n / (2 * np.pi), shown="Hz")
        for name, order in orders.items()
    ]
    spreads = [
        band
        for r, mode in enumerate(modes)
        for band in bands_of(
            mode.name, "Hz", np.repeat(hz[seen.others, r, None], POINTS, axis=1)
        )
    ]
    lower, upper = forbidden(omega, list(orders.values()), settings.band)
    begin, end = free_gaps(lower[:1], upper[:1], settings.speed_range)
    free = [(b, e) for b, e in zip(begin[0], end[0], strict=True) if e > b]
    drawn = seen.others if len(seen.others) else [0]
    resonates = np.zeros(POINTS)
    for machine in drawn:
        hit = (n >= lower[machine, :, None]) & (n <= upper[machine, :, None])
        resonates += np.any(hit, axis=0)
    resonates /= len(drawn)
    words = "share of machines that resonate"
    share = Curve("resonating", "1", "P", words, resonates, shown="%")
    if len(seen.others):
        spreads.append(sure_of(share, len(seen.others)))
    return Chart(
        Axis("motor speed", "rad/s", "rpm"),
        n,
        (*modes, *excitations, share),
        bands=tuple(spreads),
        spans=tuple(Span(b, e, "without resonance") for b, e in free),
        panels=(
            *_frequency_panels(modes, excitations, [band.name for band in spreads]),
            Panel(
                f"Share of {len(drawn)} machines that resonate"
                if len(seen.others)
                else "Whether the drive resonates",
                ("resonating", SURE) if len(seen.others) else ("resonating",),
            ),
        ),
    )


def sure_of(share: Curve, machines: int) -> Band:
    """Return the interval of a share of so many machines, at each point by itself."""
    ends = {
        count: proportion(count, machines)
        for count in set(np.rint(machines * share.values).astype(int).tolist())
    }
    found = [ends[count] for count in np.rint(machines * share.values).astype(int)]
    lower = np.array([each.lower for each in found])
    upper = np.array([each.upper for each in found])
    return Band(SURE, share.unit, lower, upper, of=share.name)


def _frequency_panels(
    modes: list[Curve], excitations: list[Curve], spreads: list[str]
) -> list[Panel]:
    """Draw each excitation with the modes that it meets, or nearly so."""
    panels = []
    for each in excitations:
        near = NEAR * each.values.min(), each.values.max() / NEAR
        met = [m.name for m in modes if near[0] <= m.values[0] <= near[1]]
        opened = [name for name in spreads if name.partition(",")[0] in met]
        if met:
            names = (each.name, *met, *opened)
            panels.append(Panel(f"What {each.name} meets", names))
    apart = tuple(curve.name for curve in (*excitations, *modes))
    return panels or [Panel("Excitations and modes do not meet", apart)]


def resonances(seen: Seen) -> Listing:
    """List where excitations meet natural frequencies, within the speeds of the motor.

    The last column is the share of the others, or whether the drive alone does.
    """
    settings, omega = seen.settings, seen.modes.omega
    orders = named_orders(settings)
    lower, upper = forbidden(omega, list(orders.values()), settings.band)
    n_modes = omega.shape[1]
    machines = seen.others if len(seen.others) else np.array([0])
    work = settings.working_speed
    place = np.arange(len(orders) * n_modes)  # order by order, mode by mode
    meets = (upper[0] >= settings.speed_range.lower) & (
        lower[0] <= settings.speed_range.upper
    )
    place = place[meets][np.argsort(lower[0, meets])]
    mode = place % n_modes
    turns = np.array(list(orders.values()))[place // n_modes]
    hit = (lower[machines][:, place] <= work) & (work <= upper[machines][:, place])
    many = len(seen.others) > 0
    each = [proportion(int(count), len(machines)) for count in hit.sum(axis=0)]
    sure = [np.array([getattr(e, end) for e in each]) for end in ("lower", "upper")]
    return Listing(
        (
            Axis("excitation", "1"),
            Axis("mode", "1", "count"),
            Axis("frequency", "Hz", "Hz"),
            Axis("critical speed", "rad/s", "rpm"),
            Axis("from", "rad/s", "rpm"),
            Axis("to", "rad/s", "rpm"),
            Axis("meets at the working speed", "1", "%"),
            *(Axis(f"{end} 95 %", "1", "%") for end in ("from,", "to,") if many),
        ),
        (
            np.array(list(orders))[place // n_modes],
            mode + 1,
            omega[0, mode] / (2 * np.pi),
            omega[0, mode] / turns,
            lower[0, place],
            upper[0, place],
            hit.mean(axis=0),
            *(sure if many else ()),
        ),
        "what meets within the speeds of the motor, and the speeds to keep away from",
    )

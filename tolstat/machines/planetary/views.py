"""Views of a planetary gear: gears of its kind, and where these exist."""

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.design import design_of
from tolstat.machines.planetary.scheme import existence
from tolstat.machines.planetary.synthesis import UNITS, search
from tolstat.model.view import Axis, Chart, Curve, Listing, Mark, Offer, Picture, Region

SENTENCE = "a gear; where tip_gap is below 0 tips touch at that addendum"
SHOWN = {"helix_2": "deg", "helix_3": "deg", "ratio_error": "%"}


def designs_listing(_: Array, settings: Settings) -> Listing:
    """Return the gears that the settings request.

    Raises ModelError if there are none; the message counts the sets of teeth after each
    condition.
    """
    i = settings.wanted_ratio or design_of(settings).ratio
    columns, counts = search(settings, i)
    if not len(columns["z1"]):
        counted = "; ".join(f"{n} {words}" for words, n in counts.items())
        raise ModelError(
            f"no gear found. Of the sets of teeth {counted}. Widen z1 ... z4, helix or "
            "ratio_tolerance, or change wanted_ratio, satellites or module_ratio"
        )
    rows = ((n, UNITS.get(n, "1"), SHOWN.get(n, ""), x) for n, x in columns.items())
    return Listing.of(SENTENCE, *rows)


def existence_chart(_: Array, settings: Settings) -> Chart:
    """Return the possible ratios of gears over D, and the gear of the settings.

    No addenda: satellites may come so near that their pitch circles touch.
    """
    design = design_of(settings)
    widest = max(2.0, 1.25 * design.D)
    D = np.unique([*np.linspace(0.01, widest, 400), 1.0])
    lower, upper = existence(settings.scheme, D, settings.satellites)
    # two satellites never touch: infinite ends are cut off
    reach = max(8 * (1 + widest), 1.25 * abs(design.ratio))
    outline = np.clip([*lower, *upper[::-1]], -reach, reach)
    lines = [np.where(np.abs(v) <= reach, v, np.nan) for v in (lower, upper)]
    where, i = np.array([design.D]), np.array([design.ratio])
    exists = f"{settings.satellites} satellites"
    if np.any(outline != [*lower, *upper[::-1]]):
        exists += f", drawn to {reach:g}"
    curves = (
        Curve("least ratio", "1", "i", "excluded", lines[0], shown="1"),
        Curve("greatest ratio", "1", "i", "excluded", lines[1], shown="1"),
        Curve("these teeth", "1", "i", "the gear", i, where, "1", points=True),
    )
    region = Region(exists, "1", np.array([*D, *D[::-1]]), outline)
    picture = Picture(f"Ratio i, {settings.scheme}", region, *curves)
    marks = (Mark("these teeth", design.D, design.ratio, "i ="),)
    return Chart.of(Axis("dw2 / dw3", "1", "1"), D, picture, marks=marks)


OFFERS = (
    Offer("designs", "balanced gears of the wanted ratio", designs_listing),
    Offer("existence", "possible ratios over dw2 / dw3", existence_chart),
)

"""A model with every possible member; its numbers have no meaning."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tolstat import (
    Contributor,
    Description,
    Measure,
    Model,
    Outcome,
    Range,
    Response,
    StudyNumber,
    column,
    setting,
)
from tolstat.errors import ModelError
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Level,
    Listing,
    Mark,
    Offer,
    Panel,
    Region,
    Span,
)

LINKS = {"A1": {"nominal": 0.120, "teeth": 20}, "A2": {"nominal": 0.040, "teeth": 17}}
STEPS = ({"time": 0.0, "moment": 5.0}, {"time": 0.1, "moment": -5.0})


@dataclass(frozen=True)
class RichSettings:
    masses: tuple = setting((2.0, 1.0), "masses", unit="kg", above=0.0, count=(1, 4))
    teeth: tuple = setting((17, 31), "numbers of teeth", at_least=5)
    formula: str = setting("A1 - A2", "the closing link")
    hoop: bool = setting(True, "whether the tension is counted")
    size: Measure = setting(Measure(0.06, "m"), "a size, of any kind of unit")
    order: int = setting(3, "how many terms", at_least=1, at_most=9)
    law: str = setting("smooth", "how it starts", choices=("smooth", "sudden"))
    speeds: Range = setting(Range(10.0, 100.0), "speeds", unit="rad/s")
    links: dict = setting(
        LINKS,
        "the links of the chain",
        columns={
            "nominal": column("its length", unit="m", above=0.0),
            "teeth": column("of its wheel", like=1, at_least=5),
        },
    )
    load: tuple = setting(
        STEPS,
        "steps of the load",
        columns={
            "time": column("when", unit="s", at_least=0.0),
            "moment": column("how much", unit="N m"),
        },
    )
    extra: dict = field(
        default_factory=dict, metadata=setting({}, "more links", columns={
            "nominal": column("its length", unit="m"),
        }).metadata,
    )  # fmt: skip

    def __post_init__(self):
        if "A1" not in self.links:
            raise ModelError("the chain has no link A1")


def designs(deviations, settings):
    z2 = np.arange(17, 22)
    return Listing(
        (
            Axis("z1", "1"),
            Axis("ratio", "1", "1"),
            Axis("size", "m"),
            Axis("hand", "1"),
        ),
        (np.full(5, 17), z2 / 17, 2e-3 * z2, np.array(["left"] * 5)),
        "a pair of wheels",
    )


def spectrum(deviations, settings):
    f = np.geomspace(1.0, 100.0, 200)
    nominal, *others = (1e-3 / (1 + (f / (10 + 1e4 * d[0])) ** 2) for d in deviations)
    bands = ()
    if others:
        lower, upper = np.min(others, axis=0), np.max(others, axis=0)
        bands = (Band("tolerances", "m", lower, upper),)
    limits = Level(6e-4, "permitted"), Level(-6e-4, "")
    shown = ("amplitude", *(band.name for band in bands), "safe")
    return Chart(
        Axis("frequency", "Hz", logarithmic=True),
        f,
        (
            Curve("amplitude", "m", "a", "amplitude", nominal),
            Curve("phase", "rad", "p", "phase", -np.arctan(f / 10), shown="deg"),
            Curve("measured", "m", "a", "points", np.array([8e-4, 2e-4]), np.array([5.0, 20.0])),
        ),
        bands,
        (Mark("amplitude", 1.0, float(nominal[0]), "peak"),),
        (Region("safe", "m", np.array([1.0, 5.0, 5.0, 1.0]), np.array([0.0, 0.0, 1e-4, 1e-4])),),
        (Span(8.0, 12.0, "working speed"),),
        (
            Panel("Amplitude", (*shown, "measured"), levels=limits),
            Panel("Phase", ("phase",)),
        ),
    )  # fmt: skip


class Rich(Model):
    name = "rich"
    title = "everything [bold] at once"
    settings = RichSettings
    failures = {
        "cannot be mounted": "the first link is not too short",
        "cuts air": "the links are not too long together",
    }
    views = (
        Offer("spectrum", "amplitude over frequency", spectrum, n_others=20),
        Offer("designs", "wheels that fit", designs),
    )

    def describe(self, settings):
        links = {**settings.links, **settings.extra}
        frequencies = range(1, len(settings.masses) + 1)
        return Description(
            tuple(Contributor(name, "m", name, f"link {name}") for name in links),
            (
                Response("stress", "Pa", "s", "stress in the rim", shown="MPa"),
                Response("modes", "1", "n", "modes below the speed", shown="count"),
                Response("contact_ratio", "1", "e", "contact ratio", shown="1"),
                Response("share", "1", "q", "share of the load"),
                *(Response(f"frequency_{i}", "Hz", f"f{i}") for i in frequencies),
            ),
        )

    def evaluate(self, deviations, settings):
        total = deviations.sum(axis=1)
        first = deviations[:, 0]
        frequencies = [
            (np.sqrt(4000.0 / m) + 1e3 * first) / (2 * np.pi) for m in settings.masses
        ]
        responses = np.stack(
            [
                2e8 + 1e11 * total,
                np.floor(3 + 2e4 * np.abs(first)),
                1.4 + 100 * total,
                0.25 + total,
                *frequencies,
            ],
            axis=1,
        )
        return Outcome(
            responses,
            failed={"cuts air": total > 2.4e-4, "cannot be mounted": first < -1.4e-4},
        )

    def numbers(self, settings, spreads, *, independent=True):
        sigma = float(np.sqrt(sum(each.sigma**2 for each in spreads.values())))
        return (
            StudyNumber("rss_stress", "Pa", 1e11 * sigma, "sigma", of="stress"),
            StudyNumber("reach", "m", sum(s.upper for s in spreads.values())),
            StudyNumber("wheels", "1", len(settings.teeth), "how many", "count"),
        )


WRITTEN = {
    "masses": ["2 kg", "500 g", "1.5 kg"],
    "teeth": [17, 31, 90],
    "formula": "A1 - A2 - B",
    "hoop": False,
    "size": "45 deg",
    "order": 4,
    "law": "sudden",
    "speeds": "60..600 rpm",
    "links": {
        "A1": {"nominal": "12 cm", "teeth": 20},
        "B": {"nominal": "30 mm", "teeth": 9},
    },
    "load": [{"time": "20 ms", "moment": "1.5 kN m"}],
    "extra": {"C": "5 mm"},
}

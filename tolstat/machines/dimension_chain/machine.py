"""A dimension chain as a model: deviations of its links in, the closing link out."""

import math

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.dimension_chain.algebras import Roundings
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.declarations import Settings
from tolstat.machines.dimension_chain.formula_warnings import jumps, slips
from tolstat.model.contract import Model, Outcome, Spreads
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.units.scale import scale_of

GAP = "gap"
SHOWN = {"1": "1", "N/m": "N/mm"}  # by SI unit of the gap, unless its limit has another
NO_VALUE = "the formula has no value"
FAILURES = {NO_VALUE: "the formula has a value: no root of a negative number, no 1/0"}


class DimensionChain(Model):
    """Links that deviate, and their closing link."""

    name = "dimension_chain"
    title = "a dimension chain: links in the study file, the gap as a formula of them"
    settings = Settings
    failures = FAILURES
    assumptions = (
        "Parts are rigid; the formula gives their geometry.",
        "Root sum square: slopes at the middle of the tolerances, links independent of "
        "each other.",
    )

    def describe(self, settings: Settings) -> Description:
        links = []
        for name, columns in settings.links.items():
            size, unit, written = columns["nominal"]
            scale = scale_of(unit, written)
            sentence = f"link of {scale.factor * size:.10g} {scale.mark}".strip()
            link = Contributor(name, unit, "", sentence, size=size, shown=scale.shown)
            links.append(link)
        unit, text = settings.unit, settings.formula.text
        gap = Response(GAP, unit, sentence=text, shown=SHOWN.get(unit, ""))
        return Description(tuple(links), (gap,))

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        return {NO_VALUE: ~np.isfinite(_gap(deviations, settings))}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        return Outcome(_gap(deviations, settings)[:, None])

    def numbers(
        self, settings: Settings, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        results = answers(settings.formula, settings.nominal, spreads)
        unit, formula = settings.unit, settings.formula
        idle = [name for name in spreads if name not in formula.used]
        turns = ", ".join(results.turning)
        of_worst = [f"{', '.join(idle)} not in the formula"] if idle else []
        of_rss = list(of_worst)
        if not independent:
            of_worst.append("correlations are ignored")
        if turns:
            of_worst.append(f"found by a search: the gap rises and falls with {turns}")
            of_rss.append(f"inaccurate: the gap rises and falls with {turns}")
        if math.isnan(results.worst_min):
            jumps = "jumps, or has no value, somewhere within the tolerances"
            of_worst = [f"the formula {jumps}"]
        worst = "closing link within the tolerances, all links at once"
        numbers = [
            ("worst_min", results.worst_min, f"least {worst}", of_worst, "least"),
            ("worst_max", results.worst_max, f"largest {worst}", of_worst, "largest"),
            ("rss_mean", results.rss_mean, "mean of the linear chain", of_rss, ""),
        ]
        shares: dict[str, float] = {}
        if independent:  # else covariances decide: no sigma, no shares
            sigma = "its sigma, by root sum square"
            numbers.append(("rss_sigma", results.rss_sigma, sigma, of_rss, ""))
            shares = results.shares
        caveat, words = "; ".join(of_rss), "of {} in that variance"
        return (
            *(
                StudyNumber(name, unit, value, words, "", GAP, "; ".join(but), side)
                for name, value, words, but, side in numbers
            ),
            *(
                StudyNumber(f"share_{n}", "1", x, words.format(n), caveat=caveat)
                for n, x in shares.items()
            ),
        )

    def warnings(self, settings: Settings, spreads: Spreads) -> tuple[str, ...]:
        units = {name: link["nominal"].unit for name, link in settings.links.items()}
        formula, nominal = settings.formula, settings.nominal
        return (
            *_unused(settings),
            *slips(formula, nominal, units),
            *jumps(formula, nominal, spreads, units),
        )


def _unused(settings: Settings) -> tuple[str, ...]:
    """Return a sentence about the links that the formula does not name."""
    used = settings.formula.used
    unused = [name for name in settings.links if name not in used]
    if not unused:
        return ()
    links, change = (
        ("link", "it changes") if len(unused) == 1 else ("links", "they change")
    )
    names = ", ".join(unused)
    return (
        f"The formula of the gap does not name the {links} {names}: {change} nothing. "
        f"It names {', '.join(used)}.",
    )


def _gap(deviations: Array, settings: Settings) -> Array:
    """Return the gap, float64[trial]; not finite if the formula has no value."""
    links = {
        name: nominal + deviations[:, i]
        for i, (name, nominal) in enumerate(settings.nominal.items())
    }
    gap = settings.formula.worked_out(Roundings(links)).value
    return np.broadcast_to(gap, len(deviations))

"""A dimension chain as a model: deviations of its links in, closing links out."""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.literal import some_of
from tolstat.machines.dimension_chain.algebras import Roundings
from tolstat.machines.dimension_chain.chain import Answers, answers, correlation_of
from tolstat.machines.dimension_chain.declarations import GAP, Settings
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.machines.dimension_chain.formula_warnings import jumps, slips
from tolstat.model.contract import Model, Outcome, Spreads
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.units.scale import scale_of

if TYPE_CHECKING:
    from tolstat.model.mechanism import Mechanism

SHOWN = {"1": "1", "N/m": "N/mm"}  # by SI unit of the gap, unless its limit has another
NO_VALUE = "the formula has no value"
MOST_PAIRS = 45  # of gaps: ten have so many
MOST_NAMED = 8  # links in a sentence
OPEN = "a loop does not close"
FAILURES = {
    OPEN: "vector loops close, in the way of the nominal machine",
    NO_VALUE: "the formula has a value: no root of a negative number, no 1/0",
}


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
        gaps = []
        for name, formula in settings.formulas.items():
            unit = settings.unit_of(formula)
            shown = SHOWN.get(unit, "")
            if settings.closed and name in settings.closed.scales:
                shown = settings.closed.scales[name].shown
            gaps.append(Response(name, unit, sentence=formula.text, shown=shown))
        return Description(tuple(links), tuple(gaps))

    def mechanism(self, deviations: Array, settings: Settings) -> "Mechanism":
        if settings.closed is None:
            raise self.fault("only vector loops can be animated; it has no [loops]")
        # seldom needed
        from tolstat.machines.dimension_chain.mechanism import mechanism_of

        algebra = _algebra(deviations[None, :], settings)
        links = {name: value[0] for name, value in algebra.links.items()}
        return mechanism_of(settings.closed, links)

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        algebra, loops = _algebra(deviations, settings), settings.closed
        gaps = _gaps(algebra, len(deviations), settings)
        no_value = {NO_VALUE: ~np.all(np.isfinite(gaps), axis=1)}
        if not loops:
            return no_value
        return {OPEN: ~loops.close(algebra), **no_value}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        algebra = _algebra(deviations, settings)
        return Outcome(_gaps(algebra, len(deviations), settings))

    def numbers(
        self, settings: Settings, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        numbers, by_gap = list[StudyNumber](), dict[str, Answers]()
        for name, formula in settings.formulas.items():
            by_gap[name] = answers(formula, settings.nominal, spreads)
            of_gap = _numbers(
                formula, by_gap[name], settings, spreads, independent=independent
            )
            suffix = f"_{name}" if settings.formulas.keys() != {GAP} else ""
            numbers += [x._replace(name=f"{x.name}{suffix}") for x in of_gap]
        pairs = [*combinations(by_gap, 2)] if independent else []
        for first, second in pairs[:MOST_PAIRS]:
            value = correlation_of(by_gap[first], by_gap[second])
            sentence = f"correlation of {first} with {second}, of linear chains"
            name = f"correlation_{first}_{second}"
            numbers.append(StudyNumber(name, "1", value, sentence, "1"))
        return tuple(numbers)

    def warnings(self, settings: Settings, spreads: Spreads) -> tuple[str, ...]:
        units, nominal = settings.units, settings.nominal
        sentences = [*_unused(settings)]
        for formula in settings.formulas.values():
            sentences += slips(formula, nominal, units)
            sentences += jumps(formula, nominal, spreads, units)
        return tuple(dict.fromkeys(sentences))


def _numbers(
    formula: Formula,
    results: Answers,
    settings: Settings,
    spreads: Spreads,
    *,
    independent: bool,
) -> Iterator[StudyNumber]:
    """Yield the numbers of one gap."""
    unit = settings.unit_of(formula)
    idle = [name for name in spreads if name not in formula.used]
    turns = some_of(results.turning, MOST_NAMED)
    # of several gaps each has links of its own
    missing = idle if not settings.gaps else []
    of_worst = [f"{', '.join(missing)} not in the formula"] if missing else []
    of_rss = list(of_worst)
    if not independent:
        of_worst.append("correlations are ignored")
    if turns:
        of_worst.append(f"found by a search: the gap rises and falls with {turns}")
        of_rss.append(f"inaccurate: the gap rises and falls with {turns}")
    if results.no_linear_part:
        of_rss = ["no linear part in the middle of the tolerances: all slopes are zero"]
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
    for name, value, words, but, side in numbers:
        yield StudyNumber(
            name, unit, value, words, "", formula.gap, "; ".join(but), side
        )
    for name, share in shares.items():
        words, caveat = f"of {name} in that variance", "; ".join(of_rss)
        yield StudyNumber(f"share_{name}", "1", share, words, caveat=caveat)


def _unused(settings: Settings) -> tuple[str, ...]:
    """Return a sentence about the links that no formula names."""
    formulas = settings.formulas.values()
    used = [n for n in settings.links if any(n in f.used for f in formulas)]
    unused = [name for name in settings.links if name not in used]
    if not unused:
        return ()
    links, change = (
        ("link", "it changes") if len(unused) == 1 else ("links", "they change")
    )
    names = ", ".join(unused)
    does_not, it = "The formula of the gap does not name", "It names"
    if settings.gaps:
        does_not, it = "No formula of a gap names", "They name"
    return (
        f"{does_not} the {links} {names}: {change} nothing. {it} {', '.join(used)}.",
    )


def _algebra(deviations: Array, settings: Settings) -> Roundings:
    """Return the algebra of trials: links, SI, and solved unknowns of loops."""
    algebra = Roundings(
        {
            name: nominal + deviations[:, i]
            for i, (name, nominal) in enumerate(settings.nominal.items())
        }
    )
    return settings.closed.solved(algebra) if settings.closed else algebra


def _gaps(algebra: Roundings, trials: int, settings: Settings) -> Array:
    """Return the gaps, float64[trial, gap]; not finite where a formula has no value."""
    gaps = np.empty((trials, len(settings.formulas)))
    for column, formula in zip(gaps.T, settings.formulas.values(), strict=True):
        column[:] = formula.worked_out(algebra).value
    return gaps

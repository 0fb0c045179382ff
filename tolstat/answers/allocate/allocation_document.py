"""Document of an allocation: the answer first, tolerances, fractions, trade-off."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tolstat.answers.allocate.allocation import Allocation, OffLimit, Role
from tolstat.answers.allocate.fresh_runs import Scheme
from tolstat.answers.allocate.search import Point
from tolstat.answers.cells import ppm
from tolstat.answers.measured_words import measured_alone
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text
from tolstat.document.view_content import plot_of
from tolstat.model.view import Axis, Chart, Curve, Mark, Picture
from tolstat.statistics.limits.yields import MET, NOT_MET

CHART = "Cost of the cheapest tolerances over the fraction out of any limit"
OUT = Axis("fraction out of any limit", "1", "ppm", logarithmic=True)
BELOW = 0.1  # of the least fraction: lower ends of intervals are shown so far
LOOSEST = text("at its loosest")
WIDEN = (
    "widen a limit, or permit tighter tolerances: no tolerances were shown to meet all "
    "limits. "
)
MORE = "More trials may settle it (--trials). Else "
WORDS = {
    Role.DRAWING: "drawing",
    Role.FOUND: "found",
    Role.PROOF: "found, its proof",
    Role.TIGHTEST: "tightest",
    Role.EQUAL_COST: "best at the drawing's cost",
    Role.ROOT_SUM_SQUARE: "root sum square",
    Role.WORST_CASE: "worst case",
}


def allocation_document(allocation: Allocation) -> blocks.Document:
    """Return the verdict with its proof, tolerances, fractions, notes, trade-off."""
    parts = (
        blocks.Paragraph(_lead(allocation), "lead"),
        _tolerances(allocation),
        _fractions(allocation),
        blocks.Bullets(tuple(_notes(allocation))),
        blocks.Figure(CHART, plot_of(chart_of(allocation)), text(CHART), wide=True),
    )
    return blocks.Document(f"Cheapest tolerances: {allocation.title}", parts)


def _lead(allocation: Allocation) -> Parts:
    proof = allocation.proof
    cost, drawing = Number(proof.cost), Number(allocation.schemes[Role.DRAWING].cost)
    if allocation.met:
        return say(
            "{} at cost {} (drawing: {}). Proof: a fresh run of {} with seed {}; "
            "each yield, with its whole interval, is as demanded or better.",
            Word("All limits are met", MET), cost, drawing,
            counted(proof.trials, "trial"), str(proof.seed),
        )  # fmt: skip
    missed = [
        say("{}: {}, {} out of limit", Name(name), Word(verdict, verdict),
            ppm(proof.fraction_out_of_limit[name]))
        for name, verdict in allocation.verdicts.items()
        if verdict != MET
    ]  # fmt: skip
    off_limit = allocation.off_limit
    return say(
        "{}{}At the tightest, which cost {} (drawing: {}): {}.",
        [_off_limit(name, mean) for name, mean in off_limit.items()],
        _advice(allocation) if len(off_limit) < len(missed) else None,
        cost, drawing, listed(missed, ""),
    )  # fmt: skip


def _advice(allocation: Allocation) -> str:
    if NOT_MET in allocation.verdicts.values():
        return WIDEN.capitalize()
    return f"{MORE}{WIDEN}"


def _off_limit(response: str, mean: OffLimit) -> Parts:
    """Return how far a mean is off its limit, and what to type to permit a shift."""
    permit: Parts = ()
    if shift := mean.shift:
        scale = shift.scale
        digit = 10.0 ** math.floor(math.log10(size := abs(scale.factor * shift.by)))
        permit = say(
            ' Permit a shift of {} by about {}: `shift = "+-{} {}"` in its cost.',
            Name(shift.entry), Number(float(f"{shift.by:.2g}"), scale),
            f"{math.ceil(size / digit) * digit:.6g}", scale.mark,
        )  # fmt: skip
    return say(
        "{}: the mean lies {} {} the limit; no permitted tolerance meets it.{} ",
        Name(response), Number(mean.distance, mean.scale),
        "outside" if mean.outside else "inside, but too near an end of", permit,
    )  # fmt: skip


def _tolerances(allocation: Allocation) -> blocks.Table:
    result = (Role.FOUND if allocation.met else Role.TIGHTEST).value
    rows: list[dict[str, blocks.Given]] = [
        {
            "entry": Name(entry.name),
            "parts": Number(entry.parts),
            "drawing": entry.specified,
            "cost (drawing)": Number(entry.cost_specified),
            result: blocks.Cell(text(entry.found), LOOSEST if entry.at_loosest else ()),
            "cost": Number(entry.cost),
        }
        for entry in allocation.entries
    ]
    drawing = Number(sum(entry.cost_specified for entry in allocation.entries))
    cost = Number(allocation.cost)
    rows.append({"entry": "all", "cost (drawing)": drawing, "cost": cost})
    return blocks.table_of(rows, "Tolerances")


def _fractions(allocation: Allocation) -> blocks.Table:
    rows: list[dict[str, blocks.Given]] = [
        {
            "tolerances": WORDS[name],
            "cost": Number(scheme.cost),
            "any limit": ppm(scheme.fraction_out_of_any_limit),
            **{n: ppm(share) for n, share in scheme.fraction_out_of_limit.items()},
            "fresh run": blocks.Cell(
                counted(scheme.trials, "trial"), (f"seed {scheme.seed}",)
            ),
        }
        for name, scheme in allocation.with_proof.items()
    ]
    title = "Fraction out of limit in fresh runs, ppm, with 95 % intervals"
    return blocks.table_of(rows, title)


def _notes(allocation: Allocation) -> Iterator[Parts]:
    if allocation.met:
        yield text(
            "Verdicts rest on the proof, which was chosen from several runs. "
            'Compare "found" with the other rows: their seed chose nothing.'
        )
        yield equal_cost_words(allocation.schemes)
    if allocation.met and allocation.active_limits:
        yield say(
            "Active limits: {}. They are not shown to be met with some tolerance a "
            "tenth looser, or by the next option of a list.",
            listed([Name(name) for name in allocation.active_limits]),
        )
    if not allocation.exhaustive:
        yield text(
            "Not all combinations were tried, for there are too many. Options were "
            "exchanged one or two at a time: cheaper tolerances may exist."
        )
    for name, reason in allocation.omitted_schemes.items():
        yield text(f"By {WORDS[name]}: {reason}.")
    fresh_trials = allocation.fresh_trials
    yield say(
        "Evaluated: {} and {} in {}.",
        counted(allocation.wide_trials, "weighted trial"),
        counted(sum(fresh_trials), "trial"),
        counted(len(fresh_trials), "fresh run"),
    )
    if allocation.measured:
        yield measured_alone(allocation.measured)
        yield text(
            "Write the study found (-o) and run it: its verdicts hold what few parts "
            "do not tell."
        )
    if allocation.integrates:
        yield text(
            "Integration errors are not audited here. Write the study found (-o) "
            "and run it: its run audits them."
        )


def equal_cost_words(schemes: Mapping[Role, Scheme]) -> Parts:
    """Return the gain of the best tolerances for the drawing's cost."""
    drawing, best = schemes[Role.DRAWING], schemes[Role.EQUAL_COST]
    if best.tolerances == drawing.tolerances:
        return text(
            "No tolerances were found for the drawing's cost with fewer trials out of "
            "limit than the drawing's."
        )
    return say(
        "At cost {} (drawing: {}), {} instead of {} are out of some limit.",
        Number(best.cost), Number(drawing.cost),
        ppm(best.fraction_out_of_any_limit), ppm(drawing.fraction_out_of_any_limit),
    )  # fmt: skip


def chart_of(allocation: Allocation) -> Chart:
    """Return the trade-off with all schemes; the found one by its proof."""
    proof = {Role.FOUND: allocation.proof} if allocation.met else {}
    schemes = {WORDS[name]: x for name, x in (allocation.schemes | proof).items()}
    return trade_off_chart(allocation.trade_off, schemes, listed=allocation.listed)


def trade_off_chart(
    points: Sequence[Point], schemes: Mapping[str, Scheme], *, listed: bool = False
) -> Chart:
    """Return a chart of the least cost over the fraction out of any limit.

    Points in order are a curve, or dots where every tolerance is of a list: nothing
    lies between them. Schemes are dots with intervals; equal ones, by words, are drawn
    once, by the longest run.
    """
    fractions = np.array([point.fraction_out_of_any_limit for point in points])
    costs = np.array([point.cost for point in points])
    sentence = "cost of the cheapest tolerances"
    curves, marks = [Curve("cheapest", "1", "", sentence, costs, points=listed)], []
    equal: dict[tuple[str, ...], list[str]] = {}
    for name, scheme in schemes.items():
        equal.setdefault(tuple(scheme.tolerances.values()), []).append(name)
    for names in equal.values():
        scheme = max((schemes[name] for name in names), key=lambda s: s.trials)
        share, lower, upper, _ = scheme.fraction_out_of_any_limit
        words, ends = " = ".join(names), np.array([lower, share, upper])
        if share > 0:
            marks.append(Mark(words, share, scheme.cost))
        else:  # has no place on an axis of ratios
            words += f", {scheme.cost:.4g}: none of {scheme.trials} out of limit"
            ends = np.array([lower, upper])
        values = np.full(len(ends), scheme.cost)
        curves.append(Curve(words, "1", "", "tolerances beside it", values, ends))
    # an interval that reaches far below all else leaves no room for that
    uppers = [s.fraction_out_of_any_limit.upper for s in schemes.values()]
    least = BELOW * min([*fractions.tolist(), *(mark.at for mark in marks), *uppers])
    axis, picture = OUT._replace(least=least), Picture("cost", *curves)
    return Chart.of(axis, fractions, picture, marks=tuple(marks))

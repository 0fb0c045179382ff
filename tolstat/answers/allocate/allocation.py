"""The answer of an allocation: tolerances, costs, fractions out of limit."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tolstat.answers.allocate.fresh_runs import Scheme
from tolstat.answers.allocate.search import Point
from tolstat.answers.answer import Answer
from tolstat.answers.cells import ppm
from tolstat.document import blocks
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Row,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.document.view_content import plot_of
from tolstat.model.view import Axis, Chart, Curve, Mark, Picture
from tolstat.statistics.limits.yields import MET

CHART = "Cost of the cheapest tolerances over the fraction out of any limit"
OUT = Axis("fraction out of any limit", "1", "ppm", logarithmic=True)
BELOW = 0.1  # of the least fraction: lower ends of intervals are shown so far
LOOSEST = text("at its loosest")
WIDEN = (
    "Widen a limit, or permit tighter tolerances: no tolerances were shown to meet all "
    "limits. "
)
DRAWING, FOUND, PROOF = "drawing", "found", "proof"
TIGHTEST, EQUAL_COST = "tightest", "equal_cost"
WORDS = {
    DRAWING: "drawing",
    FOUND: "found",
    PROOF: "found, its proof",
    TIGHTEST: "tightest",
    EQUAL_COST: "best at the drawing's cost",
    "root_sum_square": "root sum square",
    "worst_case": "worst case",
}


class AllocatedEntry(NamedTuple):
    """One entry of the study."""

    name: str
    parts: int  # that share its tolerance
    specified: str  # the tolerance on the drawing
    found: str
    cost_specified: float  # of all its parts
    cost: float
    at_loosest: bool  # whether it is as loose as it may be


@dataclass(frozen=True, repr=False)
class Allocation(Answer):
    """The cheapest tolerances with which a study meets its limits."""

    cost: float
    half_widths: dict[str, float]  # SI; of the tightest where none meet the limits
    met: bool  # whether a fresh run shows that they meet every limit
    entries: tuple[AllocatedEntry, ...]
    # "drawing", "found" or "tightest", "equal_cost" where the limits are met,
    # "root_sum_square", "worst_case": all but the tightest by runs of one seed, by
    # which nothing was chosen
    schemes: dict[str, Scheme]
    omitted_schemes: dict[str, str]  # of the last two, and why
    proof: Scheme  # the answer, by the fresh run that its verdicts are of
    verdicts: dict[str, str]  # of each limit, by the proof
    # limits that a step looser of some tolerance would break: a tenth, as far as it may
    # be, or the next option of a list
    active_limits: tuple[str, ...]
    exhaustive: bool  # whether all combinations of lists were tried
    wide_trials: int  # that were weighted, of no fresh run
    fresh_trials: tuple[int, ...]  # of each fresh run, in the order they were made
    trade_off: tuple[Point, ...]
    # of limits that are missed because of their mean: what to permit
    off_limit: dict[str, Parts] = field(metadata={"json": False})
    title: str = field(metadata={"json": False})
    # with these tolerances, and the trials of the proof, as a file
    study: str = field(metadata={"json": False})
    listed: bool = field(metadata={"json": False})  # whether all are one of a list
    integrates: bool = field(metadata={"json": False})  # whether its model does

    answers = "allocate"
    index = "scheme"

    @property
    def _short(self) -> str:
        return f"cost {self.cost:.4g}, limits {'met' if self.met else 'not met'}"

    def rows(self) -> list[Row]:
        """Return a row for each scheme: cost, fractions out of limit, tolerances."""
        rows = list[Row]()
        for name, scheme in self._with_proof.items():
            row: dict[str, Number | str | int] = {"scheme": name}
            row["cost"] = Number(scheme.cost)
            row["out of any limit [ppm]"] = ppm(scheme.fraction_out_of_any_limit)
            for limit, share in scheme.fraction_out_of_limit.items():
                row[f"{limit} out of limit [ppm]"] = ppm(share)
            for entry, words in scheme.tolerances.items():
                shift = entry not in scheme.half_widths
                row[entry if shift else f"{entry} tolerance"] = words
            rows.append({**row, "trials": scheme.trials, "seed": scheme.seed})
        return rows

    @property
    def chart(self) -> Chart:
        """The trade-off with all schemes; the found one by its proof."""
        schemes = self.schemes | ({FOUND: self.proof} if self.met else {})
        by_words = {WORDS[name]: scheme for name, scheme in schemes.items()}
        return trade_off_chart(self.trade_off, by_words, listed=self.listed)

    def study_file(self, found_by: str = "", proved_by: str = "") -> str:
        """Return the study with these tolerances, and above it where they come from.

        `found_by` and `proved_by` are commands that find and prove them again.
        """
        proof, drawing = self.proof, self.schemes[DRAWING]
        cost = f"{proof.cost:.6g} (drawing: {drawing.cost:.6g})"
        verdict = "All limits are met" if self.met else "NOT all limits are met"
        lines = [
            f"Tolerances allocated at a cost of {cost}.",
            found_by,
            f"{verdict} in a fresh run of {proof.trials} random trials with seed "
            f"{proof.seed}.",
            proved_by,
        ]
        return "".join(f"# {line}\n" for line in lines if line) + f"\n{self.study}"

    def document(self) -> blocks.Document:
        """Return its document, the answer first."""
        parts = (
            blocks.Paragraph(self._lead(), "lead"),
            self._tolerances(),
            self._fractions(),
            blocks.Bullets(tuple(self._notes())),
            blocks.Figure(CHART, plot_of(self.chart), text(CHART), wide=True),
        )
        return blocks.Document(f"Cheapest tolerances: {self.title}", parts)

    @property
    def _with_proof(self) -> dict[str, Scheme]:
        return self.schemes | ({PROOF: self.proof} if self.met else {})

    def _lead(self) -> Parts:
        cost, drawing = Number(self.cost), Number(self.schemes[DRAWING].cost)
        proof = self.proof
        if self.met:
            return say(
                "{} at cost {} (drawing: {}). Proof: a fresh run of {} with seed {}; "
                "each yield, with its whole interval, is as demanded or better.",
                Word("All limits are met", MET), cost, drawing,
                counted(proof.trials, "trial"), str(proof.seed),
            )  # fmt: skip
        shares = {n: ppm(share) for n, share in proof.fraction_out_of_limit.items()}
        missed = [
            say("{}: {}, {} out of limit", Name(n), Word(verdict, verdict), shares[n])
            for n, verdict in self.verdicts.items()
            if verdict != MET
        ]
        return say(
            "{}{}At the tightest, which cost {} (drawing: {}): {}.",
            self.off_limit.values(),
            WIDEN if len(self.off_limit) < len(missed) else None,
            cost, drawing, listed(missed, ""),
        )  # fmt: skip

    def _tolerances(self) -> blocks.Table:
        rows: list[dict[str, blocks.Given]] = [
            {
                "entry": Name(entry.name),
                "parts": Number(entry.parts),
                "drawing": entry.specified,
                "cost (drawing)": Number(entry.cost_specified),
                FOUND if self.met else TIGHTEST: blocks.Cell(
                    text(entry.found), LOOSEST if entry.at_loosest else ()
                ),
                "cost": Number(entry.cost),
            }
            for entry in self.entries
        ]
        drawing = Number(sum(entry.cost_specified for entry in self.entries))
        rows.append(
            {"entry": "all", "cost (drawing)": drawing, "cost": Number(self.cost)}
        )
        return blocks.table_of(rows, "Tolerances")

    def _fractions(self) -> blocks.Table:
        rows = list[dict[str, blocks.Given]]()
        for name, scheme in self._with_proof.items():
            row: dict[str, blocks.Given] = {"tolerances": WORDS[name]}
            row["cost"] = Number(scheme.cost)
            row["any limit"] = ppm(scheme.fraction_out_of_any_limit)
            row |= {n: ppm(scheme.fraction_out_of_limit[n]) for n in self.verdicts}
            trials = counted(scheme.trials, "trial")
            row["fresh run"] = blocks.Cell(trials, (f"seed {scheme.seed}",))
            rows.append(row)
        title = "Fraction out of limit in fresh runs, ppm, with 95 % intervals"
        return blocks.table_of(rows, title)

    def _notes(self) -> Iterator[Parts]:
        if self.met:
            yield text(
                "Verdicts rest on the proof, which was chosen from several runs. "
                'Compare "found" with the other rows: their seed chose nothing.'
            )
            yield equal_cost_words(self.schemes)
        if self.met and self.active_limits:
            yield say(
                "Active limits: {}. They are not shown to be met with some tolerance a "
                "tenth looser, or by the next option of a list.",
                listed([Name(name) for name in self.active_limits]),
            )
        if not self.exhaustive:
            yield text(
                "Not all combinations were tried, for there are too many. Options were "
                "exchanged one or two at a time: cheaper tolerances may exist."
            )
        for name, reason in self.omitted_schemes.items():
            yield text(f"By {WORDS[name]}: {reason}.")
        yield say(
            "Evaluated: {} and {} in {}.",
            counted(self.wide_trials, "weighted trial"),
            counted(sum(self.fresh_trials), "trial"),
            counted(len(self.fresh_trials), "fresh run"),
        )
        if self.integrates:
            yield text(
                "Integration errors are not audited here. Write the study found (-o) "
                "and run it: its run audits them."
            )


def equal_cost_words(schemes: Mapping[str, Scheme]) -> Parts:
    """Return the gain of the best tolerances for the drawing's cost."""
    drawing, best = schemes[DRAWING], schemes[EQUAL_COST]
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

"""The answer of an allocation: tolerances, what they cost, what that buys."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from tolstat.answers.allocate.fresh_runs import Scheme
from tolstat.answers.allocate.trade_off import Point, trade_off_chart
from tolstat.answers.answer import Answer
from tolstat.answers.cells import ppm
from tolstat.document.blocks import (
    Block,
    Bullets,
    Cell,
    Document,
    Figure,
    Given,
    Paragraph,
    Table,
    table,
)
from tolstat.document.inline import Name, Number, Parts, Word, counted, listed, text
from tolstat.model.view import Chart
from tolstat.render.serialize import Row
from tolstat.statistics.limits.yields import MET

CHART = "Cost of the cheapest tolerances over the fraction out of any limit"
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
    reproducible: bool  # whether a run of the file has the trials of the proof
    verdicts: dict[str, str]  # of each limit, by the proof
    # limits that a step looser of some tolerance would break: a tenth, as far as it may
    # be, or the next option of a list
    active_limits: tuple[str, ...]
    exhaustive: bool  # whether all combinations of lists were tried
    wide_trials: int  # that were weighted, of no fresh run
    fresh_trials: tuple[int, ...]  # of each fresh run, in the order they were made
    trade_off: tuple[Point, ...]
    title: str = field(metadata={"json": False})
    study: str = field(metadata={"json": False})  # with these tolerances, as a file
    listed: bool = field(metadata={"json": False})  # whether all are one of a list

    answers: ClassVar[str] = "allocate"
    index: ClassVar[str] = "scheme"

    @property
    def short(self) -> str:
        """Its cost, and whether that meets the limits."""
        return f"cost {self.cost:.4g}, limits {'met' if self.met else 'not met'}"

    def rows(self) -> list[Row]:
        """Return a row for each scheme: cost, fractions out of limit, tolerances."""
        return [
            {
                "scheme": name,
                "cost": Number(scheme.cost),
                "out of any limit [ppm]": ppm(scheme.fraction_out_of_any_limit),
                **{
                    f"{limit} out of limit [ppm]": ppm(share)
                    for limit, share in scheme.fraction_out_of_limit.items()
                },
                **{f"{n} tolerance": each for n, each in scheme.tolerances.items()},
                "trials": scheme.trials,
                "seed": scheme.seed,
            }
            for name, scheme in self._shown.items()
        ]

    @property
    def chart(self) -> Chart:
        """The trade-off with all schemes; of what was found its proof."""
        schemes = self.schemes | ({FOUND: self.proof} if self.met else {})
        named = {WORDS[name]: scheme for name, scheme in schemes.items()}
        return trade_off_chart(self.trade_off, named, listed=self.listed)

    def study_file(self, found_by: str = "", proved_by: str = "") -> str:
        """Return the study with these tolerances, and above it where they come from.

        `found_by` and `proved_by` are commands that find and prove them again.
        """
        proof, drawing = self.proof, self.schemes[DRAWING]
        cost = f"{proof.cost:.6g} (drawing: {drawing.cost:.6g})"
        shown = "All limits are met" if self.met else "NOT all limits are met"
        lines = [
            f"Tolerances allocated at a cost of {cost}.",
            found_by,
            f"{shown} in a fresh run of {proof.trials} random trials with seed "
            f"{proof.seed}.",
            proved_by,
        ]
        return "".join(f"# {line}\n" for line in lines if line) + f"\n{self.study}"

    def document(self) -> Document:
        """Return what it says, the answer first."""
        blocks: tuple[Block, ...] = (
            Paragraph(self._lead(), "lead"),
            self._tolerances(),
            self._fractions(),
            Bullets(tuple(text(each) for each in self._notes() if each)),
            Figure(CHART, self.chart, text(CHART), wide=True),
        )
        return Document(f"Cheapest tolerances: {self.title}", blocks)

    @property
    def _shown(self) -> dict[str, Scheme]:
        return self.schemes | ({PROOF: self.proof} if self.met else {})

    def _lead(self) -> Parts:
        cost, drawing = Number(self.cost), Number(self.schemes[DRAWING].cost)
        proof = self.proof
        if self.met:
            return text(
                Word("All limits are met", MET), " at cost ", cost,
                " (drawing: ", drawing, "). Proof: a fresh run of ",
                counted(proof.trials, "trial"), " with seed ", str(proof.seed),
                "; each yield, with its whole interval, is as demanded or better.",
            )  # fmt: skip
        missed = [
            text(
                Name(name), ": ", Word(verdict, verdict), ", ",
                ppm(proof.fraction_out_of_limit[name]), " out of limit",
            )
            for name, verdict in self.verdicts.items()
            if verdict != MET
        ]  # fmt: skip
        return text(
            "Widen a limit, or permit tighter tolerances: ",
            "no tolerances were shown to meet all limits. At the tightest, which cost ",
            cost, " (drawing: ", drawing, "): ", listed(missed, ""), ".",
        )  # fmt: skip

    def _tolerances(self) -> Table:
        found = FOUND if self.met else TIGHTEST
        heads = "entry", "parts", "drawing", "cost (drawing)", found, "cost", ""
        rows: list[list[Given]] = [
            [Name(each.name), Number(each.parts), each.specified,
             Number(each.cost_specified), each.found, Number(each.cost),
             "at its loosest" if each.at_loosest else None]
            for each in self.entries
        ]  # fmt: skip
        drawn = Number(sum(each.cost_specified for each in self.entries))
        rows.append(["all", None, None, drawn, None, Number(self.cost), None])
        return table(heads, rows, "Tolerances")

    def _fractions(self) -> Table:
        heads = "tolerances", "cost", "any limit", *self.verdicts, "fresh run"
        rows: list[list[Given]] = [
            [WORDS[name], Number(each.cost), ppm(each.fraction_out_of_any_limit),
             *(ppm(each.fraction_out_of_limit[limit]) for limit in self.verdicts),
             Cell(counted(each.trials, "trial"), text(f"seed {each.seed}"))]
            for name, each in self._shown.items()
        ]  # fmt: skip
        title = "Fraction out of limit in fresh runs, ppm, with 95 % intervals"
        return table(heads, rows, title)

    def _notes(self) -> list[Parts | None]:
        active = [(Name(name),) for name in self.active_limits]
        return [
            text(
                "Verdicts rest on the proof, which was chosen from several runs. "
                'Compare "found" with the other rows: their seed chose nothing.'
            ) if self.met else None,
            equal_cost_words(self.schemes) if self.met else None,
            text(
                "Active limits: ", listed(active), ". They are not shown to be met "
                "with some tolerance a tenth looser, or by the next option of a list.",
            ) if active and self.met else None,
            None if self.exhaustive else text(
                "Not all combinations were tried, for there are too many. Options were "
                "exchanged one or two at a time: cheaper tolerances may exist."
            ),
            *(
                text(f"By {WORDS[name]}: {reason}.")
                for name, reason in self.omitted_schemes.items()
            ),
            text(
                "Evaluated: ", counted(self.wide_trials, "weighted trial"), " and ",
                counted(sum(self.fresh_trials), "trial"), " in ",
                counted(len(self.fresh_trials), "fresh run"), ".",
            ),
        ]  # fmt: skip


def equal_cost_words(schemes: dict[str, Scheme]) -> Parts:
    """Say what the best tolerances for the drawing's cost gain."""
    drawing, best = schemes[DRAWING], schemes[EQUAL_COST]
    own, other = (each.fraction_out_of_any_limit for each in (drawing, best))
    if best.tolerances == drawing.tolerances:
        return text(
            "No tolerances were found for the drawing's cost with fewer trials out of "
            "limit than the drawing's."
        )
    if own.value == other.value:
        return text(
            "Best at the drawing's cost: no difference in runs of ",
            counted(best.trials, "trial"), "; weighted trials say fewer out of limit.",
        )  # fmt: skip
    return text(
        "At cost ", Number(best.cost), " (drawing: ", Number(drawing.cost), "), ",
        ppm(other), " instead of ", ppm(own), " are out of some limit.",
    )  # fmt: skip

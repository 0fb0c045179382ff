"""Results of a run with other deviations: the answer and its document."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm, summary_cells
from tolstat.answers.report.report_answer import AllLimits
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
from tolstat.statistics.intervals.weighted_estimates import ENOUGH
from tolstat.statistics.summary import QUANTILES, Summary
from tolstat.units.scale import PER_CENT, Scale, share_words

ON_SCREEN = (0.5, 0.95)  # quantiles


class Change(NamedTuple):
    """How a contributor is distributed."""

    baseline: str  # in words
    scenario: str
    fraction_left: float  # effective sample size with this change alone, per trial


class AllLimitsWhatIf(NamedTuple):
    """The yield of all limits, of the baseline and of the scenario."""

    baseline: AllLimits
    scenario: AllLimits


class ResponseWhatIf(NamedTuple):
    """A response of the run, and of the scenario."""

    baseline: Summary  # of the trials as they are
    scenario: Summary  # of the weighted trials
    nominal: float  # of the nominal trial
    sentence: str  # its description
    scale: Scale
    # effective sample size of the weighted out-of-limit trials; None without a limit
    out_of_limit_sample_size: int | None


@dataclass(frozen=True, repr=False)
class WhatIf(Answer):
    """Results of a run with other deviations."""

    title: str  # of the run
    run: str
    model: str
    # by contributor; all others stay, and so do batches and correlations
    changes: Mapping[str, Change]
    trials: int  # that are weighted
    # of the weighted trials; at most the expected one
    effective_sample_size: int
    expected_sample_size: float  # the same by the distributions, without the trials
    all_limits: AllLimitsWhatIf | None  # None without limits
    responses: Mapping[str, ResponseWhatIf]
    notes: tuple[str, ...]  # for readers of the numbers
    answers = "what_if"

    @property
    def _short(self) -> str:
        return f"{self.run}; {self._scenario}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response: the scenario, then the baseline."""
        return [
            {
                "title": self.title,
                "scenario": self._scenario,
                "response": name,
                "unit": each.scale.shown,
                "nominal [unit]": Number(each.nominal, each.scale),
                **summary_cells(each.scenario, each.scale),
                **summary_cells(each.baseline, each.scale, "baseline: "),
                "trials": self.trials,
                "effective sample size": self.effective_sample_size,
                "effective sample size, out of limit": ""
                if each.out_of_limit_sample_size is None
                else each.out_of_limit_sample_size,
            }
            for name, each in self.responses.items()
        ]

    def document(self) -> blocks.Document:
        """Return yields, limits and responses of baseline and scenario."""
        both = {name: (of.baseline, of.scenario) for name, of in self.changes.items()}
        parts = blocks.shown(
            blocks.Paragraph(self._yields(), "lead"),
            blocks.paragraph(
                "Baseline -> scenario: ",
                changes(both),
                ". All other deviations, batches and correlations stay.",
            ),
            self._limits(),
            self._responses(),
            *self._notes(),
        )
        return blocks.Document(f"{self.title}: what if", parts, (self.run, self.model))

    @property
    def _scenario(self) -> str:
        return "; ".join(
            f"{name}: {each.scenario}" for name, each in self.changes.items()
        )

    def _yields(self) -> Parts:
        both = self.all_limits
        if both is None:
            return text("The study limits no response.")
        whose = "all limits" if both.baseline.limits > 1 else "this limit"
        yields = (Number(each.within, PER_CENT) for each in both)
        return say("Yield, {}: {} -> {}.", whose, *yields)

    def _sides(
        self, names: Sequence[str]
    ) -> Iterator[tuple[Name | None, str, ResponseWhatIf, Summary]]:
        """Yield baseline and scenario of responses; only the first one is named."""
        for name in names:
            each = self.responses[name]
            yield Name(name), "baseline", each, each.baseline
            yield None, "scenario", each, each.scenario

    def _limits(self) -> blocks.Table:
        rows = [
            {
                "response": name,
                "": side,
                "limit": limit_cell(limited.limit) if name else None,
                "verdict": Word(limited.yields.words, limited.yields.verdict),
                "out of limit, ppm": ppm(limited.yields.fraction_out_of_limit),
                "equivalent Ppk": ppk_cell(limited.equivalent_ppk),
                "Ppk by percentiles": ppk_cell(limited.percentiles.ppk),
                "Ppk by moments": ppk_cell(limited.moments.ppk),
            }
            for name, side, _, of in self._sides([*self.responses])
            if (limited := of.limited)
        ]
        return blocks.table_of(
            rows,
            "Limits",
            page_only=["Ppk by percentiles", "Ppk by moments"],
            keys=2,
            look="verdicts",
        )

    def _responses(self) -> blocks.Table:
        """Return the statistics of all responses, those with limits first."""
        limited = [n for n, each in self.responses.items() if each.scenario.limited]
        rows = [
            {
                "response": name,
                "unit": each.scale.mark if name else None,
                "": side,
                "nominal": Number(each.nominal, each.scale) if name else None,
                "mean": Number(of.mean_for_any_distribution, each.scale),
                "sigma": Number(of.sigma_for_any_distribution, each.scale),
                **{
                    share_words(share): Number(of.quantiles[share], each.scale)
                    for share in QUANTILES
                },
            }
            for name, side, each, of in self._sides(
                [*dict.fromkeys([*limited, *self.responses])]
            )
        ]
        others = [share_words(share) for share in QUANTILES if share not in ON_SCREEN]
        return blocks.table_of(
            rows,
            "Responses",
            page_only=["nominal", "mean", "sigma", *others],
            keys=3,
            look="dense",
        )

    def _notes(self) -> Iterator[blocks.Paragraph]:
        """Yield the notes for readers of the numbers."""
        yield blocks.note(
            say(
                "Nothing was simulated: {}, reweighted, have an effective sample size "
                "of {}.",
                counted(self.trials, "stored trial"),
                Number(self.effective_sample_size),
            )
        )
        few = {
            name: each.out_of_limit_sample_size
            for name, each in self.responses.items()
            if each.out_of_limit_sample_size is not None
            and each.out_of_limit_sample_size < ENOUGH
        }
        if few:
            sizes = [(Name(name), " ", Number(size)) for name, size in few.items()]
            yield blocks.note(
                say(
                    "Few out-of-limit trials decide these fractions; their effective "
                    "sample size: {}. A fresh run tells more (`tolstat what-if ... "
                    "--write STUDY.toml`).",
                    listed(sizes),
                )
            )
        yield from map(blocks.note, self.notes)
        weighted = any(each.baseline.weighted for each in self.responses.values())
        yield blocks.note(
            "Each number has its 95 % interval below it: of fractions out of limit "
            "from weighted counts, of all others for any distribution.",
            None
            if weighted
            else " Fractions and verdicts of the baseline are "
            "anytime-valid, those of the scenario for a single look. So they may "
            "differ although the trials are equal.",
        )

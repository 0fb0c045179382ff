"""Runs compared with the first of them, as types; SI, differences less the first."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import NONE, number_cells
from tolstat.answers.compare.pairing import Pairing
from tolstat.answers.report.report_warnings import ReportWarning
from tolstat.answers.report.response_summary import DescribedResponse
from tolstat.document.inline import Number, Row
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.summary import Summary
from tolstat.units.scale import PER_CENT, PPM, Scale, share_words


class LimitDifference(NamedTuple):
    """Two designs and their limits; differences are second less first."""

    # the limit of each, or that of the other where it has none
    limits: tuple[str, str]
    # of each, as its report judges it; failed trials are out of limit
    fractions_out_of_limit: tuple[Estimate, Estimate]
    trials: tuple[int, int]  # that these rest on
    worse: int | None  # trials within in the first and out of limit in the second
    better: int | None  # the reverse; None of unpaired runs
    fraction_out_of_limit_difference: Estimate
    equivalent_ppks: tuple[Estimate, Estimate]
    equivalent_ppk_difference: Estimate
    moments_ppk_difference: Estimate

    @property
    def significant(self) -> int:
        """1 for significantly more trials out of limit in the second, -1 for fewer."""
        return _sign(self.fraction_out_of_limit_difference)

    @property
    def significant_ppk(self) -> int:
        """1 for a significantly higher Ppk by moments in the second, -1 for a lower."""
        return _sign(self.moments_ppk_difference)


def _sign(difference: Estimate) -> int:
    return int(difference.lower > 0) - int(difference.upper < 0)


UNLIMITED = LimitDifference(
    ("", ""), (NONE, NONE), (0, 0), None, None, NONE, (NONE, NONE), NONE, NONE
)


class ComparedResponse(NamedTuple):
    """The description and scale of a response, as in the first study."""

    sentence: str
    scale: Scale


class Design(NamedTuple):
    """One of the runs."""

    label: str  # "A" is the first
    title: str
    run: str
    model: str
    done: int  # trials
    failed: int
    started_at: str
    source_digest: str
    version_tolstat: str
    warnings: tuple[ReportWarning, ...]  # what a reader has to know before all else
    responses: Mapping[str, DescribedResponse]  # those that are compared


class ResponseDifference(NamedTuple):
    """A response of a design less that of the first."""

    trial_by_trial: Summary | None  # of the differences; None of unpaired runs
    smaller: Estimate  # fraction of the trials in which it is smaller than in the first
    larger: Estimate
    mean: Estimate  # difference of the means
    quantiles: Mapping[float, Estimate]  # differences of the median and of 95 %
    limit: LimitDifference | None  # None where neither study has a limit


class SignificantChanges(NamedTuple):
    """Limited responses by whether trials out of limit differ significantly."""

    fewer: tuple[str, ...]
    more: tuple[str, ...]
    neither: tuple[str, ...]
    # of these with normal tails, by whether Ppk by moments differs significantly
    higher_ppk: tuple[str, ...]
    lower_ppk: tuple[str, ...]


class Difference(NamedTuple):
    """A design less the first."""

    design: str  # its label
    pairing: Pairing
    # those that differ, as written: in the first, in this one; empty where a study
    # has none
    settings: Mapping[str, tuple[str, str]]
    deviations: Mapping[str, tuple[str, str]]
    focus: tuple[str, ...]  # responses
    responses: Mapping[str, ResponseDifference]  # all that both have
    findings: SignificantChanges

    @property
    def limits(self) -> dict[str, LimitDifference]:
        """The responses that a study limits."""
        return limits_of(self.responses)


def limits_of(
    responses: Mapping[str, ResponseDifference],
) -> dict[str, LimitDifference]:
    """Return the differences of the responses that a study limits."""
    return {n: x.limit for n, x in responses.items() if x.limit}


@dataclass(frozen=True, repr=False)
class Comparison(Answer):
    """Two or more runs, each compared with the first.

    Attributes
    ----------
    responses : dict of str to ComparedResponse
        All that are compared.
    designs : tuple of Design
        The runs, in order.
    differences : tuple of Difference
        Of each but the first.
    """

    responses: Mapping[str, ComparedResponse]
    designs: tuple[Design, ...]
    differences: tuple[Difference, ...]
    answers = "compare"

    @property
    def _short(self) -> str:
        kinds = (f"{x.design} {x.pairing.kind}" for x in self.differences)
        runs = ", ".join(f"{x.label} {x.run}" for x in self.designs)
        return f"{runs}; {', '.join(kinds)}"

    def designs_of(self, difference: Difference) -> tuple[Design, Design]:
        """Return the first design, and that of a difference."""
        second = next(x for x in self.designs if x.label == difference.design)
        return self.designs[0], second

    def rows(self) -> Sequence[Row]:
        """Return a row for each response of each design but the first."""
        return [self._row(less, n) for less in self.differences for n in less.responses]

    def _row(self, difference: Difference, name: str) -> Row:
        first, second = self.designs_of(difference)
        both = ("first: ", first), ("second: ", second)
        scale, changed = self.responses[name].scale, difference.responses[name]
        limit, less = changed.limit or UNLIMITED, "second less first: "
        row: dict[str, Number | str | int] = {
            "first": first.run,
            "second": second.run,
            "pairing": difference.pairing.kind,
            "response": name,
            "unit": scale.shown,
        }
        for words, design in both:
            response = design.responses[name]
            row[f"{words}nominal [unit]"] = Number(response.nominal, scale)
            row |= number_cells(response, scale, words)
        row[f"{less}mean [unit]"] = Number(changed.mean, scale)
        for q, quantile in changed.quantiles.items():
            row[f"{less}{share_words(q)} [unit]"] = Number(quantile, scale)
        row["smaller in second [%]"] = Number(changed.smaller, PER_CENT)
        row["larger in second [%]"] = Number(changed.larger, PER_CENT)
        out = "fraction out of limit [ppm]"
        for i, (words, _) in enumerate(both):
            row[f"{words}limit"] = limit.limits[i]
            row[words + out] = Number(limit.fractions_out_of_limit[i], PPM)
            row[f"{words}equivalent Ppk"] = Number(limit.equivalent_ppks[i])
        row[less + out] = Number(limit.fraction_out_of_limit_difference, PPM)
        row[f"{less}equivalent Ppk"] = Number(limit.equivalent_ppk_difference)
        row["worse"] = "" if limit.worse is None else limit.worse
        row["better"] = "" if limit.better is None else limit.better
        for words, design in both:
            row[f"{words}trials done"] = design.done
            row[f"{words}trials failed"] = design.failed
        return row

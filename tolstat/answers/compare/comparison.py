"""Runs compared with the first of them, as types; SI, differences less the first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import number_cells
from tolstat.answers.compare.limit_difference import LimitDifference
from tolstat.answers.compare.pairing import UNPAIRED, Pair
from tolstat.document.blocks import Document
from tolstat.document.inline import Number
from tolstat.render.serialize import Row
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.summary import Summary
from tolstat.units.scale import PER_CENT, PPM, Scale, share_words

COMPARED = (0.5, 0.95)  # quantiles of which there is a difference
NONE = Estimate(float("nan"))


class ComparedResponse(NamedTuple):
    """What a response is, and how it is shown: as the first study has it."""

    sentence: str
    scale: Scale


@dataclass(frozen=True)
class DesignResponse(Summary):
    """A response of one design, with that of its nominal trial."""

    nominal: float


class Design(NamedTuple):
    """One of the runs.

    Attributes
    ----------
    label : str
        "A" is the first.
    title, run, model : str
        What it is of.
    done, failed : int
        Trials.
    started_at, source_digest, version_tolstat : str
        How it came to be.
    responses : dict of str to DesignResponse
        Those that are compared.
    """

    label: str
    title: str
    run: str
    model: str
    done: int
    failed: int
    started_at: str
    source_digest: str
    version_tolstat: str
    responses: Mapping[str, DesignResponse]


class Pairing(NamedTuple):
    """How a design is paired with the first.

    Attributes
    ----------
    kind, words : str
        "same trials", "common random numbers" or "unpaired"; how that is known.
    trials, done_in_both, failed : int
        Trials in both runs, done in both, failed in either; 0 of unpaired runs.
    failures : Estimate
        Fraction that failed.
    promise : str
        What the intervals hold for.
    """

    kind: str
    words: str
    trials: int
    done_in_both: int
    failed: int
    failures: Estimate
    promise: str


class ResponseDifference(NamedTuple):
    """A response of a design less that of the first.

    Attributes
    ----------
    trial_by_trial : Summary or None
        Of the differences of trials; None of unpaired runs.
    smaller, larger : Estimate
        Fraction of the trials in which it is smaller, or larger, than in the first.
    mean : Estimate
        Difference of the means.
    quantiles : dict of float to Estimate
        Differences of the medians and of the 95 % quantiles.
    limit : LimitDifference or None
        None where neither study has a limit.
    """

    trial_by_trial: Summary | None
    smaller: Estimate
    larger: Estimate
    mean: Estimate
    quantiles: Mapping[float, Estimate]
    limit: LimitDifference | None


class Difference(NamedTuple):
    """A design less the first.

    Attributes
    ----------
    design : str
        Its label.
    pairing : Pairing
        How its trials are paired with those of the first.
    settings, deviations : dict of str to tuple of str
        Those that differ, as they are written: in the first, in this one; empty in a
        study that has no such one.
    focus : tuple of str
        Responses in focus.
    responses : dict of str to ResponseDifference
        All that both have.
    """

    design: str
    pairing: Pairing
    settings: Mapping[str, tuple[str, str]]
    deviations: Mapping[str, tuple[str, str]]
    focus: tuple[str, ...]
    responses: Mapping[str, ResponseDifference]

    @property
    def paired(self) -> bool:
        """Whether the trials of both are the same, or have common random numbers."""
        return self.pairing.kind != UNPAIRED

    @property
    def limits(self) -> dict[str, LimitDifference]:
        """The responses that a study limits."""
        return {n: each.limit for n, each in self.responses.items() if each.limit}


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
    pairs : tuple of Pair
        The trials; no part of the JSON.
    """

    responses: Mapping[str, ComparedResponse]
    designs: tuple[Design, ...]
    differences: tuple[Difference, ...]
    pairs: tuple[Pair, ...] = field(metadata={"json": False})
    answers: ClassVar[str] = "compare"

    @property
    def short(self) -> str:
        """What it is, in a few words."""
        kinds = (f"{each.design} {each.pairing.kind}" for each in self.differences)
        runs = ", ".join(f"{each.label} {each.run}" for each in self.designs)
        return f"{runs}; {', '.join(kinds)}"

    def of(self, one: Difference) -> tuple[Design, Design]:
        """Return the first design, and that of a difference."""
        return self.designs[0], self.designs[self.differences.index(one) + 1]

    def document(self) -> Document:
        """Return what differs significantly, then each design less the first."""
        from tolstat.answers.compare.comparison_document import comparison_document

        return comparison_document(self)

    def rows(self) -> Sequence[Row]:
        """Return a row for each response of each design but the first."""
        return [
            self._row(design, one, name)
            for design, one in zip(self.designs[1:], self.differences, strict=True)
            for name in one.responses
        ]

    def _row(self, second: Design, one: Difference, name: str) -> Row:
        first, less = self.designs[0], "second less first: "
        scale, each = self.responses[name].scale, one.responses[name]
        limit = each.limit
        row: dict[str, Number | str | int] = {
            "first": first.run,
            "second": second.run,
            "pairing": one.pairing.kind,
            "response": name,
            "unit": scale.shown,
        }
        for words, design in (("first: ", first), ("second: ", second)):
            of = design.responses[name]
            row[f"{words}nominal [unit]"] = Number(of.nominal, scale)
            row |= number_cells(of, scale, words)
        row[f"{less}mean [unit]"] = Number(each.mean, scale)
        for q, found in each.quantiles.items():
            row[f"{less}{share_words(q)} [unit]"] = Number(found, scale)
        row["smaller in second [%]"] = Number(each.smaller, PER_CENT)
        row["larger in second [%]"] = Number(each.larger, PER_CENT)
        out = "fraction out of limit [ppm]"
        for i, words in enumerate(("first: ", "second: ")):
            fraction = limit.fractions_out_of_limit[i] if limit else NONE
            row[f"{words}limit"] = limit.limits[i] if limit else ""
            row[words + out] = Number(fraction, PPM)
            ppk = limit.equivalent_ppk[i] if limit else NONE
            row[f"{words}equivalent Ppk"] = Number(ppk)
        row[less + out] = Number(limit.fraction_difference if limit else NONE, PPM)
        ppk = limit.equivalent_ppk_difference if limit else NONE
        row[f"{less}equivalent Ppk"] = Number(ppk)
        for head in ("worse", "better"):
            count = getattr(limit, head, None)
            row[head] = "" if count is None else count
        for words, design in (("first: ", first), ("second: ", second)):
            row[f"{words}trials done"] = design.done
            row[f"{words}trials failed"] = design.failed
        return row

"""Measured parts in a document: a table of all, a section for each."""

import math
from collections.abc import Iterable

from tolstat.answers.cells import tolerance_words
from tolstat.answers.parts.judged_parts import JudgedParts
from tolstat.answers.parts.parts_figures import figures_of
from tolstat.answers.parts.parts_words import finding_words
from tolstat.document import blocks
from tolstat.document.blocks import Block, Cell, Given, Section
from tolstat.document.inline import Name, Number, Word
from tolstat.document.sentences import text
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, PER_CENT, Scale

INTERVALS = (
    "Intervals (95 %) are those of normal parts: Student's, chi-square, noncentral t. "
    "Where lots differ, intervals rest on the number of lots."
)
ALL_PARTS = (
    "Pp and Ppk are from the sigma of all parts, Cp and Cpk from that within lots. "
    f"{INTERVALS} That of the share outside holds for any distribution."
)


def parts_table(characteristics: Iterable[tuple[str, JudgedParts]]) -> blocks.Table:
    """Return a row of numbers for each characteristic."""
    rows: list[dict[str, Given]] = []
    for name, part in characteristics:
        numbers, scale = part.capability, part.scale
        outside = Number(numbers.outside, PER_CENT, of=numbers.parts)
        rows.append({
            "characteristic": Name(name),
            "tolerance": Word(words, "limit")
            if (words := tolerance_words(part.tolerance, scale)) else None,
            "parts": Number(numbers.parts),
            "unit": scale.mark,
            "mean": _moment(numbers.mean, scale),
            "sigma": _moment(numbers.sigma, scale),
            "Pp": _index(Number(numbers.pp, AS_IS)),
            "Ppk": _index(Number(numbers.ppk, AS_IS)),
            "Cp": _index(Number(numbers.cp, AS_IS)),
            "Cpk": _index(Number(numbers.cpk, AS_IS)),
            "outside, %": outside if part.tolerance.finite else None,
        })  # fmt: skip
    return blocks.table_of(rows, look="dense", spare=["Pp", "Cp"])


def _moment(estimate: Estimate, scale: Scale) -> Given:
    """Return a mean or sigma; without an interval as exactly as those of lots."""
    if estimate.sure or math.isnan(estimate.value):
        return Number(estimate, scale)
    return Cell((Number(estimate.value, scale),), text(str(estimate.reason)))


def _index(number: Number) -> Number | None:
    """Return an index; None where there is neither number nor reason."""
    value = number.value
    empty = isinstance(value, tuple) and math.isnan(value.value) and not value.reason
    return None if empty else number


def parts_section(name: str, part: JudgedParts, anchor: str = "") -> Section:
    """Return how the parts were read, warnings, lots and figures."""
    sentences = tuple(finding_words(x, part.scale) for x in part.warnings)
    content: tuple[Block | None, ...] = (
        blocks.note(part.source),
        blocks.Bullets(sentences),
        _lots(part),
        Section("", (blocks.Gallery(figures_of(name, part)),), page_only=True),
    )
    return blocks.section(name, *content, anchor=anchor)


def _lots(part: JudgedParts) -> blocks.Table:
    scale = part.scale
    rows: list[dict[str, Given]] = [
        {
            "lot": Name(lot),
            "parts": Number(numbers.parts),
            scale.label("mean"): Number(numbers.mean, scale),
            scale.label("sigma"): None
            if math.isnan(numbers.sigma)
            else Number(numbers.sigma, scale),
            "outside": Number(numbers.outside) if part.tolerance.finite else None,
        }
        for lot, numbers in part.lots.items()
    ]
    return blocks.table_of(rows, "Lots")

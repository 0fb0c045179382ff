"""Measured parts in a document: a table of all, a section for each."""

import math
from collections.abc import Iterable

from tolstat.answers.cells import tolerance_words
from tolstat.answers.parts.judged_parts import (
    CoarseStep,
    Drift,
    FarParts,
    FewParts,
    JudgedParts,
    NotNormal,
    OtherLots,
    PartsWarning,
    Sorted,
    TwoKinds,
)
from tolstat.answers.parts.parts_figures import figures_of
from tolstat.document import blocks
from tolstat.document.blocks import Block, Given, Section
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.units.scale import AS_IS, PART, PER_CENT, Scale

LISTED = 5  # parts that are named
TWO = Scale("1", "1", most=2)
ALL_PARTS = (
    "Pp and Ppk are from the sigma of all parts, Cp and Cpk from that within lots. "
    "Intervals (95 %) are those of normal parts: Student's, chi-square, noncentral t. "
    "That of the share outside holds for any distribution. Where lots differ, "
    "intervals rest on the number of lots."
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
            "mean": Number(numbers.mean, scale),
            "sigma": Number(numbers.sigma, scale),
            "Pp": _index(Number(numbers.pp, AS_IS)),
            "Ppk": _index(Number(numbers.ppk, AS_IS)),
            "Cp": _index(Number(numbers.cp, AS_IS)),
            "Cpk": _index(Number(numbers.cpk, AS_IS)),
            "outside, %": outside if part.tolerance.finite else None,
        })  # fmt: skip
    return blocks.table_of(rows, look="dense", spare=["Pp", "Cp"])


def _index(number: Number) -> Number | None:
    """Return an index; None where there is neither number nor reason."""
    value = number.value
    empty = isinstance(value, tuple) and math.isnan(value.value) and not value.reason
    return None if empty else number


def parts_section(name: str, part: JudgedParts, anchor: str = "") -> Section:
    """Return how the parts were read, warnings, lots and figures."""
    sentences = tuple(warning_words(warning, part) for warning in part.warnings)
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


def warning_words(warning: PartsWarning, part: JudgedParts) -> Parts:
    """Return the sentence of a warning."""
    scale = part.scale

    def number(value: float) -> Number:
        return Number(value, scale)

    match warning:
        case FewParts(count):
            return say(
                "Only {}: 50 or more show the tails of a distribution.",
                counted(count, "part"),
            )
        case FarParts(values, places):
            far = [
                say("{} ({})", number(value), place)
                for value, place in zip(values, places, strict=True)
            ]
            if more := len(far) - LISTED:
                far[LISTED:] = [text(f"{more} more")] if more > 0 else []
            return say("Far from all others: {}. Check these parts.", listed(far))
        case TwoKinds(peaks):
            return say(
                "Two kinds of parts: {} about {}, the others about {}. Look for two "
                "machines, tools or batches; no index describes both.",
                Number(peaks.share, PART), number(peaks.lower), number(peaks.upper),
            )  # fmt: skip
        case Sorted(cut):
            return say(
                "The parts end at {}, where about {} more would lie beyond: they may "
                "have been sorted. Sigma and indices are too good then.",
                number(cut.end), Number(cut.expected, TWO),
            )  # fmt: skip
        case Drift(trend):
            return say(
                "Trend in the order of the parts: {} from the first to the last "
                "(Kendall's tau {}). Pp and Ppk hold for no later part.",
                number(trend.drift), Number(trend.correlation, TWO),
            )  # fmt: skip
        case OtherLots(lots):
            return say(
                "Lots differ: {} is lowest, {} highest.",
                Name(lots.lowest), Name(lots.highest),
            )  # fmt: skip
        case CoarseStep(step):
            return say(
                "Rounded to steps of {}: coarse beside tolerance or spread.",
                number(step),
            )
        case NotNormal(p_value):
            return say(
                "Not normal (Anderson-Darling, p = {}): sigma and indices have no "
                "interval; the share outside has.",
                Number(p_value, TWO),
            )

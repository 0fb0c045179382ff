"""What a quality engineer sees in measured parts, in sentences."""

from tolstat.answers.cells import tolerance_words
from tolstat.answers.parts import judged_parts
from tolstat.document.inline import Name, Number, Parts
from tolstat.document.sentences import counted, listed, say, text
from tolstat.units.scale import PART, Scale

LISTED = 5  # parts that are named
TWO = Scale("1", "1", most=2)


def finding_words(finding: judged_parts.PartsFinding, scale: Scale) -> Parts:
    """Return the sentence about measured parts in a unit."""

    def number(value: float) -> Number:
        return Number(value, scale)

    match finding:
        case judged_parts.FewParts(count):
            return say(
                "Only {}: 50 or more show the tails of a distribution.",
                counted(count, "part"),
            )
        case judged_parts.NotNear(least, most, tolerance):
            return say(
                "These parts are not near the tolerance: they are {} to {}, permitted "
                "is {}. Check column, nominal and unit.",
                number(least), number(most),
                text(tolerance_words(tolerance, scale)),
            )  # fmt: skip
        case judged_parts.Copies(places, first):
            more = len(places) - 1
            others = f", and {more} more repeat others" if more else ""
            return text(
                f"{places[0]} has the same cells as {first[0]}{others}. A copy counts "
                "twice: remove it."
            )
        case judged_parts.FarParts(values, places):
            far = [
                say("{} ({})", number(value), place)
                for value, place in zip(values, places, strict=True)
            ]
            if more := len(far) - LISTED:
                far[LISTED:] = [text(f"{more} more")] if more > 0 else []
            return say("Far from all others: {}. Check these parts.", listed(far))
        case judged_parts.TwoKinds(peaks):
            return say(
                "Two kinds of parts: {} about {}, the others about {}. Look for two "
                "machines, tools or batches; no index describes both.",
                Number(peaks.share, PART), number(peaks.lower), number(peaks.upper),
            )  # fmt: skip
        case judged_parts.Sorted(cut):
            return say(
                "The parts end at {}, where about {} more would lie beyond: they may "
                "have been sorted. Sigma and indices are too good then.",
                number(cut.end), Number(cut.expected, TWO),
            )  # fmt: skip
        case judged_parts.Drift(trend):
            return say(
                "Trend in the order of the parts: {} from the first to the last "
                "(Kendall's tau {}). Pp and Ppk hold for no later part.",
                number(trend.drift), Number(trend.correlation, TWO),
            )  # fmt: skip
        case judged_parts.OtherLots(lots):
            return say(
                "Lots differ: {} is lowest, {} highest.",
                Name(lots.lowest), Name(lots.highest),
            )  # fmt: skip
        case judged_parts.CoarseStep(step):
            return say(
                "Rounded to steps of {}: coarse beside tolerance or spread.",
                number(step),
            )
        case judged_parts.NotNormal(p_value):
            return say(
                "Not normal (Anderson-Darling, p = {}): sigma and indices have no "
                "interval; the share outside has.",
                Number(p_value, TWO),
            )

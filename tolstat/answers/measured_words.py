"""What few measured parts leave undecided, in words."""

from collections.abc import Mapping

from tolstat.document.inline import Name, Number, Parts, counted, listed, say, text
from tolstat.statistics.limits.yields import Caveat, PartsDoubt, Yield
from tolstat.statistics.measured.populations import LEAST_PARTS
from tolstat.units.scale import PPM

FIGURES = 3
ALL_THERE_ARE = "All numbers hold only if these parts are all there are."


def ends(share: PartsDoubt) -> Parts:
    """Write the intervals of a fraction out of limit, each with what it assumes."""
    whatever = _interval(share.for_any.lower, share.for_any.upper)
    if not share.assumed:
        return text(whatever, " ppm whatever they are")
    fitted = _interval(share.if_fitted.lower, share.if_fitted.upper)
    return say(
        f"{{}} ppm if they are {share.assumed} ({{}} whatever they are)",
        fitted, whatever,
    )  # fmt: skip


def _interval(lower: float, upper: float) -> Parts:
    return text(" to ".join(PPM.number(end, FIGURES) for end in (lower, upper)))


def condition(judged: Yield) -> Parts:
    """Say why a limit is undecided, or on which condition its verdict holds.

    Beside a condition of the parts stands what holds without it.
    """
    share = judged.measured
    if share and judged.reason and judged.reason in Caveat.of_parts():
        whatever = _interval(share.for_any.lower, share.for_any.upper)
        return say(f"({judged.reason}; {{}} ppm whatever they are)", whatever)
    return text(f"({judged.reason_words})")


def to_measure(share: PartsDoubt) -> Parts:
    """Say how many parts to measure."""
    names = listed([Name(name) for name in few_entries(share)])
    if share.fewest < LEAST_PARTS:
        return say("measure 50 parts of {}", names)
    if not share.needed:
        return say("measure more than 1000 parts of {}", names)
    return say("measure {} of {}", counted(share.needed, "part"), names)


def few_entries(share: PartsDoubt) -> list[str]:
    """Return the entries whose parts are fewer than those that would decide."""
    entries = share.entries
    most = share.needed or max(entries.values()) + 1
    if share.fewest < LEAST_PARTS:
        most = LEAST_PARTS
    return [name for name, parts in entries.items() if parts < most]


def few_parts(response: str, share: PartsDoubt) -> Parts:
    """Say what a limit is in doubt by, and how many parts would decide."""
    entries = share.entries
    numbers = listed([
        say("{} of {}", counted(entries[name], "part"), Name(name))
        for name in few_entries(share)
    ])  # fmt: skip
    if share.fewest < LEAST_PARTS:
        return say(
            "Only {} measured: at least 10 are needed for a verdict, 50 decide most "
            f"limits. {ALL_THERE_ARE}",
            numbers,
        )
    more = "Measure {}." if share.needed else "More than 1000 would be needed."
    return say(
        f"{{}}: only {{}} measured: {{}} out of limit. {more}",
        Name(response), numbers, ends(share),
        *([Number(share.needed)] if share.needed else []),
    )  # fmt: skip


def measured_alone(entries: Mapping[str, int]) -> Parts:
    """Say that numbers take measured parts as the population."""
    parts = listed(
        [say("{} of {}", counted(n, "part"), Name(name)) for name, n in entries.items()]
    )
    return say(f"{{}} measured. {ALL_THERE_ARE}", parts)

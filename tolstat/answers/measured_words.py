"""What few measured parts leave undecided, in words."""

from collections.abc import Mapping

from tolstat.answers.report.report_warnings import AllPartsWarning, PartsWarning
from tolstat.document.inline import Name, Number, Parts
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import Caveat, PartsUncertainty, Yield
from tolstat.statistics.measured.populations import LEAST_PARTS
from tolstat.units.scale import PPM

FIGURES = 3
MOST = 1000  # parts or lots that are tried
ALL_THERE_ARE = "All numbers hold only if these parts are all there are."


def ends(share: PartsUncertainty) -> Parts:
    """Write the intervals of a fraction out of limit, each with what it assumes."""
    whatever = _interval(share.for_any)
    if not share.assumed:
        return text(whatever, " ppm by the parts alone")
    words = f"{{}} ppm if they are {share.assumed} ({{}} by the parts alone)"
    return say(words, _interval(share.if_fitted), whatever)


def _interval(share: Estimate) -> str:
    return " to ".join(PPM.number(end, FIGURES) for end in share[1:3])


def condition(judged: Yield) -> Parts:
    """Say why a limit is undecided, or on which condition its verdict holds.

    Beside a condition of the parts stands what holds without it.
    """
    share = judged.measured
    if share and judged.reason and judged.reason in Caveat.of_parts():
        whatever = _interval(share.for_any)
        return text(f"({judged.reason}; {whatever} ppm by the parts alone)")
    return text(f"({judged.reason_words})")


def to_measure(share: PartsUncertainty) -> Parts:
    """Say how many parts to measure, or how."""
    if share.fewest >= LEAST_PARTS and not share.for_any.sure:
        return text("measure parts to a finer step")
    few, least = few_entries(share), 50 if share.fewest < LEAST_PARTS else 0
    number = least or share.needed or MOST
    more = "" if least or share.needed else "more than "
    kinds = {name: "part" if least else share.counts[name][1] for name in few}
    actions = [
        say(f"{more}{{}} of {{}}", counted(number, kind), listed(
            [Name(name) for name in few if kinds[name] == kind]
        ))
        for kind in dict.fromkeys(kinds.values())
    ]  # fmt: skip
    return text("measure ", listed(actions))


def few_entries(share: PartsUncertainty) -> list[str]:
    """Return the entries whose parts or lots are fewer than those that would decide."""
    if share.fewest < LEAST_PARTS:
        return [name for name, parts in share.entries.items() if parts < LEAST_PARTS]
    numbers = {name: number for name, (number, _) in share.counts.items()}
    most = share.needed or max(numbers.values()) + 1
    return [name for name, number in numbers.items() if number < most]


def warning_words(warning: PartsWarning | AllPartsWarning) -> Parts:
    """Say what the measured parts leave undecided, and how many would decide."""
    if isinstance(warning, AllPartsWarning):
        return measured_alone(warning.entries)
    response, share, few = warning.response, warning.share, few_entries(warning.share)
    if share.fewest < LEAST_PARTS:
        return say(
            "Only {} measured: at least 10 are needed for a verdict, 50 decide most "
            f"limits. {ALL_THERE_ARE}",
            _parts_of({name: share.entries[name] for name in few}),
        )
    if not share.for_any.sure:
        words = f"{{}}: {share.for_any.reason}. Measure to a finer step."
        return say(words, Name(response))
    numbers = listed(
        [say("{} of {}", counted(*share.counts[name]), Name(name)) for name in few]
    )
    more = "Measure {}." if share.needed else f"More than {MOST} would be needed."
    return say(
        f"{{}}: only {{}} measured: {{}} out of limit. {more}",
        Name(response), numbers, ends(share),
        *([Number(share.needed)] if share.needed else []),
    )  # fmt: skip


def measured_alone(entries: Mapping[str, int]) -> Parts:
    """Say that numbers take measured parts as the population."""
    return say(f"{{}} measured. {ALL_THERE_ARE}", _parts_of(entries))


def _parts_of(entries: Mapping[str, int]) -> Parts:
    return listed(
        [say("{} of {}", counted(n, "part"), Name(name)) for name, n in entries.items()]
    )

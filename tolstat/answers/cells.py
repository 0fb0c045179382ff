"""Cells that several answers have in common: limits, verdicts, estimates."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tolstat.document.blocks import Cell
from tolstat.document.inline import Name, Number, Parts, Word, counted, listed, text
from tolstat.model.description import Response
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import UNDECIDED, Yield
from tolstat.statistics.summary import QUANTILES, Summary
from tolstat.units.scale import AS_IS, KNOWN, PER_CENT, PPM, Scale, share_words


def response_cell(response: Response, link: str = "") -> Cell:
    """Name a response over what it is."""
    return Cell((Name(response.name, link),), text(response.sentence))


def limit_cell(limit: Limit) -> Cell:
    """Write a limit over what is demanded of it."""
    return Cell((Word(limit.words, "limit"),), text(f"for {demand_words(limit)}"))


def demand_words(limit: Limit) -> str:
    """Say what a limit demands: 99.73 %, or a Ppk where one is typed."""
    if limit.typed_ppk:
        return f"Ppk {limit.typed_ppk:.{KNOWN}g}"
    return share_words(limit.demanded)


def verdict_cell(judged: Yield) -> Cell:
    """Write a verdict, over the trials that would decide an undecided one."""
    word = Word(judged.verdict, judged.verdict)
    if judged.needed:
        return Cell((word,), text("about ", counted(judged.needed, "trial"), " decide"))
    if judged.verdict == UNDECIDED:
        return Cell((word,), text("more than 1e9 trials may decide"))
    return Cell((word,))


def ppm(share: Estimate) -> Number:
    """Write a fraction out of limit."""
    return Number(share, PPM)


def ppk_cell(found: Estimate) -> Cell:
    """Write a Pp or Ppk; one without an interval no larger than the reason why."""
    if found.sure or found.needs_more or not math.isfinite(found.value):
        return Cell((Number(found, AS_IS),))
    return Cell((), text(Number(found.value), f": {found.reason}"))


def changes(both: Mapping[str, tuple[str, str]]) -> Parts:
    """Write what is before and after, by name: those together that change alike."""
    alike: dict[tuple[str, str], list[str]] = {}
    for name, words in both.items():
        alike.setdefault(words, []).append(name)
    return listed(
        [
            text(listed([Name(n) for n in names]), f": {a or 'none'} -> {b or 'none'}")
            for (a, b), names in alike.items()
        ],
        joint="",
    )


def number_cells(
    each: Summary, scale: Scale, whose: str = ""
) -> dict[str, Number | str]:
    """Return cells of a wide table: the numbers of a response."""
    return {
        f"{whose}mean [unit]": Number(each.mean, scale),
        f"{whose}sigma [unit]": Number(each.sigma, scale),
        f"{whose}least [unit]": Number(each.least, scale),
        **{
            f"{whose}{share_words(share)} [unit]": Number(each.quantiles[share], scale)
            for share in QUANTILES
        },
        f"{whose}largest [unit]": Number(each.largest, scale),
    }


def summary_cells(
    each: Summary, scale: Scale, whose: str = ""
) -> dict[str, Number | str]:
    """Return cells of a wide table: the numbers of a response, and of its limit."""
    none = Estimate(math.nan)
    limited, yields = each.limited, each.limited.yields if each.limited else None
    ends = limited.limit.permitted if limited else (math.nan, math.nan)
    lower, upper = (end if math.isfinite(end) else math.nan for end in ends)
    demanded = limited.limit.demanded if limited else math.nan
    out = yields.out_of_limit if yields else none
    by_percentiles = limited.percentiles.ppk if limited else none
    return {
        **number_cells(each, scale, whose),
        f"{whose}lower limit [unit]": Number(lower, scale),
        f"{whose}upper limit [unit]": Number(upper, scale),
        f"{whose}demanded [%]": Number(demanded, PER_CENT),
        f"{whose}verdict": yields.verdict if yields else "",
        f"{whose}yield [%]": Number(yields.least if yields else none, PER_CENT),
        f"{whose}fraction out of limit [ppm]": Number(out, PPM),
        f"{whose}equivalent Ppk": Number(limited.equivalent if limited else none),
        f"{whose}Ppk by percentiles": Number(by_percentiles),
    }

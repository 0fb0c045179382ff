"""Cells that several answers share: limits, verdicts, estimates."""

import math
from collections.abc import Mapping

from tolstat.document.blocks import Cell, Given
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import UNDECIDED, Yield
from tolstat.statistics.summary import QUANTILES, Limited, Summary
from tolstat.store.run_records import Stopped
from tolstat.units.scale import AS_IS, PER_CENT, PPM, Scale, share_words

Cells = dict[str, Number | str]
NONE = Estimate(math.nan)


def limit_cell(limit: Limit) -> Cell:
    """Return a limit above its demand."""
    return Cell((Word(limit.words, "limit"),), text(f"for {demand_words(limit)}"))


def demand_words(limit: Limit) -> str:
    """Return the demand of a limit as typed: 99.73 %, Ppk 1.33, 2000 ppm."""
    return limit.demand or share_words(limit.demanded)


def limit_row(
    limited: Limited, trials: int = 0, failed: int = 0, stopped: Stopped | None = None
) -> dict[str, Given]:
    """Return cells of a table: a limit with its demand, verdict and results.

    Of so many trials, of which some failed.
    """
    yields, ppk = limited.yields, limited.equivalent_ppk
    good = say("yield, if failed trials were good: {}",
               Number(yields.within_at_most, PER_CENT, of=trials))  # fmt: skip
    fraction = ppm(yields.fraction_out_of_limit, trials)
    return {
        "limit": limit_cell(limited.limit),
        "verdict": verdict_cell(yields, stopped),
        "out of limit, ppm": Cell((fraction,), good if failed else ()),
        "equivalent Ppk": Cell(
            (Number(ppk),), say("demanded {}", Number(limited.limit.ppk))
        ),
    }


def verdict_cell(judged: Yield, stopped: Stopped | None = None) -> Cell:
    """Return a verdict, above its reason or the trials that decided or would decide it.

    How many would is not known above 1e9, nor of weighted trials.
    """
    word = Word(judged.verdict, judged.verdict)
    if judged.measured and judged.reason:
        from tolstat.answers.measured_words import condition  # seldom used

        return Cell((word,), condition(judged))
    if judged.reason:
        most = Number(judged.missed, PPM, "at_most")
        up_to = say(", one of up to {}", most) if judged.missed else None
        return Cell((word,), text(f"({judged.reason}", up_to, ")"))
    if judged.needed:
        return Cell((word,), text("about ", counted(judged.needed, "trial"), " decide"))
    if stopped and stopped.decides and judged.verdict != UNDECIDED:
        trials = counted(stopped.stages[-1], "trial")
        return Cell((word,), text("decided after ", trials))
    return Cell((word,))


def ppm(share: Estimate, of: int = 0) -> Number:
    """Write a fraction out of limit, of so many trials."""
    return Number(share, PPM, of=of)


def ppk_cell(estimate: Estimate) -> Cell:
    """Return a Pp or Ppk; one without an interval is small, with the reason."""
    if estimate.sure or estimate.needs_more or not math.isfinite(estimate.value):
        return Cell((Number(estimate, AS_IS),))
    return Cell((), text(Number(estimate.value), f": {estimate.reason}"))


def indices_words(summary: Summary) -> Parts:
    """Return Ppk by moments and by percentiles with Pp, where they hold.

    Mean and sigma tell the fraction out of limit of a normal response only.
    """
    limited = summary.limited
    methods = {"by moments": "moments", "by percentiles": "percentiles"}
    if limited is None or not summary.normal_tails:
        del methods["by moments"]
    known = list[Parts]()
    for words, method in methods.items() if limited else ():
        pp, ppk = getattr(limited, method)
        if ppk.sure:
            width = say(", Pp {}", _with_ends(pp)) if pp.sure else None
            known.append(text(f"{words} ", _with_ends(ppk), width))
    return listed(known, "") if known else ()


def _with_ends(index: Estimate) -> str:
    value, lower, upper = AS_IS.interval(*index[:3])
    return f"{value} ({lower} to {upper})"


def changes(both: Mapping[str, tuple[str, str]]) -> Parts:
    """Return changes by name; names with equal changes stand together."""
    equal: dict[tuple[str, str], list[str]] = {}
    for name, words in both.items():
        equal.setdefault(words, []).append(name)
    return listed(
        [
            text(listed([Name(n) for n in names]), f": {a or 'none'} -> {b or 'none'}")
            for (a, b), names in equal.items()
        ],
        joint="",
    )


def numbers_of(summary: Summary, scale: Scale) -> dict[str, Number]:
    """Return the numbers of a response by name."""
    numbers: dict[str, Estimate | float] = {
        "mean": summary.mean, "sigma": summary.sigma, "least": summary.least,
        **{share_words(share): summary.quantiles[share] for share in QUANTILES},
        "largest": summary.largest,
    }  # fmt: skip
    return {name: Number(value, scale) for name, value in numbers.items()}


def number_cells(summary: Summary, scale: Scale, whose: str = "") -> Cells:
    """Return cells of a wide table: the numbers of a response."""
    numbers = numbers_of(summary, scale) | {
        "mean, for any distribution": Number(summary.mean_for_any_distribution, scale),
        "sigma, for any distribution": Number(
            summary.sigma_for_any_distribution, scale
        ),
    }
    return {f"{whose}{n} [unit]": x for n, x in numbers.items()}


def limit_cells(limited: Limited | None, scale: Scale) -> Cells:
    """Return cells of a wide table: a limit, and its results."""
    lower, upper, demanded, verdict = math.nan, math.nan, math.nan, ""
    within = fraction = ppk = NONE
    if limited:
        ends, yields = limited.limit.permitted, limited.yields
        lower, upper = (end if math.isfinite(end) else math.nan for end in ends)
        demanded, verdict = limited.limit.demanded, yields.words
        within, fraction = yields.within, yields.fraction_out_of_limit
        ppk = limited.equivalent_ppk
    return {
        "lower limit [unit]": Number(lower, scale),
        "upper limit [unit]": Number(upper, scale),
        "demanded [%]": Number(demanded, PER_CENT),
        "verdict": verdict,
        "yield [%]": Number(within, PER_CENT),
        "fraction out of limit [ppm]": Number(fraction, PPM),
        "equivalent Ppk": Number(ppk),
    }


def summary_cells(summary: Summary, scale: Scale, whose: str = "") -> Cells:
    """Return cells of a wide table: the numbers of a response, and of its limit."""
    limited = summary.limited
    cells = limit_cells(limited, scale)
    for method in ("percentiles", "moments"):
        pp, ppk = getattr(limited, method) if limited else (NONE, NONE)
        cells[f"Ppk by {method}"] = Number(ppk)
        cells[f"Pp by {method}"] = Number(pp)
    named = {f"{whose}{head}": cell for head, cell in cells.items()}
    return number_cells(summary, scale, whose) | named


def tolerance_words(tolerance: tuple[float, float], scale: Scale) -> str:
    """Return permitted values, SI, as a limit is written."""
    lower, upper = (scale.number(end) for end in tolerance)
    match [math.isfinite(end) for end in tolerance]:
        case [True, True]:
            words = f"{lower}..{upper}"
        case [True, False]:
            words = f">= {lower}"
        case [False, True]:
            words = f"<= {upper}"
        case _:
            return ""
    return f"{words} {scale.mark}".strip()

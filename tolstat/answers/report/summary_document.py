"""The summary of a run, as it is printed after the run."""

import math
from collections.abc import Sequence

import numpy as np

from tolstat.answers.cells import numbers_of
from tolstat.answers.next_steps import command
from tolstat.answers.report.finding_words import in_words, next_steps, what_next
from tolstat.answers.report.first_page import (
    CENTRAL,
    is_clipped,
    lead,
    limits_table,
    of_variance,
    performance,
    reading,
    rests_on,
)
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.report.response_summary import ResponseSummary
from tolstat.answers.run_answer import responses_in_focus
from tolstat.document import blocks
from tolstat.document.blocks import Cell
from tolstat.document.inline import Name, Number, Parts, Said
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.limits.limit import Limit, margins
from tolstat.statistics.summary import QUANTILES
from tolstat.units.scale import share_words

LIMIT_ROUNDING = 1e-9  # of a limit
STARRED = {"mean": "mean *", "sigma": "sigma *"}  # their assumption stands below
AS_SAMPLED = "As sampled: holds if no rarer kind of trial exists than those seen."
FOR_ANY = "For any distribution instead, as trials are few, or few dominate"
LOW = [share_words(share) for share in QUANTILES if share < 0.5]
HIGH = [share_words(share) for share in QUANTILES if share > 0.5]
EXTREMES = ("least", "largest")  # of trials; weighted ones have none
MEDIAN, LARGEST_SHARE = share_words(0.5), "main contribution"


def summary_document(summary: RunSummary) -> blocks.Document:
    """Return limits, limited responses, worst cases and the next step."""
    title = f"{summary.title} ({summary.model})"
    if not summary.trials.ran:
        return blocks.Document(title, (lead(summary), what_next(next_steps(summary))))
    names = [*summary.limits] or responses_in_focus(summary.stored_run)
    others = len(summary.responses) - len(names)
    more = f"Other responses: {others}; the report has them."
    report = command("report", summary.stored_run.path)
    steps = next_steps(summary) or (text("Write the report: ", report, "."),)
    return blocks.Document(
        title,
        blocks.shown(
            in_words(summary.early_warnings),
            lead(summary),
            limits_table(summary),
            performance(summary),
            responses_table(summary, names),
            blocks.note(more) if others else None,
            blocks.paragraph(_worst_cases(summary)),
            in_words(summary.late_warnings),
            *map(blocks.note, summary.trials.notes),
            assumption(summary, names) if summary.trials.done else None,
            reading(summary),
            what_next(steps),
        ),
    )


def responses_table(summary: RunSummary, names: Sequence[str] = ()) -> blocks.Table:
    """Return the numbers of responses; of all by default, for a page.

    A screen shows the quantiles on the sides that have limits. Responses without a
    limit that are zero in every trial are left out, and named below.
    """
    zero = [] if names else [n for n, x in summary.responses.items() if x.nothing]
    rows: list[dict[str, blocks.Given]] = [
        {
            "response": Name(name),
            "unit": response.scale.mark,
            "nominal": Number(response.nominal, response.scale),
            **{
                STARRED.get(n, n): x
                for n, x in numbers_of(response, response.scale).items()
                if not (response.weighted and n in EXTREMES)
            },
            LARGEST_SHARE: _largest_share(response) if names else None,
        }
        for name in names or summary.responses
        if name not in zero
        for response in [summary.responses[name]]
    ]
    ends = [limited.limit.permitted for limited in summary.limits.values()]
    ends = ends or [(0.0, 0.0)]
    hidden = [*EXTREMES] + [MEDIAN] * bool(summary.limits)
    hidden += LOW if all(lower == -math.inf for lower, _ in ends) else []
    hidden += HIGH if all(upper == math.inf for _, upper in ends) else []
    caption = () if names and summary.limits else rests_on(summary)
    if zero and rows:
        names_of_zero = listed([*map(Name, zero)])
        caption = say("{}. Zero in every trial: {}.", caption, names_of_zero)
    return blocks.table_of(
        rows, "Responses", page_only=hidden, words=[LARGEST_SHARE],
        caption=caption, keys=2, look="dense",
        spare=["nominal", "5 %", "95 %", "0.135 %", "99.865 %", MEDIAN],
    )  # fmt: skip


def assumption(summary: RunSummary, names: Sequence[str] = ()) -> blocks.Paragraph:
    """Say what the intervals of mean and sigma assume; of all responses by default."""
    wide = {
        name: for_any(summary.responses[name]) for name in names or summary.responses
    }
    named = "; ".join(f"{n}, {' and '.join(x)}" for n, x in wide.items() if x)
    others = f" {FOR_ANY}: {named}." if named else ""
    return blocks.note(f"* {AS_SAMPLED}{others}")


def for_any(response: ResponseSummary) -> list[str]:
    """Return which of mean and sigma have an interval for any distribution only."""
    both = {
        "mean": (response.mean, response.mean_for_any_distribution),
        "sigma": (response.sigma, response.sigma_for_any_distribution),
    }
    return [n for n, (usual, wide) in both.items() if usual.sure and usual == wide]


def _largest_share(response: ResponseSummary) -> Cell:
    """Return the largest contribution to the variance, or why none is named."""
    if (largest := response.largest_share) is None:
        if (contributions := response.contributions) is None:
            return Cell(())
        shares = [x for x in contributions.first_order.values() if x.value != x.value]
        reason = f"{shares[0].reason}" if shares else "not significant"
        dominated = contributions.dominated_by_few
        return Cell((), text("few trials dominate" if dominated else reason))
    name, share = largest
    central = CENTRAL if is_clipped(response) else None
    return Cell((Name(name),), text(of_variance(share), central))


def _worst_cases(summary: RunSummary) -> Parts:
    """Say where the worst corner of the tolerances is out of limit, or failed."""
    out = []
    for name, limited in summary.limits.items():
        scale, limit = summary.responses[name].scale, limited.limit
        cases = summary.stored_run.worst_cases(name)
        rounding = _rounding(limit, summary.responses[name].nominal)
        for case in cases.values():
            within = margins(np.array(case.value), limit.permitted) >= -rounding
            if within and not case.failed:
                continue
            value: Said = Number(case.value, scale)
            if math.isnan(case.value):
                value = "failed"
            elif case.failed:  # out of limit, too
                corners = counted(case.failed, "corner")
                value = text(value, " and ", corners, " that failed")
            out.append(say(f"{{}} {{}} ({limit.words})", Name(name), value))
    listing = listed(out, joint="")
    return (
        say("Worst case of the tolerances, out of limit: {}.", listing) if out else ()
    )


def _rounding(limit: Limit, size: float) -> float:
    """Return the distance, SI, from an end of a limit that rounding may cause."""
    return LIMIT_ROUNDING * max(0.0, *map(abs, (*limit.asked, size)))  # NaN is none

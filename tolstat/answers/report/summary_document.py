"""The summary of a run, as it is printed after the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.cells import numbers_of
from tolstat.answers.next_steps import command
from tolstat.answers.report.first_page import (
    CENTRAL,
    is_clipped,
    lead,
    limits_table,
    next_steps,
    of_variance,
    reading,
    rests_on,
    what_next,
)
from tolstat.answers.report.off_centre import findings, rounding
from tolstat.answers.report.report_warnings import in_words
from tolstat.answers.run_answer import responses_in_focus
from tolstat.document import blocks
from tolstat.document.blocks import Cell
from tolstat.document.inline import Name, Number, Parts, Typed, listed, say, text
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.summary import QUANTILES
from tolstat.units.scale import share_words

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import ResponseSummary, RunSummary

STARRED = {"mean": "mean *", "sigma": "sigma *"}  # their assumption stands below
AS_SAMPLED = "As sampled: holds if no rarer kind of trial exists than those seen."
FOR_ANY = "For any distribution instead, as trials are few, or few dominate"
LOW = [share_words(share) for share in QUANTILES if share < 0.5]
HIGH = [share_words(share) for share in QUANTILES if share > 0.5]
MEDIAN, LARGEST_SHARE = share_words(0.5), "main contribution"


def summary_document(found: RunSummary) -> blocks.Document:
    """Return limits, limited responses, worst cases and the next step."""
    title = f"{found.title} ({found.model})"
    if not found.trials.ran:
        return blocks.Document(title, (lead(found), what_next(next_steps(found))))
    own = [*found.limits] or responses_in_focus(found.stored_run)
    others = len(found.responses) - len(own)
    more = f"Other responses: {others}; the report has them."
    report = Typed(command("report", found.stored_run.path))
    steps = next_steps(found) or (text("Write the report: ", report, "."),)
    return blocks.Document(
        title,
        blocks.shown(
            in_words(found.early_warnings),
            lead(found),
            blocks.Bullets(findings(found)),
            limits_table(found),
            responses_table(found, own),
            blocks.note(more) if others else None,
            blocks.paragraph(_worst_cases(found)),
            in_words(found.late_warnings),
            *map(blocks.note, found.trials.notes),
            assumption(found, own) if found.trials.done else None,
            reading(found),
            what_next(steps),
        ),
    )


def responses_table(found: RunSummary, names: Sequence[str] = ()) -> blocks.Table:
    """Return the numbers of responses; of all by default, for a page.

    A screen shows the quantiles on the sides that have limits. Responses without a
    limit that are zero in every trial are left out, and named below.
    """
    zero = [] if names else [n for n, each in found.responses.items() if each.nothing]
    rows: list[dict[str, blocks.Given]] = [
        {
            "response": Name(name),
            "unit": each.scale.mark,
            "nominal": Number(each.nominal, each.scale),
            **{STARRED.get(n, n): x for n, x in numbers_of(each, each.scale).items()},
            LARGEST_SHARE: _largest_share(each) if names else None,
        }
        for name in names or found.responses
        if name not in zero
        for each in [found.responses[name]]
    ]
    ends = [each.limit.permitted for each in found.limits.values()] or [(0.0, 0.0)]
    hidden = ["least", "largest"] + [MEDIAN] * bool(found.limits)
    hidden += LOW if all(lower == -math.inf for lower, _ in ends) else []
    hidden += HIGH if all(upper == math.inf for _, upper in ends) else []
    said = () if names and found.limits else rests_on(found)
    if zero and rows:
        said = say("{}. Zero in every trial: {}.", said, listed([*map(Name, zero)]))
    return blocks.table_of(
        rows, "Responses", page_only=hidden, words=[LARGEST_SHARE],
        caption=said, keys=2, look="dense",
        spare=["nominal", "5 %", "95 %", "0.135 %", "99.865 %", MEDIAN],
    )  # fmt: skip


def assumption(found: RunSummary, names: Sequence[str] = ()) -> blocks.Paragraph:
    """Say what the intervals of mean and sigma assume; of all responses by default."""
    wide = {name: for_any(found.responses[name]) for name in names or found.responses}
    named = "; ".join(f"{n}, {' and '.join(of)}" for n, of in wide.items() if of)
    others = f" {FOR_ANY}: {named}." if named else ""
    return blocks.note(f"* {AS_SAMPLED}{others}")


def for_any(each: ResponseSummary) -> list[str]:
    """Return which of mean and sigma have an interval for any distribution only."""
    both = {
        "mean": (each.mean, each.mean_for_any_distribution),
        "sigma": (each.sigma, each.sigma_for_any_distribution),
    }
    return [name for name, (one, other) in both.items() if one.sure and one == other]


def _largest_share(each: ResponseSummary) -> Cell:
    """Return the largest contribution to the variance, or why none is named."""
    if (most := each.largest_share) is None:
        if (known := each.contributions) is None:
            return Cell(())
        shares = [x for x in known.first_order.values() if x.value != x.value]
        reason = shares[0].reason if shares else "not significant"
        few = known.dominated_by_few
        return Cell((), text("few trials dominate" if few else reason))
    central = CENTRAL if is_clipped(each) else None
    return Cell((Name(most[0]),), text(of_variance(most[1]), central))


def _worst_cases(found: RunSummary) -> Parts:
    """Say where the worst corner of the tolerances is out of limit, or failed."""
    out = []
    for name, limited in found.limits.items():
        scale, limit = found.responses[name].scale, limited.limit
        cases = found.stored_run.worst_cases(name)
        out += [
            say(f"{{}} {{}} ({limit.words})", Name(name),
                "failed" if math.isnan(case.value) else Number(case.value, scale))
            for case in cases.values()
            if not margins(np.array(case.value), limit.permitted)
            >= -rounding(limit, found.responses[name].nominal)
        ]  # fmt: skip
    said = listed(out, joint="")
    return say("Worst case of the tolerances, out of limit: {}.", said) if out else ()

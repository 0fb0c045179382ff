"""The statistical tolerance report as a document."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tolstat.answers.next_steps import command
from tolstat.answers.report.first_page import (
    ALL_LIMITS,
    INTERVAL,
    MOST_LIMITS,
    first_page,
    limits_table,
    reading,
)
from tolstat.answers.report.response_section import response_section
from tolstat.answers.report.summary_document import assumption, responses_table
from tolstat.deviations.dependence import scores_of_rank
from tolstat.document import blocks
from tolstat.document.inline import Number, Parts, Typed, listed, say, text
from tolstat.units.scale import PER_CENT

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import Report
    from tolstat.answers.run_answer import Assumptions, RunAnswer
    from tolstat.answers.sweep.extremes import Extremes

LONGEST = 60  # letters of a title at the foot of a sheet
MOMENTS = (
    "Mean and sigma are of the trials that do not fail. Quantiles count failed trials "
    "as out of limit where the limit has one end. With two ends or none the interval "
    "holds for any value of failed trials."
)
JUDGED = (
    "A limit is met when the whole interval of its yield lies at or above the demanded "
    "yield, and not met when it lies below. Failed trials count as out of limit. If "
    "integration errors can change a verdict, the limit is undecided.",
    "The number of trials that decide does so with a chance of 80 %.",
    "Equivalent Ppk: of a normal response with the same fraction out of limit, half of "
    "it at each end where there are two. 1.00 is 1350 ppm at one end.",
    "Main cause: it differs significantly among out-of-limit trials. Rarer kinds of "
    "trials than those seen may have other causes.",
)


def report_document(found: Report) -> blocks.Document:
    """Return first page, assumptions, summary, responses in focus, provenance."""
    first, rest = first_page(found, found.focus), None
    if len(found.limits) > MOST_LIMITS:  # behind the worst ones
        rest = blocks.Section(ALL_LIMITS, (limits_table(found, found.focus),), "limits")
    return sheet(
        "Statistical tolerance report",
        found,
        (*first, blocks.note(*reading(found).parts)),
        rest,
        assumptions_section(found.assumptions, _assumed(found)),
        _summary(found),
        _numbers(found),
        *(response_section(found, name) for name in found.focus),
        role="first" if rest is None else "",  # else more than one sheet
    )


def sheet(
    what: str,
    found: RunAnswer | Extremes,
    first: tuple[blocks.Block, ...],
    *sections: blocks.Section | None,
    role: str = "first",
) -> blocks.Document:
    """Return a document on a run: title block, first page, sections, provenance.

    A screen shows neither title block nor provenance.
    """
    block, given, title = found.title_block, found.provenance, found.title
    rows = [(name, text(value)) for name, value in block._asdict().items() if value]
    if not block.approval:
        rows.append(("approval, date", ()))
    signed = blocks.Section("", (blocks.Facts(tuple(rows), "sheet"),), page_only=True)
    source = str(given["source_digest"])[:12]
    seed = f"seed {given['seed']}, " if "seed" in given else ""
    made_by = f"{seed}tolstat {given['version_tolstat']}, {source}"
    head = what, f"model {found.model}", found.run, made_by, str(given["started_at"])
    known = {name.replace("_", " "): text(str(each)) for name, each in given.items()}
    del known["study"]
    study = blocks.Verbatim(str(given["study"]))
    text_of_study = blocks.Section("The study", (study,), level=3)
    made = (blocks.Facts(tuple(known.items())), text_of_study)
    shown = blocks.shown(
        blocks.Section("", (signed, blocks.note(" · ".join(head)), *first), role=role),
        *sections,
        blocks.Section("Provenance", made, "provenance", page_only=True),
    )
    short = title[:LONGEST] + "..." * (len(title) > LONGEST)
    foot = (block.drawing, block.revision, short, found.run)
    return blocks.Document(title, shown, foot)


def assumptions_section(given: Assumptions, said: list[Parts]) -> blocks.Section:
    """Return the assumptions: distributions, tolerances, and some sentences."""
    rows: list[dict[str, blocks.Given]] = [
        {
            "contributor": name,
            "distribution": each.words,
            "tolerance": say(
                "{} to {}",
                each.scale.number(each.lower),
                Number(each.upper, each.scale),
            ),
            "": each.sentence,
        }
        for name, each in given.deviations.items()
    ]
    table = blocks.table_of(rows, words=["distribution", ""])
    return blocks.Section(
        "Tolerances and assumptions",
        blocks.shown(table, blocks.Bullets(tuple(said))),
        "assumptions",
        page_only=True,
    )


def _assumed(found: Report) -> list[Parts]:
    given, trials = found.assumptions, found.trials
    others = len(given.deviations) < len(found.stored_run.contributors)
    said = [
        text("All other contributors have no deviation." if others else None),
        text("A normal deviation has three sigma in half its tolerance (Cp 1), unless "
             "the study says otherwise. Yields depend on it."),
        _correlation(found),
        text(f"Sampling: {trials.sampling}; {trials.promise}."),
    ]  # fmt: skip
    if given.settings:
        chosen = [
            f"{n} {each.words}" for n, each in given.settings.items() if each.given
        ]
        show = Typed(command("show", found.model, machine=found.stored_run.machine))
        others = len(chosen) < len(given.settings)
        said.append(
            text(f"Settings of the study: {', '.join(chosen) or 'none'}.",
                 (" All others have their default: ", show, ".") if others else None)
        )  # fmt: skip
    said += map(text, given.of_the_model)
    said += _judged(found)
    if given.missing:
        said.append(
            text(f"No slopes, worst cases or halved tolerances: {given.missing}.")
        )
    return list(filter(None, said))


def _correlation(found: Report) -> Parts:
    pairs = [
        f"{a} with {b} {rank:.6g} ({scores_of_rank(rank):.3g})"
        for a, others in found.assumptions.correlation.items()
        for b, rank in others.items()
    ]
    if pairs:
        return say(
            "Rank correlations (Gaussian copula), in brackets Pearson's of normal "
            "deviations: {}.",
            listed(pairs),
        )
    if found.stored_run.independent:
        return text("Deviations are independent.")
    return text("Deviations are independent, except parts of one batch named above.")


def _judged(found: Report) -> list[Parts]:
    """Return sentences on how limits are judged."""
    if found.all_limits is None:
        return []
    rule, *others = map(text, JUDGED)
    if (sampled := found.stored_run.sampled) and sampled.replicates:
        chance = text(
            "Intervals are approximate, from the scatter between replicates. A verdict "
            "holds for a number of trials chosen beforehand."
        )
    else:
        wrongly = Number(found.all_limits.wrongly_met, PER_CENT, "at_most")
        chance = say(
            'Each verdict is wrongly "met" with a chance of at most 2.5 %, one or more '
            "of all with at most {}. Verdicts are anytime-valid: trials may be added "
            "until they fall.", wrongly,
        )  # fmt: skip
    return [rule, chance, *others]


def _summary(found: Report) -> blocks.Section:
    failed, done = found.trials.failed, found.trials.done
    one_in = math.floor(1 / found.trials.unseen)
    of = "of those that do not fail " if failed else ""
    outside = (
        f" Least and largest are those of the trials: at most 1 in {one_in} units {of}"
        "lies outside (95 %)."
    )
    shown = blocks.shown(
        responses_table(found),
        blocks.note(
            f"{INTERVAL}, or why there is none.{outside if one_in > 1 else ''}"
        ),
        assumption(found) if done else None,
        blocks.note(MOMENTS) if failed and done else None,
    )
    return blocks.Section("Summary", shown, "summary")


def _numbers(found: Report) -> blocks.Section | None:
    rows: list[dict[str, blocks.Given]] = [
        {
            "number": name,
            "value": Number(each.value, each.scale),
            "unit": each.scale.mark,
            "": "; ".join(filter(None, (each.sentence, each.caveat))),
        }
        for name, each in found.numbers.items()
    ]
    said = "From settings and tolerances alone: equal for all trials, no interval."
    table = blocks.table_of(rows, words=[""])
    shown = (table, blocks.note(said))
    return blocks.Section("Numbers of the study", shown, "numbers") if rows else None

"""The statistical tolerance report as a document."""

import math
from collections.abc import Mapping
from dataclasses import replace

from tolstat.answers.next_steps import command
from tolstat.answers.parts.parts_section import ALL_PARTS, parts_section, parts_table
from tolstat.answers.report.case_results import cases_section
from tolstat.answers.report.chain_section import is_chain, links_table, three_ways
from tolstat.answers.report.first_page import (
    ALL_LIMITS,
    INTERVAL,
    MOST_NOTES,
    first_page,
    limits_table,
    most_limits,
    performance,
    ranges_section,
)
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.looks_figure import narrowing
from tolstat.answers.report.opening import deciding, opening, sketches_of
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.report.response_section import response_section
from tolstat.answers.report.summary_document import assumption, responses_table
from tolstat.answers.run_answer import AboutRun
from tolstat.deviations.dependence import scores_of_rank
from tolstat.document import blocks
from tolstat.document.inline import Number, Parts
from tolstat.document.sentences import listed, say, text
from tolstat.model.setting_kinds import NO_ROWS
from tolstat.units.scale import PER_CENT

MOST_DIMENSIONS = 6  # on the first page
LONGEST = 60  # letters of a title at the foot of a sheet
MOMENTS = (
    "Mean and sigma are of the trials that do not fail. Quantiles count failed trials "
    "as out of limit where the limit has one end. With two ends or none the interval "
    "holds for any value of failed trials."
)
AS_DEVIATIONS = "Numbers are deviations from the nominal."
TAILS = (
    " A fraction of 1 ppm depends on the tails of the distributions as much as on the "
    "model."
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


def report_document(report: Report, *, whole: bool = False) -> blocks.Document:
    """Return first page, assumptions, summary, responses in focus, provenance.

    Of many contributors tables have the first ones, unless they are `whole`.
    """
    sketches, drawing = sketches_of(report), _drawing(report)
    first = first_page(
        report, report.focus, opening(report),
        sketches if len(sketches) > 1 else {}, drawing,
    )  # fmt: skip
    page_1 = {
        (figure.alt, figure.picture.height) for figure in blocks.figures_in(*first)
    }
    return sheet(
        "Statistical tolerance report",
        report,
        (*first, blocks.note(f"{INTERVAL}.")),
        _limits(report, sketches, crowded=len(report.limits) > most_limits(drawing)),
        assumptions_section(report),
        _measured_parts(report),
        cases_section(report),
        _summary(report),
        _numbers(report),
        *(
            response_section(
                report, name, page_1 if name == deciding(report) else (), whole=whole
            )
            for name in report.focus
        ),
    )


def _drawing(report: Report) -> tuple[blocks.Block, ...]:
    """Return three ways to judge the chain that decides, and its links if few."""
    name = deciding(report)
    if not is_chain(report.stored_run, name) or not report.trials.done:
        return ()
    links = links_table(report, name, brief=True)
    few = (links,) if len(links.rows) <= MOST_DIMENSIONS else ()
    ways = three_ways(report, name)
    medians = (column.head for column in ways.columns if column.head.startswith("50 %"))
    return replace(ways.without(*medians), look="dense"), *few


def _limits(
    report: Report, sketches: Mapping[str, blocks.Sketch], *, crowded: bool
) -> blocks.Section:
    """Return all limits where the first page has the worst, and what is permitted."""
    table = limits_table(report, report.focus, sketches=sketches) if crowded else None
    return blocks.section(
        ALL_LIMITS,
        table,
        ranges_section(report),
        performance(report),
        narrowing(report),
        *(map(blocks.note, report.trials.notes[MOST_NOTES:]) if crowded else ()),
        anchor="limits",
    )


def sheet(
    kind: str,
    answer: AboutRun,
    first: tuple[blocks.Block, ...],
    *sections: blocks.Section | None,
    role: str = "first",
) -> blocks.Document:
    """Return a document on a run: title block, first page, sections, provenance.

    A screen shows neither title block nor provenance.
    """
    block, provenance, title = answer.title_block, answer.provenance, answer.title
    rows = [(name, text(value)) for name, value in block._asdict().items() if value]
    if not block.approval:
        rows.append(("approval, date", ()))
    signed = blocks.section("", blocks.Facts(tuple(rows), "sheet"), page_only=True)
    source = str(provenance["source_digest"])[:12]
    seed = f"seed {provenance['seed']}, " if "seed" in provenance else ""
    made_by = f"{seed}tolstat {provenance['version_tolstat']}, {source}"
    started = str(provenance["started_at"])[:16].replace("T", " ")
    head = kind, f"model {answer.model}", answer.run, made_by, started
    facts = {n.replace("_", " "): text(str(x)) for n, x in provenance.items()}
    del facts["study"]
    study = blocks.Verbatim(str(provenance["study"]))
    parts = blocks.shown(
        blocks.section("", signed, blocks.note(" · ".join(head)), *first, role=role),
        *sections,
        blocks.section(
            "Provenance", blocks.Facts(tuple(facts.items())),
            blocks.section("The study", study),
            anchor="provenance", page_only=True,
        ),
    )  # fmt: skip
    short = title[:LONGEST] + "..." * (len(title) > LONGEST)
    foot = (block.drawing, block.revision, short, answer.run)
    return blocks.Document(title, parts, foot)


def assumptions_section(summary: RunSummary) -> blocks.Section:
    """Return the assumptions: distributions, tolerances, and what else holds."""
    rows: list[dict[str, blocks.Given]] = [
        {
            "contributor": name,
            "distribution": part.words,
            "tolerance": say("{} to {}", part.scale.number(part.lower),
                             Number(part.upper, part.scale)),
            "": part.sentence,
        }
        for name, part in summary.assumptions.deviations.items()
    ]  # fmt: skip
    return blocks.section(
        "Tolerances and assumptions",
        blocks.table_of(rows, words=["distribution", ""]),
        blocks.Bullets(tuple(_assumed(summary))),
        anchor="assumptions", page_only=True,
    )  # fmt: skip


def _assumed(summary: RunSummary) -> list[Parts]:
    assumptions, trials = summary.assumptions, summary.trials
    run = summary.stored_run
    others = len(assumptions.deviations) < len(run.contributors)
    sentences = [
        text("All other contributors have no deviation." if others else None),
        text("A normal deviation has three sigma in half its tolerance (Cp 1), unless "
             "the study says otherwise. Yields depend on it."),
        _correlation(summary),
        text(f"Sampling: {trials.sampling}; {trials.promise}.",
             TAILS if run.aim else None),
    ]  # fmt: skip
    if settings := assumptions.settings:
        chosen = [f"{n} {x.words}" for n, x in settings.items() if x.given]
        show = command("show", summary.model, machine=run.machine)
        others = any(not x.given and x.words != NO_ROWS for x in settings.values())
        sentences.append(
            text(f"Settings of the study: {', '.join(chosen) or 'none'}.",
                 (" All others have their default: ", show, ".") if others else None)
        )  # fmt: skip
    sentences += map(text, assumptions.of_the_model)
    sentences += [] if run.aim else _judged(summary)
    if missing := assumptions.missing:
        none = f"No slopes, worst cases or halved tolerances: {missing}."
        sentences.append(text(none))
    return list(filter(None, sentences))


def _measured_parts(report: Report) -> blocks.Section:
    """Return the measured parts against the tolerance of their drawing."""
    parts = report.measured_parts
    return blocks.section(
        "Measured parts",
        parts_table(parts.items()),
        blocks.note(f"{AS_DEVIATIONS} {ALL_PARTS}") if parts else None,
        *(parts_section(name, part) for name, part in parts.items()),
        anchor="measured-parts", page_only=True,
    )  # fmt: skip


def _correlation(summary: RunSummary) -> Parts:
    pairs = [
        f"{a} with {b} {rank:.6g} ({scores_of_rank(rank):.3g})"
        for a, others in summary.assumptions.correlation.items()
        for b, rank in others.items()
    ]
    if pairs:
        return say(
            "Rank correlations (Gaussian copula), in brackets Pearson's of normal "
            "deviations: {}.",
            listed(pairs),
        )
    if summary.stored_run.independent:
        return text("Deviations are independent.")
    return text("Deviations are independent, except parts of one batch named above.")


def _judged(summary: RunSummary) -> list[Parts]:
    """Return sentences on how limits are judged."""
    if summary.all_limits is None:
        return []
    rule, *others = map(text, JUDGED)
    if (sampled := summary.stored_run.sampled) and sampled.replicates:
        chance = text(
            "Intervals are approximate, from the scatter between replicates. A verdict "
            "holds for a number of trials chosen beforehand."
        )
    else:
        wrongly = Number(summary.all_limits.wrongly_met, PER_CENT, "at_most")
        chance = say(
            'Each verdict is wrongly "met" with a chance of at most 2.5 %, one or more '
            "of all with at most {}. Verdicts are anytime-valid: trials may be added "
            "until they fall.", wrongly,
        )  # fmt: skip
    return [rule, chance, *others]


def _summary(report: Report) -> blocks.Section:
    failed, done = report.trials.failed, report.trials.done
    one_in = math.floor(1 / report.trials.unseen)
    which = "of those that do not fail " if failed else ""
    outside = (
        f" Least and largest are those of the trials: at most 1 in {one_in} units "
        f"{which}lies outside (95 %)."
    )
    intervals = f"{INTERVAL}, or why there is none.{outside if one_in > 1 else ''}"
    return blocks.section(
        "Summary",
        responses_table(report),
        blocks.note(intervals),
        assumption(report) if done else None,
        blocks.note(MOMENTS) if failed and done else None,
        anchor="summary",
    )


def _numbers(report: Report) -> blocks.Section:
    rows: list[dict[str, blocks.Given]] = [
        {
            "number": name,
            "value": Number(number.value, number.scale),
            "unit": number.scale.mark,
            "": "; ".join(filter(None, (number.sentence, number.caveat))),
        }
        for name, number in report.numbers.items()
    ]
    sources = "settings and tolerances alone"
    if report.stored_run.measured:
        sources = "settings, tolerances and measured parts"
    equal = f"From {sources}: equal for all trials, no interval."
    table = blocks.table_of(rows, words=[""])
    note = blocks.note(equal) if rows else None
    return blocks.section("Numbers of the study", table, note, anchor="numbers")

"""The first page: which limits are met, in a table, main causes, next steps."""

from collections import Counter
from collections.abc import Collection, Mapping
from types import MappingProxyType

from tolstat.answers.cells import indices_words, limit_row
from tolstat.answers.report.finding_words import in_words, next_steps, what_next
from tolstat.answers.report.report_answer import (
    LimitFinding,
    NoCause,
    RunSummary,
    UnseenErrors,
)
from tolstat.answers.report.response_summary import Causes, ResponseSummary
from tolstat.answers.run_answer import NOT_DECIDED
from tolstat.deviations.names import IN_CASE
from tolstat.document import blocks
from tolstat.document.blocks import Cell, Sketch
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text
from tolstat.model.case_changes import changes_of, condition_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.statistics.sensitivity.pairs import Together
from tolstat.units.scale import PART, PER_CENT, PPM

MOST_LIMITS = 6  # in the table of a first page: on paper it is one sheet
MOST_NOTES = 1  # below so many limits: how many trials failed
MOST_ABOVE_DIMENSIONS = 3  # where the dimensions of a chain stand there, too
PICTURE = "Fraction out of limit against what is permitted"
ALL_LIMITS = "All limits"
CASES = "cases"  # of a study
IN_TILES = ("limit", "verdict", "out of limit, ppm", "equivalent Ppk")
LEAST_LEVEL = 1e-6  # smaller ones say no more
ALL = 0.9995  # of a share, which has three figures
INTERVAL = "Each number has its 95 % interval below it"
CENTRAL = " of the central 99 %"  # of the trials: others are clipped
READING = (
    "Quantiles: order statistics, for any distribution. Fractions out of limit: "
    "anytime-valid, trials may be added. Equivalent Ppk: of a normal response with the "
    "same fraction out of limit."
)
RANDOM_TRIALS = "causes are named for random trials only"


def first_page(
    summary: RunSummary,
    links: Collection[str] = (),
    opening: Collection[blocks.Block] = (),
    sketches: Mapping[str, Sketch] = MappingProxyType({}),
    drawing: Collection[blocks.Block] = (),
) -> tuple[blocks.Block, ...]:
    """Return the blocks of the first page, title block and header left out.

    Names of responses in `links`, of a report, lead to their sections. Its first page
    has the worst of many limits.

    Parameters
    ----------
    opening, drawing : collection of Block
        Tiles and pictures above the limits, and dimensions below the next steps.
    sketches : mapping of str to Sketch
        Small histograms for the table of limits.
    """
    most = most_limits(drawing) if links else len(summary.limits)
    table = limits_table(summary, links, most, sketches)
    notes = summary.trials.notes if summary.trials.ran else ()
    if len(summary.limits) > most:  # the others stand behind, with all limits
        notes = notes[:MOST_NOTES]
    if opening and len(table.rows) == 1:
        table = table.without(*IN_TILES)
    return blocks.shown(
        in_words(summary.early_warnings),
        lead(summary),
        *opening,
        table,
        what_next(next_steps(summary)),
        in_words(summary.late_warnings),
        *drawing,
        *map(blocks.note, notes),
    )


def most_limits(drawing: Collection[blocks.Block]) -> int:
    """Return how many limits a first page has, above dimensions of the drawing."""
    return MOST_ABOVE_DIMENSIONS if drawing else MOST_LIMITS


def lead(summary: RunSummary) -> blocks.Paragraph:
    """Say how many limits are met, and the yield of all of them."""
    return blocks.Paragraph(_lead(summary), "lead")


def _lead(summary: RunSummary) -> Parts:
    if not summary.trials.ran:
        return text("No trial has run.")
    if summary.all_limits is None:
        return text("The study limits no response.")
    verdicts = [limited.yields for limited in summary.limits.values()]
    tones = {yields.words: yields.verdict for yields in verdicts}
    counts = Counter(yields.words for yields in verdicts)
    (words, first), *others = counts.items()
    n, trials = counts.total(), summary.trials.done + summary.trials.failed
    subject = "The limit is" if n == 1 else f"All {n} limits are"
    if first < n:
        subject = f"{first} of {n} limits {'is' if first == 1 else 'are'}"
    verdict = Word(words, tones[words])
    if words == NOT_MET and 1 < first == n:
        subject, verdict = f"None of {n} limits is", Word(MET, NOT_MET)
    counted = [text(f"{subject} ", verdict)]
    counted += [text(f"{count} ", Word(word, tones[word])) for word, count in others]
    ran, requested = summary.trials.ran, summary.trials.requested
    so_far = f" So far {ran} of {requested} trials have run." if ran < requested else ""
    if summary.stored_run.deciding:
        so_far = f" So far {ran} trials have run; {NOT_DECIDED}."
    return say(
        f"{{}}. Yield, {'all limits' if n > 1 else 'this limit'}: {{}}.{{}}{{}}",
        listed(counted, joint=""),
        Number(summary.all_limits.within, PER_CENT, of=trials),
        " Failed trials count as out of limit." if summary.trials.failed else None,
        so_far or None,
    )  # fmt: skip


def ranges_section(summary: RunSummary) -> blocks.Section:
    """Draw fractions out of limit, with intervals, against what is permitted."""
    ranges = [
        blocks.Range(
            name,
            limited.yields.fraction_out_of_limit,
            1 - limited.limit.demanded,
            limited.yields.verdict,
        )
        for name, limited in summary.limits.items()
    ]
    shares = ", ".join(f"{r.name} {PPM.interval(*r.found[:3])[0]}" for r in ranges)
    words = f"Fractions out of limit in ppm: {shares}"
    picture = blocks.Ranges(words, tuple(ranges), PPM, "permitted")
    return blocks.section(PICTURE, picture, page_only=True)


def limits_table(
    summary: RunSummary,
    links: Collection[str] = (),
    most: int | None = None,
    sketches: Mapping[str, Sketch] = MappingProxyType({}),
) -> blocks.Table:
    """Return verdict, fraction out of limit, main cause and what would help.

    Of all limits, or of the worst ones. Names in `links` lead to their sections;
    `sketches` are small histograms.
    """
    rows = list[dict[str, blocks.Given]]()
    limits = list(summary.limits.items())
    trials = summary.trials.done + summary.trials.failed
    cases = summary.stored_run.study.table.get(CASES, {}) if links else {}
    changes = changes_of(cases) if cases else {}
    for name, limited in limits[:most]:
        response, finding = summary.responses[name], summary.findings.limits[name]
        link, sentence = Name(name, name if name in links else ""), response.sentence
        condition = condition_words(changes.get(name.rpartition(IN_CASE)[2], {}))
        if condition:  # in sight on paper and on a phone, where sentences are hidden
            sentence = sentence.removesuffix(condition).removesuffix(", ")
        cells = limit_row(limited, trials, summary.trials.failed, summary.stopped)
        limit = blocks.cell_of(cells["limit"])
        rows.append({
            "response": Cell(
                text(link, f", {condition}" if condition else None), text(sentence)
            ),
            **cells,
            "limit": limit._replace(sketch=sketches.get(name)),
            "main cause": _cause_cell(response, finding),
            "what would help": _help_cell(summary, name),
        })  # fmt: skip
    _say_once(rows, "what would help")
    caption = rests_on(summary)
    if unseen := summary.unseen_errors:
        caption = say("{}; {}", caption, _unseen_words(unseen))
    if any(is_clipped(summary.responses[name]) for name, _ in limits[:most]):
        caption = say("{}; variance: {}", caption, CENTRAL.strip())
    if len(rows) < len(limits):
        first = f"The {len(rows)} worst of {len(limits)} limits; behind: "
        caption = say("{}{}. {}", first, Name(ALL_LIMITS, "limits"), caption)
    return blocks.table_of(
        rows, "Limits", words=("main cause", "what would help"), caption=caption,
        look="verdicts", spare=["what would help", "equivalent Ppk"],
    )  # fmt: skip


def _say_once(rows: list[dict[str, blocks.Given]], head: str) -> None:
    """Shorten cells whose words are those of the row above."""
    cells = [blocks.cell_of(row[head]) for row in rows]
    for above, cell, row in zip(cells, cells[1:], rows[1:], strict=False):
        if cell.main and cell.main == above.main:
            row[head] = cell._replace(main=text("the same"))


def performance(summary: RunSummary) -> blocks.Paragraph | None:
    """Say Ppk by moments and by percentiles of the first limits, where they hold."""
    sentences = [
        say("{} {}", Name(name), words)
        for name in [*summary.limits][:MOST_LIMITS]
        if (words := indices_words(summary.responses[name]))
    ]
    if not sentences:
        return None
    return blocks.note(
        say(
            "Beside the equivalent Ppk, by moments of a normal response and by "
            "percentiles of any (ISO 22514-2): {}.",
            listed(sentences, ""),
        )
    )


def _unseen_words(errors: UnseenErrors) -> str:
    most = PER_CENT.at_most(errors.share.upper)
    return (
        f"{errors.evaluated} random trials evaluated again, {errors.moved or 'none'} "
        f"moved: up to {most} % of all may"
    )


def _cause_cell(response: ResponseSummary, finding: LimitFinding) -> Cell:
    """Return the main cause of out-of-limit trials, above the trials it explains.

    Without a cause, the largest variance contribution stands below.
    """
    if (causes := response.causes) is None:
        return Cell(())
    if main := causes.main:
        level = max(main.level, LEAST_LEVEL)
        below = text("significant at ", Number(level, PART))
        if main.together:
            below = explained(main.together, causes)
        return Cell(text(main.words), text(below, also(causes)))
    variance: Parts = ()
    if finding.largest_contribution and response.largest_share:
        name, share = response.largest_share
        variance = say("variance: {} {}", Name(name), of_variance(share))
    return Cell(text(no_cause(finding)), variance)


def _help_cell(summary: RunSummary, response: str) -> Cell:
    """Return what to measure or to change; a limit that is met needs nothing."""
    findings = summary.findings
    limit, remedy = findings.limits[response], findings.remedy
    if limit.measured:
        from tolstat.answers.measured_words import to_measure  # seldom used

        return Cell(to_measure(limit.measured))
    if remedy is None or limit.verdict == MET:
        return Cell(())
    from tolstat.answers.remedy.remedy_words import remedy_cell  # seldom used

    return remedy_cell(summary.stored_run, remedy, response)


def of_variance(share: Estimate) -> Parts:
    """Write a variance contribution; of an open interval the lower end."""
    return at_least(share) if share.upper == 1 else text(Number(share, PART))


def is_clipped(response: ResponseSummary) -> bool:
    """Whether its variance contributions are of the central trials alone."""
    return response.contributions is not None and response.contributions.clipped


def at_least(share: Estimate) -> Parts:
    """Write the lower end of a share."""
    if share.lower >= ALL:
        return text("nearly all")
    return text("at least ", Number(max(share.lower, 0.0), PER_CENT, "at_least"))


def explained(together: Together, causes: Causes) -> Parts:
    """Say how many out-of-limit trials a pair explains, and how rare it is."""
    n = causes.trials_out_of_limit
    trials = f"{round(together.far.value * n)} of {n} out-of-limit trials"
    return say(f"{trials} in its outer {{}}", Number(together.of_all, PART))


def also(causes: Causes) -> str:
    """Name the other causes after the main one."""
    main, *others = causes.named
    new = [cause.words for cause in others if not {*cause.members} & {*main.members}]
    return f"; also {'; '.join(new)}" if new else ""


def no_cause(finding: LimitFinding) -> str:
    """Say why no cause is named, and how many trials would tell of a limit not met."""
    if finding.no_cause == NoCause.RANDOM_ONLY:
        return RANDOM_TRIALS
    if finding.measured:
        from tolstat.answers.measured_words import few_entries  # seldom used

        return f"{finding.no_cause} ({', '.join(few_entries(finding.measured))})"
    tell = f"; about {finding.trials_that_tell} trials would tell"
    return f"{finding.no_cause}{tell if finding.trials_that_tell else ''}"


def rests_on(summary: RunSummary) -> Parts:
    """Say how many trials the numbers of a table rest on."""
    trials = summary.trials
    if summary.stored_run.aim:
        return text(counted(trials.counted, "weighted trial"), " of the last stage")
    part: Parts = ()
    if trials.counted < trials.ran:
        part = say(", of the {} that statistics rest on", Number(trials.counted))
    return say("{} done, {} failed{}", counted(trials.done, "trial"),
               Number(trials.failed), part)  # fmt: skip


def reading(summary: RunSummary) -> blocks.Paragraph:
    """Explain the numbers."""
    sampled = summary.stored_run.sampled
    promise = f"{sampled.promise}." if sampled and sampled.replicates else READING
    return blocks.paragraph(f"{INTERVAL}. {promise}")

"""The document about a rare run."""

from tolstat.answers.cells import ppm
from tolstat.answers.next_steps import to_replay
from tolstat.answers.rare.rare_answer import FailurePoint, RareSummary
from tolstat.answers.rare.rare_figures import rare_pictures
from tolstat.answers.report.finding_words import in_words, next_steps
from tolstat.answers.report.first_page import INTERVAL, limits_table, ranges_section
from tolstat.answers.report.report_document import assumptions_section, sheet
from tolstat.answers.report.summary_document import assumption, responses_table
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.limits.yields import MET
from tolstat.units.scale import PART, PER_CENT, PPM

STAGES = (
    "The first stage has a greater spread, to find out-of-limit trials of any kind. "
    "The search approaches the limit step by step (subset simulation). It moves "
    "out-of-limit trials towards the median deviations, where they are more probable, "
    "and samples about the points reached. The last stage gives the fraction."
)
FIRST_ORDER = (
    "The out-of-limit trials nearest to the median deviations, in normal scores. A "
    "straight limit at the distance of the first would have {} out of limit at this "
    "end. Nearer trials that were not met, and another end of the limit, would add to "
    "it."
)


def rare_document(summary: RareSummary) -> blocks.Document:
    """Return verdict, failure points, stages, assumptions, provenance."""
    ran, requested = summary.trials.ran, summary.trials.requested
    return sheet(
        f"Rare events, {ran} of {requested} trials have run",
        summary,
        _verdict(summary),
        _failure_points(summary),
        _stages(summary),
        _responses(summary),
        assumptions_section(summary),
    )


def _verdict(summary: RareSummary) -> tuple[blocks.Block, ...]:
    aim, trials = summary.response, summary.trials
    sentences = [*next_steps(summary)]
    if trials.counted:
        sentences.append(_unmet_kinds(summary))
    sentences += [_yield(summary), _most_probable(summary)]
    if summary.plain_trials == summary.plain_trials:
        needed = Number(summary.plain_trials)
        plain = "A plain run would need about {} trials for as narrow an interval."
        sentences.append(say(plain, needed))
    notes = [
        say(
            f"{INTERVAL}. The last stage gives the fraction: {{}} "
            f"({summary.trials_out_of_limit} out of limit), each weighted by the ratio "
            "of densities. Failed trials count as out of limit.",
            counted(trials.counted, "independent trial"),
        ),
        *map(text, trials.notes),
    ]  # fmt: skip
    if others := [name for name in summary.limits if name != aim]:
        words = (
            f"Only the limit of {aim} was searched. Few trials tell of "
            f"{', '.join(others)}; a run of its own tells more."
        )
        notes.append(text(words))
    lead = say("The limit is {}. Out of limit: {}.",
               Word(summary.words, summary.verdict),
               ppm(summary.fraction_out_of_limit))  # fmt: skip
    return blocks.shown(
        in_words(summary.warnings),
        blocks.Paragraph(lead, "lead"),
        rare_pictures(summary),
        limits_table(summary),
        ranges_section(summary),
        *map(blocks.paragraph, sentences),
        *map(blocks.note, notes),
    )


def _unmet_kinds(summary: RareSummary) -> Parts:
    """Say what interval and verdict hold for, and what they leave out."""
    return say(
        "Interval and verdict hold for the kinds of out-of-limit trials that the last "
        "stage met. A kind that it never met may make up to {}{}.",
        Number(summary.trials.unseen, PPM, "at_most"),
        ", more than the limit permits: another seed or a plain run can find it"
        if summary.reason and summary.verdict == MET else None,
    )  # fmt: skip


def _yield(summary: RareSummary) -> Parts:
    """Return the yield, if its digits are below 100 %."""
    share = summary.within
    if not share.sure:
        return ()
    lower, upper = (float(x) for x in PER_CENT.interval(*share[:3])[1:])
    if lower < upper and (upper < 100 or share.upper == 1):
        return say("Yield: {}.", Number(share, PER_CENT))
    return ()


def _most_probable(summary: RareSummary) -> Parts:
    """Return a sentence on the most probable failure point."""
    if not summary.failure_points or not (point := summary.failure_points[0]).leading:
        return ()
    scales = summary.stored_run.scales
    parts = [
        say("{} {} ({})", Name(name), Number(point.deviations[name], scales[name]),
            _how_far(point, name))
        for name in point.leading
    ]  # fmt: skip
    rest = ", others less than half as far out"
    return say(
        "Most probable failure point that was met: {}{}: "
        f"trial {point.trial}, {{}} sigmas from the median of all deviations.",
        listed(parts), rest if len(point.leading) < len(point.scores) else None,
        Number(point.distance),
    )  # fmt: skip


def _how_far(point: FailurePoint, name: str) -> Parts:
    """Return how far out a part lies, in sigmas if normal."""
    if point.normal(name):
        sign = "+" * (point.off[name] > 0)
        return text(sign, Number(point.off[name]), " sigmas")
    return say("{} of such parts lie farther out", Number(point.farther[name], PART))


def _failure_points(summary: RareSummary) -> blocks.Section | None:
    if not summary.failure_points:
        return None
    again, scale, run = "to see it again", summary.scale, summary.stored_run
    rows: list[dict[str, blocks.Given]] = []
    for point in summary.failure_points:
        failed = point.value != point.value
        rows.append({
            "trial": Number(point.trial),
            scale.label(summary.response): "failed" if failed
            else Number(point.value, scale),
            "sigmas off": Number(point.distance),
            **{
                run.scales[name].label(name): Number(deviation, run.scales[name])
                for name, deviation in point.deviations.items()
            },
            again: to_replay(run.path, point.trial, run.machine),
        })  # fmt: skip
    note = blocks.note(say(FIRST_ORDER, Number(summary.first_order, PPM)))
    table = blocks.table_of(rows, words=[again], look="dense")
    return blocks.section("Most probable failure points", table, note, page_only=True)


def _responses(summary: RareSummary) -> blocks.Section:
    """Return the numbers of all responses, from the weighted trials."""
    note = blocks.note("All numbers are of the last stage, each trial weighted.")
    return blocks.section(
        "Summary", responses_table(summary), note, assumption(summary),
        anchor="summary", page_only=True,
    )  # fmt: skip


def _stages(summary: RareSummary) -> blocks.Section:
    rows: list[dict[str, blocks.Given]] = []
    for stage in summary.stages:
        numbers = f"{stage.first} to {stage.last}"
        upto = (" to ", Number(stage.largest)) if stage.least != stage.largest else None
        rows.append({
            "stages": numbers if stage.last > stage.first else f"{stage.first}",
            "for": stage.purpose,
            "times the spread": text(Number(stage.least), upto),
            "trials": Number(stage.trials),
            "out of limit": Number(stage.trials_out_of_limit),
            "of these failed": Number(stage.failed),
        })  # fmt: skip
    changed = blocks.note(
        f"Of {summary.precise} trials evaluated again more precisely {summary.changed} "
        "change sides of the limit."
    )
    return blocks.section("Stages", blocks.table_of(rows), blocks.note(STAGES),
                          changed if summary.precise else None)  # fmt: skip

"""The first page: which limits are met, main causes, next steps."""

from collections import Counter
from collections.abc import Collection

from tolstat.answers.report.finding_words import (
    in_words,
    next_steps,
    off_centre_words,
    what_next,
)
from tolstat.answers.report.limits_table import limits_table
from tolstat.answers.report.report_answer import RunSummary
from tolstat.document import blocks
from tolstat.document.inline import Number, Parts, Word, listed, say, text
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.units.scale import PER_CENT, PPM

MOST_LIMITS = 6  # in the table of a first page: on paper it is one sheet
PICTURE = "Fraction out of limit against what is permitted"


def first_page(
    summary: RunSummary, links: Collection[str] = ()
) -> tuple[blocks.Block, ...]:
    """Return the blocks of the first page, title block and header left out.

    Names of responses in `links`, of a report, lead to their sections. Its first page
    has the worst of many limits.
    """
    steps = what_next(next_steps(summary))
    many = links and len(summary.limits) > MOST_LIMITS
    ranges = blocks.shown(ranges_of(summary))
    picture = blocks.Section(PICTURE, ranges, level=3, page_only=True)
    return blocks.shown(
        in_words(summary.early_warnings),
        lead(summary),
        blocks.Bullets(off_centre_words(summary)),
        limits_table(summary, links, MOST_LIMITS if many else None),
        *((steps, picture) if many else (picture, steps)),
        in_words(summary.late_warnings),
        *map(blocks.note, summary.trials.notes if summary.trials.ran else ()),
    )


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
    return say(
        f"{{}}. Yield, {'all limits' if n > 1 else 'this limit'}: {{}}.{{}}{{}}",
        listed(counted, joint=""),
        Number(summary.all_limits.within, PER_CENT, of=trials),
        " Failed trials count as out of limit." if summary.trials.failed else None,
        f" So far {ran} of {requested} trials have run." if ran < requested else None,
    )  # fmt: skip


def ranges_of(summary: RunSummary) -> blocks.Ranges:
    """Return fractions out of limit, with intervals, against what is permitted."""
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
    return blocks.Ranges(words, tuple(ranges), PPM, "permitted")

"""A remedy in words."""

from tolstat.answers.cells import ppm, tolerance_words
from tolstat.answers.remedy.remedy_finding import (
    EntryChange,
    Evidence,
    RemedyFinding,
    RemedyStep,
    Unavoidable,
)
from tolstat.document.blocks import Cell
from tolstat.document.inline import Name, Number, Parts
from tolstat.document.sentences import listed, say, text
from tolstat.literal import some_of
from tolstat.store.stored_run import Run
from tolstat.units.scale import KNOWN, PER_CENT, figures

MOST_STEPS = 2  # that have sentences of their own: a first page is one sheet
MOST_IN_CELL = 3  # changes that a cell of a table names
NOT_BY_FREE = "no change of free dimensions"
NONE_MEETS = "no change is known to meet all limits"
MISSED = "No change is known to meet all limits; the best one found misses them. "


def remedy_words(run: Run, remedy: RemedyFinding) -> tuple[Parts, ...]:
    """Say what to change, a sentence each step; or why nothing helps."""
    if remedy.unavoidable:
        return (_unavoidable(run, remedy.unavoidable, remedy.trials),)
    note = f" Not proved: {remedy.note}." if remedy.note else None
    if not remedy.steps:
        return (text(f"No remedy: {remedy.reason}.", note),)
    *earlier, last = remedy.steps
    if remedy.missed or len(remedy.steps) > MOST_STEPS:
        earlier, last = [], remedy.in_one
    sentences = [text(_step(run, step), ".") for step in earlier]
    met = "all limits met" if remedy.met else "not all limits surely met"
    evidence = "predicted from these trials"
    if remedy.evidence is Evidence.PROVED:
        evidence = f"{'proved ' * remedy.met}by {remedy.trials} new trials"
    if remedy.missed:
        met = f"{', '.join(remedy.missed)} still not met"
    proof = say(" Prove it: {}", remedy.proving) if remedy.proving else None
    study = None
    if remedy.commands:  # none where nothing is evaluated here
        study = say(" Write its study: {} Run it: {}", *remedy.commands)
    sentences.append(
        text(
            MISSED if remedy.missed else None,
            _step(run, last),
            f"; {met}, {evidence}.",
            *_worse(remedy),
            note,
            proof,
            study,
        )
    )
    return tuple(sentences)


def remedy_cell(run: Run, remedy: RemedyFinding, response: str) -> Cell:
    """Return the changes, above the fraction out of a limit that they leave."""
    if remedy.unavoidable:
        return Cell(text(NOT_BY_FREE))
    if not remedy.steps:
        return Cell(())
    changes, (_, after) = remedy.changes, remedy.limits[response]
    if remedy.missed:
        return Cell(text(NONE_MEETS), text(ppm(after), " by the best one found"))
    words = listed([_change(run, change) for change in changes])
    if len(changes) > MOST_IN_CELL:
        words = text("see the remedy")
    is_open = remedy.evidence is Evidence.PROVED and not remedy.met
    evidence = "not surely met" if is_open else remedy.evidence
    return Cell(words, text(ppm(after), f", {evidence}"))


def _step(run: Run, step: RemedyStep) -> Parts:
    """Say what a step changes, and what it does to the yield of all limits."""
    alike = dict[str, list[EntryChange]]()
    for change in step.changes:
        key = change.entry if change.shift else change.tolerance
        alike.setdefault(key, []).append(change)
    changes = list[Parts]()
    for same in alike.values():
        if len(same) > MOST_IN_CELL:
            names = some_of([change.entry for change in same], MOST_IN_CELL)
            changes.append(text(f"tighten {names} to {same[0].tolerance}"))
        else:
            changes += [_change(run, change) for change in same]
    first, *others = changes
    word = str(first[0])
    capital = text(word[0].upper() + word[1:], *first[1:])
    before, after = step.before.value, step.after
    return say(
        "{}: yield, all limits, from {} to {}", listed([capital, *others]),
        Number(before, PER_CENT), Number(after, PER_CENT),
    )  # fmt: skip


def _change(run: Run, change: EntryChange) -> Parts:
    """Say where an entry moves, and how far it is tightened."""
    scale, words = run.scales[change.members[0]], list[Parts]()
    if change.shift:
        by = f"{figures(scale.factor * change.shift, KNOWN)} {scale.mark}".strip()
        words.append(say(f"move {{}} by {by}", Name(change.entry)))
    if change.tolerance:
        words.append(say(f"tighten {{}} to {change.tolerance}", Name(change.entry)))
    return listed(words)


def _worse(remedy: RemedyFinding) -> list[Parts]:
    """Return sentences on limits that more trials miss than before."""
    return [
        say(" {} gets worse, from {} to {}.", Name(name), ppm(before), ppm(after))
        for name, (before, after) in remedy.limits.items()
        if after.lower > before.upper
    ]


def _unavoidable(run: Run, rest: Unavoidable, trials: int) -> Parts:
    """Say what stays out of limit, where it comes from, and what would help."""
    causes = [
        say("{} ({} of the variance)", Name(name), Number(share, PER_CENT))
        for name, share in rest.causes.items()
    ]
    stays = text(
        say("without their spread {} stay out of limit", ppm(rest.share)),
        text(", from ", listed(causes)) if causes else None,
    )  # fmt: skip
    if rest.medians:
        stays = listed(
            [
                say(
                    f"the median of {{}} lies {{}} {'above' if x > 0 else 'below'} its "
                    "limit", Name(name), Number(abs(x), run.scales[name]),
                )
                for name, x in rest.medians.items()
            ]
        )  # fmt: skip
    options = [
        text("widen ", Name(name), " to ", tolerance_words(ends, run.scales[name]))
        for name, ends in rest.limits.items()
    ]
    proof = f" with all tolerances as they are (proved by {trials} new trials)"
    widen = [text(listed(options), proof)] if options else []
    freed = [_change(run, change) for change in rest.freed]
    return text(
        "No change of the free dimensions meets all limits: ", stays, ".",
        say(" What would help: {}.", listed([*widen, *freed], "or"))
        if widen or freed else None,
    )  # fmt: skip

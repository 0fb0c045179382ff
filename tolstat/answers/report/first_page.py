"""The first page: which limits are met, main causes, next steps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from typing import TYPE_CHECKING

from tolstat.answers.cells import limit_cell, ppm, verdict_cell
from tolstat.answers.halved_entries import halved_entries
from tolstat.answers.next_steps import to_allocate, to_extend, to_halve, to_resume
from tolstat.answers.report import what_helps
from tolstat.answers.report.finer_run import settle
from tolstat.answers.report.off_centre import OFF_CENTRE, findings
from tolstat.answers.report.report_warnings import JUMPS, JumpWarning, in_words
from tolstat.document import blocks
from tolstat.document.blocks import Cell
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import INTEGRATION_ERROR, MET, NOT_MET
from tolstat.statistics.summary import Limited
from tolstat.units.scale import PART, PER_CENT, PPM

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import (
        Causes,
        ResponseSummary,
        RunSummary,
    )
    from tolstat.statistics.sensitivity.pairs import Together

UNNAMED = (
    OFF_CENTRE,
    JUMPS,
    INTEGRATION_ERROR,
)  # reasons for which no contributor is named
MOST_LIMITS = 6  # in the table of a first page: on paper it is one sheet
ALL_LIMITS = "All limits"
PICTURE = "Fraction out of limit against what is permitted"
TINY = 1e-6  # a level below it is no more telling
INTERVAL = "Each number has its 95 % interval below it"
CENTRAL = " of the central 99 %"  # of the trials: others are clipped
READING = (
    "Quantiles: order statistics, for any distribution. Fractions out of limit: "
    "anytime-valid, trials may be added. Equivalent Ppk: of a normal response with the "
    "same fraction out of limit."
)


def first_page(
    found: RunSummary, links: Collection[str] = ()
) -> tuple[blocks.Block, ...]:
    """Return the blocks of the first page, title block and header left out.

    Names of responses in `links`, of a report, lead to their sections. Its first page
    has the worst of many limits.
    """
    steps = what_next(next_steps(found))
    many = links and len(found.limits) > MOST_LIMITS
    ranges = blocks.shown(ranges_of(found))
    picture = blocks.Section(PICTURE, ranges, level=3, page_only=True)
    return blocks.shown(
        in_words(found.early_warnings),
        lead(found),
        blocks.Bullets(findings(found)),
        limits_table(found, links, MOST_LIMITS if many else None),
        *((steps, picture) if many else (picture, steps)),
        in_words(found.late_warnings),
        *map(blocks.note, found.trials.notes if found.trials.ran else ()),
    )


def what_next(steps: tuple[Parts, ...]) -> blocks.Section:
    """Return the section of next steps, the first one first."""
    shown = blocks.shown(blocks.Bullets(steps, numbered=len(steps) > 1))
    return blocks.Section("What to do next", shown, level=3)


def lead(found: RunSummary) -> blocks.Paragraph:
    """Say how many limits are met, and the yield of all of them."""
    return blocks.Paragraph(_lead(found), "lead")


def _lead(found: RunSummary) -> Parts:
    if not found.trials.ran:
        return text("No trial has run.")
    if found.all_limits is None:
        return text("The study limits no response.")
    judged = [each.yields for each in found.limits.values()]
    tones = {each.words: each.verdict for each in judged}
    counts = Counter(each.words for each in judged)
    (word, first), *others = counts.items()
    n, trials = counts.total(), found.trials.done + found.trials.failed
    of = "The limit is" if n == 1 else f"All {n} limits are"
    if first < n:
        of = f"{first} of {n} limits {'is' if first == 1 else 'are'}"
    shown = Word(word, tones[word])
    if word == NOT_MET and 1 < first == n:
        of, shown = f"None of {n} limits is", Word(MET, NOT_MET)
    said = [text(f"{of} ", shown)]
    said += [text(f"{count} ", Word(word, tones[word])) for word, count in others]
    ran, requested = found.trials.ran, found.trials.requested
    return say(
        f"{{}}. Yield, {'all limits' if n > 1 else 'this limit'}: {{}}.{{}}{{}}",
        listed(said, joint=""), Number(found.all_limits.within, PER_CENT, of=trials),
        " Failed trials count as out of limit." if found.trials.failed else None,
        f" So far {ran} of {requested} trials have run." if ran < requested else None,
    )  # fmt: skip


def limits_table(
    found: RunSummary, links: Collection[str] = (), most: int | None = None
) -> blocks.Table:
    """Return verdict, fraction out of limit, main cause and what would help.

    Of all limits, or of the worst ones.
    """
    rows, every = [], list(found.limits.items())
    of = found.trials.done + found.trials.failed
    for name, limited in every[:most]:
        each, yields = found.responses[name], limited.yields
        good = Number(yields.within_at_most, PER_CENT, of=of)
        failed = say("yield, if failed trials were good: {}", good)
        rows.append({
            **limit_row(
                Cell((Name(name, name if name in links else ""),), text(each.sentence)),
                limited.limit, verdict_cell(yields),
                Cell((ppm(yields.fraction_out_of_limit, of),),
                     failed if found.trials.failed else ()),
                limited.equivalent_ppk,
            ),
            "main cause": _cause_cell(each),
            "what would help": what_helps.cell(found.stored_run, each.causes, limited),
        })  # fmt: skip
    words, said = ("main cause", "what would help"), rests_on(found)
    if found.unseen_errors:
        said = say("{}; {}", said, found.unseen_errors)
    if any(is_clipped(found.responses[name]) for name, _ in every[:most]):
        said = say("{}; variance: {}", said, CENTRAL.strip())
    if len(rows) < len(every):
        first = f"The {len(rows)} worst of {len(every)} limits; behind: "
        said = say("{}{}. {}", first, Name(ALL_LIMITS, "limits"), said)
    return blocks.table_of(
        rows, "Limits", words=words, caption=said, look="verdicts",
        spare=["what would help", "equivalent Ppk"],
    )  # fmt: skip


def limit_row(
    name: Cell, limit: Limit, verdict: blocks.Given, share: Cell, equivalent: Estimate
) -> dict[str, blocks.Given]:
    """Return a row on a limit: its demand and its results."""
    demanded = Number(limit.ppk)
    return {
        "response": name,
        "limit": limit_cell(limit),
        "verdict": verdict,
        "out of limit, ppm": share,
        "equivalent Ppk": Cell((Number(equivalent),), say("demanded {}", demanded)),
    }


def _cause_cell(each: ResponseSummary) -> Cell:
    """Return the main cause of out-of-limit trials, above the trials it explains.

    Without a cause, the largest variance contribution stands below.
    """
    causes = each.causes
    if causes is None:
        return Cell(())
    if main := causes.main:
        level = text("significant at ", Number(max(main.level, TINY), PART))
        below = explained(main.together, causes) if main.together else level
        return Cell(text(main.words), text(below, also(causes)))
    variance: Parts = ()
    if causes.reason not in UNNAMED and (most := each.largest_share):
        variance = say("variance: {} {}", Name(most[0]), of_variance(most[1]))
    return Cell(text(no_cause(each)), variance)


def of_variance(share: Estimate) -> Parts:
    """Write a variance contribution; of an open interval the lower end."""
    return at_least(share) if share.upper == 1 else text(Number(share, PART))


def is_clipped(each: ResponseSummary) -> bool:
    """Whether its variance contributions are of the central trials alone."""
    return each.contributions is not None and each.contributions.clipped


def at_least(share: Estimate) -> Parts:
    """Write the lower end of a share."""
    return text("at least ", Number(max(share.lower, 0.0), PER_CENT, "at_least"))


def explained(together: Together, causes: Causes) -> Parts:
    """Say how many out-of-limit trials a pair explains, and how rare it is."""
    n = causes.trials_out_of_limit
    trials = f"{round(together.far.value * n)} of {n} out-of-limit trials"
    return say(f"{trials} in its outer {{}}", Number(together.of_all, PART))


def also(causes: Causes) -> str:
    """Name the other causes after the main one."""
    main, *others = causes.named
    new = [each.words for each in others if not {*each.members} & {*main.members}]
    return f"; also {'; '.join(new)}" if new else ""


def no_cause(each: ResponseSummary) -> str:
    """Say why no cause is named, and how many trials would tell of a limit not met."""
    causes, limited = each.causes, each.limited
    if causes is None or causes.reason == RANDOM_ONLY:
        return "causes are named for random trials only"
    more = causes.needed and limited and limited.yields.verdict != MET
    tell = f"; about {causes.needed} trials would tell" if more else ""
    return f"{causes.reason or 'no significant difference'}{tell}"


def next_steps(found: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next: resume, tighten the main cause, or run more trials."""
    run = found.stored_run
    if not run.complete:
        what = "Run the trials that are missing"
        if run.ended == run.trials:
            what = "Finish the run, whose audit or diagnostics are missing"
        return (text(f"{what}: ", Typed(to_resume(run.path, run.machine)), "."),)
    halve = (  # first what is known to gain
        _halve(found, name, each, known=known)
        for known in (True, False)
        for name, each in found.limits.items()
    )
    rough = [
        name
        for name, each in found.limits.items()
        if each.yields.reason == INTEGRATION_ERROR
    ]
    if finer := settle(run, rough):
        return (finer,)  # the other numbers are of the rough run, too
    more = _more_trials(found)
    jumps = [each for each in found.warnings if isinstance(each, JumpWarning)]
    turns = [Name(each.response) for each in jumps if each.clusters.turn]
    others = [Name(each.response) for each in jumps if not each.clusters.turn]
    steps = [
        say("Mend the formula of {}, as said above.", listed(turns)) if turns else (),
        say(
            "Mend the formula of {} if the machine does not jump as said above.",
            listed(others),
        )
        if others
        else (),
        _centre(found),
        next(filter(None, halve), ()),
        more,
        _allocate(found),
    ]
    return tuple(filter(None, steps))


def _allocate(found: RunSummary) -> Parts:
    """Return the step that searches the cheapest tolerances; empty where all is met.

    Without costs in the study, only where halving those of the causes is too little, or
    enough trials are out of limit and none of their causes is named.
    """
    parts, unmet = dict[str, None](), False
    for name, each in found.limits.items():
        if each.yields.reason:
            return ()
        response = found.responses[name]
        unmet |= each.yields.verdict != MET
        causes = response.causes
        if not causes or each.yields.verdict == MET or causes.reason in UNNAMED:
            continue
        if main := causes.main:
            now = each.yields.fraction_out_of_limit.value
            if what_helps.still(main, each.limit) or main.halved.value >= now:
                parts |= dict.fromkeys(m for by in causes.named for m in by.members)
        elif each.yields.verdict == NOT_MET and not causes.needed:
            parts |= dict.fromkeys(response.most_of_variance)
    run = found.stored_run
    can = [name for name in parts if halved_entries(run, [name])]  # no phase, no data
    if not unmet or not (commands := to_allocate(run, can)):
        return ()
    if len(commands) == 1:
        last = Typed(*commands)
        return text("Find the cheapest tolerances that meet all limits: ", last, ".")
    return say("Find the widest tolerances of {} that meet all limits. Write prices of "
               "1 over the tolerance: {} Search: {}",
               listed([*map(Name, can)]), *map(Typed, commands))  # fmt: skip


def _centre(found: RunSummary) -> Parts:
    """Return the step that centres responses; its commands stand in the findings."""
    every = {name: found.responses[name].off_centre for name in found.limits}
    names = [Name(name) for name, off in every.items() if off and off.shifts]
    return say("Centre {} first, as said above.", listed(names)) if names else ()


def _more_trials(found: RunSummary) -> Parts:
    """Return the step that adds trials; empty where no more would tell.

    Until a verdict falls, and until causes can be named of a limit that more trials
    miss than it permits.
    """
    limited, missed = found.limits.items(), dict[str, int]()
    verdicts = {
        name: each.yields.needed for name, each in limited if each.yields.needed
    }
    for name, each in limited:
        causes, share = found.responses[name].causes, each.yields.fraction_out_of_limit
        missing = each.yields.verdict != MET and share.value > 1 - each.limit.demanded
        if missing and causes and causes.needed:
            missed[name] = causes.needed
    run, said, needed = found.stored_run, [], 0
    if verdicts:
        name = min(verdicts, key=lambda name: verdicts[name])
        needed, said = verdicts[name], [say("decide {}", Name(name))]
    if missed:
        name = min(missed, key=lambda name: missed[name])
        if missed[name] > needed and to_extend(run, missed[name]):
            needed = missed[name]
            said.append(say("find the causes of {}", Name(name)))
    if not said:
        return ()
    command, trials = to_extend(run, needed), counted(needed, "trial")
    how = (" in all: ", Typed(command)) if command else ", in a new run of the study"
    return say("Add trials to {}: about {}{}.", listed(said), trials, how)


def _halve(found: RunSummary, name: str, limited: Limited, *, known: bool) -> Parts:
    """Return the step that halves tolerances of the main cause; empty without a gain.

    `known`: these trials show the effect; otherwise a fresh run is needed.
    """
    now, verdict = limited.yields.fraction_out_of_limit, limited.yields.verdict
    causes, run = found.responses[name].causes, found.stored_run
    if verdict == MET or causes is None or (main := causes.main) is None:
        return ()
    if limited.yields.reason:  # the numbers are wrong
        return ()
    clear, then = what_helps.differ(main.halved, now), main.halved.value
    missing = now.value > 1 - limited.limit.demanded  # by the trials seen
    gains = then < now.value and (clear or missing)
    if not (gains if known else math.isnan(then)):
        return ()
    parts = main.members
    named, commands = what_helps.named(main), to_halve(run, parts)
    if not (known or commands):
        return say(f"{{}} cannot be halved: {main.halved.reason}.", named)
    effect = say("the effect on {} is not estimable", Name(name))
    if known:
        falls = "falls" if clear else "may fall"
        still = what_helps.still(main, limited.limit)
        effect = say(f"{{}} {falls} from {{}} to {{}}{still}", Name(name), ppm(now),
                     ppm(main.halved))  # fmt: skip
    return say(
        f"{'Halve' if clear else 'Test half'} the "
        f"{'tolerance' if len(parts) == 1 else 'tolerances'} of {{}}: {{}}{{}}",
        named,
        effect,
        say(". Check it with a fresh run: {} Run it: {}", *map(Typed, commands))
        if commands else ".",
    )  # fmt: skip


def ranges_of(found: RunSummary) -> blocks.Ranges:
    """Return fractions out of limit, with intervals, against what is permitted."""
    rows = []
    for name, each in found.limits.items():
        share, verdict = each.yields.fraction_out_of_limit, each.yields.verdict
        rows.append(blocks.Range(name, share, 1 - each.limit.demanded, verdict))
    said = ", ".join(f"{each.name} {PPM.interval(*each.found[:3])[0]}" for each in rows)
    words = f"Fractions out of limit in ppm: {said}"
    return blocks.Ranges(words, tuple(rows), PPM, "permitted")


def rests_on(found: RunSummary) -> Parts:
    """Say how many trials the numbers of a table rest on."""
    trials = found.trials
    of: Parts = ()
    if trials.counted < trials.ran:
        of = say(", of the {} that statistics rest on", Number(trials.counted))
    return say("{} done, {} failed{}", counted(trials.done, "trial"),
               Number(trials.failed), of)  # fmt: skip


def reading(found: RunSummary) -> blocks.Paragraph:
    """Explain the numbers."""
    sampled = found.stored_run.sampled
    said = f"{sampled.promise}." if sampled and sampled.replicates else READING
    return blocks.paragraph(f"{INTERVAL}. {said}")

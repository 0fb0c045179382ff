"""The first page: which limits are met, main causes, next steps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.cells import limit_cell, numbers_of, ppm, verdict_cell
from tolstat.answers.next_steps import to_extend, to_halve, to_resume
from tolstat.document import blocks, plot
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
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.statistics.summary import Limited
from tolstat.units.scale import AS_IS, KNOWN, PART, PER_CENT, PPM

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import (
        Causes,
        ResponseSummary,
        RunSummary,
    )
    from tolstat.statistics.sensitivity.pairs import Together

MOST_NAMED = 4  # parts in a sentence
LEVEL = PER_CENT.beside(1.0)  # of chance: no test is better than that
STARRED = {"mean": "mean *", "sigma": "sigma *"}  # their assumption stands below
PAGE_ONLY = ("mean *", "sigma *", "least", "largest", "0.135 %", "99.865 %")
INTERVAL = "Each number has its 95 % interval below it"
READING = (
    "Quantiles: order statistics, for any distribution. Fractions out of limit: "
    "anytime-valid, trials may be added. Equivalent Ppk: of a normal response with the "
    "same fraction out of limit."
)


def summary_document(found: RunSummary) -> blocks.Document:
    """Return the summary that is printed at the end of a run."""
    return blocks.Document(
        f"{found.title} ({found.model})",
        blocks.shown(*first_page(found), responses_table(found), reading(found)),
    )


def first_page(
    found: RunSummary, links: Collection[str] = ()
) -> tuple[blocks.Block, ...]:
    """Return the blocks of the first page, title block and header left out.

    Names of responses in `links` lead to their sections.
    """
    steps = _next_steps(found)
    next_steps = blocks.shown(blocks.Bullets(steps, numbered=len(steps) > 1))
    return blocks.shown(
        blocks.Paragraph(_lead(found), "lead"),
        limits_table(found, links),
        blocks.Section("What to do next", next_steps, level=3),
        *map(blocks.note, found.trials.notes),
    )


def _lead(found: RunSummary) -> Parts:
    """Say how many limits are met, and the yield of all of them."""
    if not found.trials.ran:
        return text("No trial has run.")
    if found.all_limits is None:
        return text("The study limits no response.")
    counts = Counter(each.yields.verdict for each in found.limits.values())
    (word, first), *others = counts.items()
    n = counts.total()
    of = "The limit is" if n == 1 else f"All {n} limits are"
    if first < n:
        of = f"{first} of {n} limits {'is' if first == 1 else 'are'}"
    said = [text(f"{of} ", Word(word, word))]
    said += [text(f"{count} ", Word(word, word)) for word, count in others]
    return say(
        f"{{}}. Yield, {'all limits' if n > 1 else 'this limit'}: {{}}.{{}}",
        listed(said, joint=""), Number(found.all_limits.within, PER_CENT),
        " Failed trials count as out of limit." if found.trials.failed else None,
    )  # fmt: skip


def limits_table(found: RunSummary, links: Collection[str] = ()) -> blocks.Table:
    """Return verdict, fraction out of limit, main cause and effect of halving it."""
    rows = []
    for name, limited in found.limits.items():
        each, yields = found.responses[name], limited.yields
        good = Number(yields.within_at_most, PER_CENT)
        failed = say("yield, if failed trials were good: {}", good)
        rows.append({
            **limit_row(
                Cell((Name(name, name if name in links else ""),), text(each.sentence)),
                limited.limit, verdict_cell(yields),
                Cell((ppm(yields.fraction_out_of_limit),),
                     failed if found.trials.failed else ()),
                limited.equivalent_ppk,
            ),
            "main cause": _cause_cell(each),
            "tolerance halved, ppm": _effect_cell(each, limited),
        })  # fmt: skip
    return blocks.table_of(
        rows, "Limits", words=["main cause"], caption=rests_on(found), look="verdicts"
    )


def limit_row(
    name: Cell, limit: Limit, verdict: blocks.Given, share: Cell, equivalent: Estimate
) -> dict[str, blocks.Given]:
    """Return a row on a limit: its demand and its results."""
    typed = limit.typed_ppk
    demanded = f"{typed:.{KNOWN}g}" if typed else AS_IS.number(limit.ppk)
    return {
        "response": name,
        "limit": limit_cell(limit),
        "verdict": verdict,
        "out of limit, ppm": share,
        "equivalent Ppk": Cell((Number(equivalent),), text(f"demanded {demanded}")),
    }


def _cause_cell(each: ResponseSummary) -> Cell:
    """Return the main cause of out-of-limit trials, above the trials it explains.

    Without a cause, the largest variance contribution stands below.
    """
    causes = each.causes
    if causes is None:
        return Cell(())
    if main := causes.main:
        level = text("significant at ", Number(main.level, LEVEL))
        below = explained(main.together, causes) if main.together else level
        return Cell(text(main.words), text(below, also(causes)))
    variance: Parts = ()
    if most := each.largest_share:
        name, share = most
        least = share.upper == 1  # open at the top
        said = at_least(share) if least else Number(share, PART)
        variance = say("variance: {} {}", Name(name), said)
    return Cell(text(no_cause(causes)), variance)


def at_least(share: Estimate) -> Parts:
    """Write the lower end of a share."""
    return text("at least ", Number(max(share.lower, 0.0), PER_CENT, "at_least"))


def explained(together: Together, causes: Causes) -> Parts:
    """Say how many out-of-limit trials a pair explains, and how rare it is."""
    n = causes.out_of_limit
    trials = f"{round(together.far.value * n)} of {n} out-of-limit trials"
    return say(f"{trials} in its outer {{}}", Number(together.of_all, PART))


def also(causes: Causes) -> str:
    """Name the other causes after the main one."""
    main, *others = causes.named
    new = [each.words for each in others if not {*each.members} & {*main.members}]
    return f"; also {'; '.join(new)}" if new else ""


def no_cause(causes: Causes) -> str:
    """Say why no cause is named."""
    if causes.reason == RANDOM_ONLY:
        return "causes are named for random trials only"
    return causes.reason or "no significant difference"


def _effect_cell(each: ResponseSummary, limited: Limited) -> Cell:
    """Return the fraction out of limit with tolerances of the main cause halved."""
    main = each.causes.main if each.causes else None
    if main is None:
        return Cell(())
    now = limited.yields.fraction_out_of_limit
    same = main.halved.sure and not differ(main.halved, now)
    return Cell((ppm(main.halved),), text("no significant change") if same else ())


def differ(one: Estimate, other: Estimate) -> bool:
    """Tell whether two fractions differ significantly.

    They do if their intervals do not overlap. Each end errs in 2.5 % of all runs, so
    one of the two facing ends errs in at most 5 %. The trials are the same: an interval
    of the difference would be narrower, but its coverage was not measured.
    """
    return one.upper < other.lower or other.upper < one.lower


def _next_steps(found: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next: resume, tighten the main cause, or run more trials."""
    run = found.stored_run
    if run.ended < run.trials:
        resume = Typed(to_resume(run.path, run.machine))
        return (text("Run the trials that are missing: ", resume, "."),)
    halve = (  # first what is known to gain
        _halve(found, name, each, known=known)
        for known in (True, False)
        for name, each in found.limits.items()
    )
    steps = [next(filter(None, halve), ())]
    limits = [(found.limits[name].yields.needed, name) for name in found.verdicts]
    if undecided := [each for each in limits if each[0]]:
        needed, name = min(undecided)
        command = to_extend(run, needed)
        how = (
            (" in all: ", Typed(command)) if command else ", in a new run of the study"
        )
        trials = counted(needed, "trial")
        steps.append(say("Decide {}: about {}{}.", Name(name), trials, how))
    steps.append(_tell_causes(found))
    return tuple(filter(None, steps))


def _tell_causes(found: RunSummary) -> Parts:
    """Return the step that adds trials until causes can be named; empty without."""
    limits = {
        name: causes.needed
        for name, each in found.limits.items()
        if each.yields.verdict != MET and (causes := found.responses[name].causes)
    }
    name = min((n for n in limits if limits[n]), key=lambda n: limits[n], default="")
    if not name or not (command := to_extend(found.stored_run, limits[name])):
        return ()
    trials = counted(limits[name], "trial")
    return say("Find the causes of {}: about {} in all: {}.", Name(name), trials,
               Typed(command))  # fmt: skip


def _halve(found: RunSummary, name: str, limited: Limited, *, known: bool) -> Parts:
    """Return the step that halves tolerances of the main cause; empty without a gain.

    `known`: these trials show the effect; otherwise a fresh run is needed.
    """
    now, verdict = limited.yields.fraction_out_of_limit, limited.yields.verdict
    causes, run = found.responses[name].causes, found.stored_run
    if verdict == MET or causes is None or (main := causes.main) is None:
        return ()
    clear, then = differ(main.halved, now), main.halved.value
    gains = then < now.value and (clear or verdict == NOT_MET)
    if not (gains if known else math.isnan(then) and main.effective_sample_size):
        return ()
    parts = main.members
    few = len(parts) <= MOST_NAMED
    effect = say("the effect on {} is not estimable", Name(name))
    if known:
        falls = "falls" if clear else "may fall"
        effect = say(f"{{}} {falls} from {{}} to {{}}", Name(name), ppm(now),
                     ppm(main.halved))  # fmt: skip
    command = to_halve(run, parts)
    return say(
        f"{'Halve' if clear else 'Test half'} the "
        f"{'tolerance' if len(parts) == 1 else 'tolerances'} of {{}}: {{}}{{}}.",
        listed([Name(part) for part in parts]) if few else main.words,
        effect,
        (". Check it with a fresh run: ", Typed(command)) if command else None,
    )


def ranges_figure(found: RunSummary) -> blocks.Figure | None:
    """Return a figure of fractions out of limit, with intervals and limits."""
    every = {
        name: each.yields.fraction_out_of_limit for name, each in found.limits.items()
    }
    sure = {name: share for name, share in every.items() if share.sure}
    if len(sure) < 2:
        return None
    permitted = {1e6 * (1 - each.limit.demanded) for each in found.limits.values()}
    least = min(1.0, *(each / 10 for each in permitted if each))
    ends = np.array([share[:3] for share in sure.values()]).T * 1e6
    value, lower, upper = np.maximum(ends, least)
    verdicts = tuple(found.limits[name].yields.verdict for name in sure)
    layers: tuple[plot.Layer, ...] = (
        plot.Ranges(tuple(sure), lower, upper, value, verdicts),
        *(plot.Rule(x, upright=True, label=f"permitted {x:.4g}")
          for x in sorted(permitted)),
    )  # fmt: skip
    said = ", ".join(f"{n} {PPM.number(share.value)}" for n, share in sure.items())
    axes = plot.PlotAxis("out of limit, ppm", "log"), plot.PlotAxis("")
    drawn = plot.Plot((plot.PlotPanel(*axes, layers),), height=0.22 * len(sure) + 0.8)
    return blocks.Figure(f"Fractions out of limit in ppm: {said}", drawn)


def responses_table(found: RunSummary) -> blocks.Table:
    """Return the numbers of all responses."""
    rows: list[dict[str, blocks.Given]] = [
        {
            "response": Name(name),
            "unit": each.scale.mark,
            "nominal": Number(each.nominal, each.scale),
            **{STARRED.get(n, n): x for n, x in numbers_of(each, each.scale).items()},
        }
        for name, each in found.responses.items()
    ]
    return blocks.table_of(rows, "Responses", page_only=PAGE_ONLY,
                           caption=rests_on(found), keys=2, look="dense")  # fmt: skip


def rests_on(found: RunSummary) -> Parts:
    """Say how many trials the numbers of a table rest on."""
    trials = found.trials
    of: Parts = ()
    if trials.counted < trials.requested:
        of = say(", of the {} that statistics rest on", Number(trials.counted))
    return say("{} done, {} failed{}", counted(trials.done, "trial"),
               Number(trials.failed), of)  # fmt: skip


def reading(found: RunSummary) -> blocks.Paragraph:
    """Explain the numbers."""
    sampled = found.stored_run.sampled
    said = f"{sampled.promise}." if sampled and sampled.replicates else READING
    return blocks.paragraph(f"{INTERVAL}. {said}")

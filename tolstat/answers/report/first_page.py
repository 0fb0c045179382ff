"""The first page: which limits are met, what causes the rest, what to do next."""

from __future__ import annotations

import numpy as np

from tolstat.answers.cells import limit_cell, ppm, response_cell, verdict_cell
from tolstat.answers.next_steps import to_extend, to_halve
from tolstat.answers.report.report_answer import (
    WORST_FIRST,
    Causes,
    PairCause,
    Report,
    ReportedResponse,
    ResponseSummary,
    RunSummary,
    TitleBlock,
)
from tolstat.document.blocks import (
    Block,
    Bullets,
    Cell,
    Document,
    Facts,
    Figure,
    Given,
    Paragraph,
    Section,
    Table,
    note,
    paragraph,
    shown,
    table_of,
)
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Said,
    Typed,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.document.plot import Layer, Plot, PlotAxis, PlotPanel, Ranges, Rule
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.statistics.summary import QUANTILES, Limited
from tolstat.units.scale import AS_IS, KNOWN, PART, PER_CENT, PPM, share_words

MOST_NAMED = 4  # parts in a sentence
LEVEL = PER_CENT.beside(1.0)  # of chance: no test is better than that
PRINTED = (0.05, 0.5, 0.95, 0.99)  # quantiles on a screen
INTERVAL = "Below each number stands its 95 % interval"
READING = (
    "Quantiles: order statistics, for any distribution. Fractions out of limit: "
    "anytime-valid, trials may be added. Equivalent Ppk: of a normal response with the "
    "same fraction out of limit."
)


def summary_document(found: RunSummary) -> Document:
    """Return what is printed at the end of a run."""
    n = found.trials.requested
    return Document(
        f"{found.title}: {n} {'trial' if n == 1 else 'trials'} of {found.model}",
        shown(*first_page(found), responses_table(found), reading(found)),
    )


def first_page(found: RunSummary) -> tuple[Block, ...]:
    """Return the blocks of the first page, title block and header left out."""
    steps = _next_steps(found)
    next_steps = shown(Bullets(steps, numbered=len(steps) > 1))
    return shown(
        Paragraph(_lead(found), "lead"),
        limits_table(found),
        Section("What to do next", next_steps, level=3),
        *map(note, found.trials.notes),
    )


def title_facts(block: TitleBlock) -> Facts:
    """Return the title block; what is not given is left out, except the approval."""
    rows = [(name, text(value)) for name, value in block._asdict().items() if value]
    if not block.approval:
        rows.append(("approval, date", ()))
    return Facts(tuple(rows), "sheet")


def _lead(found: RunSummary) -> Parts:
    """Say how many limits are met, and the yield of all of them."""
    if found.all_limits is None:
        return text("The study limits no response.")
    verdicts = list(found.verdicts.values())
    n = len(verdicts)
    counts = [(verdicts.count(word), Word(word, word)) for word in WORST_FIRST]
    (first, word), *others = [each for each in counts if each[0]]
    of = "The limit is" if n == 1 else f"All {n} limits are"
    if first < n:
        of = f"{first} of {n} limits {'is' if first == 1 else 'are'}"
    said = [text(f"{of} ", word), *(text(f"{count} ", word) for count, word in others)]
    return say(
        f"{{}}. Yield, {'all limits' if n > 1 else 'this limit'}: {{}}.{{}}",
        listed(said, joint=""), Number(found.all_limits.within, PER_CENT),
        " Failed trials count as out of limit." if found.trials.failed else None,
    )  # fmt: skip


def limits_table(found: RunSummary) -> Table:
    """Return verdict, fraction out of limit, main cause and effect of halving it."""
    rows = [_limit_row(found, name, each) for name, each in found.limits.items()]
    return table_of(
        rows, "Limits", words=["main cause"], caption=rests_on(found), look="verdicts"
    )


def limit_row(
    name: Cell, limit: Limit, verdict: Given, share: Cell, equivalent: Estimate
) -> dict[str, Given]:
    """Return a row on a limit: what is demanded, and what was found."""
    typed = limit.typed_ppk
    demanded = f"{typed:.{KNOWN}g}" if typed else AS_IS.number(limit.ppk)
    return {
        "response": name,
        "limit": limit_cell(limit),
        "verdict": verdict,
        "out of limit, ppm": share,
        "equivalent Ppk": Cell((Number(equivalent),), text(f"demanded {demanded}")),
    }


def _limit_row(found: RunSummary, name: str, limited: Limited) -> dict[str, Given]:
    each, yields = found.responses[name], limited.yields
    response = next(one for one in found.of.responses if one.name == name)
    link = name if isinstance(found, Report) and name in found.focus else ""
    good = Number(yields.most, PER_CENT)
    failed = say("yield, if failed trials were good: {}", good)
    share = Cell((ppm(yields.out_of_limit),), failed if found.trials.failed else ())
    return {
        **limit_row(response_cell(response, link), limited.limit, verdict_cell(yields),
                    share, limited.equivalent),
        "main cause": _cause_cell(each),
        "tolerance halved, ppm": _effect_cell(each, limited),
    }  # fmt: skip


def _cause_cell(each: ResponseSummary) -> Cell:
    """Name the main cause of out-of-limit trials, over what it explains of them.

    Without one the kind of part that has most of the variance stands below.
    """
    causes = each.causes
    if causes is None:
        return Cell(())
    if pair := causes.pair:
        every = [one.words for one in (pair, *causes.equivalent_pairs)]
        return Cell(text("; or equally ".join(every)), explained(pair, causes))
    if causes.leading and (cause := causes.main):
        assert not isinstance(cause, PairCause)
        below = text("significant at ", Number(cause.level, LEVEL))
        return Cell((Name(causes.leading[0]),), below)
    most = largest_share(each) if isinstance(each, ReportedResponse) else None
    variance = say("variance: {} {}", Name(most[0]), _least(most[1])) if most else ()
    return Cell(text(no_cause(causes)), variance)


def largest_share(each: ReportedResponse) -> tuple[str, Estimate] | None:
    """Return what has most of a variance; None where few trials dominate it."""
    found = each.contributions
    if found is None or found.dominated_by_few:
        return None
    kinds = {name: share_of_kind(each, name) for name in found.groups}
    grouped = {member for members in each.members.values() for member in members}
    alone = {n: x for n, x in found.first_order.items() if n not in grouped}
    every = {**kinds, **alone}
    known = {n: x for n, x in every.items() if x.value > 0 and not x.lower <= 0}
    name = max(known, key=lambda name: known[name].value, default="")
    return (name, known[name]) if name else None


def share_of_kind(each: ReportedResponse, kind: str) -> Estimate:
    """Return the share of a kind of part: with interactions, where that is known."""
    found = each.contributions
    assert found
    together = found.together[kind]
    return together if together.value > 0 else found.groups[kind]


def _least(share: Estimate) -> Parts:
    """Write a share; one whose interval is open at the top as its lower end."""
    if share.upper == 1:
        return text("at least ", Number(max(share.lower, 0.0), PER_CENT, "at_least"))
    return text(Number(share, PART))


def explained(pair: PairCause, causes: Causes) -> Parts:
    """Say how many out-of-limit trials a pair explains, and how rare it is."""
    n = causes.out_of_limit
    trials = f"{round(pair.together.far.value * n)} of {n} out-of-limit trials are in "
    return say(f"{trials}the outer {{}} of it", Number(pair.together.of_all, PART))


def no_cause(causes: Causes) -> str:
    """Say why no cause is named."""
    if causes.reason == RANDOM_ONLY:
        return "causes are named for random trials only"
    return causes.reason or "no significant difference"


def _effect_cell(each: ResponseSummary, limited: Limited) -> Cell:
    """Write what halving the tolerances of the main cause leaves out of limit."""
    main = each.causes.main if each.causes else None
    if main is None:
        return Cell(())
    same = main.halved.sure and not differ(main.halved, limited.yields.out_of_limit)
    return Cell((ppm(main.halved),), text("no significant change") if same else ())


def differ(one: Estimate, other: Estimate) -> bool:
    """Tell whether two fractions differ significantly.

    Only where their intervals lie wholly apart: each end errs in 2.5 % of all runs, so
    that one of the two that face each other does in 5 % at most, however they err
    together. Of the difference itself, as the trials are the same, an interval would be
    narrower; none was measured to cover.
    """
    return one.upper < other.lower or other.upper < one.lower


def _next_steps(found: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next: tighten the main cause, or run more trials."""
    halve = (_halve(found, name, each) for name, each in found.limits.items())
    steps = [next(filter(None, halve), ())]
    limits = [(found.limits[name].yields.needed, name) for name in found.verdicts]
    if undecided := [each for each in limits if each[0]]:
        needed, name = min(undecided)
        command = to_extend(found.of, needed)
        how = (
            (" in all: ", Typed(command)) if command else ", in a new run of the study"
        )
        trials = counted(needed, "trial")
        steps.append(say("Decide {}: about {}{}.", Name(name), trials, how))
    return tuple(filter(None, steps))


def _halve(found: RunSummary, name: str, limited: Limited) -> Parts:
    """Say what halving the tolerances of the main cause gains; nothing if it does not.

    Where these trials do not tell, a fresh run does.
    """
    now, verdict = limited.yields.out_of_limit, limited.yields.verdict
    causes = found.responses[name].causes
    if verdict == MET or causes is None or (main := causes.main) is None:
        return ()
    told = differ(main.halved, now)
    if not (main.halved.value < now.value and (told or verdict == NOT_MET)):
        return ()
    if isinstance(main, PairCause):
        parts: tuple[str, ...] = main.together.members
    else:
        kinds = kinds_of_part(list(found.of.assumed), found.of.contributors)
        parts = tuple(kinds.get(causes.leading[0], causes.leading[:1]))
    few = len(parts) <= MOST_NAMED
    command = to_halve(found.of, parts)
    fresh: Said = (". Check it with a fresh run: ", Typed(command)) if command else None
    return say(
        f"{'Halve' if told else 'Test half'} the "
        f"{'tolerance' if len(parts) == 1 else 'tolerances'} of {{}}: {{}} "
        f"{'falls' if told else 'may fall'} from {{}} to {{}}{{}}.",
        listed([Name(part) for part in parts]) if few else Name(causes.leading[0]),
        Name(name), ppm(now), ppm(main.halved), fresh,
    )  # fmt: skip


def ranges_figure(found: RunSummary) -> Figure | None:
    """Draw the fractions out of limit with their intervals, and what is permitted."""
    every = {name: each.yields for name, each in found.limits.items()}
    sure = {name: each for name, each in every.items() if each.out_of_limit.sure}
    if len(sure) < 2:
        return None
    permitted = {1e6 * (1 - each.limit.demanded) for each in found.limits.values()}
    least = min(1.0, *(each / 10 for each in permitted if each))
    ends = np.array([each.out_of_limit[:3] for each in sure.values()]).T * 1e6
    value, lower, upper = np.maximum(ends, least)
    verdicts = tuple(each.verdict for each in sure.values())
    layers: tuple[Layer, ...] = (
        Ranges(tuple(sure), lower, upper, value, verdicts),
        *(Rule(x, upright=True, label=f"permitted {x:.4g}") for x in sorted(permitted)),
    )
    said = [f"{n} {PPM.number(each.out_of_limit.value)}" for n, each in sure.items()]
    panel = PlotPanel(PlotAxis("out of limit, ppm", "log"), PlotAxis(""), layers)
    plot = Plot((panel,), width=7.0, height=0.22 * len(sure) + 0.8)
    words = f"Fractions out of limit in ppm: {', '.join(said)}"
    return Figure(words, plot, wide=True)


def responses_table(found: RunSummary) -> Table:
    """Return the numbers of all responses."""
    rows: list[dict[str, Given]] = []
    for name, each in found.responses.items():
        scale, quantiles = each.scale, each.quantiles
        rows.append({
            "response": Name(name), "unit": scale.mark,
            "nominal": Number(each.nominal, scale), "mean *": Number(each.mean, scale),
            "sigma *": Number(each.sigma, scale), "least": Number(each.least, scale),
            **{share_words(q): Number(quantiles[q], scale) for q in QUANTILES},
            "largest": Number(each.largest, scale),
        })  # fmt: skip
    page_only = [share_words(q) for q in QUANTILES if q not in PRINTED]
    page_only += ["mean *", "sigma *", "least", "largest"]
    return table_of(rows, "Responses", page_only=page_only, caption=rests_on(found),
                    keys=2, look="dense")  # fmt: skip


def rests_on(found: RunSummary) -> Parts:
    """Say how many trials the numbers of a table rest on."""
    trials = found.trials
    of: Parts = ()
    if trials.counted < trials.requested:
        of = say(", of the {} that statistics rest on", Number(trials.counted))
    return say("{} done, {} failed{}", counted(trials.done, "trial"),
               Number(trials.failed), of)  # fmt: skip


def reading(found: RunSummary) -> Paragraph | None:
    """Explain the numbers."""
    if (sampled := found.of.sampled) is None:
        return None
    return paragraph(
        f"{INTERVAL}. {f'{sampled.promise}.' if sampled.replicates else READING}"
    )

"""The first page: which limits are met, what causes the rest, what to do next."""

from __future__ import annotations

import math
from collections.abc import Iterator

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
    Column,
    Document,
    Facts,
    Figure,
    Paragraph,
    Section,
    Table,
    note,
    paragraph,
    table,
)
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    text,
)
from tolstat.document.plot import Layer, Plot, PlotAxis, PlotPanel, Ranges, Rule
from tolstat.render.json_schema import share_words
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET, NOT_MET, UNDECIDED
from tolstat.statistics.summary import QUANTILES, Limited
from tolstat.units.scale import AS_IS, KNOWN, PART, PER_CENT, PPM

MATTERS = 0.05  # of the variance, from which a contributor is named
MOST_SENTENCES = 3
MOST_NAMED = 4  # parts in a sentence
LEVEL = PER_CENT.beside(1.0)  # of chance: no test is better than that
PRINTED = (0.05, 0.5, 0.95, 0.99)  # quantiles on a screen


def summary_document(found: RunSummary) -> Document:
    """Return what is printed at the end of a run."""
    n = found.trials.requested
    return Document(
        f"{found.title}: {n} {'trial' if n == 1 else 'trials'} of {found.model}",
        (*first_page(found), responses_table(found), *reading(found)),
    )


def first_page(found: RunSummary) -> tuple[Block, ...]:
    """Return the blocks of the first page, title block and header left out."""
    blocks: list[Block] = [Paragraph(lead(found), "lead")]
    if found.limited:
        blocks.append(limits_table(found))
    if steps := next_steps(found):
        numbered = Bullets(steps, numbered=len(steps) > 1)
        blocks.append(Section("What to do next", (numbered,), level=3))
    return (*blocks, *(note(each) for each in found.trials.notes))


def title_facts(block: TitleBlock) -> Facts:
    """Return the title block; what is not given is left out, except the approval."""
    rows = [(name, text(value)) for name, value in block._asdict().items() if value]
    if not block.approval:
        rows.append(("approval, date", ()))
    return Facts(tuple(rows), "sheet")


def lead(found: RunSummary) -> Parts:
    """Say how many limits are met, and the yield of all of them."""
    if found.all_limits is None:
        return text("The study limits no response.")
    verdicts = [found.responses[name].limited for name in found.limited]
    counts = {
        word: sum(1 for each in verdicts if each and each.yields.verdict == word)
        for word in WORST_FIRST
    }
    n = len(verdicts)
    said: list[Parts] = []
    for word, count in counts.items():
        if count and not said:
            of = "The limit " if n == 1 else f"{count} of {n} limits "
            of = f"All {n} limits " if count == n > 1 else of
            said.append(text(of, "is " if count == 1 else "are ", Word(word, word)))
        elif count:
            said.append(text(f"{count} ", Word(word, word)))
    within = Number(found.all_limits.within, PER_CENT)
    whose = "all limits" if n > 1 else "this limit"
    failed = " Failed trials count as out of limit." if found.trials.failed else ""
    return text(listed(said, joint=""), f". Yield, {whose}: ", within, f".{failed}")


def limits_table(found: RunSummary) -> Table:
    """Return verdict, fraction out of limit, main cause and effect of halving it."""
    heads: list[Column | str] = [
        "response", "limit", "verdict", "out of limit, ppm", "equivalent Ppk",
    ]  # fmt: skip
    heads += [Column("main cause", words=True), "tolerance halved, ppm"]
    rows = [_limit_row(found, name) for name in found.limited]
    if not any(row[-1].main for row in rows):  # no cause is named
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    return table(
        heads,
        rows,
        "Limits",
        caption=rests_on(found),
        look="verdicts",
    )


def _limit_row(found: RunSummary, name: str) -> list[Cell]:
    each = found.responses[name]
    limited = each.limited
    assert limited
    response = next(one for one in found.of.responses if one.name == name)
    link = name if isinstance(found, Report) and name in found.focus else ""
    below: Parts = ()
    if found.trials.failed:
        most = Number(limited.yields.most, PER_CENT)
        below = text("yield, if failed trials were good: ", most)
    return [
        response_cell(response, link),
        limit_cell(limited.limit),
        verdict_cell(limited.yields),
        Cell((ppm(limited.yields.out_of_limit),), below),
        Cell((Number(limited.equivalent),), demanded_ppk(limited.limit)),
        _cause_cell(each),
        _effect_cell(each, limited),
    ]


def demanded_ppk(limit: Limit) -> Parts:
    """Say which Ppk a limit demands: as typed, else of four figures."""
    typed = limit.typed_ppk
    return text("demanded ", f"{typed:.{KNOWN}g}" if typed else AS_IS.number(limit.ppk))


def _cause_cell(each: ResponseSummary) -> Cell:
    """Name the main cause of out-of-limit trials, over what it explains of them."""
    causes = each.causes
    if causes is None:
        return Cell(())
    if pair := causes.pair:
        every = [one.words for one in (pair, *causes.equivalent_pairs)]
        return Cell(text("; or equally ".join(every)), explained(pair, causes))
    if causes.leading:
        name = causes.leading[0]
        cause = causes.kinds.get(name) or causes.contributors[name]
        return Cell((Name(name),), text("significant at ", Number(cause.level, LEVEL)))
    return Cell(text(no_cause(causes)))


def explained(pair: PairCause, causes: Causes) -> Parts:
    """Say how many out-of-limit trials a pair explains, and how rare it is."""
    n = causes.out_of_limit
    trials = f"{round(pair.together.far.value * n)} of {n} out-of-limit trials "
    return text(
        trials, "are in the outer ", Number(pair.together.of_all, PART), " of it"
    )


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


def next_steps(found: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next: tighten the main cause, or run more trials."""
    steps = []
    for name in found.limited:
        each = found.responses[name]
        assert each.limited
        judged, causes = each.limited.yields, each.causes
        if judged.verdict == MET or causes is None or (main := causes.main) is None:
            continue
        told = differ(main.halved, judged.out_of_limit)
        if main.halved.value < judged.out_of_limit.value and (
            told or judged.verdict == NOT_MET
        ):
            steps.append(_tighten(found, name, causes, told))
            break
    undecided = [
        (each.limited.yields.needed, name)
        for name, each in found.responses.items()
        if each.limited
        and each.limited.yields.verdict == UNDECIDED
        and each.limited.yields.needed
    ]
    if undecided:
        needed, name = min(undecided)
        command = to_extend(found.of, needed)
        steps.append(
            text(
                "Decide ", Name(name), ": about ", counted(needed, "trial"),
                (" in all: ", Typed(command)) if command
                else ", in a new run of the study", ".",
            )
        )  # fmt: skip
    return tuple(steps)


def _tighten(found: RunSummary, name: str, causes: Causes, told: bool) -> Parts:
    """Say what halving the tolerances of the main cause gains, and how to prove it.

    Where these trials do not tell, a fresh run does.
    """
    main, each = causes.main, found.responses[name]
    assert main and each.limited
    parts = (
        main.together.members
        if isinstance(main, PairCause)
        else _members(found, causes.leading[0])
    )
    command = to_halve(found.of, parts)
    which = "tolerance of " if len(parts) == 1 else "tolerances of "
    return text(
        f"Halve the {which}" if told else f"Test half the {which}",
        listed([Name(part) for part in parts])
        if len(parts) <= MOST_NAMED
        else Name(causes.leading[0]),
        ": ", Name(name), " falls from " if told else " may fall from ",
        ppm(each.limited.yields.out_of_limit), " to ", ppm(main.halved),
        None if told else ", which these trials do not decide",
        (f". {'Prove it with a' if told else 'A'} fresh run: ", Typed(command))
        if command else None, ".",
    )  # fmt: skip


def _members(found: RunSummary, name: str) -> tuple[str, ...]:
    """Name the contributors of a kind of part."""
    from tolstat.model.description import kinds_of_part

    kinds = kinds_of_part(list(found.of.assumed), found.of.contributors)
    return tuple(kinds.get(name, (name,)))


def variance_sentences(found: Report) -> Iterator[Parts]:
    """Say which contributors have most of the variance, where no cause is named."""
    every = dict.fromkeys([*found.limited, *found.focus])
    told = 0
    for name in every:
        each = found.responses[name]
        if each.causes and each.causes.main:
            continue
        if (said := _variance(name, each)) and told < MOST_SENTENCES:
            told += 1
            yield said


def _variance(name: str, each: ReportedResponse) -> Parts:
    """Name up to three groups or contributors with most of a variance."""
    found = each.contributions
    if found is None:
        return ()
    few = found.dominated_by_few
    grouped = {member for members in each.members.values() for member in members}
    single = [part for part in found.first_order if part not in grouped]
    known: dict[str, Estimate] = {}
    for part in [*each.members, *single]:
        # what parts do together, where that can be told
        shares = [
            of[part]
            for of in (found.together, found.groups, found.first_order)
            if part in of and not math.isnan(of[part].value)
        ]
        if not shares or (few and shares[0] is not found.together.get(part)):
            continue
        share = shares[0]
        size = share.lower if few else share.value
        if MATTERS <= size <= 1 and not (share.sure and share.lower <= 0):
            known[part] = share
    order = sorted(known, key=lambda p: -(known[p].lower if few else known[p].value))
    named = [
        text(
            Name(part), " ",
            ("at least ", Number(known[part].lower, PER_CENT, "at_least"))
            if few or known[part].upper == 1
            else Number(known[part], PART),
        )
        for part in order[:3]
    ]  # fmt: skip
    about = text("Variance contributions to ", Name(name), ": ")
    if few:
        return text(
            about,
            "dominated by few trials",
            ("; ", listed(named)) if named else None,
            ".",
        )
    return text(about, listed(named), ".") if named else ()


def ranges_figure(found: RunSummary) -> Figure | None:
    """Draw the fractions out of limit with their intervals, and what is permitted."""
    limited = {
        name: each.limited
        for name in found.limited
        if (each := found.responses[name]).limited and each.limited
    }
    shares = {
        n: x.yields.out_of_limit
        for n, x in limited.items()
        if x.yields.out_of_limit.sure
    }
    if len(shares) < 2:
        return None
    import numpy as np

    permitted = {1e6 * (1 - x.limit.demanded) for x in limited.values()}
    least = min(1.0, *(each / 10 for each in permitted if each))
    ends = np.array([each[:3] for each in shares.values()]).T * 1e6
    value, lower, upper = np.maximum(ends, least)
    layers: tuple[Layer, ...] = (
        Ranges(
            tuple(shares), lower, upper, value,
            tuple(limited[n].yields.verdict for n in shares),
        ),
        *(
            Rule(each, upright=True, label=f"permitted {each:.4g}")
            for each in sorted(permitted)
        ),
    )  # fmt: skip
    said = ", ".join(f"{n} {PPM.number(each.value)}" for n, each in shares.items())
    plot = Plot(
        (PlotPanel(PlotAxis("out of limit, ppm", "log"), PlotAxis(""), layers),),
        width=7.0,
        height=0.22 * len(shares) + 0.8,
    )
    return Figure(f"Fractions out of limit in ppm: {said}", plot, wide=True)


def responses_table(found: RunSummary) -> Table:
    """Return the numbers of all responses."""
    shares = [
        Column(share_words(share), page_only=share not in PRINTED)
        for share in QUANTILES
    ]
    return table(
        [
            "response", "unit", "nominal", Column("mean *", page_only=True),
            Column("sigma *", page_only=True), Column("least", page_only=True),
            *shares, Column("largest", page_only=True),
        ],
        [
            [
                Name(name), each.scale.mark, Number(each.nominal, each.scale),
                Number(each.mean, each.scale), Number(each.sigma, each.scale),
                Number(each.least, each.scale),
                *(Number(each.quantiles[q], each.scale) for q in QUANTILES),
                Number(each.largest, each.scale),
            ]
            for name, each in found.responses.items()
        ],
        "Responses",
        caption=rests_on(found),
        keys=2,
        look="dense",
    )  # fmt: skip


def rests_on(found: RunSummary) -> Parts:
    """Say how many trials the numbers of a table rest on."""
    trials = found.trials
    of: Parts = ()
    if trials.counted < trials.requested:
        of = text(", of the ", Number(trials.counted), " that statistics rest on")
    done = counted(trials.done, "trial")
    return text(done, " done, ", Number(trials.failed), " failed", of)


def reading(found: RunSummary) -> tuple[Paragraph, ...]:
    """Explain the numbers."""
    run = found.of
    if run.sampled and not run.sampled.replicates:
        return (
            paragraph(
                "Below each number stands its 95 % interval. Quantiles: order "
                "statistics, for any distribution. Fractions out of limit: anytime-"
                "valid, trials may be added. Equivalent Ppk: of a normal response with "
                "the same fraction out of limit."
            ),
        )
    if run.sampled:
        return (
            paragraph(
                "Below each number stands its 95 % interval. ", run.sampled.promise, "."
            ),
        )
    return ()

"""All that a report says of one response in focus."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.next_steps import to_replay
from tolstat.answers.report.first_page import LEVEL, explained, no_cause, rests_on
from tolstat.answers.report.report_answer import (
    Cause,
    Causes,
    IntegrationErrors,
    Report,
    ReportedResponse,
)
from tolstat.answers.report.response_figures import figures_of
from tolstat.document.blocks import (
    Block,
    Cell,
    Column,
    Gallery,
    Given,
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
from tolstat.render.json_schema import share_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.units.scale import AS_IS, PART, PER_CENT, Ratio

CHOSEN = {"near": "next to the limit", "worst": "worst", "spread": "over the range"}
MOST_PAIRS = 3  # named beside the first


def response_section(found: Report, name: str) -> Section:
    """Return figures, performance, main causes, contributions, errors, worst trials."""
    each = found.responses[name]
    blocks: list[Block] = [note(_declared(each))]
    if said := _point_mass(each):
        blocks.append(paragraph(said))
    blocks.append(
        Gallery(tuple(figures_of(found, name)))
        if found.trials.done
        else paragraph(Word("No trial is done"), ": there is no value to draw.")
    )
    blocks += [paragraph(said) for said in _indices(each)]
    parts = (
        _performance(found, each),
        _causes(found, each),
        _contributions(found, each),
        _classical(found, name, each),
        _integration(each),
        _worst_trials(found, name, each),
    )
    blocks += [part for part in parts if part]
    return Section(name, tuple(blocks), name)


def _part(title: str, *blocks: Block | None) -> Section:
    return Section(title, tuple(each for each in blocks if each), level=3)


def _declared(each: ReportedResponse) -> Parts:
    source = f"equation {each.source}" if each.source else ""
    said = ", ".join(filter(None, (each.sentence, each.symbol, source)))
    return text(f"{said}." if said else None)


def _point_mass(each: ReportedResponse) -> Parts:
    """Say which value many trials share."""
    mass = each.point_mass
    if mass is None:
        return ()
    between = None
    if mass.least != mass.largest:
        ends = (Number(end, each.scale) for end in (mass.least, mass.largest))
        between = text(" (from ", next(ends), " to ", next(ends), ")")
    return text(
        Number(mass.share, PER_CENT), " of production shares one value, ",
        Number(mass.value, each.scale), between, ". The histogram shows the others.",
    )  # fmt: skip


def _indices(each: ReportedResponse) -> list[Parts]:
    """Say why there are no Sobol' indices, where the run was made for them."""
    found = each.indices
    if found is None:
        return []
    groups = counted(found.groups, "whole group")
    left = f" ({found.broken} left out: not all of their trials are done)"
    if found.dominated_by_few:
        return [
            text(
                "No Sobol' indices: few trials dominate the variance of the ",
                groups,
                left,
                ".",
            )
        ]
    if any(share.value == share.value for share in found.first.values()):
        return []
    reasons = [share.reason for share in found.total.values()]
    reason = reasons[0] if reasons else "nothing deviates"
    return [text("No Sobol' indices: ", reason, "; there are ", groups, left, ".")]


def _performance(found: Report, each: ReportedResponse) -> Section | None:
    limited = each.limited
    if limited is None:
        return None
    rows: list[list[Given]] = [
        ["equivalent, of the fraction out of limit", None, Number(limited.equivalent)],
        ["by percentiles (ISO 22514-2)", ppk_cell(limited.percentiles.pp),
         ppk_cell(limited.percentiles.ppk)],
        ["by moments, as for normal responses", ppk_cell(limited.moments.pp),
         ppk_cell(limited.moments.ppk)],
    ]  # fmt: skip
    heads = [f"against {limited.limit.words}", "Pp", "Ppk"]
    said = "Simulated trials show performance, not the capability of a process."
    return _part("Performance", table(heads, rows, caption=rests_on(found)), note(said))


def _causes(found: Report, each: ReportedResponse) -> Section | None:
    causes, limited = each.causes, each.limited
    if causes is None or limited is None:
        return None
    said = text(
        counted(causes.out_of_limit, "trial"), " out of limit",
        ", failed ones among them" if found.trials.failed else None,
    )  # fmt: skip
    if causes.leading:
        said = text(said, ". Significantly different among them: ",
                    listed([Name(each) for each in causes.leading]), ".")  # fmt: skip
    else:
        said = text(said, f": {no_cause(causes)}.")
    blocks: list[Block | None] = [paragraph(said)]
    if causes.pairs:
        blocks.append(paragraph(_pairs(causes)))
    if causes.contributors and causes.out_of_limit:
        blocks.append(_causes_table(found, causes, limited.yields.out_of_limit))
        blocks.append(note(
            "Among out-of-limit trials: mean less that of all trials, and root mean "
            "square distance from it, both in sigmas of all trials. Level: how often "
            "chance alone makes some contributor differ so much (two rank sum tests, "
            f"corrected for {len(causes.contributors)} contributors after Holm; of a "
            "kind of part its clearest member). Halved: the stored trials weighted by "
            "the ratio of densities; a fresh run tells more sharply."
        ))  # fmt: skip
    if found.assumptions.correlation and causes.contributors:
        blocks.append(
            note(
                "Deviations are correlated: what is correlated with a cause differs "
                "too."
            )
        )
    return _part("Main causes of out-of-limit trials", *blocks)


def _pairs(causes: Causes) -> Parts:
    first, *others = causes.pairs
    together = first.together
    return text(
        "Together: ", Word(first.words), ": ", explained(first, causes),
        "; either of them alone in at most ",
        Number(together.alone, PER_CENT, "at_most"), " (level ",
        Number(together.level, PER_CENT), ", corrected for the number of pairs)",
        ("; with both tolerances halved ", ppm(first.halved))
        if first.halved.sure
        else None,
        ("; also ", listed([
            text(other.words, " (level ", Number(other.together.level, PER_CENT), ")")
            for other in others[:MOST_PAIRS]
        ])) if others else None,
        ".",
    )  # fmt: skip


def _causes_table(found: Report, causes: Causes, now: Estimate) -> Table:
    heads = [
        "contributor", "mean, sigmas", "distance, sigmas", "level, %",
        "out of limit with its tolerance halved, ppm", "effective sample size",
    ]  # fmt: skip
    rows: list[list[Given]] = [
        ["all as specified", None, None, None, ppm(now), Number(found.trials.counted)]
    ]
    for of in (causes.kinds, causes.contributors):
        rows += [_cause_row(name, of[name]) for name in clearest_first(of)]
    return table(heads, rows, caption=rests_on(found))


def _cause_row(name: str, each: Cause) -> list[Given]:
    known = each.shift == each.shift
    return [
        Word(name) if each.significant else Name(name),
        Number(each.shift) if known else None,
        Number(each.width) if known else None,
        Number(each.level, LEVEL),
        ppm(each.halved),
        Number(each.effective_sample_size) if each.effective_sample_size else None,
    ]


def clearest_first(found: Mapping[str, Cause]) -> list[str]:
    """Sort by how clearly it differs, then by what halving leaves out of limit."""

    def place(name: str) -> tuple[float, float]:
        left = found[name].halved.value
        return found[name].level, math.inf if math.isnan(left) else left

    return sorted(found, key=place)


def _contributions(found: Report, each: ReportedResponse) -> Section | None:
    known = each.contributions
    if known and not known.first_order:
        known = None
    every = _contributors(each)
    if not every:
        return None
    blocks: list[Block | None] = []
    if known and known.dominated_by_few:
        blocks.append(paragraph(
            "Few trials dominate the variance. The trials tell what parts contribute "
            "together at least, and not what each contributes alone."
        ))  # fmt: skip
    if known and known.groups:
        blocks.append(_groups_table(found, each, known))
    blocks.append(_contributors_table(found, each, known, every))
    if known:
        blocks.append(note(_remarks(found, known)))
    return _part("Variance contributions", *blocks)


def _contributors(each: ReportedResponse) -> list[str]:
    """Name all contributors of which something is known, what matters first."""
    known = [*each.leading, *each.slopes]
    for case in each.worst_cases.values():
        known += [name for name, off in case.deviations.items() if off]
    return list(dict.fromkeys(known))


def _groups_table(found: Report, each: ReportedResponse, known: Contributions) -> Table:
    few = known.dominated_by_few

    def size(group: str) -> float:
        for shares in (known.together, known.groups):
            if not math.isnan(shares[group].value) and shares[group].value:
                return shares[group].value
        return 0.0

    rows: list[list[Given]] = []
    for group in sorted(known.groups, key=lambda name: -size(name)):
        members = Cell((Name(group),), text(", ".join(each.members[group])))
        together = known.together[group]
        if not few:
            rows.append(
                [members, Number(known.groups[group], PART), Number(together, PART)]
            )
        elif together.sure:
            least = Number(max(together.lower, 0.0), PER_CENT, "at_least")
            rows.append([members, text("at least ", least)])
        else:
            rows.append([members, Cell((), text(together.reason))])
    heads = ["parts", "each alone, summed, %", "together with interactions, %"]
    return table([Column(heads[0], words=True), *heads[2 if few else 1 :]], rows,
                 caption=rests_on(found))  # fmt: skip


def _contributors_table(
    found: Report, each: ReportedResponse, known: Contributions | None, every: list[str]
) -> Table:
    scales = found.of.scales
    alone = known.first_order if known and not known.dominated_by_few else {}
    ranks = known.rank_regression if known else {}
    linear = each.linear.shares if each.linear else {}
    columns: dict[str, Mapping[str, Number | Parts]] = {
        "alone, % of the variance": {n: Number(x, PART) for n, x in alone.items()},
        "rank regression coefficient": {n: Number(x) for n, x in ranks.items()},
        "slope at the nominal trial": {
            n: text(Number(x, Ratio(each.scale, scales[n])), "")  # with its unit
            for n, x in each.slopes.items()
        },
        "root sum square, % of the variance": {
            n: Number(x, PER_CENT) for n, x in linear.items()
        },
        **{
            f"worst case, {side}": {
                n: text(Number(x, scales[n]), "") for n, x in case.deviations.items()
            }
            for side, case in each.worst_cases.items()
        },
    }
    columns = {head: cells for head, cells in columns.items() if cells}
    rows: list[list[Given]] = [
        [Name(part), *(cells.get(part) for cells in columns.values())] for part in every
    ]
    return table(["contributor", *columns], rows, caption=rests_on(found))


def _remarks(found: Report, known: Contributions) -> Parts:
    rest = "interaction" if known.linear else "interaction, correlation or chance"
    alone, ranks = known.unexplained, known.explained
    told = not known.dominated_by_few and not math.isnan(alone.value)
    return text(
        ("Not explained by contributors alone: ", Number(alone, PART), f" ({rest}). ")
        if told
        else None,
        None
        if math.isnan(ranks.value)
        else ("Ranks explain ", Number(ranks, PART), ". "),
        "Shares come from a linear regression, which explains nearly all. "
        if known.linear
        else "Shares come from nearest neighbours, which understate what parts do "
        "together. ",
        "Estimates below 0 are chance. " if told and not known.linear else None,
        "They hold for trials such as those seen; a rarer kind would change them.",
        " Deviations are correlated: shares overlap and need not add up to 100 %."
        if found.assumptions.correlation
        else None,
    )  # fmt: skip


def _classical(found: Report, name: str, each: ReportedResponse) -> Section | None:
    if not (each.linear or each.worst_cases):
        return None
    rows: list[list[Given]] = []
    for side, case in each.worst_cases.items():
        failed = (
            f"; {case.failed} of these failed, and count as out of limit"
            if case.failed
            else None
        )
        rows.append([
            f"worst case, {side}", Number(case.value, each.scale),
            text(
                f"no probability: the worst of {case.tried} trials within the "
                "tolerances", failed,
            ),
        ])  # fmt: skip
    if each.linear:
        sigma = text("sigma ", Number(each.linear.sigma, each.scale))
        rows.append([
            "root sum square", Cell((Number(each.linear.mean, each.scale),), sigma),
            "slopes at the nominal trial, normal response",
        ])  # fmt: skip
    for departure in each.departures:
        simulated = text(
            "simulated ", Number(each.quantiles[departure.share], each.scale)
        )
        wrong = "little" if departure.relative > 0 else "much"
        fails = (Word("root sum square fails"), f", it promises too {wrong}: ")
        rows.append([
            f"{share_words(departure.share)}: root sum square",
            Number(departure.linear, each.scale),
            text(fails if departure.fails else None, simulated),
        ])  # fmt: skip
    heads: list[Column | str] = ["answer", each.scale.label(name)]
    heads.append(Column("", words=True))
    return _part("Classical answers", table(heads, rows, caption=rests_on(found)))


def _integration(each: ReportedResponse) -> Section | None:
    errors = each.integration_errors
    if errors is None:
        return None
    exact = each.scale.exact
    tightened = ", ".join(f"{k} {AS_IS.number(v)}" for k, v in errors.settings.items())
    said = [text(
        counted(errors.trials, "trial"), f" evaluated again with {tightened} "
        f"({errors.failed} failed one of the two times)."
    )]  # fmt: skip
    if errors.at_random.trials:
        said.append(text(
            f"Largest error of the {errors.at_random.trials} chosen at random: ",
            Number(errors.at_random.largest, exact), ". ",
            ("At most ", Number(errors.above, PER_CENT, "at_most"),
             " of production err more (95 %).")
            if errors.above == errors.above
            else "The fraction that errs more is not known: trials depend on each "
            "other.",
        ))  # fmt: skip
    if errors.chosen:
        chosen = [
            text(f"{of.trials} {CHOSEN[why]} ", Number(of.largest, exact))
            for why, of in errors.chosen.items()
        ]
        said.append(
            text("Largest error of those chosen on purpose: ", listed(chosen), ".")
        )
    if errors.effect:
        largest = Number(errors.largest, exact)
        said.append(text("The largest of all, ", largest, ", is no bound for others."))
    said += _effect(each, errors)
    return _part("Integration error", *map(paragraph, said))


def _effect(each: ReportedResponse, errors: IntegrationErrors) -> list[Parts]:
    """Say how far errors move the numbers, and how many trials change sides."""
    effect, sides, exact = errors.effect, errors.sides, each.scale.exact
    if effect is None:
        return []
    moved = [("mean", effect.mean), ("sigma", effect.sigma)]
    moved += [(share_words(share), by) for share, by in effect.quantiles.items()]
    said = [text(
        "If each trial errs as the audited one of nearest response, errors move ",
        listed([text(f"{what} by ", Number(by, exact)) for what, by in moved]),
        (", the fraction out of limit by ", Number(effect.out_of_limit, PER_CENT))
        if effect.out_of_limit is not None
        else None,
        ".",
    )]  # fmt: skip
    if sides is None:
        return said
    gap = Number(sides.gap, exact)
    if math.isinf(sides.gap):
        rest = text("All were evaluated again.")
    elif sides.gap <= errors.largest:
        rest = text(
            "One that was not evaluated again lies ", gap, " from the limit, and "
            "errors as large were seen: others may change sides too."
        )  # fmt: skip
    else:
        rest = text(
            f"All {sides.near} less than ", gap, " from the limit were evaluated "
            "again. While no other errs by so much, the fraction out of limit moves by "
            "at most ",
            Number(sides.at_most, PER_CENT, "at_most"), ".",
        )  # fmt: skip
    changed = text(
        "Trials that change sides of the limit: ", Number(sides.changed), ". "
    )
    return [*said, text(changed, rest)]


def _worst_trials(found: Report, name: str, each: ReportedResponse) -> Section | None:
    if not each.worst_trials:
        return None
    named, scales = list(each.worst_trials[0].deviations), found.of.scales
    heads: list[Column | str] = ["trial", each.scale.label(name)]
    heads += ["evaluated again"] * bool(each.integration_errors)
    heads += [*named, Column("to see it again", words=True)]
    rows: list[list[Given]] = []
    for worst in each.worst_trials:
        row: list[Given] = [
            Number(worst.trial),
            Number(worst.value, each.scale),
        ]
        if each.integration_errors:
            row.append(Number(worst.precise, each.scale))
        row += [text(Number(worst.deviations[n], scales[n]), "") for n in named]
        again = to_replay(found.of.path, worst.trial, found.of.machine)
        rows.append([*row, Typed(again)])
    of = rests_on(found)
    if found.trials.counted < found.trials.requested:  # these are the worst of all
        of = text("of all ", Number(found.trials.by_status["done"]), " trials done")
    return _part("Worst trials", table(heads, rows, caption=of))

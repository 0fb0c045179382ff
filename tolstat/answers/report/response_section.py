"""All that a report says of one response in focus."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.next_steps import to_replay
from tolstat.answers.report.first_page import (
    LEVEL,
    explained,
    no_cause,
    rests_on,
    share_of_kind,
)
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
    Gallery,
    Given,
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
    with_unit,
)
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.units.scale import AS_IS, PART, PER_CENT, Ratio, Scale, share_words

Row = dict[str, Given]

CHOSEN = {"near": "next to the limit", "worst": "worst", "spread": "over the range"}
MOST_PAIRS = 3  # named beside the first
PERFORMANCE = "Simulated trials show performance, not the capability of a process."
LEVELS = (
    "Among out-of-limit trials: mean less that of all trials, and root mean square "
    "distance from it, both in sigmas of all trials. Level: how often chance alone "
    "makes some contributor differ so much (two rank sum tests, corrected for {} "
    "contributors after Holm; of a kind of part its clearest member). Halved: the "
    "stored trials weighted by the ratio of densities; a fresh run tells more sharply."
)
CORRELATED = "Deviations are correlated: what is correlated with a cause differs too."
FEW = (
    "Few trials dominate the variance. The trials tell what parts contribute together "
    "at least, and not what each contributes alone."
)
LINEAR = "Shares come from a linear regression, which explains nearly all. "
NEIGHBOURS = (
    "Shares come from nearest neighbours, which understate what parts do together. "
)
RARER = "They hold for trials such as those seen; a rarer kind would change them."
OVERLAP = " Deviations are correlated: shares overlap and need not add up to 100 %."


def response_section(found: Report, name: str) -> Section:
    """Return figures, performance, main causes, contributions, errors, worst trials."""
    each = found.responses[name]
    nothing = text(Word("No trial is done"), ": there is no value to draw.")
    done = found.trials.done
    blocks = shown(
        note(_declared(each)),
        paragraph(_point_mass(each)),
        Gallery(figures_of(found, name)) if done else paragraph(nothing),
        paragraph(_indices(each)),
        _part("Performance", *_performance(found, each)),
        _part("Main causes of out-of-limit trials", *_causes(found, each)),
        _part("Variance contributions", *_contributions(found, each)),
        _part("Classical answers", _classical(found, name, each)),
        _part("Integration error", *map(paragraph, _integration(each))),
        _part("Worst trials", _worst_trials(found, name, each)),
    )
    return Section(name, blocks, name)


def _part(title: str, *blocks: Block | None) -> Section:
    return Section(title, shown(*blocks), level=3)


def _declared(each: ReportedResponse) -> Parts:
    source = f"equation {each.source}" if each.source else ""
    said = ", ".join(filter(None, (each.sentence, each.symbol, source)))
    return text(f"{said}." if said else None)


def _point_mass(each: ReportedResponse) -> Parts:
    """Say which value many trials share."""
    if (mass := each.point_mass) is None:
        return ()
    ends = Number(mass.least, each.scale), Number(mass.largest, each.scale)
    return say(
        "{} of production shares one value, {}{}. The histogram shows the others.",
        Number(mass.share, PER_CENT), Number(mass.value, each.scale),
        say(" (from {} to {})", *ends) if mass.least != mass.largest else None,
    )  # fmt: skip


def _indices(each: ReportedResponse) -> Parts:
    """Say why there are no Sobol' indices, where the run was made for them."""
    found = each.indices
    if found is None:
        return ()
    reason = next((x.reason for x in found.total.values()), "nothing deviates")
    if found.dominated_by_few:
        reason = "few trials dominate the variance"
    elif any(share.value == share.value for share in found.first.values()):
        return ()
    return say(
        "No Sobol' indices: {}; there are {} ({} left out: not all of their trials are "
        "done).",
        reason, counted(found.groups, "whole group"), str(found.broken),
    )  # fmt: skip


def _performance(found: Report, each: ReportedResponse) -> tuple[Block, ...]:
    if (limited := each.limited) is None:
        return ()
    head = f"against {limited.limit.words}"
    rows: list[Row] = [
        {head: "equivalent, of the fraction out of limit", "Pp": None,
         "Ppk": Number(limited.equivalent)},
    ]  # fmt: skip
    for method, by in (
        ("by percentiles (ISO 22514-2)", limited.percentiles),
        ("by moments, as for normal responses", limited.moments),
    ):
        rows.append({head: method, "Pp": ppk_cell(by.pp), "Ppk": ppk_cell(by.ppk)})
    return table_of(rows, caption=rests_on(found)), note(PERFORMANCE)


def _causes(found: Report, each: ReportedResponse) -> tuple[Block | None, ...]:
    if (causes := each.causes) is None:
        return ()
    said = text(f": {no_cause(causes)}.")
    if causes.leading:
        names = listed([Name(each) for each in causes.leading])
        said = say(". Significantly different among them: {}.", names)
    out, known = causes.out_of_limit, causes.contributors
    failed = ", failed ones among them" if found.trials.failed else None
    correlated = found.assumptions.correlation and known
    return (
        paragraph(say("{} out of limit{}{}", counted(out, "trial"), failed, said)),
        paragraph(_pairs(causes)),
        _causes_table(found, causes) if out else None,
        note(say(LEVELS, str(len(known)))) if out and known else None,
        note(CORRELATED) if correlated else None,
    )


def _pairs(causes: Causes) -> Parts:
    if not causes.pairs:
        return ()
    first, *others = causes.pairs
    together, halved = first.together, first.halved
    also = [
        say("{} (level {})", other.words, Number(other.together.level, PER_CENT))
        for other in others[:MOST_PAIRS]
    ]
    return say(
        "Together: {}: {}; either of them alone in at most {} (level {}, corrected for "
        "the number of pairs){}{}.",
        Word(first.words), explained(first, causes),
        Number(together.alone, PER_CENT, "at_most"), Number(together.level, PER_CENT),
        say("; with both tolerances halved {}", ppm(halved)) if halved.sure else None,
        say("; also {}", listed(also)) if also else None,
    )  # fmt: skip


def _causes_table(found: Report, causes: Causes) -> Table:
    rows: list[Row] = []
    for of in (causes.kinds, causes.contributors):
        for name in clearest_first(of):
            each, size = of[name], of[name].effective_sample_size
            known = each.shift == each.shift
            rows.append({
                "contributor": Word(name) if each.significant else Name(name),
                "mean, sigmas": Number(each.shift) if known else None,
                "distance, sigmas": Number(each.width) if known else None,
                "level, %": Number(each.level, LEVEL),
                "out of limit with its tolerance halved, ppm": ppm(each.halved),
                "effective sample size": Number(size) if size else None,
            })  # fmt: skip
    return table_of(rows, caption=rests_on(found))


def clearest_first(found: Mapping[str, Cause]) -> list[str]:
    """Sort by how clearly it differs, then by what halving leaves out of limit."""

    def place(name: str) -> tuple[float, float]:
        left = found[name].halved.value
        return found[name].level, math.inf if math.isnan(left) else left

    return sorted(found, key=place)


def _contributions(found: Report, each: ReportedResponse) -> tuple[Block | None, ...]:
    known = each.contributions
    if known and not known.first_order:
        known = None
    every = [*each.leading, *each.slopes]  # what matters first
    for case in each.worst_cases.values():
        every += [name for name, off in case.deviations.items() if off]
    if not every:
        return ()
    return (
        paragraph(FEW) if known and known.dominated_by_few else None,
        _groups_table(found, each, known) if known else None,
        _contributors_table(found, each, known, list(dict.fromkeys(every))),
        note(_remarks(found, known)) if known else None,
    )


def _groups_table(found: Report, each: ReportedResponse, known: Contributions) -> Table:
    rows: list[Row] = []
    size = {name: share_of_kind(each, name).value for name in known.groups}
    for group in sorted(size, key=lambda n: -size[n] if size[n] == size[n] else 0.0):
        together, head = known.together[group], "together with interactions, %"
        row: Row = {"parts": Cell((Name(group),), text(", ".join(each.members[group])))}
        if not known.dominated_by_few:
            row["each alone, summed, %"] = Number(known.groups[group], PART)
            row[head] = Number(together, PART)
        elif together.sure:
            least = Number(max(together.lower, 0.0), PER_CENT, "at_least")
            row[head] = text("at least ", least)
        else:
            row[head] = Cell((), text(together.reason))
        rows.append(row)
    return table_of(rows, words=["parts"], caption=rests_on(found))


def _contributors_table(
    found: Report, each: ReportedResponse, known: Contributions | None, every: list[str]
) -> Table:
    alone = known.first_order if known and not known.dominated_by_few else {}
    ranks = known.rank_regression if known else {}
    linear = each.linear.shares if each.linear else {}
    rows: list[Row] = []
    for part in every:
        scale = found.of.scales[part]

        def known_of(
            of: Mapping[str, Estimate] | Mapping[str, float], scale: Scale | Ratio
        ) -> Number | None:
            return Number(of[part], scale) if part in of else None  # noqa: B023

        ratio = Ratio(each.scale, scale)
        rows.append({
            "contributor": Name(part),
            "alone, % of the variance": known_of(alone, PART),
            "rank regression coefficient": known_of(ranks, AS_IS),
            "slope at the nominal trial": with_unit(known_of(each.slopes, ratio)),
            "root sum square, % of the variance": known_of(linear, PER_CENT),
            **{
                f"worst case, {side}": with_unit(known_of(case.deviations, scale))
                for side, case in each.worst_cases.items()
            },
        })  # fmt: skip
    return table_of(rows, caption=rests_on(found))


def _remarks(found: Report, known: Contributions) -> Parts:
    rest = "interaction" if known.linear else "interaction, correlation or chance"
    alone, ranks = Number(known.unexplained, PART), Number(known.explained, PART)
    told = not known.dominated_by_few and not math.isnan(known.unexplained.value)
    return text(
        say(f"Not explained by contributors alone: {{}} ({rest}). ", alone)
        if told else None,
        None if math.isnan(known.explained.value)
        else say("Ranks explain {}. ", ranks),
        LINEAR if known.linear else NEIGHBOURS,
        "Estimates below 0 are chance. " if told and not known.linear else None,
        RARER,
        OVERLAP if found.assumptions.correlation else None,
    )  # fmt: skip


def _classical(found: Report, name: str, each: ReportedResponse) -> Table:
    scale, rows = each.scale, dict[str, tuple[Given, Said]]()
    for side, case in each.worst_cases.items():
        said = f"no probability: the worst of {case.tried} trials within the tolerances"
        if case.failed:
            said += f"; {case.failed} of these failed, and count as out of limit"
        rows[f"worst case, {side}"] = Number(case.value, scale), said
    if linear := each.linear:
        sigma = say("sigma {}", Number(linear.sigma, scale))
        mean = Cell((Number(linear.mean, scale),), sigma)
        rows["root sum square"] = mean, "slopes at the nominal trial, normal response"
    for departure in each.departures:
        wrong = "little" if departure.relative > 0 else "much"
        fails = (Word("root sum square fails"), f", it promises too {wrong}: ")
        simulated = Number(each.quantiles[departure.share], scale)
        rows[f"{share_words(departure.share)}: root sum square"] = (
            Number(departure.linear, scale),
            (fails if departure.fails else None, "simulated ", simulated),
        )
    return table_of(
        [{"answer": answer, scale.label(name): value, "": text(said)}
         for answer, (value, said) in rows.items()],
        words=[""], caption=rests_on(found),
    )  # fmt: skip


def _integration(each: ReportedResponse) -> list[Parts]:
    """Say how large integration errors are, and what they move."""
    if (errors := each.integration_errors) is None:
        return []
    exact, n = each.scale.exact, errors.at_random.trials
    tightened = ", ".join(f"{k} {AS_IS.number(v)}" for k, v in errors.settings.items())
    above = text(
        "The fraction that errs more is not known: trials depend on each other."
    )
    if errors.above == errors.above:
        most = Number(errors.above, PER_CENT, "at_most")
        above = say("At most {} of production err more (95 %).", most)
    chosen = [
        text(f"{of.trials} {CHOSEN[why]} ", Number(of.largest, exact))
        for why, of in errors.chosen.items()
    ]
    random = Number(errors.at_random.largest, exact)
    return [
        say(f"{{}} evaluated again with {tightened} ({errors.failed} failed one of the "
            "two times).", counted(errors.trials, "trial")),
        say(f"Largest error of the {n} chosen at random: {{}}. {{}}", random, above)
        if n else (),
        say("Largest error of those chosen on purpose: {}.", listed(chosen))
        if chosen else (),
        say("The largest of all, {}, is no bound for others.",
            Number(errors.largest, exact)) if errors.effect else (),
        *_effect(each, errors),
    ]  # fmt: skip


def _effect(each: ReportedResponse, errors: IntegrationErrors) -> list[Parts]:
    """Say how far errors move the numbers, and how many trials change sides."""
    effect, sides, exact = errors.effect, errors.sides, each.scale.exact
    if effect is None:
        return []
    moved = {"mean": effect.mean, "sigma": effect.sigma}
    moved |= {share_words(share): by for share, by in effect.quantiles.items()}
    numbers = [say(f"{what} by {{}}", Number(by, exact)) for what, by in moved.items()]
    if effect.out_of_limit is not None:
        by = Number(effect.out_of_limit, PER_CENT)
        numbers.append(say("the fraction out of limit by {}", by))
    said = [say(
        "If each trial errs as the audited one of nearest response, errors move {}.",
        listed(numbers),
    )]  # fmt: skip
    if sides is None:
        return said
    gap = Number(sides.gap, exact)
    if math.isinf(sides.gap):
        rest = text("All were evaluated again.")
    elif sides.gap <= errors.largest:
        rest = say(
            "One that was not evaluated again lies {} from the limit, and errors as "
            "large were seen: others may change sides too.", gap,
        )  # fmt: skip
    else:
        rest = say(
            f"All {sides.near} less than {{}} from the limit were evaluated again. "
            "While no other errs by so much, the fraction out of limit moves by at "
            "most {}.",
            gap, Number(sides.at_most, PER_CENT, "at_most"),
        )  # fmt: skip
    sentence = "Trials that change sides of the limit: {}. {}"
    return [*said, say(sentence, Number(sides.changed), rest)]


def _worst_trials(found: Report, name: str, each: ReportedResponse) -> Table:
    again, scales, run = "to see it again", found.of.scales, found.of
    rows: list[Row] = []
    for worst in each.worst_trials:
        precise = Number(worst.precise, each.scale)
        rows.append({
            "trial": Number(worst.trial),
            each.scale.label(name): Number(worst.value, each.scale),
            "evaluated again": precise if each.integration_errors else None,
            **{n: with_unit(Number(x, scales[n])) for n, x in worst.deviations.items()},
            again: Typed(to_replay(run.path, worst.trial, run.machine)),
        })  # fmt: skip
    of = rests_on(found)
    if found.trials.counted < found.trials.requested:  # these are the worst of all
        of = say("of all {} trials done", Number(found.trials.by_status["done"]))
    return table_of(rows, words=[again], caption=of)

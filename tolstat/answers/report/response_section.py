"""The section of a report on one response in focus."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.next_steps import to_replay, typed_setting
from tolstat.answers.report.first_page import (
    CENTRAL,
    at_least,
    explained,
    no_cause,
    rests_on,
)
from tolstat.answers.report.off_centre import finding
from tolstat.answers.report.response_figures import figures_of
from tolstat.answers.report.summary_document import AS_SAMPLED, for_any
from tolstat.document import blocks
from tolstat.document.blocks import Block, Cell, Given, Section, Table
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Said,
    Typed,
    Word,
    counted,
    say,
    text,
    with_unit,
)
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, PART, PER_CENT, PPM, Ratio, Scale, share_words

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import (
        Cause,
        Causes,
        NamedCause,
        Report,
        ReportedResponse,
    )
    from tolstat.statistics.sensitivity.contributions import Contributions

Row = dict[str, Given]
Values = Mapping[str, Estimate] | Mapping[str, float]

CHOSEN = {
    "random": "at random", "near": "next to the limit", "worst": "worst",
    "spread": "over the range", "out": "at random, out of limit",
}  # fmt: skip
ALONE, TOGETHER = "alone, % of the variance", "with interactions, % of the variance"
STILL = (
    "All trials lie from {} to {}. This range is below a thousandth of its distance to "
    "the limit: its spread is not analysed."
)
PERFORMANCE = (
    "Simulated trials show performance, not the capability of a process. By moments of "
    "random trials: as sampled."
)
REACH = (
    "For any distribution: no unit leaves the declared range of the response. Where "
    "none is declared, none lies more than twice the observed range outside."
)
LEVELS = (
    "Among out-of-limit trials: mean less that of all trials, and root mean square "
    "distance from it, both in sigmas of all trials. Level: how often chance alone "
    "makes some contributor differ so much (two rank sum tests, corrected for {} "
    "contributors and for pairs; of a kind of part its least clear member, unless it "
    "is named as a whole). Halved: the "
    "stored trials weighted by the ratio of densities; a fresh run is more precise."
)
CORRELATED = (
    "Deviations are correlated: parts correlated with a cause differ too. They are "
    "named only for what the others do not tell."
)
FEW = (
    "Few trials dominate the variance. The trials show the least joint contribution of "
    "parts, and not the contribution of each alone."
)
LINEAR = "Shares come from a linear regression, which explains nearly all. "
NEIGHBOURS = (
    "Shares come from nearest neighbours, which understate joint effects of parts. "
)
CLIPPED = (
    "Few trials may dominate the variance: shares are those of the response clipped to "
    "the central 99 % of its trials. "
)
RARER = "They hold for trials like those seen. A rarer kind would change them."
OVERLAP = " Deviations are correlated: shares overlap and need not add up to 100 %."


def response_section(found: Report, name: str) -> Section:
    """Return figures, performance, main causes, contributions, errors, worst trials."""
    each = found.responses[name]
    nothing = text(Word("No trial is done"), ": there is no value to draw.")
    if each.still:
        ends = Number(each.least, each.scale), Number(each.largest, each.scale)
        nothing = say(STILL, *ends)
    drawn = found.trials.done and not each.still
    analysed = (
        _part("Main causes of out-of-limit trials", *_causes(found, each)),
        _part("Variance contributions", *_contributions(found, each)),
        _part("Classical answers", _classical(found, name, each)),
    )
    shown = blocks.shown(
        blocks.note(_declared(each)),
        blocks.paragraph(_point_mass(each, found.trials.done)),
        blocks.Gallery(figures_of(found, name)) if drawn else blocks.paragraph(nothing),
        blocks.paragraph(finding(found.stored_run, name, each)),
        _part("Performance", *_performance(found, each)),
        _part("Mean and sigma", *_kinds_of_interval(found, each)),
        *(() if each.still else analysed),
        _part("Integration error", *_integration(found, each)),
        _part("Worst trials", _worst_trials(found, name, each)),
    )
    return Section(name, shown, name)


def _part(title: str, *given: Block | None) -> Section:
    return Section(title, blocks.shown(*given), level=3)


def _declared(each: ReportedResponse) -> Parts:
    source = f"equation {each.source}" if each.source else ""
    said = ", ".join(filter(None, (each.sentence, each.symbol, source)))
    return text(f"{said}." if said else None)


def _point_mass(each: ReportedResponse, done: int) -> Parts:
    """Return a sentence on the value that many trials share."""
    if (mass := each.point_mass) is None:
        return ()
    ends = Number(mass.least, each.scale), Number(mass.largest, each.scale)
    return say(
        "{} of production shares one value, {}{}. The histogram shows the others.",
        Number(mass.share, PER_CENT, of=done), Number(mass.value, each.scale),
        say(" (from {} to {})", *ends) if mass.least != mass.largest else None,
    )  # fmt: skip


def _indices(each: ReportedResponse) -> Parts:
    """Return the trials behind Sobol' indices, or why there are none."""
    if (found := each.indices) is None:
        return ()
    why = f"No Sobol' indices: {found.reason}; there are" if found.reason else None
    left_out = f"({found.broken} left out: not all of their trials are done)."
    groups = counted(found.groups, "group")
    return text(why or "Sobol' indices of", " ", groups, f" of trials {left_out}")


def _performance(found: Report, each: ReportedResponse) -> tuple[Block, ...]:
    if (limited := each.limited) is None:
        return ()
    head = f"against {limited.limit.words}"
    found_by: dict[str, Iterable[Given]] = {
        "equivalent, of the fraction out of limit": (
            None,
            Number(limited.equivalent_ppk),
        ),
        "by percentiles (ISO 22514-2)": map(ppk_cell, limited.percentiles),
        "by moments, as for normal responses": map(ppk_cell, limited.moments),
    }
    rows: list[Row] = [
        {head: method, "Pp": pp, "Ppk": ppk} for method, (pp, ppk) in found_by.items()
    ]
    return blocks.table_of(rows, caption=rests_on(found)), blocks.note(PERFORMANCE)


def _kinds_of_interval(found: Report, each: ReportedResponse) -> tuple[Block, ...]:
    """Return mean and sigma with either kind of interval."""
    wide, own = for_any(each), each.scale
    rows: list[Row] = [
        {
            "interval": "as sampled",
            "mean": None if "mean" in wide else Number(each.mean, own),
            "sigma": None if "sigma" in wide else Number(each.sigma, own),
        },
        {
            "interval": "for any distribution",
            "mean": Number(each.mean_for_any_distribution, own),
            "sigma": Number(each.sigma_for_any_distribution, own),
        },
    ]
    table = blocks.table_of(rows, caption=rests_on(found))
    return table, blocks.note(f"{AS_SAMPLED} {REACH}")


def _causes(found: Report, each: ReportedResponse) -> tuple[Block | None, ...]:
    if (causes := each.causes) is None:
        return ()
    out, known = causes.trials_out_of_limit, causes.contributors
    failed = ", failed ones among them" if found.trials.failed else None
    none = None if causes.named else f": {no_cause(each)}"
    correlated = found.assumptions.correlation and known
    return (
        blocks.paragraph(counted(out, "trial"), " out of limit", failed, none, "."),
        _causes_table(found, causes) if out else None,
        blocks.note(say(LEVELS, str(len(known)))) if out and known else None,
        blocks.note(CORRELATED) if correlated else None,
    )


def _causes_table(found: Report, causes: Causes) -> Table:
    """Return a row for what is named together, each kind of part and contributor."""
    rows: list[Row] = []
    for named in causes.named:
        if named.words in causes.contributors:
            continue
        below: Parts = ()
        if named.together:
            below = say(
                "{}; any of them alone in at most {}",
                explained(named.together, causes),
                Number(named.together.alone, PER_CENT, "at_most"),
            )
        rows.append(_cause(Cell((Word(named.words),), below), named.level, named))
    for name, each in sorted(causes.every.items(), key=_clearest_first):
        known = each.shift == each.shift
        part = Word(name) if each.significant else Name(name)
        rows.append({
            **_cause(Cell((part,)), each.level, each),
            "mean, sigmas": Number(each.shift) if known else None,
            "distance, sigmas": Number(each.width) if known else None,
        })  # fmt: skip
    return blocks.table_of(rows, words=["contributor"], caption=rests_on(found))


def _cause(part: Cell, level: float, cause: Cause | NamedCause) -> Row:
    size = cause.effective_sample_size
    return {
        "contributor": part,
        "level, %": Number(level, PART),
        "out of limit with its tolerance halved, ppm": ppm(cause.halved),
        "effective sample size": Number(size) if size else None,
    }


def _clearest_first(named: tuple[str, Cause]) -> tuple[float, float]:
    """Sort by how clearly it differs, then by what halving leaves out of limit."""
    cause, left = named[1], named[1].halved.value
    return cause.level, math.inf if math.isnan(left) else left


def _contributions(found: Report, each: ReportedResponse) -> tuple[Block | None, ...]:
    known = each.contributions
    if known and not known.first_order:
        known = None
    every = [*each.leading, *each.slopes]  # what matters first
    for case in each.worst_cases.values():
        every += [name for name, off in case.deviations.items() if off]
    every += each.indices.first if each.indices else ()
    if not every:
        return ()
    kinds = _kinds(each, known) if known else []
    rows = _contributors(found, each, known, list(dict.fromkeys(every)))
    return (
        blocks.paragraph(FEW) if known and known.dominated_by_few else None,
        blocks.paragraph(_indices(each)),
        blocks.table_of([*kinds, *rows], caption=rests_on(found), look="dense"),
        blocks.note(_remarks(found, known)) if known else None,
    )


def _kinds(each: ReportedResponse, known: Contributions) -> list[Row]:
    """Return a row for each kind of part, the largest share first."""
    rows: list[Row] = []
    size = {kind: share.value for kind, share in each.shares_of_kinds.items()}
    for kind in sorted(size, key=lambda n: -size[n] if size[n] == size[n] else 0.0):
        together = known.together[kind]
        share: Given = Number(together, PART)
        if known.dominated_by_few:
            reason = Cell((), text(together.reason))
            share = at_least(together) if together.sure else reason
        alone: Given = None
        if not known.dominated_by_few:
            summed = Number(known.groups[kind], PART)
            alone = Cell((summed,), text("sum of first orders"))
        rows.append({
            "contributor": Cell((Name(kind),), text(", ".join(each.members[kind]))),
            ALONE + CENTRAL * known.clipped: alone,
            TOGETHER + CENTRAL * known.clipped: share,
        })  # fmt: skip
    return rows


def _contributors(
    found: Report, each: ReportedResponse, known: Contributions | None, every: list[str]
) -> list[Row]:
    """Return a row for each contributor."""
    shares: dict[str, tuple[Values, Scale | Ratio]] = {}
    if known:
        alone = {} if known.dominated_by_few else known.first_order
        shares[ALONE + CENTRAL * known.clipped] = alone, PART
        shares["rank regression coefficient"] = known.rank_regression, AS_IS
    if (indices := each.indices) and not indices.reason:
        central = CENTRAL * indices.clipped
        shares[f"Sobol' first-order index, %{central}"] = indices.first, PART
        shares[f"Sobol' total index, %{central}"] = indices.total, PART
    if each.root_sum_square:
        shares["root sum square, % of the variance"] = (
            each.root_sum_square.shares,
            PART,
        )
    rows: list[Row] = []
    for part in every:
        shown = found.stored_run.scales.get(part, AS_IS)  # a batch has none
        own: dict[str, tuple[Values, Scale | Ratio]] = {
            "slope at the nominal trial": (each.slopes, Ratio(each.scale, shown))
        }
        for side, case in each.worst_cases.items():
            if not case.deviations:
                continue
            own[f"worst case, {side}"] = case.deviations, shown
        row: Row = {"contributor": Name(part)}
        for head, (of, scale) in (shares | own).items():
            if part in of:
                number = Number(of[part], scale)
                row[head] = with_unit(number) if head in own else number
        rows.append(row)
    return rows


def _remarks(found: Report, known: Contributions) -> Parts:
    rest = "interaction" if known.linear else "interaction, correlation or chance"
    estimated = not known.dominated_by_few and not math.isnan(known.unexplained.value)
    alone = say(f"Not explained by contributors alone: {{}} ({rest}). ",
                Number(known.unexplained, PART))  # fmt: skip
    ranks = say("Ranks explain {}. ", Number(known.explained, PART))
    return text(
        alone if estimated else None,
        None if math.isnan(known.explained.value) else ranks,
        CLIPPED if known.clipped else None,
        LINEAR if known.linear else NEIGHBOURS,
        "Estimates below 0 are chance. " if estimated and not known.linear else None,
        RARER,
        OVERLAP if found.assumptions.correlation else None,
    )


def _classical(found: Report, name: str, each: ReportedResponse) -> Table:
    scale, rows = each.scale, dict[str, tuple[Given, Said]]()
    for side, case in each.worst_cases.items():
        said = "no probability: the worst within the tolerances, by the model"
        if case.tried:
            said = f"no probability: the worst of {case.tried} trials within them"
        if case.failed:
            said += f"; {case.failed} of these failed, and count as out of limit"
        rows[f"worst case, {side}"] = Number(case.value, scale), said
    if linear := each.root_sum_square:
        sigma = say("sigma {}", Number(linear.sigma, scale))
        mean = Cell((Number(linear.mean, scale),), sigma)
        rows["root sum square"] = mean, "slopes at the nominal trial, normal response"
    for departure in each.departures:
        wrong = "little" if departure.relative > 0 else "much"
        fails = (Word("root sum square fails"), f" (it promises too {wrong}): ")
        simulated = Number(each.quantiles[departure.share], scale)
        rows[f"{share_words(departure.share)}: root sum square"] = (
            Number(departure.linear, scale),
            (fails if departure.fails else None, "simulated ", simulated),
        )
    return blocks.table_of(
        [{"answer": answer, scale.label(name): value, "": text(said)}
         for answer, (value, said) in rows.items()],
        words=[""], caption=rests_on(found),
    )  # fmt: skip


def _integration(found: Report, each: ReportedResponse) -> tuple[Block | None, ...]:
    """Return the size of integration errors, and their effect."""
    if (errors := each.integration_errors) is None:
        return ()
    exact, effect = each.scale._replace(least=0.0), errors.effect
    run, given = found.stored_run, errors.settings
    typed = (f"{n} {typed_setting(run, n, x)}" for n, x in given.items())
    tightened = ", ".join(typed).replace('"', "")
    above = text("Trials depend on each other: how many err more is not known.")
    if errors.above == errors.above:
        most = Number(errors.above, PER_CENT, "at_most")
        above = say(
            "At most {} of production err more (95 %) than the largest at random.", most
        )
    seen: list[Row] = [
        {"chosen": CHOSEN[why], "trials": Number(of.trials),
         exact.label("largest error"): Number(of.largest, exact)}
        for why, of in {"random": errors.at_random, **errors.chosen}.items()
        if of.trials
    ]  # fmt: skip
    moved: Row = {}
    if effect:
        by = {"mean": effect.mean, "sigma": effect.sigma}
        by |= {share_words(share): x for share, x in effect.quantiles.items()}
        moved = {"unit": exact.mark, **{n: Number(x, exact) for n, x in by.items()}}
        if effect.fraction_out_of_limit is not None:
            moved["out of limit, ppm"] = Number(effect.fraction_out_of_limit, PPM)
    sides = None
    if errors.changed is not None:
        sides = blocks.paragraph(
            "Trials that change sides of the limit: ", Number(errors.changed), "."
        )
    nearest = (
        "Estimate: each trial has the error of the audited one of nearest response."
    )
    return (
        blocks.paragraph(say(
            f"{{}} evaluated again with {tightened} ({errors.failed} failed one of the "
            "two times). The largest error is no bound for others. {}",
            counted(errors.trials, "trial"), above if errors.at_random.trials else None,
        )),
        blocks.table_of(seen, caption=rests_on(found)),
        blocks.table_of([moved], caption=rests_on(found)) if moved else None,
        blocks.note(nearest) if moved else None,
        sides,
    )  # fmt: skip


def _worst_trials(found: Report, name: str, each: ReportedResponse) -> Table:
    again, scales, run = "to see it again", found.stored_run.scales, found.stored_run
    rows: list[Row] = []
    for worst in each.worst_trials:
        rows.append({
            "trial": Number(worst.trial),
            each.scale.label(name): Number(worst.value, each.scale),
            "evaluated again": None if math.isnan(worst.precise)
            else Number(worst.precise, each.scale),
            **{n: with_unit(Number(x, scales[n])) for n, x in worst.deviations.items()},
            again: Typed(to_replay(run.path, worst.trial, run.machine)),
        })  # fmt: skip
    of = rests_on(found)
    if found.trials.counted < found.trials.ran:  # these are the worst of all
        of = say("of all {} trials done", Number(found.trials.by_status["done"]))
    return blocks.table_of(rows, words=[again], caption=of)

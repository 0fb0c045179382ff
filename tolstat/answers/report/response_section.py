"""The section of a report on one response in focus."""

import math
from collections.abc import Iterable, Mapping

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.next_steps import to_replay, typed_setting
from tolstat.answers.report.finding_words import centring_words
from tolstat.answers.report.limits_table import (
    CENTRAL,
    at_least,
    explained,
    no_cause,
    rests_on,
)
from tolstat.answers.report.report_answer import Report
from tolstat.answers.report.response_figures import figures_of
from tolstat.answers.report.response_summary import (
    Cause,
    Causes,
    NamedCause,
    ReportedResponse,
)
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
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.units.scale import AS_IS, PART, PER_CENT, PPM, Ratio, Scale, share_words

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


def response_section(report: Report, name: str) -> Section:
    """Return figures, performance, main causes, contributions, errors, worst trials."""
    response = report.responses[name]
    nothing = text(Word("No trial is done"), ": there is no value to draw.")
    if response.still:
        ends = (
            Number(response.least, response.scale),
            Number(response.largest, response.scale),
        )
        nothing = say(STILL, *ends)
    drawn = report.trials.done and not response.still
    centring = report.findings.centring.get(name)
    analysed = (
        _part("Main causes of out-of-limit trials", *_causes(report, name, response)),
        _part("Variance contributions", *_contributions(report, response)),
        _part("Classical answers", _classical(report, name, response)),
    )
    parts = blocks.shown(
        blocks.note(_declared(response)),
        blocks.paragraph(_point_mass(response, report.trials.done)),
        blocks.Gallery(figures_of(report, name))
        if drawn
        else blocks.paragraph(nothing),
        blocks.paragraph(centring_words(report.stored_run, response, centring)),
        _part("Performance", *_performance(report, response)),
        _part("Mean and sigma", *_kinds_of_interval(report, response)),
        *(() if response.still else analysed),
        _part("Integration error", *_integration(report, response)),
        _part("Worst trials", _worst_trials(report, name, response)),
    )
    return Section(name, parts, name)


def _part(title: str, *parts: Block | None) -> Section:
    return Section(title, blocks.shown(*parts), level=3)


def _declared(response: ReportedResponse) -> Parts:
    source = f"equation {response.source}" if response.source else ""
    facts = ", ".join(filter(None, (response.sentence, response.symbol, source)))
    return text(f"{facts}." if facts else None)


def _point_mass(response: ReportedResponse, done: int) -> Parts:
    """Return a sentence on the value that many trials share."""
    if (mass := response.point_mass) is None:
        return ()
    ends = Number(mass.least, response.scale), Number(mass.largest, response.scale)
    return say(
        "{} of production shares one value, {}{}. The histogram shows the others.",
        Number(mass.share, PER_CENT, of=done), Number(mass.value, response.scale),
        say(" (from {} to {})", *ends) if mass.least != mass.largest else None,
    )  # fmt: skip


def _indices(response: ReportedResponse) -> Parts:
    """Return the trials behind Sobol' indices, or why there are none."""
    if (indices := response.indices) is None:
        return ()
    why = f"No Sobol' indices: {indices.reason}; there are" if indices.reason else None
    broken = f"({indices.broken} left out: not all of their trials are done)."
    groups = counted(indices.groups, "group")
    return text(why or "Sobol' indices of", " ", groups, f" of trials {broken}")


def _performance(report: Report, response: ReportedResponse) -> tuple[Block, ...]:
    if (limited := response.limited) is None:
        return ()
    head = f"against {limited.limit.words}"
    equivalent = None, Number(limited.equivalent_ppk)
    methods: dict[str, Iterable[Given]] = {
        "equivalent, of the fraction out of limit": equivalent,
        "by percentiles (ISO 22514-2)": map(ppk_cell, limited.percentiles),
        "by moments, as for normal responses": map(ppk_cell, limited.moments),
    }
    rows: list[Row] = [
        {head: method, "Pp": pp, "Ppk": ppk} for method, (pp, ppk) in methods.items()
    ]
    return blocks.table_of(rows, caption=rests_on(report)), blocks.note(PERFORMANCE)


def _kinds_of_interval(report: Report, response: ReportedResponse) -> tuple[Block, ...]:
    """Return mean and sigma with either kind of interval."""
    wide, scale = for_any(response), response.scale
    rows: list[Row] = [
        {
            "interval": "as sampled",
            "mean": None if "mean" in wide else Number(response.mean, scale),
            "sigma": None if "sigma" in wide else Number(response.sigma, scale),
        },
        {
            "interval": "for any distribution",
            "mean": Number(response.mean_for_any_distribution, scale),
            "sigma": Number(response.sigma_for_any_distribution, scale),
        },
    ]
    table = blocks.table_of(rows, caption=rests_on(report))
    return table, blocks.note(f"{AS_SAMPLED} {REACH}")


def _causes(
    report: Report, name: str, response: ReportedResponse
) -> tuple[Block | None, ...]:
    if (causes := response.causes) is None:
        return ()
    out, known = causes.trials_out_of_limit, causes.contributors
    failed = ", failed ones among them" if report.trials.failed else None
    why = f": {no_cause(report.findings.limits[name])}"
    none = None if causes.named else why
    correlated = report.assumptions.correlation and known
    return (
        blocks.paragraph(counted(out, "trial"), " out of limit", failed, none, "."),
        _causes_table(report, causes) if out else None,
        blocks.note(say(LEVELS, str(len(known)))) if out and known else None,
        blocks.note(CORRELATED) if correlated else None,
    )


def _causes_table(report: Report, causes: Causes) -> Table:
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
    for name, cause in sorted(causes.by_name.items(), key=_clearest_first):
        single = cause.shift == cause.shift
        part = Word(name) if cause.significant else Name(name)
        rows.append({
            **_cause(Cell((part,)), cause.level, cause),
            "mean, sigmas": Number(cause.shift) if single else None,
            "distance, sigmas": Number(cause.width) if single else None,
        })  # fmt: skip
    return blocks.table_of(rows, words=["contributor"], caption=rests_on(report))


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
    cause, after = named[1], named[1].halved.value
    return cause.level, math.inf if math.isnan(after) else after


def _contributions(
    report: Report, response: ReportedResponse
) -> tuple[Block | None, ...]:
    known = response.contributions
    if known and not known.first_order:
        known = None
    names = [*response.leading, *response.slopes]  # what matters first
    for case in response.worst_cases.values():
        names += [name for name, off in case.deviations.items() if off]
    names += response.indices.first if response.indices else ()
    if not names:
        return ()
    kinds = _kinds(response, known) if known else []
    rows = _contributors(report, response, known, list(dict.fromkeys(names)))
    return (
        blocks.paragraph(FEW) if known and known.dominated_by_few else None,
        blocks.paragraph(_indices(response)),
        blocks.table_of([*kinds, *rows], caption=rests_on(report), look="dense"),
        blocks.note(_remarks(report, known)) if known else None,
    )


def _kinds(response: ReportedResponse, known: Contributions) -> list[Row]:
    """Return a row for each kind of part, the largest share first."""
    rows: list[Row] = []
    size = {kind: share.value for kind, share in response.shares_of_kinds.items()}
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
            "contributor": Cell((Name(kind),), text(", ".join(response.members[kind]))),
            ALONE + CENTRAL * known.clipped: alone,
            TOGETHER + CENTRAL * known.clipped: share,
        })  # fmt: skip
    return rows


def _contributors(
    report: Report,
    response: ReportedResponse,
    known: Contributions | None,
    names: list[str],
) -> list[Row]:
    """Return a row for each contributor."""
    shares: dict[str, tuple[Values, Scale | Ratio]] = {}
    if known:
        alone = {} if known.dominated_by_few else known.first_order
        shares[ALONE + CENTRAL * known.clipped] = alone, PART
        shares["rank regression coefficient"] = known.rank_regression, AS_IS
    if (indices := response.indices) and not indices.reason:
        central = CENTRAL * indices.clipped
        shares[f"Sobol' first-order index, %{central}"] = indices.first, PART
        shares[f"Sobol' total index, %{central}"] = indices.total, PART
    if response.root_sum_square:
        shares["root sum square, % of the variance"] = (
            response.root_sum_square.shares,
            PART,
        )
    rows: list[Row] = []
    for part in names:
        scale_of_part = report.stored_run.scales.get(part, AS_IS)  # a batch has none
        with_units: dict[str, tuple[Values, Scale | Ratio]] = {
            "slope at the nominal trial": (
                response.slopes,
                Ratio(response.scale, scale_of_part),
            )
        }
        for side, case in response.worst_cases.items():
            if not case.deviations:
                continue
            with_units[f"worst case, {side}"] = case.deviations, scale_of_part
        row: Row = {"contributor": Name(part)}
        for head, (values, scale) in (shares | with_units).items():
            if part in values:
                number = Number(values[part], scale)
                row[head] = with_unit(number) if head in with_units else number
        rows.append(row)
    return rows


def _remarks(report: Report, known: Contributions) -> Parts:
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
        OVERLAP if report.assumptions.correlation else None,
    )


def _classical(report: Report, name: str, response: ReportedResponse) -> Table:
    scale, rows = response.scale, dict[str, tuple[Given, Said]]()
    for side, case in response.worst_cases.items():
        note = "no probability: the worst within the tolerances, by the model"
        if case.tried:
            note = f"no probability: the worst of {case.tried} trials within them"
        if case.failed:
            note += f"; {case.failed} of these failed, and count as out of limit"
        rows[f"worst case, {side}"] = Number(case.value, scale), note
    if linear := response.root_sum_square:
        sigma = say("sigma {}", Number(linear.sigma, scale))
        mean = Cell((Number(linear.mean, scale),), sigma)
        rows["root sum square"] = mean, "slopes at the nominal trial, normal response"
    for departure in response.departures:
        wrong = "little" if departure.relative > 0 else "much"
        fails = (Word("root sum square fails"), f" (it promises too {wrong}): ")
        simulated = Number(response.quantiles[departure.share], scale)
        rows[f"{share_words(departure.share)}: root sum square"] = (
            Number(departure.linear, scale),
            (fails if departure.fails else None, "simulated ", simulated),
        )
    return blocks.table_of(
        [{"answer": answer, scale.label(name): value, "": text(note)}
         for answer, (value, note) in rows.items()],
        words=[""], caption=rests_on(report),
    )  # fmt: skip


def _integration(
    report: Report, response: ReportedResponse
) -> tuple[Block | None, ...]:
    """Return the size of integration errors, and their effect."""
    if (errors := response.integration_errors) is None:
        return ()
    exact, effect = response.scale._replace(least=0.0), errors.effect
    run = report.stored_run
    typed = (f"{n} {typed_setting(run, n, x)}" for n, x in errors.settings.items())
    tightened = ", ".join(typed).replace('"', "")
    above = text("Trials depend on each other: how many err more is not known.")
    if errors.above == errors.above:
        most = Number(errors.above, PER_CENT, "at_most")
        above = say(
            "At most {} of production err more (95 %) than the largest at random.", most
        )
    seen: list[Row] = [
        {"chosen": CHOSEN[why], "trials": Number(largest.trials),
         exact.label("largest error"): Number(largest.largest, exact)}
        for why, largest in {"random": errors.at_random, **errors.chosen}.items()
        if largest.trials
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
        blocks.table_of(seen, caption=rests_on(report)),
        blocks.table_of([moved], caption=rests_on(report)) if moved else None,
        blocks.note(nearest) if moved else None,
        sides,
    )  # fmt: skip


def _worst_trials(report: Report, name: str, response: ReportedResponse) -> Table:
    again, scales, run = "to see it again", report.stored_run.scales, report.stored_run
    rows: list[Row] = []
    for worst in response.worst_trials:
        rows.append({
            "trial": Number(worst.trial),
            response.scale.label(name): Number(worst.value, response.scale),
            "evaluated again": None if math.isnan(worst.precise)
            else Number(worst.precise, response.scale),
            **{n: with_unit(Number(x, scales[n])) for n, x in worst.deviations.items()},
            again: Typed(to_replay(run.path, worst.trial, run.machine)),
        })  # fmt: skip
    caption = rests_on(report)
    if report.trials.counted < report.trials.ran:  # these are the worst of all
        caption = say("of all {} trials done", Number(report.trials.by_status["done"]))
    return blocks.table_of(rows, words=[again], caption=caption)

"""The tables at the end of a run: responses, limits, and what they rest on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.answers.report.main_causes import culprits_of
from tolstat.answers.sampled_trials import Drawn, drawn_trials
from tolstat.model.description import StudyNumber
from tolstat.render.plain import demand_words, in_line
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import NOT_MET, joint_yield
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import Limited, Summary, summarize
from tolstat.status import Status
from tolstat.store.audited import Audited
from tolstat.store.stored_run import ROUNDING, Run
from tolstat.units.scale import AS_IS, PER_CENT, Scale

PRINTED = {0.5: "median", 0.05: "5 %", 0.95: "95 %", 0.99: "99 %"}
EXTREMES = ("least", "in trial", "largest", "in trial")

WEIGHTED = (
    "with each number its 95 % interval: of shares beyond limits from weighted counts, "
    "of all else for any distribution of the response; shares and verdicts as run hold "
    "however often one looks while trials are added, those of what-if for a single "
    "look: so their intervals and verdicts may differ where the machines do not"
)

# a text, or a number with the ends of its interval
Cell = str | tuple[str, str, str]


class SummaryTable(NamedTuple):
    """Tables of text.

    Attributes
    ----------
    title : str
        What the run is.
    heads : list of str
        Columns of the table of responses.
    rows : list of list of Cell
        One for each response.
    limit_heads : list of str
        Columns of the table of limits.
    limit_rows : list of list of Cell
        One for each limit; empty without limits.
    notes : list of str
        What must be known to read them: failures first.
    not_met : tuple of str
        Responses whose limit is not met.
    """

    title: str
    heads: list[str]
    rows: list[list[Cell]]
    limit_heads: list[str]
    limit_rows: list[list[Cell]]
    notes: list[str]
    not_met: tuple[str, ...] = ()


def summaries_of(drawn: Drawn) -> dict[str, Summary]:
    """Summarize every response of a run whose machines were drawn."""
    run, found = drawn.run, {}
    for response in run.responses:
        name = response.name
        limit = run.limits.get(name)
        values, ends = drawn.values(name), response.range
        found[name] = summarize(values, drawn.sample, limit, ends)
    return found


def summary_table(run: Run) -> SummaryTable:
    """Summarize a run for the screen.

    Parameters
    ----------
    run : Run
        Complete or not.

    Returns
    -------
    SummaryTable
        In the units of the study. Of trials that were drawn quantiles and shares, each
        with its 95 % interval; of a grid or a table, whose machines were chosen, the
        extremes and where they are.
    """
    drawn = drawn_trials(run)
    sample = drawn.sample if drawn else None
    summaries = summaries_of(drawn) if drawn else {}
    rows: list[list[Cell]] = []
    limit_rows: list[list[Cell]] = []
    for response in run.responses:
        name, scale = response.name, run.scales[response.name]
        row: list[Cell] = [name, scale.mark, scale.number(run.nominal_values[name])]
        if name in summaries:
            quantiles = summaries[name].quantiles
            row += [estimate_in_words(quantiles[share], scale) for share in PRINTED]
            if limited := summaries[name].limited:
                limit_rows.append([name, *_judged(limited)])
        else:
            row += _extremes(run, name, scale)
            if name in run.limits:
                beyond = f"{np.count_nonzero(run.beyond(name))} of {run.ended}"
                limit_rows.append([name, run.limits[name].words, beyond])
        rows.append(row)
    judged = ["limit", "demanded", "verdict", "% beyond", "as Ppk"]
    return SummaryTable(
        f"{run.title}: {run.trials} trials of {run.model}",
        ["response", "unit", "nominal", *(PRINTED.values() if sample else EXTREMES)],
        rows,
        ["response", *(judged if sample else ["limit", "machines beyond"])],
        limit_rows,
        [
            *_joint(drawn),
            *_culprits(drawn),
            *notes_of(run, sample),
            *reading_of(run, sample),
        ],
        tuple(
            name
            for name, each in summaries.items()
            if each.limited and each.limited.yields.verdict == NOT_MET
        ),
    )


def estimate_in_words(estimate: Estimate, scale: Scale) -> Cell:
    """Write an estimate with its interval, or why it has none.

    Of one that is nothing to an engineer the interval says nothing more.
    """
    value, lower, upper = scale.interval(*estimate[:3])
    if estimate.sure and math.isinf(estimate.upper):
        return f"at least {lower}"
    if estimate.sure and math.isinf(estimate.lower):
        return f"at most {upper}"
    if math.isinf(estimate.value):
        return "no interval"
    if estimate.sure:
        nothing = estimate.value and scale.nothing(max(map(abs, estimate[:3])))
        return value if nothing else (value, lower, upper)
    if estimate.needs_more:
        return estimate.reason
    return f"{value}: no interval"


def _judged(limited: Limited) -> list[Cell]:
    """Write what a limit asks for and what the machines say."""
    verdict = limited.yields.verdict
    if limited.yields.needed:
        verdict += f": {limited.yields.needed} decide"
    return [
        limited.limit.words,
        demand_words(limited.limit),
        verdict,
        estimate_in_words(limited.yields.beyond, PER_CENT),
        estimate_in_words(limited.equivalent, AS_IS),
    ]


def joint_of(drawn: Drawn) -> Estimate | None:
    """Estimate the share of machines within all limits at once; None without any."""
    limits = {name: limit.permitted for name, limit in drawn.run.limits.items()}
    if not limits or not drawn.sample.ran.any():
        return None
    values = {name: drawn.values(name) for name in limits}
    return joint_yield(values, drawn.sample, limits)


def _joint(drawn: Drawn | None) -> list[str]:
    """Say how many machines are within all limits at once."""
    share = joint_of(drawn) if drawn else None
    if share is None or not drawn:
        return []
    return [f"{in_line(share)} of the machines are within all limits at once"]


def _culprits(drawn: Drawn | None) -> list[str]:
    """Say who drives the machines beyond each limit, where that is known."""
    found = culprits_of(drawn) if drawn else {}
    said = (each.sentence(name) for name, each in found.items())
    return [sentence for sentence in said if sentence]


def _extremes(run: Run, name: str, scale: Scale) -> list[Cell]:
    """Write the least and the largest value, each with its trial."""
    done = np.flatnonzero(run.status == Status.DONE)
    if not len(done):
        return ["failed", "", "failed", ""]
    values = run.column(name)[done]
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        return [scale.number(float(values[0])), "all", "", ""]
    cells: list[Cell] = []
    for where in (values.argmin(), values.argmax()):
        cells += [scale.number(float(values[where])), str(done[where])]
    return cells


def _in_words(run: Run, number: StudyNumber) -> str:
    """Write a number of the study, and what it does not say."""
    value = run.scale_of(number).words(number.value)
    if math.isnan(number.value):
        value = "none"
    caveat = f" ({number.caveat})" if number.caveat else ""
    return f"{number.name} {value}{caveat}"


def _rerun(run: Run, rerun: Audited) -> str:
    """Say how failed trials ended when they were evaluated again."""
    settings = ", ".join(f"{key} = {value:g}" for key, value in rerun.settings.items())
    codes, counts = np.unique(rerun.status, return_counts=True)
    pairs = zip(codes.tolist(), counts, strict=True)
    ended = (f"{count} {run.words[code]}" for code, count in pairs)
    return (
        f"{len(rerun.trials)} failed trials evaluated again with {settings}: "
        + ", ".join(ended)
        + "; they count as failed all the same"
    )


def notes_of(run: Run, sample: Sample | None) -> list[str]:
    """Say what must be known to read the numbers of a run: failures first."""
    notes = []
    if run.ended and not run.rare:  # of machines that were sought it is no share
        text = f"{run.failed} of {run.ended} trials failed"
        if sample and len(sample.status) < run.trials:
            ran = int(np.count_nonzero(sample.ran))
            text += f", {sample.failed} of the {ran} that statistics rest on"
        if sample and (share := sample.failures).sure:
            _, *ends = PER_CENT.interval(*share[:3])
            text += f" (95 % interval {ends[0]}..{ends[1]} %)"
        if run.failures:
            said = (f"{count} {word}" for word, count in run.failures.items())
            text += ": " + ", ".join(said) + "; they count as beyond every limit"
        notes.append(text)
    if run.rerun:
        notes.append(_rerun(run, run.rerun))
    if run.ended < run.trials:
        left = run.trials - run.ended
        notes.append(f"{left} of {run.trials} trials have not run")
    nominal = run.nominal_values["status"]
    if nominal != Status.DONE.word:
        notes.append(f"the nominal machine: {nominal}")
    notes += run.notes
    own = [_in_words(run, number) for number in run.numbers if number.of]
    if own and not (sample and sample.weights):  # of the tolerances as run
        notes.append("without any trial: " + ", ".join(own))
    if run.stopped:
        reached = "reached" if run.stopped.reached else "not reached"
        stages = ", ".join(map(str, run.stopped.stages))
        rules = "; ".join(run.stopped.rules)
        text = f"{rules}: {reached}; looked at after {stages} trials"
        if math.isfinite(wanted := run.stopped.wanted) and wanted:
            text += f"; the last look asks for about {wanted:.0f}"
        notes.append(text)
    return notes


def reading_of(run: Run, sample: Sample | None) -> list[str]:
    """Say what stands with each number of a table for the screen."""
    if sample and sample.weights:
        return [WEIGHTED]
    if sample and not sample.replicates:
        return [
            "with each number its 95 % interval: order statistics for quantiles; of "
            "shares beyond limits it holds however often one looks while trials are "
            'added; "needs N": no interval exists with fewer trials; "N decide": with '
            "a chance of 80 %; as Ppk: of a normal response with as many beyond"
        ]
    if run.sampled:
        return [f"with each number its 95 % interval: {run.sampled.promise}"]
    return []

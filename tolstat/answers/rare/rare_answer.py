"""What a rare run says: the share beyond, and the machines that lead there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat.answers.rare.failure_points import LikelyFindings, likeliest_of
from tolstat.answers.report.findings import (
    Assumptions,
    DocumentFindings,
    TrialsFindings,
)
from tolstat.answers.report.gather import assumptions_of, document_of, provenance_of
from tolstat.answers.report.summary_table import (
    Cell,
    SummaryTable,
    estimate_in_words,
    notes_of,
    reading_of,
)
from tolstat.errors import PictureError, allowed_names
from tolstat.render.plain import demand_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.capability import by_share
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.rare_share import ENOUGH, plain_trials, rare_share, unmet
from tolstat.statistics.limits.yields import NOT_MET, verdict
from tolstat.statistics.reweighting.weights import effective_number
from tolstat.status import Status
from tolstat.store.fresh_run_advice import AT_RANDOM, own_run
from tolstat.store.layout import SPREAD, STAGE, WEIGHT
from tolstat.store.stored_run import Run
from tolstat.units.scale import AS_IS, PPM, Scale

UNMET = (
    "Interval and verdict leave out machines beyond of a kind that the last stage "
    "never met: there may be up to {} per million of these"
)
STAGES = (
    "Stage 0 is drawn wide; the stages right after it, at 1 times the spread, go to "
    "the limit step by step where the response leads (subset simulation); all others "
    "are drawn where machines beyond were found, or those nearest to the limit while "
    "hardly any were, and the last one tells the share"
)


class StageFindings(NamedTuple):
    """Trials that were drawn at once.

    Attributes
    ----------
    trials, beyond, failed : int
        How many have run; of these, beyond the limit, failed ones among them.
    least, largest : float
        Times the spread of the study that they aimed at.
    """

    trials: int
    beyond: int
    failed: int
    least: float
    largest: float


@dataclass(frozen=True)
class RareFindings:
    """What a rare run says of its limit. SI.

    Attributes
    ----------
    title, run, model, machine : str
        What it is of.
    document : DocumentFindings
        The title block.
    trials : TrialsFindings
        What became of them, in all stages; those of the last are counted, and tell what
        share failed. Unseen is the share of a kind of machine beyond which the
        last stage has not met, at most (97.5 %).
    met : int
        Machines beyond in the last stage.
    response, sentence : str
        What is limited.
    scale : Scale
        How it is shown.
    nominal : float
        Of the nominal machine; NaN if that failed.
    limit : Limit
        What is permitted, and of how many machines it is asked.
    demanded_ppk : float
        What is demanded, as the Ppk of a normal response.
    beyond, within : Estimate
        Shares of the machines; failed ones are beyond.
    verdict : str
        As of a plain run; of the interval at one look.
    equivalent : Estimate
        Ppk of a normal response with as many beyond.
    plain_trials : float
        Trials of a plain run that would have as narrow an interval; NaN where none.
    first_order : float
        Share beyond at this end of a limit that is straight, as far from the middle
        machine as the nearest beyond that was met; NaN where none was.
    stages : tuple of StageFindings
        In order; the last one tells the share.
    likeliest : tuple of LikelyFindings
        The most likely machines beyond that were met, the nearest first.
    precise, changed : int
        Trials evaluated again more precisely, and those of them that change sides.
    assumptions : Assumptions
        What the numbers hang on.
    scales : dict of str to Scale
        How each contributor that deviates is shown.
    provenance : dict
        Versions, times, processor; the study as it was written.
    """

    title: str
    run: str
    model: str
    machine: str
    document: DocumentFindings
    trials: TrialsFindings
    met: int
    response: str
    sentence: str
    scale: Scale
    nominal: float
    limit: Limit
    demanded_ppk: float
    beyond: Estimate
    within: Estimate
    verdict: str
    equivalent: Estimate
    plain_trials: float
    first_order: float
    stages: tuple[StageFindings, ...]
    likeliest: tuple[LikelyFindings, ...]
    precise: int
    changed: int
    assumptions: Assumptions
    scales: Mapping[str, Scale]
    provenance: Mapping[str, object]


def _telling_of(name: str, run: Run) -> tuple[str, str]:
    """Say what is changed in a study to tell of another response; name the copy."""
    names = [each.name for each in run.responses]
    if name not in names:
        raise PictureError(f"response {name}: unknown; {allowed_names(name, names)}")
    if name in run.limits:
        return f'write there `sampling = {{ rare = "{name}" }}`', name
    return AT_RANDOM, "random"


def rare_findings(run: Run, chosen: Sequence[str] = ()) -> RareFindings:
    """Gather what a rare run says; of its file alone.

    Parameters
    ----------
    run : Run
        Complete or not.
    chosen : sequence of str
        Responses that the user names: its own, or none.

    Raises
    ------
    PictureError
        If no trial has run, or another response is asked for.
    """
    name, limit = run.rare, run.limits[run.rare]
    if others := [each for each in chosen if each != name]:
        own = own_run(run, *_telling_of(others[0], run))
        raise PictureError(
            f'response {others[0]}: {run.path} has sampling = "rare" and tells of '
            f"{name} alone; {own}"
        )
    if not run.ended:
        raise PictureError(f"{run.path}: no trial has run; there is nothing to report")
    ran = run.status != Status.NOT_RUN
    beyond, stage = run.beyond(name), run.column(STAGE)
    weights = run.column(WEIGHT)
    last = ran & ~np.isnan(weights)
    share = rare_share(beyond[last], weights[last])
    failures = rare_share(run.status[last] > Status.DONE, weights[last])
    if failures.value > 0:  # those that fail are beyond: no more than are beyond
        failures = failures._replace(upper=min(failures.upper, share.upper))
    good = share.complement
    likeliest = likeliest_of(run, beyond)
    response = next(each for each in run.responses if each.name == name)
    sampled = run.sampled
    assert sampled
    return RareFindings(
        run.title,
        run.path.name,
        run.model,
        run.machine,
        document_of(run),
        TrialsFindings(
            run.trials,
            run.ended,
            run.ended - run.failed,
            run.failed,
            int(np.count_nonzero(last)),
            run.counts,
            failures,
            unmet(weights[last]) if last.any() else math.nan,
            run.sampling,
            sampled.promise,
            (
                *_worth(weights[last & beyond]),
                *_failing(run, failures),
                *notes_of(run, None),
            ),
        ),
        int(np.count_nonzero(beyond[last])),
        name,
        response.sentence,
        run.scales[name],
        run.nominal_values[name],
        limit,
        limit.ppk,
        share,
        good,
        verdict(good, limit.demanded),
        by_share(share, limit),
        plain_trials(share),
        float(ndtr(-likeliest[0].distance)) if likeliest else math.nan,
        tuple(
            _stage(run, ran & (stage == each), beyond) for each in np.unique(stage[ran])
        ),
        likeliest,
        *_changed(run),
        assumptions_of(run),
        {each: run.scales[each] for each in run.assumed},
        provenance_of(run, sampled),
    )


def _worth(weights: NDArray[np.float64]) -> list[str]:
    """Say why an interval is so wide, of the weights of the machines beyond."""
    worth = effective_number(weights)
    if not 0 < worth < ENOUGH:
        return []
    return [
        f"the machines beyond are worth only {worth} independent ones, fewer than "
        f"{ENOUGH}: the search did not come to its end, and the interval is as wide as "
        "that of a few hundred plain trials; more trials, or another seed, may end it"
    ]


def _failing(run: Run, share: Estimate) -> list[str]:
    """Say how many machines fail, and that failed trials are no share of any."""
    if not run.failed:
        return ["no machine failed in any stage"]
    words = ", ".join(f"{count} {word}" for word, count in run.failures.items())
    if share.sure:
        value, *ends = PPM.interval(*share[:3])
        said = (
            f"{value} ({ends[0]}..{ends[1]}) of a million machines fail, and count as"
        )
        said += " beyond"
    else:
        said = f"what share of the machines fails is not known: {share.reason}"
    return [f"{said}; of the trials, sought where machines are beyond: {words}"]


def _stage(
    run: Run, trials: NDArray[np.bool_], beyond: NDArray[np.bool_]
) -> StageFindings:
    spread = run.column(SPREAD)[trials]
    return StageFindings(
        int(np.count_nonzero(trials)),
        int(np.count_nonzero(trials & beyond)),
        int(np.count_nonzero(run.status[trials] > Status.DONE)),
        float(spread.min()),
        float(spread.max()),
    )


def _changed(run: Run) -> tuple[int, int]:
    """Count the trials evaluated again, and those that change sides of the limit."""
    if run.audited is None:
        return 0, 0
    permitted = run.limits[run.rare].permitted
    sides = [
        within(values, permitted)
        for values in (
            run.column(run.rare)[run.audited.trials],
            run.audited.responses[run.rare],
        )
    ]
    return len(run.audited.trials), int(np.count_nonzero(sides[0] != sides[1]))


def rare_table(run: Run) -> SummaryTable:
    """Summarize a rare run for the screen: its stages, its limit.

    Parameters
    ----------
    run : Run
        Complete or not.
    """
    title = f"{run.title}: {run.trials} trials of {run.model}, sought in stages"
    if not run.ended:
        return SummaryTable(title, ["stage"], [], [], [], notes_of(run, None))
    found = rare_findings(run)
    rows: list[list[Cell]] = [
        [str(number), _spread(each), str(each.trials), str(each.beyond)]
        for number, each in enumerate(found.stages)
    ]
    limits: list[list[Cell]] = [
        [
            found.response,
            found.limit.words,
            demand_words(found.limit),
            found.verdict,
            _cell(found.beyond, PPM),
            _cell(found.equivalent, AS_IS),
        ]
    ]
    return SummaryTable(
        title,
        ["stage", "times the spread", "trials", "beyond"],
        rows,
        ["response", "limit", "demanded", "verdict", "beyond, ppm", "as Ppk"],
        limits,
        [*_said(run, found), *found.trials.notes, *reading_of(run, None)],
        (found.response,) if found.verdict == NOT_MET else (),
    )


def _cell(estimate: Estimate, scale: Scale) -> Cell:
    return estimate.reason or estimate_in_words(estimate, scale)


def _spread(stage: StageFindings) -> str:
    if stage.least == stage.largest:
        return AS_IS.number(stage.least)
    return f"{AS_IS.number(stage.least)}..{AS_IS.number(stage.largest)}"


def _said(run: Run, found: RareFindings) -> list[str]:
    """Say what the numbers of a rare run mean."""
    said = [STAGES]
    if found.likeliest and (first := found.likeliest[0]).leading:
        parts = ", ".join(
            f"{name} {found.scales[name].words(first.deviations[name])} "
            f"({first.how_far(name)})"
            for name in first.leading
        )
        if len(first.leading) < len(first.scores):
            parts += ", others less than half as far out"
        said.append(
            f"likeliest machine beyond that was met: {parts}: trial {first.trial}, "
            f"{AS_IS.number(first.distance)} sigmas from the middle machine"
        )
    if not math.isnan(found.plain_trials):
        said.append(
            f"a plain run would need about {AS_IS.number(found.plain_trials)} trials "
            "for as narrow an interval"
        )
    if found.trials.counted:
        said.append(UNMET.format(PPM.at_most(found.trials.unseen)))
    if others := [name for name in run.limits if name != run.rare]:
        said.append(f"not asked: {', '.join(others)}; that takes a run of its own")
    if found.changed:
        said.append(
            f"of {found.precise} trials evaluated again more precisely {found.changed} "
            "change sides of the limit"
        )
    return said

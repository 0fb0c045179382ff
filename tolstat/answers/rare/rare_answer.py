"""The answer about a rare run: the fraction out of one limit, failure points. SI."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.answers.cells import limit_cells
from tolstat.answers.report.gather import summary_of
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import changes_of, drawn_trials
from tolstat.arrays import Integers
from tolstat.deviations.samplers import DISTANCE, SPREAD, STAGE
from tolstat.document.inline import Number, Row
from tolstat.errors import QuestionError
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import (
    ENOUGH,
    plain_trials,
    rare_share,
    unmet,
)
from tolstat.statistics.intervals.weights import effective_number
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import JUMP, Caveat, Verdict, worded
from tolstat.status import Status
from tolstat.store.assumed import SCORES
from tolstat.store.stored_run import Run
from tolstat.units.scale import PPM, Scale

MOST_POINTS = 10  # named
LEADING = 0.5  # times as far out as the farthest contributor: named too
NORMAL = 0.01  # between its sigmas and its normal score: taken as normal


class FailurePoint(NamedTuple):
    """An out-of-limit trial, of those that are most probable."""

    trial: int
    value: float  # of the response, SI; NaN where it failed
    distance: float  # from the median trial, in normal scores: how many sigmas off
    deviations: Mapping[str, float]  # by contributor that deviates, SI
    off: Mapping[str, float]  # the same in sigmas of its distribution, from its mean
    # the same as normal scores: as unlikely as so many sigmas of a normal part
    scores: Mapping[str, float]
    # share of its distribution that lies farther out, to the same side
    farther: Mapping[str, float]

    @property
    def leading(self) -> list[str]:
        """The contributors that lie far out, the farthest first.

        By normal scores: a uniform part at its very end is 1.7 sigmas off, and as
        unlikely there as a normal one at four.
        """
        distances = {name: abs(score) for name, score in self.scores.items()}
        least = LEADING * max(distances.values(), default=0.0)
        return sorted(
            (n for n in distances if distances[n] >= least),
            key=lambda name: -distances[name],
        )

    def normal(self, name: str) -> bool:
        """Tell whether a deviation is as unlikely as its sigmas say."""
        return abs(self.off[name] - self.scores[name]) < NORMAL


def failure_points(run: Run, out: NDArray[np.bool_]) -> tuple[FailurePoint, ...]:
    """Return the trials among bool[trial] that are nearest to the median trial.

    A trial that repeats another is left out.
    """
    trials = np.flatnonzero(out)
    distances, first = np.unique(run.column(DISTANCE)[trials], return_index=True)
    nearest = zip(trials[first].tolist(), distances.tolist(), strict=True)
    return tuple(_point(run, *pair) for pair in islice(nearest, MOST_POINTS))


def _point(run: Run, trial: int, distance: float) -> FailurePoint:
    deviations = {name: float(run.column(name)[trial]) for name in run.assumed}
    sigmas_off = {
        name: (deviations[name] - assumed.mean) / assumed.sigma
        for name, assumed in run.assumed.items()
        if assumed.sigma > 0
    }
    scores = {
        name: normal_score(deviations[name], run.assumed[name].quantiles)
        for name in sigmas_off
    }
    farther = {name: float(ndtr(-abs(score))) for name, score in scores.items()}
    value = float(run.column(run.aim)[trial])
    return FailurePoint(trial, value, distance, deviations, sigmas_off, scores, farther)


def normal_score(deviation: float, at_scores: Sequence[float]) -> float:
    """Return how unlikely it is that a part lies as far out, as a normal score.

    Of its distribution the quantiles at `SCORES`.
    """
    quantiles = np.array(at_scores)
    first, behind = (
        int(np.searchsorted(quantiles, deviation, s)) for s in ("left", "right")
    )
    if first < behind:  # of many equal parts the one that is least far out
        return float(np.clip(0.0, SCORES[first], SCORES[behind - 1]))
    if first in (0, len(quantiles)):
        return float(SCORES[min(first, len(quantiles) - 1)])
    # between two: shares, not scores, go evenly along a density without a slope
    side = 1.0 if SCORES[first - 1] >= 0 else -1.0
    shares = ndtr(-side * SCORES[first - 1 : first + 1])
    share = np.interp(deviation, quantiles[first - 1 : first + 1], shares)
    return float(-side * ndtri(share))


class Stages(NamedTuple):
    """Consecutive stages with one purpose, and counts of their trials."""

    purpose: str  # "greater spread", "search", "estimate"
    first: int  # number of the first stage
    last: int
    trials: int  # that have run
    trials_out_of_limit: int  # failed ones among them
    failed: int
    least: float  # times the spread of the study that they aimed at
    largest: float


@dataclass(frozen=True, repr=False)
class RareSummary(RunSummary):
    """The answer about a rare run and the limit that it searched.

    Its trials are those of all stages. Those of the last one, weighted, are counted and
    give all responses and the failed fraction. `unseen` limits (97.5 %) the fraction of
    any kind of out-of-limit trial that the last stage did not meet.
    """

    trials_out_of_limit: int  # trials of the last stage
    response: str  # the limited response
    sentence: str
    scale: Scale
    nominal: float  # of the nominal trial; NaN if that failed
    limit: Limit
    demanded_ppk: float  # the demand, as the Ppk of a normal response
    fraction_out_of_limit: Estimate  # of production; failed trials are out of limit
    within: Estimate
    verdict: Verdict  # as of a plain run, for one number of trials
    # why it is undecided: `INTEGRATION_ERROR` or `JUMP`; or on which condition the
    # limit is met
    reason: Caveat
    equivalent_ppk: Estimate  # of a normal response with the same fraction
    plain_trials: float  # of a plain run with as narrow an interval; NaN where none
    # fraction out of limit at this end of a limit that is straight, as far from the
    # median trial as the most probable failure point; NaN where none was met
    first_order: float
    stages: tuple[Stages, ...]
    failure_points: tuple[FailurePoint, ...]  # that were met, the most probable first
    precise: int  # trials evaluated again more precisely
    changed: int  # those of them that change sides of the limit
    answers = "rare"

    @property
    def words(self) -> str:
        """The verdict, and its reason or condition where it has one."""
        return worded(self.verdict, self.reason)

    @property
    def _short(self) -> str:
        share = self.fraction_out_of_limit
        value = f", {PPM.interval(*share[:3])[0]} ppm" if share.sure else ""
        return f"{self.run}, {self.response} {self.words}{value}"

    def rows(self) -> Sequence[Row]:
        """Return the one response in a row."""
        return [{
            "title": self.title,
            "response": self.response,
            "unit": self.scale.shown,
            "nominal [unit]": Number(self.nominal, self.scale),
            **limit_cells(self.responses[self.response].limited, self.scale),
            "failed [ppm]": Number(self.trials.failures, PPM),
            "trials run": self.trials.ran,
            "trials counted": self.trials.counted,
            "of these out of limit": self.trials_out_of_limit,
        }]  # fmt: skip


def rare_summary(run: Run, chosen: Sequence[str] = ()) -> RareSummary:
    """Return the answer about a rare run, from its file alone.

    Raises
    ------
    QuestionError
        If no trial has run, or a response is unknown.
    """
    responses_in_focus(run, chosen)
    if (drawn := drawn_trials(run)) is None or not run.ended:
        raise QuestionError(f"{run.path}: no trial has run; there is nothing to report")
    summary, name = summary_of(drawn, ()), run.aim
    aim = summary.responses[name]
    assert aim.limited and drawn.sample.weights
    yields, weights = aim.limited.yields, drawn.sample.weights.values
    share, out = yields.fraction_out_of_limit, run.beyond(name)
    failures = rare_share(drawn.sample.failed_trials, weights)
    if failures.value > 0:  # failed trials are out of limit: no more than these
        failures = failures._replace(upper=min(failures.upper, share.upper))
    too_few, failed = _too_few(weights[out[drawn.trials]]), _failing(run, failures)
    points, changes = failure_points(run, out), changes_of(run, name)
    trials = summary.trials._replace(
        done=run.ended - run.failed,
        failed=run.failed,
        failures=failures,
        unseen=unmet(weights) if len(weights) else math.nan,
        notes=(*too_few, failed, *summary.trials.notes),
    )
    return RareSummary(
        **{**vars(summary), "trials": trials},
        trials_out_of_limit=int(np.count_nonzero(out[drawn.trials])),
        response=name,
        sentence=aim.sentence,
        scale=aim.scale,
        nominal=aim.nominal,
        limit=aim.limited.limit,
        demanded_ppk=aim.limited.demanded_ppk,
        fraction_out_of_limit=share,
        within=yields.within,
        verdict=yields.verdict,
        reason=yields.reason,
        equivalent_ppk=aim.limited.equivalent_ppk,
        # where it jumps no trials decide
        plain_trials=math.nan if yields.reason == JUMP else plain_trials(share),
        first_order=float(ndtr(-points[0].distance)) if points else math.nan,
        stages=tuple(_stages(run, drawn.trials)),
        failure_points=points,
        precise=len(changes),
        changed=int(np.count_nonzero(changes)),
    )


def _too_few(weights: NDArray[np.float64]) -> list[str]:
    """Return why an interval is wide, from the weights of out-of-limit trials."""
    size = effective_number(weights)
    if not 0 < size < ENOUGH:
        return []
    return [
        f"the out-of-limit trials have an effective sample size of {size}; {ENOUGH} "
        "are needed for a narrow interval: run more trials, or another seed"
    ]


def _failing(run: Run, share: Estimate) -> str:
    """Return a note on the fraction that fails, and on failed trials of the search."""
    if not run.failed:
        return "no trial failed in any stage"
    words = ", ".join(f"{count} {word}" for word, count in run.failures.items())
    if share.sure:
        value, *ends = PPM.interval(*share[:3])
        fraction = f"{value} ppm ({ends[0]} to {ends[1]}) fail"
        note = f"{fraction}, and count as out of limit"
    else:
        note = f"the fraction that fails is not known: {share.reason}"
    return f"{note}; of the trials sampled near the limit: {words}"


def _stages(run: Run, estimate: Integers) -> Iterator[Stages]:
    stage, last = run.column(STAGE), np.zeros(run.trials, np.bool_)
    last[estimate] = True
    search = (run.status != Status.NOT_RUN) & ~last
    for purpose, trials in (
        ("greater spread", search & (stage == 0)),
        ("search", search & (stage > 0)),
        ("estimate", last),
    ):
        if not trials.any():
            continue
        spread, out = run.column(SPREAD)[trials], run.beyond(run.aim)[trials]
        yield Stages(
            purpose,
            int(stage[trials].min()),
            int(stage[trials].max()),
            len(spread),
            int(np.count_nonzero(out)),
            int(np.count_nonzero(run.status[trials] > Status.DONE)),
            float(spread.min()),
            float(spread.max()),
        )

"""What a rare run says: the fraction out of one limit, and the trials there. SI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat.answers.answer import Answer
from tolstat.answers.rare.failure_points import FailurePoint, failure_points
from tolstat.answers.report.gather import (
    assumptions_of,
    provenance_of,
    title_block_of,
)
from tolstat.answers.report.report_answer import Assumptions, TitleBlock, TrialCounts
from tolstat.answers.report.run_notes import notes_of
from tolstat.deviations.rare_stage import SPREAD, STAGE, WEIGHT
from tolstat.document.blocks import Document
from tolstat.document.inline import Number
from tolstat.errors import PictureError, allowed_names
from tolstat.render.tables import Row
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import (
    ENOUGH,
    plain_trials,
    rare_share,
    unmet,
)
from tolstat.statistics.intervals.weights import effective_number
from tolstat.statistics.limits.capability import by_share
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.yields import NOT_MET, verdict
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.units.scale import AS_IS, PER_CENT, PPM, Scale


class Stage(NamedTuple):
    """Trials that were sampled at once.

    Attributes
    ----------
    trials, out_of_limit, failed : int
        How many have run; of these, out of limit, failed ones among them.
    least, largest : float
        Times the spread of the study that they aimed at.
    """

    trials: int
    out_of_limit: int
    failed: int
    least: float
    largest: float


@dataclass(frozen=True, repr=False)
class RareSummary(Answer):
    """What a rare run says of its limit.

    Attributes
    ----------
    title, run, model : str
        What it is of.
    title_block : TitleBlock
        What it is part of, and who answers for it.
    trials : TrialCounts
        What became of them, in all stages; those of the last are counted, and tell
        which fraction failed. Unseen is the fraction of a kind of out-of-limit trial
        that the last stage has not met, at most (97.5 %).
    met : int
        Out-of-limit trials in the last stage.
    response, sentence : str
        What is limited.
    scale : Scale
        How it is shown.
    nominal : float
        Of the nominal trial; NaN if that failed.
    limit : Limit
        What is permitted, and what is demanded.
    demanded_ppk : float
        What is demanded, as the Ppk of a normal response.
    fraction_out_of_limit, within : Estimate
        Fractions of production; failed trials are out of limit.
    verdict : str
        As of a plain run, for one number of trials.
    equivalent_ppk : Estimate
        Of a normal response with the same fraction out of limit.
    plain_trials : float
        Trials of a plain run with as narrow an interval; NaN where none.
    first_order : float
        Fraction out of limit at this end of a limit that is straight, as far from the
        median trial as the most probable failure point; NaN where none was met.
    stages : tuple of Stage
        In order; the last one tells the fraction.
    failure_points : tuple of FailurePoint
        The most probable out-of-limit trials that were met, the nearest first.
    precise, changed : int
        Trials evaluated again more precisely; those of them that change sides.
    assumptions : Assumptions
        What the numbers rest on.
    scales : dict of str to Scale
        How each contributor that deviates is shown.
    provenance : dict
        Versions, times, processor; the study as it was written.
    of : Run
        The run itself; no part of the JSON.
    """

    title: str
    run: str
    model: str
    title_block: TitleBlock
    trials: TrialCounts
    met: int
    response: str
    sentence: str
    scale: Scale
    nominal: float
    limit: Limit
    demanded_ppk: float
    fraction_out_of_limit: Estimate
    within: Estimate
    verdict: str
    equivalent_ppk: Estimate
    plain_trials: float
    first_order: float
    stages: tuple[Stage, ...]
    failure_points: tuple[FailurePoint, ...]
    precise: int
    changed: int
    assumptions: Assumptions
    scales: Mapping[str, Scale]
    provenance: Mapping[str, object]
    of: Run = field(metadata={"json": False})
    answers: ClassVar[str] = "rare"

    @property
    def not_met(self) -> tuple[str, ...]:
        """The response, if its limit is not met."""
        return (self.response,) if self.verdict == NOT_MET else ()

    @property
    def short(self) -> str:
        """What it is, in a few words."""
        value = PPM.interval(*self.fraction_out_of_limit[:3])[0]
        return f"{self.run}, {self.response} {self.verdict}, {value} ppm"

    def document(self) -> Document:
        """Return verdict, failure points, stages, assumptions."""
        from tolstat.answers.rare.rare_document import rare_document

        return rare_document(self)

    def rows(self) -> Sequence[Row]:
        """Return the one response in a row."""
        lower, upper = (
            end if math.isfinite(end) else math.nan for end in self.limit.permitted
        )
        return [
            {
                "title": self.title,
                "response": self.response,
                "unit": self.scale.shown,
                "nominal [unit]": Number(self.nominal, self.scale),
                "lower limit [unit]": Number(lower, self.scale),
                "upper limit [unit]": Number(upper, self.scale),
                "demanded [%]": Number(self.limit.demanded, PER_CENT),
                "verdict": self.verdict,
                "yield [%]": Number(self.within, PER_CENT),
                "fraction out of limit [ppm]": Number(self.fraction_out_of_limit, PPM),
                "equivalent Ppk": Number(self.equivalent_ppk, AS_IS),
                "failed [ppm]": Number(self.trials.failures, PPM),
                "trials run": self.trials.ran,
                "trials counted": self.trials.counted,
                "of these out of limit": self.met,
            }
        ]


def rare_summary(run: Run, chosen: Sequence[str] = ()) -> RareSummary:
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
        If no trial has run, or another response is requested.
    """
    name, limit = run.aim, run.limits[run.aim]
    names = [each.name for each in run.responses]
    if others := [each for each in chosen if each != name]:
        if others[0] not in names:
            unknown = allowed_names(others[0], names)
            raise PictureError(f"response {others[0]}: unknown; {unknown}")
        raise PictureError(
            f'response {others[0]}: {run.path} has sampling = "rare" and tells of '
            f"{name} alone"
        )
    if not run.ended:
        raise PictureError(f"{run.path}: no trial has run; there is nothing to report")
    ran = run.status != Status.NOT_RUN
    out, stage, weights = run.beyond(name), run.column(STAGE), run.column(WEIGHT)
    last = ran & ~np.isnan(weights)
    share = rare_share(out[last], weights[last])
    failures = rare_share(run.status[last] > Status.DONE, weights[last])
    if failures.value > 0:  # failed trials are out of limit: no more than these
        failures = failures._replace(upper=min(failures.upper, share.upper))
    good = share.complement
    points = failure_points(run, out)
    assert run.sampled
    return RareSummary(
        title=run.title,
        run=run.path.name,
        model=run.model,
        title_block=title_block_of(run),
        trials=TrialCounts(
            run.trials,
            run.ended,
            run.ended - run.failed,
            run.failed,
            int(np.count_nonzero(last)),
            run.counts,
            failures,
            unmet(weights[last]) if last.any() else math.nan,
            run.sampling,
            run.sampled.promise,
            (
                *_too_few(weights[last & out]),
                _failing(run, failures),
                *notes_of(run, None),
            ),
        ),
        met=int(np.count_nonzero(out[last])),
        response=name,
        sentence=next(each.sentence for each in run.responses if each.name == name),
        scale=run.scales[name],
        nominal=run.nominal_values[name],
        limit=limit,
        demanded_ppk=limit.ppk,
        fraction_out_of_limit=share,
        within=good,
        verdict=verdict(good, limit.demanded),
        equivalent_ppk=by_share(share, limit),
        plain_trials=plain_trials(share),
        first_order=float(ndtr(-points[0].distance)) if points else math.nan,
        stages=tuple(
            _stage(run, ran & (stage == n), out) for n in np.unique(stage[ran])
        ),
        failure_points=points,
        **_changed(run),
        assumptions=assumptions_of(run),
        scales={each: run.scales[each] for each in run.assumed},
        provenance=provenance_of(run),
        of=run,
    )


def _too_few(weights: NDArray[np.float64]) -> list[str]:
    """Say why an interval is so wide, of the weights of out-of-limit trials."""
    size = effective_number(weights)
    if not 0 < size < ENOUGH:
        return []
    return [
        f"the out-of-limit trials have an effective sample size of {size}; {ENOUGH} "
        "are needed for a narrow interval: run more trials, or another seed"
    ]


def _failing(run: Run, share: Estimate) -> str:
    """Say which fraction fails; failed trials of a search are no fraction of any."""
    if not run.failed:
        return "no trial failed in any stage"
    words = ", ".join(f"{count} {word}" for word, count in run.failures.items())
    if share.sure:
        value, *ends = PPM.interval(*share[:3])
        said = f"{value} ppm ({ends[0]} to {ends[1]}) fail, and count as out of limit"
    else:
        said = f"the fraction that fails is not known: {share.reason}"
    return f"{said}; of the trials sampled near the limit: {words}"


def _stage(run: Run, trials: NDArray[np.bool_], out: NDArray[np.bool_]) -> Stage:
    spread = run.column(SPREAD)[trials]
    return Stage(
        int(np.count_nonzero(trials)),
        int(np.count_nonzero(trials & out)),
        int(np.count_nonzero(run.status[trials] > Status.DONE)),
        float(spread.min()),
        float(spread.max()),
    )


def _changed(run: Run) -> dict[str, int]:
    """Count the trials evaluated again, and those that change sides of the limit."""
    if run.audited is None:
        return {"precise": 0, "changed": 0}
    permitted = run.limits[run.aim].permitted
    before = within(run.column(run.aim)[run.audited.trials], permitted)
    after = within(run.audited.responses[run.aim], permitted)
    changed = int(np.count_nonzero(before != after))
    return {"precise": len(run.audited.trials), "changed": changed}

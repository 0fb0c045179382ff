"""What if parts came from other distributions: the stored trials, reweighted."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import NamedTuple

from tolstat.answers.relimit import with_limits
from tolstat.answers.report.gather import all_limits, reportable, summaries_of
from tolstat.answers.report.run_notes import notes_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.scenario import Entries, changed_kinds, read_scenario
from tolstat.answers.what_if.what_if_answer import (
    Change,
    ResponseWhatIf,
    WhatIf,
    YieldAllLimits,
)
from tolstat.deviations.density_ratio import DensityRatio, dependent_groups, equal_parts
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.overlap import Overlap, check_overlap, overlap_of
from tolstat.errors import (
    Advice,
    DistributionError,
    PictureError,
    RunFileError,
    StudyError,
)
from tolstat.execution.compatibility import trials_drawn_otherwise
from tolstat.execution.continuation import plan_again, study_of
from tolstat.execution.trial_table import drawn_again
from tolstat.model.contract import Model
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.statistics.intervals.weights import LEAST_EFFECTIVE, Weights
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations
from tolstat.study.problems import Problems
from tolstat.study.study import Study


def what_if(
    run: Run | str | os.PathLike[str],
    deviations: Entries,
    *,
    limits: Entries | None = None,
    model: Model | None = None,
) -> WhatIf:
    """Say what a run would have found with other deviations; nothing is simulated.

    The stored trials are weighted by the ratio of densities.

    Parameters
    ----------
    run : Run or path
        Of random trials.
    deviations : mapping of str to str or dict
        As the section [deviations] of a study has them: `{"rod_length": "+-0.6 mm"}`.
    limits : mapping, optional
        Other limits, as of `limited`.
    model : Model, optional
        A custom model, if the run is of one.

    Returns
    -------
    WhatIf
        Every number with an interval that holds for weighted trials, or why it has
        none.

    Raises
    ------
    StudyError
        If an entry cannot be read, or the stored trials do not cover it: see
        `fresh_study` for the study of a run that does.
    PictureError
        If the trials are not random.
    """
    run = run if isinstance(run, Run) else open_run(run)
    if limits:
        run = with_limits(run, limits)
    drawn, _ = reportable(run)
    if drawn.sample.replicates:
        raise PictureError(
            f"{run.path}: what-if is {RANDOM_ONLY}; {run.sampling} trials depend on "
            "each other"
        )
    study = study_of(run, model=model)
    _check_drawn(run, study)
    problems = Problems(f"{run.path}", "cannot be asked that")
    scenario = read_scenario(deviations, study, run, problems)
    if not deviations:
        problems.add("[deviations]", None, "nothing is asked; name a contributor")
    problems.raise_if_any()
    found = _covered(scenario, study, drawn, problems)
    kinds = [*changed_kinds(deviations, scenario, study, run)]
    if not found:
        raise StudyError("\n  ".join([str(problems.refusal), *kinds]))
    weights = found.weights
    weighted = drawn._replace(sample=drawn.sample._replace(weights=weights))
    before, after = summaries_of(drawn), summaries_of(weighted)
    before_all, after_all = all_limits(drawn), all_limits(weighted)
    return WhatIf(
        run.title,
        run.path.name,
        run.model,
        {
            name: Change(run.assumed[name].words, words, found.left[name])
            for name, words in scenario.words.items()
        },
        len(drawn.trials),
        weights.number,
        found.overlap.efficiency * len(drawn.trials),
        YieldAllLimits(before_all, after_all) if before_all and after_all else None,
        {
            response.name: ResponseWhatIf(
                before[response.name],
                after[response.name],
                run.nominal_values[response.name],
                response.sentence,
                run.scales[response.name],
            )
            for response in run.responses
        },
        (*kinds, *notes_of(run, weighted.sample)),
    )


def _check_drawn(run: Run, study: Study) -> None:
    """Refuse a run whose study samples other deviations by now."""
    plan = plan_again(run, study, drawn_again(run, study).trials)
    if len(trials_drawn_otherwise(run, plan)):
        raise RunFileError(
            f"{run.path}: its study draws other deviations by now, because its data or "
            "the machine are others",
            Advice("run again", run.path, run.machine, run=run),
        )


class _Covered(NamedTuple):
    """What the trials say of other deviations."""

    left: dict[str, float]  # fraction of the trials, with each change alone
    overlap: Overlap
    weights: Weights


def _covered(
    scenario: Deviations, study: Study, drawn: Drawn, problems: Problems
) -> _Covered | None:
    """Weight the trials; None where they do not cover the scenario, which is noted."""
    left = _left(scenario, study, problems)
    if problems.found:
        return None
    with problems.noting("all together", None):
        overlap = _overlap(scenario.distributions, study, len(drawn.trials), left)
        baseline = study.deviating
        values = {name: drawn.values(name) for name in baseline.distributions}
        ratio = DensityRatio(values, baseline.distributions, baseline.dependence)
        new = ratio.weights(scenario.distributions)
        weights = Weights(new, overlap.most, overlap.cut)
        if weights.too_few:
            raise DistributionError(f"{weights.too_few}: {LEAST_EFFECTIVE} are needed")
        return _Covered(left, overlap, weights)
    return None


def _left(scenario: Deviations, study: Study, problems: Problems) -> dict[str, float]:
    """Check that each change alone is covered; what each leaves of the trials."""
    found, baseline = {}, study.deviating
    for name, new in scenario.distributions.items():
        with problems.noting(f"[deviations] {name}", scenario.words[name]):
            if name not in baseline.distributions:
                raise DistributionError("it does not deviate in this run")
            with_it = equal_parts(name, baseline.dependence)
            if any(scenario.distributions.get(n) != new for n in with_it):
                raise DistributionError(
                    f"all parts of its batch are equal: {', '.join(with_it)}"
                )
            try:
                found[name] = check_overlap(baseline.distributions[name], new)
            except DistributionError as error:
                raise DistributionError(
                    f"{error}; drawn was {baseline.words[name]}"
                ) from None
    return found


def _overlap(
    new: Mapping[str, Distribution],
    study: Study,
    trials: int,
    left: Mapping[str, float],
) -> Overlap:
    """Check that the effective sample size suffices for all changes together."""
    baseline = study.deviating
    try:
        found = overlap_of(baseline.distributions, baseline.dependence, new, trials)
    except DistributionError as error:
        joint = dependent_groups(new, baseline.dependence)
        others = [name for group in joint for name in group if name not in new]
        more = f": {', '.join(others)} too" if others else ""
        raise DistributionError(f"{error}{more}") from None
    if found.efficiency * trials < LEAST_EFFECTIVE:
        least = sorted(left, key=lambda name: left[name])
        each = ", ".join(f"{name} alone {100 * left[name]:.2g} %" for name in least)
        raise DistributionError(
            f"{found.efficiency * trials:.0f} effective trials would be left of "
            f"{trials}, and {LEAST_EFFECTIVE} are needed ({each})"
        )
    return found

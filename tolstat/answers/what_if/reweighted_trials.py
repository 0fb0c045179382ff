"""Results with other distributions, from the stored trials reweighted."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from tolstat.answers.relimit import problems_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.what_if_answer import Change
from tolstat.deviations.density_ratio import (
    DensityRatio,
    check_overlap,
    overlap_of,
    uncovered,
)
from tolstat.deviations.names import expand
from tolstat.errors import (
    Advice,
    DependenceError,
    DistributionError,
    QuestionError,
    Remedy,
    RunFileError,
)
from tolstat.execution.planning import assumed_of
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.statistics.intervals.weighted_estimates import unmet
from tolstat.statistics.intervals.weights import (
    LEAST_EFFECTIVE,
    Weights,
    effective_number,
)
from tolstat.statistics.limits.limit import within
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.editor import Entries
from tolstat.study.problems import Problems
from tolstat.study.study import Study
from tolstat.study.study_schema import check_section
from tolstat.units.scale import PPM


class ReweightedScenario(NamedTuple):
    """The trials of a run as those of a scenario."""

    trials: Drawn
    changes: dict[str, Change]  # by contributor
    expected: float  # effective sample size by the distributions
    weights: Weights
    notes: tuple[str, ...]


def reweighted_scenario(
    run: Run, deviations: Entries, study: Study, trials: Drawn
) -> ReweightedScenario:
    """Return the trials weighted by the ratio of densities; nothing is simulated.

    Raises
    ------
    StudyError
        If an entry cannot be read, or the trials do not cover it.
    QuestionError
        If the trials are not random.
    """
    if trials.sample.replicates:
        raise QuestionError(
            f"{run.path}: what-if is {RANDOM_ONLY}; {run.sampling} trials depend on "
            "each other"
        )
    problems = problems_of(run)
    scenario = read_scenario(deviations, study, run, problems)
    if not deviations:
        problems.add("[deviations]", None, "no entry is given; name a contributor")
    problems.raise_if_any()
    return reweighted(scenario, study, trials, problems)


def _without(run: Run, weights: Weights) -> Iterator[str]:
    """Yield what a rare or thinned run says of trials that a scenario does not have."""
    if run.thinned:
        yield (
            f"the scenario rests on the first {run.random_trials} trials, which are "
            "random; fractions of the baseline rest on thinned ones, too"
        )
    if not run.aim:
        return
    share = PPM.words(min(unmet(weights.values) + weights.cut, 1.0))
    yield (
        f"the interval of the limit of {run.aim} holds for the kinds of out-of-limit "
        f"trials that the last stage met; one that it never met may make up {share}"
    )


def out_of_limit_sample_size(trials: Drawn, response: str) -> int | None:
    """Return the effective sample size of the out-of-limit trials."""
    sample, limit = trials.sample, trials.run.limits.get(response)
    if limit is None or sample.weights is None:
        return None
    good = sample.done & within(trials.values(response), limit.permitted)
    return effective_number(sample.weights.values[sample.ran & ~good])


def check_assumed(run: Run, study: Study) -> None:
    """Refuse a run whose study samples other deviations now."""
    sampled, again = (
        {name: part.distribution for name, part in assumed.items()}
        for assumed in (run.assumed, assumed_of(study.deviating))
    )
    if sampled != again:
        raise RunFileError(
            f"{run.path}: its study samples other deviations now: its data or its "
            "model have changed",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def read_scenario(
    entries: Entries, study: Study, run: Run, problems: Problems
) -> Deviations:
    """Return the entries of [deviations] as changed; data files lie beside the study.

    A tolerance alone keeps the distribution of its parts.
    """
    check_section("deviations", entries, problems)
    editor, changed = study.editor(), dict[str, Any]()
    for name, entry in entries.items():
        with problems.noting(f"[deviations] {name}", entry):
            expand(name, [*editor.parts])  # refuses unknown names first
            if isinstance(entry, dict) and "common" in entry:
                raise DependenceError("batches stay as sampled; leave out common")
            if isinstance(entry, dict) and "nominal" in entry and "data" not in entry:
                raise DistributionError(
                    "a nominal is changed alone, in an entry of its own with --write; "
                    "then the tolerance, of the run of that study"
                )
            changed |= editor.scenario(name, entry)
    contributors, folder = study.description.contributors, run.data_folder
    return read_deviations(changed, {}, contributors, folder, problems)


def reweighted(
    scenario: Deviations, study: Study, trials: Drawn, problems: Problems
) -> ReweightedScenario:
    """Return the trials weighted for a scenario that was read; see above.

    Raises
    ------
    StudyError
        If they do not cover the scenario.
    """
    overlaps, baseline = dict[str, float](), study.deviating
    for name, new in scenario.distributions.items():
        with problems.noting(f"[deviations] {name}", scenario.words[name]):
            if name not in baseline.distributions:
                raise DistributionError(
                    "its distribution is not known; the study of the run gives none"
                    if trials.run.listed
                    else "it does not deviate in this run"
                )
            try:
                overlaps[name] = check_overlap(baseline.distributions[name], new)
            except DistributionError as error:
                sampled = baseline.words[name]
                raise DistributionError(f"{error}; sampled: {sampled}") from None
    problems.raise_if_any()
    expected, weights = problems.required(
        "all together", None, lambda: _together(scenario, study, trials, overlaps)
    )
    changes = {
        name: Change(baseline.words[name], words, overlaps[name])
        for name, words in scenario.words.items()
    }
    return ReweightedScenario(
        replace(trials, sample=trials.sample._replace(weights=weights)),
        changes, expected, weights,
        (*scenario.warnings, *_without(trials.run, weights)),
    )  # fmt: skip


def _together(
    scenario: Deviations, study: Study, trials: Drawn, overlaps: dict[str, float]
) -> tuple[float, Weights]:
    """Return expected effective sample size and weights for all changes at once.

    `overlaps`: effective sample size per trial, by contributor whose change is alone.
    """
    new, baseline = scenario.distributions, study.deviating
    before = trials.sample.weights
    number = before.number if before else len(trials.trials)
    overlap = overlap_of(baseline.distributions, baseline.dependence, new, number)
    expected = overlap.efficiency * number
    if expected < LEAST_EFFECTIVE and not before:
        least = sorted(overlaps, key=overlaps.__getitem__)
        alone = ", ".join(f"{n} alone {100 * overlaps[n]:.2g} %" for n in least)
        raise DistributionError(
            f"effective sample size {expected:.0f} of {number} trials; "
            f"{LEAST_EFFECTIVE} needed ({alone})"
        )
    values = {name: trials.values(name) for name in baseline.distributions}
    ratio = DensityRatio(values, baseline.distributions, baseline.dependence)
    ratios = ratio.weights(new)
    weights = Weights(ratios, overlap.most, overlap.cut)
    if before:  # what is above either cap stays above the product of both
        outside = uncovered(values, baseline.distributions, new)
        ratios[outside.trials] = 0.0
        weights = Weights(
            before.values * ratios, before.most * overlap.most, overlap.cut,
            uncovered=outside.units,
        )  # fmt: skip
    elif weights.too_few:
        raise DistributionError(weights.too_few)
    return expected, weights

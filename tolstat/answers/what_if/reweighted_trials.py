"""Results with other distributions, from the stored trials reweighted."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from tolstat.answers.halved_entries import moved
from tolstat.answers.relimit import with_limits
from tolstat.answers.report.gather import all_limits, reportable, summaries_of
from tolstat.answers.run_answer import notes_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.what_if_answer import (
    AllLimitsWhatIf,
    Change,
    ResponseWhatIf,
    WhatIf,
)
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.deviations.names import expand
from tolstat.deviations.overlap import check_overlap, overlap_of
from tolstat.deviations.spread import unshifted, zone_of
from tolstat.errors import (
    Advice,
    DependenceError,
    DistributionError,
    QuestionError,
    Remedy,
    RunFileError,
    StudyError,
)
from tolstat.execution.compatibility import study_of, trials_sampled_differently
from tolstat.execution.planning import planned_run
from tolstat.execution.proposers import drawn_again
from tolstat.model.contract import Model
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.statistics.intervals.weights import (
    LEAST_EFFECTIVE,
    Weights,
    effective_number,
)
from tolstat.statistics.limits.limit import within
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study import Study
from tolstat.study.study_schema import check_section

Entries = Mapping[str, str | dict[str, Any]]


def what_if(
    run: RunSource,
    deviations: Entries,
    *,
    limits: Entries | None = None,
    model: Model | None = None,
) -> WhatIf:
    """Return the results of a run with other deviations; nothing is simulated.

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
        Every number with an interval that holds for weighted trials, or the reason why
        it has none.

    Raises
    ------
    StudyError
        If an entry cannot be read, or the stored trials do not cover it: see
        `fresh_study` for the study of a run that does.
    QuestionError
        If the trials are not random.

    Examples
    --------
    >>> found = tolstat.what_if("runs/stack-up.h5", {"housing": "+-0.06 mm"})
    >>> found.all_limits.scenario.within
    0.999749 (0.999041 to 0.999879)
    """
    run = open_run(run)
    if limits:
        run = with_limits(run, limits)
    drawn, _ = reportable(run)
    if drawn.sample.replicates:
        raise QuestionError(
            f"{run.path}: what-if is {RANDOM_ONLY}; {run.sampling} trials depend on "
            "each other"
        )
    study = study_of(run, model=model)
    _check_drawn(run, study)
    problems = problems_of(run)
    scenario = read_scenario(deviations, study, run, problems)
    if not deviations:
        problems.add("[deviations]", None, "no entry is given; name a contributor")
    problems.raise_if_any()
    kinds = _changed_kinds(deviations, scenario, study, run)
    try:
        found = reweighted(scenario, study, drawn, problems)
    except StudyError as error:
        raise StudyError("\n  ".join([str(error), *kinds])) from None
    weighted = drawn._replace(sample=drawn.sample._replace(weights=found.weights))
    before, after = summaries_of(drawn), summaries_of(weighted)
    before_all, after_all = all_limits(drawn), all_limits(weighted)
    # numbers of the tolerances are those of the baseline
    notes = notes_of(replace(run, numbers=()), drawn.sample)
    return WhatIf(
        run.title,
        run.path.name,
        run.model,
        {
            name: Change(run.assumed[name].words, words, found.left[name])
            for name, words in scenario.words.items()
        },
        len(drawn.trials),
        min(found.weights.number, int(found.expected)),
        found.expected,
        AllLimitsWhatIf(before_all, after_all) if before_all and after_all else None,
        {
            response.name: ResponseWhatIf(
                before[response.name],
                after[response.name],
                run.nominal_values[response.name],
                response.sentence,
                run.scales[response.name],
                _out_of_limit(weighted, response.name),
            )
            for response in run.responses
        },
        (*scenario.warnings, *kinds, *notes),
    )


def _out_of_limit(drawn: Drawn, response: str) -> int | None:
    """Return the effective sample size of the out-of-limit trials."""
    sample, limit = drawn.sample, drawn.run.limits.get(response)
    if limit is None or sample.weights is None:
        return None
    good = sample.done & within(drawn.values(response), limit.permitted)
    return effective_number(sample.weights.values[sample.ran & ~good])


def _check_drawn(run: Run, study: Study) -> None:
    """Refuse a run whose study samples other deviations now."""
    plan = planned_run(study, drawn_again(run, study).trials, run.path)
    if len(trials_sampled_differently(run, plan)):
        raise RunFileError(
            f"{run.path}: its study samples other deviations now: its data or its "
            "model have changed",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def problems_of(run: Run) -> Problems:
    """Return the collection of problems of a scenario."""
    return Problems(f"{run.path}", "cannot answer this")


def read_scenario(
    given: Entries, study: Study, run: Run, problems: Problems
) -> Deviations:
    """Return the entries of [deviations]; data files lie beside the run's study."""
    check_section("deviations", given, problems)
    for name, entry in given.items():
        if isinstance(entry, dict) and "common" in entry:
            with problems.noting(f"[deviations] {name}", entry):
                raise DependenceError("batches stay as sampled; leave out common")
        if isinstance(entry, dict) and "nominal" in entry and "data" not in entry:
            with problems.noting(f"[deviations] {name}", entry):
                raise DistributionError(
                    "a nominal is changed alone, in an entry of its own with --write; "
                    "then the tolerance, of the run of that study"
                )
    contributors, home = study.description.contributors, run.study_file or run.path
    return read_deviations(given, {}, contributors, home.parent, problems)


def _changed_kinds(
    given: Entries, scenario: Deviations, study: Study, run: Run
) -> list[str]:
    """Return notes on ranges, which are normal, that replace another distribution."""
    names = [each.name for each in run.contributors]
    table, sampled = run.study.table, study.deviating.distributions
    before = {
        member: entry
        for section in ("links", "deviations")
        for name, entry in table.get(section, {}).items()
        if isinstance(entry, dict) and "distribution" in entry
        for member in expand(name, names)
    }
    said = dict[str, None]()
    for name, entry in given.items():
        for member in expand(name, names) if isinstance(entry, str) else ():
            new, old = scenario.distributions[member], sampled.get(member)
            if member not in before or old is None:
                continue
            if type(new) is type(old := unshifted(old)):
                continue
            kind, scale = before[member]["distribution"], run.scales[member]
            own = {k: v for k, v in before[member].items() if k in vars(old)}
            if zone_of(old) and (other := zone_of(new)):
                own = moved(own, old, other, scale)
            kept = toml_of({**own, "tolerance": entry, "distribution": kind})
            said[
                f"{name} was sampled {kind}; a range alone is normal: {kept} keeps it "
                f"{kind}"
            ] = None
    return [*said]


class Reweighted(NamedTuple):
    """The trials of a run, weighted as those of a scenario."""

    left: dict[str, float]  # effective sample size per trial, with each change alone
    expected: float  # effective sample size by the distributions
    weights: Weights


def reweighted(
    scenario: Deviations, study: Study, drawn: Drawn, problems: Problems
) -> Reweighted:
    """Return the weighted trials.

    Raises
    ------
    StudyError
        If they do not cover the scenario.
    """
    left, baseline = dict[str, float](), study.deviating
    for name, new in scenario.distributions.items():
        with problems.noting(f"[deviations] {name}", scenario.words[name]):
            if name not in baseline.distributions:
                raise DistributionError("it does not deviate in this run")
            try:
                left[name] = check_overlap(baseline.distributions[name], new)
            except DistributionError as error:
                sampled = baseline.words[name]
                raise DistributionError(f"{error}; sampled: {sampled}") from None
    problems.raise_if_any()
    return problems.required(
        "all together", None, lambda: _together(scenario, study, drawn, left)
    )


def _together(
    scenario: Deviations, study: Study, drawn: Drawn, left: dict[str, float]
) -> Reweighted:
    """Return the trials weighted for all changes at once."""
    trials, new, baseline = len(drawn.trials), scenario.distributions, study.deviating
    overlap = overlap_of(baseline.distributions, baseline.dependence, new, trials)
    expected = overlap.efficiency * trials
    if expected < LEAST_EFFECTIVE:
        least = sorted(left, key=left.__getitem__)
        each = ", ".join(f"{name} alone {100 * left[name]:.2g} %" for name in least)
        raise DistributionError(
            f"effective sample size {expected:.0f} of {trials} trials; "
            f"{LEAST_EFFECTIVE} needed ({each})"
        )
    values = {name: drawn.values(name) for name in baseline.distributions}
    ratio = DensityRatio(values, baseline.distributions, baseline.dependence)
    weights = Weights(ratio.weights(new), overlap.most, overlap.cut)
    if weights.too_few:
        raise DistributionError(weights.too_few)
    return Reweighted(left, expected, weights)

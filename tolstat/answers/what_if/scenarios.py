"""What if: a run with other deviations or limits, in one scenario or several."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, overload

from tolstat.answers.compare.compare_runs import differences_of
from tolstat.answers.compare.pairing import pair_of
from tolstat.answers.relimit import with_limits
from tolstat.answers.report.summaries import all_limits, reportable, summaries_of
from tolstat.answers.run_answer import notes_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.evaluated_trials import (
    baseline_run,
    is_cheap,
    scenario_run,
)
from tolstat.answers.what_if.fresh_study import NO_ENTRIES, as_entries
from tolstat.answers.what_if.reweighted_trials import (
    check_assumed,
    out_of_limit_sample_size,
    reweighted_scenario,
)
from tolstat.answers.what_if.what_if_answer import (
    AllLimitsWhatIf,
    Change,
    Method,
    ResponseWhatIf,
    Scenarios,
    WhatIf,
)
from tolstat.errors import StudyError
from tolstat.execution.compatibility import check_source, study_of
from tolstat.model.contract import Model
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.editor import Entries, StudyChange
from tolstat.study.settings_section import NOMINAL
from tolstat.study.study import Study


@overload
def what_if(
    run: RunSource,
    deviations: Entries,
    *,
    limits: Entries | None = None,
    model: Model | None = None,
    evaluate: bool | None = None,
) -> WhatIf: ...


@overload
def what_if(
    run: RunSource,
    deviations: Sequence[Entries],
    *,
    limits: Entries | None = None,
    model: Model | None = None,
    evaluate: bool | None = None,
) -> Scenarios: ...


def what_if(
    run: RunSource,
    deviations: Entries | Sequence[Entries],
    *,
    limits: Entries | None = None,
    model: Model | None = None,
    evaluate: bool | None = None,
) -> WhatIf | Scenarios:
    """Return the results of a run with other deviations or limits.

    A cheap model evaluates the trials of the run again, with the same seed: a formula,
    or any model that does 20 000 trials in 10 s, or as fast as the run took. Otherwise
    the stored trials are weighted by the ratio of densities. Where scenarios of a
    thinned run are evaluated, so is the baseline: with the same random trials.

    Parameters
    ----------
    run : Run or path
        Of sampled trials; if it is not cheap, of random trials or rare: then for the
        limit that it searched.
    deviations : mapping of str to str or dict, or several of these
        `{"rod_length": "+-0.6 mm"}` is another tolerance of the same distribution. A
        dict is a whole entry, as the section [deviations] of a study has it; one with
        `shift` alone leaves all else. Several mappings are scenarios side by side. An
        empty one has other limits alone.
    limits : mapping, optional
        Other limits, as of `limited`.
    model : Model, optional
        A custom model, if the run is of one.
    evaluate : bool, optional
        Whether to evaluate trials, or to weight the stored ones; by default whether the
        model is cheap.

    Returns
    -------
    WhatIf or Scenarios
        Every number with an interval, or the reason why it has none. Of evaluated
        trials also the paired differences.

    Raises
    ------
    StudyError
        If an entry cannot be read, or weighted trials do not cover it: see
        `fresh_study` for the study of a run that does.
    QuestionError
        If the trials are not random, and the model is not cheap.

    Examples
    --------
    >>> found = tolstat.what_if("runs/stack-up.h5", {"housing": "+-0.06 mm"})
    >>> found.all_limits.scenario.within
    0.9999 (0.999247 to 1)
    """
    run = open_run(run)
    reportable(run)
    study = study_of(run, model=model)
    check_assumed(run, study)
    several = isinstance(deviations, Iterable) and not isinstance(deviations, Mapping)
    asked: Iterable[Any] = deviations if several else [deviations]
    scenarios = [as_entries(scenario) for scenario in asked]
    if not scenarios:
        raise StudyError(NO_ENTRIES)
    if evaluate is None:
        evaluate = any(scenarios) and is_cheap(run, study)
    if evaluate:
        check_source(run, study)
    answers = []
    before = baseline_run(run, study) if evaluate and run.thinned else run
    baseline = with_limits(before, limits) if limits else before
    for scenario in scenarios:
        if not scenario and limits:
            answers.append(_answer(before, baseline, {}, Method.STORED))
        elif evaluate:
            again = scenario_run(run, study, StudyChange(scenario, limits or {}))
            answers.append(_evaluated(baseline, again, scenario, study))
        else:
            answers.append(_reweighted(baseline, scenario, study))
    if not several:
        return answers[0]
    return Scenarios(run.title, run.path.name, run.model, tuple(answers))


def _reweighted(run: Run, deviations: Entries, study: Study) -> WhatIf:
    trials, _ = reportable(run)
    scenario = reweighted_scenario(run, deviations, study, trials)
    answer = _answer(
        run, scenario.trials, scenario.changes, Method.REWEIGHTED, scenario.notes
    )
    size = min(scenario.weights.number, int(scenario.expected))
    return replace(
        answer, effective_sample_size=size, expected_sample_size=scenario.expected
    )


def _evaluated(run: Run, again: Run, deviations: Entries, study: Study) -> WhatIf:
    editor = study.editor()
    changes = {
        name: Change(
            str(editor.links.get(name, {}).get(NOMINAL, "")),
            f"{NOMINAL} {change[NOMINAL]}",
            1.0,
        )
        for name, change in deviations.items()
        if isinstance(change, dict) and editor.is_size(name, change)
    }
    changes |= {
        name: Change(before.words, after.words, 1.0)
        for name, after in again.assumed.items()
        if (before := run.assumed.get(name)) and before.words != after.words
    }
    warnings = [x for x in again.warnings if x not in run.warnings]
    return _answer(run, again, changes, Method.EVALUATED, warnings)


def _answer(
    run: Run,
    scenario: Run | Drawn,
    changes: Mapping[str, Change],
    method: Method,
    notes: Sequence[str] = (),
) -> WhatIf:
    """Return the answer of a scenario: of other trials, or of weighted ones."""
    trials, _ = reportable(run)
    other = reportable(scenario)[0] if isinstance(scenario, Run) else scenario
    before, after = summaries_of(trials), summaries_of(other)
    yields, new_yields = all_limits(trials), all_limits(other)
    pair = pair_of(run, other.run) if method is Method.EVALUATED else None
    less = differences_of(pair, before, after) if pair else {}
    # numbers of the tolerances are those of the baseline
    of_run = notes_of(replace(run, numbers=()), trials.sample)
    return WhatIf(
        title=run.title, run=run.path.name, model=run.model, method=method,
        changes=changes,
        trials=len(other.trials),
        effective_sample_size=len(other.trials),
        expected_sample_size=float(len(other.trials)),
        all_limits=AllLimitsWhatIf(yields, new_yields)
        if yields and new_yields
        else None,
        responses={
            response.name: ResponseWhatIf(
                before[response.name],
                after[response.name],
                run.nominal_values[response.name],
                response.sentence,
                run.scales[response.name],
                out_of_limit_sample_size(other, response.name),
                less.get(response.name),
            )
            for response in run.responses
        },
        notes=(*notes, *of_run),
        baseline=trials, scenario=other,
    )  # fmt: skip

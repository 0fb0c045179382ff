"""The study of a fresh run: that of a run, with other deviations or limits."""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.relimit import problems_of
from tolstat.answers.sampled_trials import drawn_trials, no_sample
from tolstat.answers.what_if.reweighted_trials import read_scenario, reweighted
from tolstat.errors import QuestionError, StudyError, TolstatError
from tolstat.execution.compatibility import seconds_per_trial, study_of
from tolstat.model.contract import Model
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.sample_size import (
    DECIDE,
    surely_decide,
    trials_enough,
    trials_likely_enough,
)
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations
from tolstat.study.distribution_entry import Entry
from tolstat.study.editor import Entries, StudyChange, StudyEditor
from tolstat.study.limits_section import read_limits
from tolstat.study.memory_needed import too_large
from tolstat.study.sampling import decides, deciding, rule_stored
from tolstat.study.study import Study, load
from tolstat.study.study_schema import check_section
from tolstat.toml import toml_table

QUICK = 5e-4  # s a trial: all limits are decided, or 200 000 trials done, in 100 s
MOST_TIMES = 10  # trials of a fresh run over those of the run: its page says the rest

NO_ENTRIES = (
    'deviations: expected a mapping such as {"rod_length": "+-0.6 mm"}; `what_if` '
    "takes several in a list, and a change as change.deviations, limits=change.limits"
)


def fresh_study(
    run: RunSource,
    deviations: Entries | StudyChange,
    *,
    limits: Entries | None = None,
    model: Model | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> str:
    """Return the study of a fresh run with other deviations, limits or settings.

    Parameters
    ----------
    run : Run or path
        Its study is edited: batches and correlations stay, the seed is new. It has as
        many trials, or more if more are likely to decide every limit, up to ten times
        as many. Where a trial is quick, it goes on until every limit is decided,
        unless the trials of the run cover the change and are as many as decide.
        Sampling becomes random where its
        trials depend on each other; a rare run stays one.
    deviations, limits : mapping of str to str or dict
        As of `what_if`; whether the stored trials cover them does not matter. A link
        may get another size: `{"housing": {"nominal": "120.4 mm"}}`. A text in braces
        is an inline table: `entries` of a remedy are typed so. Deviations may also be
        the `change` of a next step of a report, with limits and settings of its own.
    model : Model, optional
        A custom model, if the run is of one.
    folder : path, optional
        Where the study is to lie, beside its data files; that of the run's study if
        not given.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    StudyError
        If an entry cannot be read, a data file is missing in the folder, or no study
        can hold it: it changes one part of a batch alone, for example.
    QuestionError
        If the trials of the run were not sampled.

    Examples
    --------
    >>> print(tolstat.fresh_study("runs/stack-up.h5", {"shaft": "h7"}))
    title = "Axial gap of a shaft between two bearings"
    ...
    """
    run, change = open_run(run), deviations
    if not isinstance(change, StudyChange):
        change = StudyChange(as_entries(change))
    if limits:
        change = replace(change, limits=limits)
    if run.sampled is None:
        raise no_sample(run)
    if run.listed:
        raise QuestionError(
            f"{run.path}: its trials are rows of a file, and no study samples others; "
            "run the changed study in the program that wrote them"
        )
    study = study_of(run, model=model)
    editor, sizes, scenario, limited = edited(run, study, change)
    keys = {"seed": run.sampled.seed + 1}  # the fresh run has no trial of this one
    editor.table |= keys if run.rules else {**keys, "trials": run.trials}
    rule = deciding(slow=True) if run.thinned else rule_stored(run.rules)
    if rule and not decides(editor.table["trials"]):  # a command asked for it
        editor.table["trials"] = rule
    if run.sampled.replicates:
        editor.table["sampling"] = "random"
    elif run.aim and limited:
        aim = run.aim if run.aim in limited else next(iter(limited))
        editor.table["sampling"] = {"rare": aim}
    home, before = run.study_file or run.path, study.deviating
    data = run.data_folder or Path()
    target = Path(folder or data)
    deviating = replace(
        before, distributions={**before.distributions, **scenario.distributions}
    )
    if sizes or change.settings:  # the grade of a link follows its size
        deviating = load(editor.table, model=study.model, folder=data).deviating
    fresh = study_in(target, editor.table, study.model, deviating, home)
    if not (run.rules or run.aim):
        covered = None if sizes or change.settings else scenario
        enough = _enough(run, study, covered, fresh)
        if enough is None or (
            enough > run.trials and not too_large(enough, study.description)
        ):
            editor.table["trials"] = enough or DECIDE
            fresh = load(editor.table, model=study.model, folder=target)
    return fresh.text


def as_entries(deviations: Entries) -> dict[str, Entry]:
    """Return entries of [deviations]; a text in braces is an inline table of TOML."""
    if not isinstance(deviations, Mapping):
        raise StudyError(NO_ENTRIES)
    entries = dict[str, Entry](deviations)
    for name, text in deviations.items():
        if isinstance(text, str) and text.lstrip().startswith("{"):
            with suppress(ValueError, RecursionError):  # else no tolerance, either
                entries[name] = toml_table(f"entry = {text.strip()}")["entry"]
    return entries


class Edited(NamedTuple):
    """The study of a run with other deviations and limits."""

    editor: StudyEditor
    sizes: set[str]  # names whose nominal value changes
    scenario: Deviations  # the other changes
    limited: dict[str, Limit]


def edited(run: Run, study: Study, change: StudyChange) -> Edited:
    """Return the study of a run, changed; StudyError names the entry that is wrong."""
    deviations, limits = change.deviations, change.limits
    editor, problems = study.editor(), problems_of(run)
    responses = [response.name for response in run.responses]
    sizes = {n for n, entry in deviations.items() if editor.is_size(n, entry)}
    changed = {n: entry for n, entry in deviations.items() if n not in sizes}
    scenario = read_scenario(changed, study, run, problems)
    check_section("limits", limits, problems)
    limited = read_limits(limits, run.responses, problems)
    if change == StudyChange():
        problems.add("[deviations]", None, "no entry is given; name a contributor")
    for name, entry in deviations.items():
        with problems.noting(f"[deviations] {name}", None):
            editor.change(name, entry)
    problems.raise_if_any()
    for name, limit in limits.items():
        editor.limit(name, limit, responses)
    settings = {**editor.table.get("settings", {}), **change.settings}
    editor.table |= {"settings": settings} if settings else {}
    return Edited(editor, sizes, scenario, limited)


def study_in(
    folder: Path,
    table: Mapping[str, Any],
    model: Model,
    deviating: Deviations,
    home: Path,
) -> Study:
    """Load a study as a file of a folder; `home` lies beside its data files.

    Raises
    ------
    StudyError
        If it could not run there, or would not sample these deviations.
    """
    reason = f"data of that name differ there; write it beside {home}"
    try:
        study = load(table, model=model, folder=folder)
        same = study.deviating.distributions == deviating.distributions
        if same and study.deviating.dependence == deviating.dependence:
            return study
    except TolstatError as error:
        reason = str(error)
    raise StudyError(f"no study in {folder} samples these deviations: {reason}")


def _enough(
    run: Run, study: Study, scenario: Deviations | None, fresh: Study
) -> int | None:
    """Return how many trials are likely to decide every limit of the fresh study.

    As many as the run has where these suffice. The fractions out of limit are those of
    the stored trials where they cover the scenario. Else they count as zero. None in a
    quick run of random trials that can go on until all are decided: where the stored
    trials do not cover the scenario, or a limit is likely to stay undecided.
    """
    known, counts = False, dict.fromkeys(fresh.limits, (0, 1))
    trials = drawn_trials(run)
    ran = trials.sample.ran if trials else np.zeros(0, np.bool_)
    if (
        trials
        and ran.any()
        and scenario
        and scenario.distributions
        and not trials.sample.replicates
    ):
        with suppress(StudyError):
            weights = reweighted(scenario, study, trials, problems_of(run)).weights
            for name, limit in fresh.limits.items():
                out = ~within(trials.values(name)[ran], limit.permitted)
                share = np.average(out, weights=weights.values[ran])
                counts[name] = round(share * weights.number), weights.number
            known = True
    goes_on = fresh.limits and fresh.sampling == "random"
    goes_on = goes_on and seconds_per_trial(run, study) <= QUICK
    planned, most = run.trials, MOST_TIMES * run.trials
    demands = [
        (*counts[name], 1 - limit.demanded) for name, limit in fresh.limits.items()
    ]
    if goes_on:
        decided = known and all(surely_decide(*demand, planned) for demand in demands)
        return planned if decided else None
    if not known:
        enough = (trials_enough(*demand, planned) for demand in demands)
        return min(max(enough, default=planned), most)
    for demand in demands:
        planned = trials_likely_enough(*demand, planned, most)
    return min(planned, most)

"""The study of a fresh run: that of a run, with other deviations or limits."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.answers.sampled_trials import drawn_trials, no_sample
from tolstat.answers.what_if.reweighted_trials import (
    Entries,
    problems_of,
    read_scenario,
    reweighted,
)
from tolstat.deviations.names import expand, general
from tolstat.errors import StudyError, TolstatError
from tolstat.execution.compatibility import study_of
from tolstat.model.contract import Model
from tolstat.statistics.estimate import CONFIDENCE
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.limits.limit import within
from tolstat.statistics.limits.sample_size import trials_that_decide
from tolstat.statistics.limits.yields import UNDECIDED, verdict
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations
from tolstat.study.limits_section import read_limits
from tolstat.study.links_section import NOMINAL, with_deviation
from tolstat.study.memory_needed import too_large
from tolstat.study.study import Study, load
from tolstat.study.study_schema import check_section

MOST_TIMES = 10  # trials of a fresh run over those of the run: its page says the rest


def fresh_study(
    run: RunSource,
    deviations: Entries,
    *,
    limits: Entries | None = None,
    model: Model | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> str:
    """Return the study of a fresh run with other deviations or limits.

    Parameters
    ----------
    run : Run or path
        Its study is edited: batches and correlations stay, the seed is new. It has as
        many trials, or more if more are likely to decide every limit, up to ten times
        as many. Sampling becomes random where its trials depend on each other; a rare
        run stays one.
    deviations, limits : mapping of str to str or dict
        As of `what_if`; whether the stored trials cover them does not matter. A link
        may get another size: `{"housing": {"nominal": "120.4 mm"}}`.
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
    run = open_run(run)
    if run.sampled is None:
        raise no_sample(run)
    study = study_of(run, model=model)
    problems = problems_of(run)
    links = run.study.table.get("links", {})
    linked = {n: deviations[n] for n in {*links, *map(general, links)} & {*deviations}}
    sizes = [n for n, e in linked.items() if isinstance(e, dict) and {*e} == {NOMINAL}]
    changed = {n: e for n, e in deviations.items() if n not in sizes}
    scenario = read_scenario(changed, study, run, problems)
    check_section("limits", limits or {}, problems)
    limited = read_limits(limits or {}, run.responses, problems)
    batches = study.deviating.dependence.batches
    for name in scenario.distributions:
        if name in batches and (batch := batches[name].name) not in deviations:
            message = f"a batch is one entry; give all of its parts, `{batch} = ...`"
            problems.add(f"[deviations] {name}", None, message)
    if not deviations and not limits:
        problems.add("[deviations]", None, "no entry is given; name a contributor")
    problems.raise_if_any()
    names = [each.name for each in run.contributors]
    table = _with_deviations(run.study.table, deviations, names, study.model)
    if limits:
        names = [each.name for each in run.responses]
        table["limits"] = _replaced(table.get("limits", {}), limits, names, _demanding)
    if not run.rules:
        table["trials"] = run.trials
    table["seed"] = run.sampled.seed + 1  # the fresh run has no trial of this one
    if run.sampled.replicates:
        table["sampling"] = "random"
    elif run.aim and limits:
        name = run.aim if run.aim in limited else next(iter(limited))
        table["sampling"] = {"rare": name}
    home, before = run.study_file or run.path, study.deviating
    place = Path(folder or home.parent)
    new = {**before.distributions, **scenario.distributions}
    wanted = before._replace(distributions=new)
    if sizes:  # the grade of a link follows its size
        wanted = load(table, model=study.model, folder=home.parent).deviating
    found = study_in(place, table, study.model, wanted, home)
    if not (run.rules or run.aim):
        enough = _enough(run, study, scenario, found)
        if enough > run.trials and not too_large(enough, study.description):
            found = load({**table, "trials": enough}, model=study.model, folder=place)
    return found.text


def study_in(
    folder: Path,
    table: Mapping[str, Any],
    model: Model,
    wanted: Deviations,
    home: Path,
) -> Study:
    """Load a study as a file of a folder; `home` lies beside its data files.

    Raises
    ------
    StudyError
        If it could not run there, or would not sample the wanted deviations.
    """
    reason = f"data of that name differ there; write it beside {home}"
    try:
        found = load(table, model=model, folder=folder)
        now = found.deviating
        same = now.distributions == wanted.distributions
        if same and now.dependence == wanted.dependence:
            return found
    except TolstatError as error:
        reason = str(error)
    raise StudyError(f"no study in {folder} samples these deviations: {reason}")


def _enough(run: Run, study: Study, scenario: Deviations, fresh: Study) -> int:
    """Return how many trials are likely to decide every limit of the fresh study.

    As many as the run has where these suffice. The fractions out of limit are those of
    the stored trials where they cover the scenario; else zero.
    """
    counts = dict.fromkeys(fresh.limits, (0, 1))
    drawn, enough = drawn_trials(run), run.trials
    some = drawn is not None and np.any(drawn.sample.ran)
    if drawn and some and scenario.distributions and not drawn.sample.replicates:
        with suppress(StudyError):
            weights = reweighted(scenario, study, drawn, problems_of(run)).weights
            ran = drawn.sample.ran
            for name, limit in fresh.limits.items():
                out = ~within(drawn.values(name)[ran], limit.permitted)
                share = np.average(out, weights=weights.values[ran])
                counts[name] = round(share * weights.number), weights.number
    for name, limit in fresh.limits.items():
        count, of = counts[name]
        likely = anytime_valid(round(count / of * run.trials), run.trials, CONFIDENCE)
        if verdict(likely.complement, limit.demanded) == UNDECIDED:
            wanted = trials_that_decide(count, of, 1 - limit.demanded)
            enough = max(enough, wanted)
    return min(enough, MOST_TIMES * run.trials)


def _with_deviations(
    table: Mapping[str, Any],
    given: Entries,
    contributors: Sequence[str],
    model: Model,
) -> dict[str, Any]:
    """Return a study with other entries of [deviations] or [links]."""
    links, others = dict(table.get("links", {})), dict(given)
    for name, entry in given.items():
        members = expand(name, contributors)
        if set(members) & set(links):
            del others[name]
            links |= {n: with_deviation(links[n], entry, model) for n in members}
    deviations = _replaced(table.get("deviations", {}), others, contributors, _like)
    sections = {"links": links, "deviations": deviations}
    return {**table, **{name: each for name, each in sections.items() if each}}


def _replaced(
    before: Mapping[str, Any],
    given: Entries,
    known: Sequence[str],
    like: Callable[[Any, Any], Any],
) -> dict[str, Any]:
    """Return a section with other entries; the rest of a group keeps the old entry."""
    every = dict(before)
    for name, entry in given.items():
        members = expand(name, known)
        gone = [n for n in every if set(expand(n, known)) & set(members)]
        own = {other: every.pop(other) for other in gone}
        every[name] = like(next(iter(own.values()), None), entry)
        for other, its in own.items():
            rest = [n for n in expand(other, known) if n not in members]
            every |= dict.fromkeys(rest, its)
    return every


def _demanding(before: Any, entry: Any) -> Any:
    """Return a limit with the demanded yield of the one before, if it names none."""
    named = isinstance(entry, str) and isinstance(before, Mapping)
    return {**before, "limit": entry} if named else entry


def _like(before: Any, entry: Any) -> Any:
    """Return an entry with the batch of the one before."""
    if not isinstance(before, Mapping) or "common" not in before:
        return entry
    keys = {"tolerance": entry} if isinstance(entry, str) else entry
    return {**keys, "common": before["common"]}

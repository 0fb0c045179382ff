"""A scenario: other deviations, and the study of a fresh run with them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tolstat.answers.sampled_trials import no_sample
from tolstat.deviations.names import expand
from tolstat.errors import DependenceError, StudyError, TolstatError
from tolstat.execution.compatibility import study_of
from tolstat.model.contract import Model
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.edited_study import with_deviations, with_limits
from tolstat.study.limits_section import read_limits
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study import Study, load
from tolstat.study.study_schema import check_section

Entries = Mapping[str, str | dict[str, Any]]


def read_scenario(
    given: Entries, study: Study, run: Run, problems: Problems
) -> Deviations:
    """Read entries of [deviations]; data files are those beside the run's study."""
    check_section("deviations", given, problems)
    for name, entry in given.items():
        if isinstance(entry, dict) and "common" in entry:
            with problems.noting(f"[deviations] {name}", entry):
                raise DependenceError("batches stay as sampled; leave out common")
    contributors = study.description.contributors
    return read_deviations(given, {}, contributors, folder_of(run), problems)


def folder_of(run: Run) -> Path:
    """Return the folder of a run's study."""
    return (run.study_file or run.path).parent


def changed_kinds(
    given: Entries, scenario: Deviations, study: Study, run: Run
) -> Iterator[str]:
    """Say where a range alone, which is normal, replaces another distribution."""
    names = [each.name for each in run.contributors]
    table, sampled = run.study.table, study.deviating.distributions
    before = {
        member: entry
        for name, entry in (
            table.get("links", {}) | table.get("deviations", {})
        ).items()
        if isinstance(entry, dict) and "distribution" in entry
        for member in expand(name, names)
    }
    said = dict[str, None]()
    for name, entry in given.items():
        for member in expand(name, names) if isinstance(entry, str) else ():
            new, old = scenario.distributions[member], sampled.get(member)
            if member not in before or type(new) is type(old):
                continue
            kind = before[member]["distribution"]
            own = {k: v for k, v in before[member].items() if k in vars(old)}
            kept = toml_of({**own, "tolerance": entry, "distribution": kind})
            said[
                f"{name} was sampled {kind}; a range alone is normal: {kept} keeps it "
                f"{kind}"
            ] = None
    yield from said


def fresh_study(
    run: Run | str | os.PathLike[str],
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
        Its study is edited: trials, batches and correlations stay, the seed is new.
        Sampling becomes random where its trials depend on each other; a rare run stays
        one.
    deviations, limits : mapping of str to str or dict
        As of `what_if`; whether the stored trials cover them does not matter.
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
        can say it: of a part of a batch, for example.
    PictureError
        If the trials of the run were not sampled.
    """
    run = run if isinstance(run, Run) else open_run(run)
    if run.sampled is None:
        raise no_sample(run)
    study = study_of(run, model=model)
    problems = Problems(f"{run.path}", "cannot be asked that")
    scenario = read_scenario(deviations, study, run, problems)
    check_section("limits", limits or {}, problems)
    limited = read_limits(limits or {}, run.responses, problems)
    if not deviations and not limits:
        problems.add("[deviations]", None, "no entry is given; name a contributor")
    problems.raise_if_any()
    names = [each.name for each in run.contributors]
    table = with_deviations(run.study.table, deviations, names, study.model)
    if limits:
        table = with_limits(table, limits, [each.name for each in run.responses])
    if not run.rules:
        table["trials"] = run.trials
    table["seed"] = run.sampled.seed + 1  # the run that proves knows no trial of this
    if run.sampled.replicates:
        table["sampling"] = "random"
    elif run.aim and limits:
        name = run.aim if run.aim in limited else next(iter(limited))
        table["sampling"] = {"rare": name}
    return _checked(table, deviations, scenario, study, Path(folder or folder_of(run)))


def _checked(
    table: dict[str, Any],
    given: Entries,
    scenario: Deviations,
    study: Study,
    folder: Path,
) -> str:
    """Return a study as text, if it says what is asked."""
    before, wrong = study.deviating, f"of {', '.join(given)} alone"
    try:
        found = load(table, model=study.model, folder=folder)
        now = found.deviating
        wanted = {**before.distributions, **scenario.distributions}
        if now.dependence == before.dependence and now.distributions == wanted:
            return found.text
    except TolstatError as error:
        wrong = f"because {error}"
    said = _part_of_batch(given, scenario, study)
    raise StudyError(said or f"no study in {folder} can say that {wrong}")


def _part_of_batch(given: Entries, scenario: Deviations, study: Study) -> str:
    """Say that a batch is one entry, where only some of its parts are given."""
    batches = study.deviating.dependence.batches
    some = {n: batches[n].name for n in scenario.distributions if n in batches}
    part = {n: batch for n, batch in some.items() if batch not in given}
    if not part:
        return ""
    whole = " and ".join(f"`{batch} = ...`" for batch in dict.fromkeys(part.values()))
    return (
        f"no study can say that of {', '.join(part)} alone: a batch is one entry; give "
        f"all of its parts, {whole}"
    )

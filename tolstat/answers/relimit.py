"""Other limits for a stored run; nothing is simulated."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.deviations.names import expand
from tolstat.errors import QuestionError, TolstatError
from tolstat.execution.compatibility import study_of
from tolstat.execution.diagnostics.influence import halved_shares
from tolstat.execution.stages import Trials
from tolstat.model.contract import Model
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.limits_section import read_limits
from tolstat.study.problems import Problems
from tolstat.study.study_schema import check_section
from tolstat.units.grammar import unit_of


def limited(
    run: RunSource,
    limits: Mapping[str, str | dict[str, Any]],
    model: Model | None = None,
) -> Run:
    """Return a run with other limits than its study has.

    Parameters
    ----------
    run : Run or path
        Stored; its file stays as it is.
    limits : mapping of str to str or dict
        As in the section [limits] of a study, `{"rod_force": "<= 120 kN"}`. Each is
        added, or replaces the limit of the response. A replaced limit keeps its
        demanded yield unless a new one is given.
    model : Model, optional
        A custom model, if the run is of one. Without it the effect of halved tolerances
        on new limits is unknown.

    Raises
    ------
    StudyError
        If a limit cannot be read, or there is no such response.
    QuestionError
        If it is a rare run that searched another end of the limit.

    Examples
    --------
    >>> run = tolstat.limited("runs/stack-up.h5", {"gap": "0.1..0.7 mm"})
    >>> tolstat.summary(run)
    <tolstat summary: stack-up.h5, 10000 trials; gap met>
    """
    run = open_run(run)
    other = with_limits(run, limits)
    before, halved = run.diagnostics, _halved(other, model)
    same = {
        name: shares
        for name, shares in before.halved.items()
        if run.limits[name].permitted == other.limits[name].permitted
    }
    return replace(other, diagnostics=replace(before, halved=halved or same))


def with_limits(run: Run, limits: Mapping[str, str | dict[str, Any]]) -> Run:
    """Return a run with other limits and unchanged diagnostics; see `limited`."""
    problems = problems_of(run)
    check_section("limits", limits, problems)
    read = read_limits(limits, run.responses, problems)
    problems.raise_if_any()
    before = run.limits
    searched = [limits[run.aim] for limits in (before, read) if run.aim in limits]
    if len({tuple(map(math.isfinite, limit.permitted)) for limit in searched}) > 1:
        raise QuestionError(
            f"{run.path}: a rare run is sampled for one limit, {before[run.aim].words} "
            f"of {run.aim}; it cannot answer for another end"
        )
    for name, entry in limits.items():
        for response in expand(name, list(read)):
            if isinstance(entry, str) and response in before:
                old, new = before[response], read[response]
                new = new._replace(demanded=old.demanded)
                if old.ends == new.ends:
                    new = new._replace(demand=old.demand, typed_ppk=old.typed_ppk)
                read[response] = new
    both = {**before, **read}
    names = [response.name for response in run.responses]
    limits_words = "; ".join(f"{name} {limit.words}" for name, limit in read.items())
    note = f"requested limits, not those of the study: {limits_words}"
    chosen = {"audit": run.audited, "worst cases": run.diagnostics.worst_cases}
    if unchanged := [kind for kind, records in chosen.items() if records]:
        note += f"; of the study's limits: {' and '.join(unchanged)}"
    units = {name: unit_of(limit.words) for name, limit in read.items()}
    return run.limited({n: both[n] for n in names if n in both}, units, note)


def problems_of(run: Run) -> Problems:
    """Return the collection of problems of a question about a run."""
    return Problems(f"{run.path}", "cannot answer this")


def _halved(run: Run, model: Model | None) -> Any:
    """Return fractions with halved tolerances; empty if trials cannot be weighted."""
    if not run.complete:
        return {}
    with suppress(TolstatError):  # without a model the page says so
        study = replace(study_of(run, model=model), limits=run.limits)
        columns = [run.column(part.name) for part in run.contributors]
        trials = Trials.planned(study.description, np.stack(columns, axis=1))
        trials.take_stored(run, np.ones(run.trials, np.bool_))
        return halved_shares(study, trials, run.assumed, run.diagnostics.slopes)
    return {}

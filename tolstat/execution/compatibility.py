"""Comparison of a run with its study, and whether the run can be resumed."""

import tomllib
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.catalogue import place_of
from tolstat.deviations.draw import SAMPLERS
from tolstat.errors import Advice, DataError, Remedy, RunFileError, StudyError
from tolstat.model.contract import Model
from tolstat.status import Status
from tolstat.store.checksums import ranges_of
from tolstat.store.stored_run import Run
from tolstat.study.files import study_text
from tolstat.study.study import Study, load


def study_of(run: Run, trials: int | None = None, model: Model | None = None) -> Study:
    """Return the study of a run, read from its stored text."""
    sampled = run.sampled
    if trials is None and (run.complete or not run.rules):
        trials = run.trials
    return load(
        run.study.table,
        model=model,
        trials=trials if sampled else None,
        seed=sampled.seed if sampled else None,
        folder=run.study_file.parent if run.study_file else None,
    )


def study_differs(run: Run, study_file: Path | None = None) -> list[str]:
    """Return the changes of the study file since a run was made from it."""
    path = study_file or run.study_file
    try:
        text = study_text(path) if path else run.study.text
        now = tomllib.loads(text)
    except (DataError, ValueError, RecursionError):
        return []  # moved, or being edited: the run stores its text
    return [
        f"{path}: {key} was {was!r} when the run was made, and is {is_now!r}"
        for key, was, is_now in _changes(run.study.table, now)
    ]


def _changes(
    was: Mapping[str, Any], now: Mapping[str, Any], within: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    for key in dict.fromkeys([*was, *now]):
        a, b = was.get(key), now.get(key)
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            yield from _changes(a, b, f"{within}{key}.")
        elif a != b:
            yield f"{within}{key}", a, b


def check_same(run: Run, again: Run) -> None:
    """Refuse to resume a run if its study now samples other trials.

    `again` is the run planned from the study as it is now, before any trial has run.
    """
    changes = _changes(_deciding(run), _deciding(again))
    said = [f"{key}: {a}, now {b}" for key, a, b in changes]
    if not said:
        other = trials_drawn_otherwise(run, again)
        healthy = np.setdiff1d(other[run.status[other] > 0], run.damage.trials)
        if len(healthy):
            said.append(
                f"the deviations of trials {ranges_of(healthy)} differ from those that "
                f"the study samples now: {why_drawn_otherwise(run)}"
            )
    if said:
        raise RunFileError(
            f"{run.path} cannot be resumed: {'; '.join(said)}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def _deciding(run: Run) -> dict[str, Any]:
    """Return the properties, beside the deviations, that two equal runs share."""
    points = run.reference.columns if run.reference else {}
    return {
        **{f"column {each.name}": each.unit for each in run.described},
        **{f"setting {name}": each.words for name, each in run.settings.items()},
        **{f"limit {name}": each.words for name, each in run.limits.items()},
        **{f"deviation {name}": each.words for name, each in run.assumed.items()},
        **{f"status {code}": word for code, word in run.words.items()},
        **{f"points of the reference, {n}": p.tolist() for n, p in points.items()},
    }


def why_drawn_otherwise(run: Run) -> str:
    """Return why a study may sample other trials than those of its run."""
    if not run.aim:
        return "its data or number of trials differ"
    return (
        "its data or number of trials differ, or the run was made by a tolstat "
        f"{run.made['version_tolstat']} that searched for rare trials differently "
        f"(here: {version('tolstat')})"
    )


def trials_drawn_otherwise(run: Run, again: Run) -> NDArray[np.int64]:
    """Return the trials of a run whose deviations differ when sampled again.

    Stages are left out that were not sampled yet, or cannot be sampled again because
    answers are missing.
    """
    other, known = np.zeros(run.trials, bool), np.ones(run.trials, bool)
    for each in again.contributors:
        known &= ~np.isnan(again.column(each.name)[: run.trials])
        missing = np.isnan(run.column(each.name))
        known &= (run.status != Status.NOT_RUN) | ~missing
    for name in again.known:
        drawn, stored = again.column(name)[: run.trials], run.column(name)
        if drawn.dtype.kind == "f":  # bit for bit
            drawn, stored = (
                np.ascontiguousarray(each).view(np.uint64) for each in (drawn, stored)
            )
        other |= drawn != stored
    return np.flatnonzero(other & known)


def check_extensible(run: Run, trials: int) -> None:
    """Refuse an extension that would not keep the stored trials."""
    if run.sampled is None:
        raise RunFileError(
            f'{run.path} cannot be extended: sampling = "{run.sampling}" runs exactly '
            "the trials of the study"
        )
    if run.rules and not run.complete:
        raise RunFileError(
            f"{run.path} is not complete: {run.ended} of at most {run.trials} trials "
            "have run; finish it first",
            Advice(Remedy.RESUME, run.path, run.machine),
        )
    if trials <= run.trials:
        raise RunFileError(
            f"{run.path} has {run.trials} trials already; give a larger number"
        )
    if not SAMPLERS[run.sampling].extensible:
        raise StudyError(
            f'{run.path} cannot be extended: with sampling = "{run.sampling}" every '
            f"trial depends on the number of trials, and would change with {trials}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, trials, run),
        )


def check_asked(run: Run, study: Study) -> None:
    """Refuse a run of another study, of another seed, or of fewer trials."""
    said, machine = study_differs(run, study.path), place_of(study.model)
    advice = []
    if run.sampled and run.sampled.seed != study.seed:
        said.append(f"seed: the run has {run.sampled.seed}, the study {study.seed}")
    if run.sampled and study.until and not run.rules:
        said.append(
            f"trials: the run has {run.trials} without a stopping rule; the study runs "
            f"until {', '.join(study.until.rules)}"
        )
    elif run.sampled and not run.rules and run.trials < study.trials:
        more = f"trials: the run has {run.trials}, the study {study.trials}"
        if not said and SAMPLERS[run.sampling].extensible:
            advice.append(Advice(Remedy.EXTEND, run.path, machine, study.trials))
        said.append(more)
    if said:
        assert study.path
        raise RunFileError(
            f"{run.path} is a run of another study: {'; '.join(said)}; it is kept",
            *advice,
            Advice(Remedy.REPLACE_RUN, study.path, machine),
        )

"""Whether a run can be resumed: what differs between it and its study now."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import Advice, RunFileError
from tolstat.status import Status
from tolstat.store.checksums import ranges_of
from tolstat.store.stored_run import Run


def study_differs(run: Run, study_file: Path | None = None) -> list[str]:
    """Say what has changed in the study file since a run was made from it."""
    path = study_file or run.study_file
    try:
        text = path.read_text("utf-8") if path else run.study.text
        now = tomllib.loads(text)
    except (OSError, ValueError, RecursionError):
        return []  # moved, or at work in an editor: the run has its own text
    return [
        f"{path}: {key} was {was!r} when the run was made, and is {is_now!r}"
        for key, was, is_now in _changes(run.study.table, now, ())
    ]


def _changes(
    was: Mapping[str, Any], now: Mapping[str, Any], path: tuple[str, ...]
) -> Iterator[tuple[str, Any, Any]]:
    for key in dict.fromkeys([*was, *now]):
        a, b, here = was.get(key), now.get(key), (*path, key)
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            yield from _changes(a, b, here)
        elif a != b:
            yield ".".join(here), a, b


def check_same(run: Run, again: Run) -> None:
    """Refuse to resume a run whose trials are no longer those of its study.

    The other run is that of its study as it is read now, before any trial has run.
    """
    was, now = deciding(run), deciding(again)
    said = [f"{key}: {a}, now {b}" for key, a, b in _changes(was, now, ())]
    if not said:
        other = trials_drawn_otherwise(run, again)
        healthy = np.setdiff1d(other[run.status[other] > 0], run.damage.trials)
        if len(healthy):
            said.append(
                f"the deviations of trials {ranges_of(healthy)} are not those that the "
                f"study draws now: {why_drawn_otherwise(run)}"
            )
    if said:
        raise RunFileError(
            f"{run.path} cannot be resumed: {'; '.join(said)}",
            Advice("run again", run.path, run.machine, run=run),
        )


def deciding(run: Run) -> dict[str, Any]:
    """Return what decides whether two runs are the same, beside their draws."""
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
    """Say why a study may draw other trials than those of its run."""
    if not run.aim:
        return "its data or number of trials differ"
    return (
        "its data or number of trials differ, or the run was made by a tolstat "
        f"{run.made['version_tolstat']} that searched for rare trials differently "
        f"(here: {version('tolstat')})"
    )


def trials_drawn_otherwise(run: Run, again: Run) -> NDArray[np.int64]:
    """Return the trials of a run whose deviations are not those drawn again.

    Those of stages that were not drawn yet, or cannot be drawn again because answers
    are missing, are not among them.
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

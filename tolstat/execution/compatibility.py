"""Whether a run can be gone on with: what differs between it and its study now."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import RunFileError
from tolstat.execution.rare_loop import NOT_YET, is_drawn
from tolstat.model.description import Contributor, Response
from tolstat.status import Status
from tolstat.store.commands import to_run_anew
from tolstat.store.damage import ranges_of
from tolstat.store.layout import STAGE, encoded
from tolstat.store.plan import Plan, Reference
from tolstat.store.provenance import provenance
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


def check_same(run: Run, plan: Plan) -> None:
    """Refuse to go on with a run whose machines are no longer those of its study.

    The plan is that of its study, as it is read now, with its trials drawn again.
    """
    said = []
    contributors, responses = plan.description
    stored = units_of([*run.contributors, *run.responses])
    asked = units_of([*contributors, *responses])
    pairs: list[tuple[str, Mapping[str, Any], Mapping[str, Any]]] = [
        ("column", stored, asked),
        ("setting", words_of(run.settings), words_of(plan.settings)),
        ("limit", words_of(run.limits), words_of(plan.limits)),
        ("deviation", words_of(run.assumed), words_of(plan.assumed)),
        ("status", {str(k): v for k, v in run.words.items()},
         {str(k): v for k, v in plan.words.items()}),
    ]  # fmt: skip
    for what, was, now in pairs:
        said += [f"{what} {k}: {a}, now {b}" for k, a, b in _changes(was, now, ())]
    if not np.array_equal(_points(run.reference), _points(plan.reference)):
        said.append("reference: its points are others now")
    if not said:
        other = trials_drawn_otherwise(run, plan)
        healthy = np.setdiff1d(other[run.status[other] > 0], run.damage.trials)
        if len(healthy):
            said.append(
                f"the deviations of trials {ranges_of(healthy)} are not those that the "
                f"study draws now: {why_drawn_otherwise(run)}"
            )
    if said:
        raise RunFileError(
            f"{run.path} cannot be gone on with: "
            + "; ".join(said)
            + f"; {to_run_anew(run)}"
        )


def why_drawn_otherwise(run: Run) -> str:
    """Say why a study may draw other machines than those of its run."""
    if not run.rare:
        return "its data, or the number of its trials, are others"
    was, here = run.provenance["version_tolstat"], provenance()["version_tolstat"]
    if was != here:
        return (
            f"the run was made by tolstat {was}, and this is {here}, which may seek "
            "rare machines otherwise"
        )
    return (
        "its data, or the number of its trials, are others, or the run was made by a "
        f"tolstat {was} that sought rare machines otherwise"
    )


def _points(reference: Reference | None) -> NDArray[np.float64]:
    return np.array([*reference.columns.values()] if reference else [], np.float64)


def units_of(columns: Sequence[Contributor | Response]) -> dict[str, str]:
    """Return the SI unit of each column."""
    return {each.name: each.unit for each in columns}


def words_of(named: Mapping[str, Any]) -> dict[str, str]:
    """Return what settings, limits or deviations are, in words."""
    return {name: str(each.words) for name, each in named.items()}


def trials_drawn_otherwise(run: Run, plan: Plan) -> NDArray[np.int64]:
    """Return the trials of a run whose deviations are not those drawn again.

    What of a rare run was not drawn yet, or cannot be drawn again because answers are
    missing, is not among them.
    """
    other = np.zeros(run.trials, bool)
    known = is_drawn(plan.deviations[: run.trials])
    if run.rare:
        known &= (run.status != Status.NOT_RUN) | (run.column(STAGE) != NOT_YET)
    names = [each.name for each in plan.description.contributors]
    again = dict(zip(names, plan.deviations.T, strict=True)) | dict(plan.drawn)
    for name, values in again.items():
        drawn = np.ascontiguousarray(values[: run.trials])
        stored = np.ascontiguousarray(run.column(name))
        other |= stored.view(np.uint64) != drawn.view(np.uint64)
    other &= known
    for name, swept in plan.swept.items():
        values = encoded(swept.values)[: run.trials]
        other |= encoded(run.column(name)) != values
    return np.flatnonzero(other)

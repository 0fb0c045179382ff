"""A run file read."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

import h5py

from tolstat.errors import DamagedError, RunFileError
from tolstat.model.description import Response
from tolstat.store import metadata as facts
from tolstat.store import run_columns as of_column
from tolstat.store.attributes import texts
from tolstat.store.audited import read_audited
from tolstat.store.commands import command, to_resume
from tolstat.store.damage import damage_of
from tolstat.store.layout import (
    AUDIT,
    CLOCK,
    EVIDENCE,
    NOMINAL,
    RERUN,
    STATUS,
    STEPS,
    SWEPT,
    decoded,
)
from tolstat.store.provenance import facts_of
from tolstat.store.run_times import seconds_of, written_at
from tolstat.store.seal import check_seal
from tolstat.store.stored_diagnostics import read_evidence
from tolstat.store.stored_run import Run, StudyText


def open(path: str | os.PathLike[str], *, damaged: bool = False) -> Run:
    """Open a run file, also one that is still being written.

    Parameters
    ----------
    path : path
        As `tolstat run` wrote it.
    damaged : bool
        Whether a run is wanted though some of its trials are damaged: its attribute
        `damage` names them.

    Returns
    -------
    Run
        Everything in it, read at once.

    Raises
    ------
    RunFileError
        If there is no such file or it holds no run.
    DamagedError
        If it is not as it was written.
    """
    path = existing(Path(path))
    check_seal(path)
    try:
        with h5py.File(path, "r", locking=False) as file:
            run = _read(path, file)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read as HDF5: {error}") from error
    except (KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise RunFileError(f"{path} is no whole run: {error}") from error
    if run.damage and not damaged:
        raise DamagedError(
            f"{path} is damaged: {run.damage.words}; `{to_resume(path, run.machine)}` "
            "computes that again"
        )
    return run


def existing(path: Path) -> Path:
    """Return a path; refuse one where no run can be."""
    if path.suffix == ".toml":
        raise RunFileError(
            f"{path} is a study; `{command('run', path)}` makes a run of it"
        )
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    return path


def _read(path: Path, file: h5py.File) -> Run:
    # status first: what a writer adds meanwhile has not run yet
    status = file[STATUS][...]
    attrs = file.attrs
    text = str(attrs["study"])
    datasets = {n: item for n, item in file.items() if isinstance(item, h5py.Dataset)}
    columns = {name: item[...] for name, item in datasets.items()} | {STATUS: status}
    words = of_column.words_of(file[STATUS])
    complete = EVIDENCE in file
    damage = damage_of(file, columns, words, complete=complete)
    clock = file[CLOCK][...]
    names = texts(file, "contributors")
    responses = tuple(of_column.response_of(file[n]) for n in texts(file, "responses"))
    limits = {each.name: of_column.limit_of(file[each.name]) for each in responses}
    assumed = {name: of_column.assumed_of(file[name]) for name in names}
    told = {"ended_at": written_at(clock), "seconds": seconds_of(clock)}
    return Run(
        path=path,
        study=StudyText(text, tomllib.loads(text)),
        title=str(attrs["title"]),
        model=str(attrs["model"]),
        machine=str(attrs["machine"]),
        sampling=str(attrs["sampling"]),
        source_digest=str(attrs["source_digest"]),
        rare=str(attrs.get(facts.RARE, "")),
        contributors=tuple(of_column.contributor_of(file[name]) for name in names),
        responses=responses,
        nominal_values=_nominal(file[NOMINAL], responses, words),
        words=words,
        sampled=facts.sampled_of(file),
        settings=facts.settings_of(file),
        numbers=facts.numbers_of(file),
        reference=facts.reference_of(file),
        stopped=facts.stopped_of(file),
        study_file=facts.study_file_of(path, file),
        swept={
            name: str(item.attrs["units"])
            for name, item in datasets.items()
            if item.attrs.get("role") == SWEPT
        },
        limits={name: limit for name, limit in limits.items() if limit},
        assumed={name: each for name, each in assumed.items() if each},
        grid=texts(file, "grid"),
        notes=texts(file, "notes"),
        assumptions=texts(file, "assumptions"),
        rules=texts(file, "until"),
        audited=read_audited(file.get(AUDIT), responses),
        rerun=read_audited(file.get(RERUN), responses),
        evidence=read_evidence(file.get(EVIDENCE)),
        complete=complete,
        damage=damage,
        _facts={**facts_of(file), **told},
        _shown={
            name: str(item.attrs[of_column.SHOWN])
            for name, item in datasets.items()
            if of_column.SHOWN in item.attrs
        },
        _columns={name: decoded(values) for name, values in columns.items()},
    )


def _nominal(
    group: h5py.Group, responses: tuple[Response, ...], words: dict[int, str]
) -> dict[str, Any]:
    found: dict[str, Any] = {r.name: float(group[r.name][()]) for r in responses}
    found[STATUS] = words.get(int(group[STATUS][()]), "unknown")
    if STEPS in group:
        found[STEPS] = int(group[STEPS][()])
    return found

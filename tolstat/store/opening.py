"""A run file read."""

from __future__ import annotations

import math
import os
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import DamagedError, RunFileError
from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.limit import Limit
from tolstat.store.advice import to_resume
from tolstat.store.attributes import texts
from tolstat.store.audited import read_audited
from tolstat.store.clock import seconds_of, written_at
from tolstat.store.damage import damage_of
from tolstat.store.evidence import read_evidence
from tolstat.store.layout import (
    ASSUMED,
    AUDIT,
    BATCH,
    CLOCK,
    CODES,
    DEMANDED,
    EVIDENCE,
    LIMIT,
    NOMINAL,
    NUMBERS,
    PART,
    RANGE,
    RARE,
    REFERENCE,
    RERUN,
    SETTINGS,
    SHOWN,
    STATUS,
    STEPS,
    SWEPT,
    TOLERANCE,
    WORDS,
    WRITTEN,
)
from tolstat.store.plan import Assumed, Chosen, Reference, Sampled, Stopped
from tolstat.store.provenance import facts_of
from tolstat.store.run import Run, StudyText
from tolstat.store.seal import check_seal


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
        raise RunFileError(f"{path} is a study; `tolstat run {path}` makes a run of it")
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    return path


def _read(path: Path, file: h5py.File) -> Run:
    # status first: what a writer adds meanwhile has not run yet
    status = file[STATUS][...]
    attrs = file.attrs
    text = str(attrs["study"])
    datasets = {n: item for n, item in file.items() if isinstance(item, h5py.Dataset)}
    swept = {n: d for n, d in datasets.items() if d.attrs.get("role") == SWEPT}
    columns = {name: item[...] for name, item in datasets.items()} | {STATUS: status}
    words = dict(
        zip(file[STATUS].attrs[CODES].tolist(), texts(file[STATUS], WORDS), strict=True)
    )
    complete = EVIDENCE in file
    damage = damage_of(file, columns, words, complete=complete)
    clock = file[CLOCK][...]
    contributors = tuple(_contributor(file[n]) for n in texts(file, "contributors"))
    responses = tuple(_response(file[n]) for n in texts(file, "responses"))
    return Run(
        path,
        StudyText(text, tomllib.loads(text)),
        str(attrs["title"]),
        str(attrs["model"]),
        str(attrs["machine"]),
        str(attrs["sampling"]),
        contributors,
        responses,
        _nominal(file[NOMINAL], responses, words),
        _sampled(file) if "seed" in attrs else None,
        {name: _chosen(item) for name, item in file[SETTINGS].items()},
        {name: str(item.attrs["units"]) for name, item in swept.items()},
        texts(file, "grid"),
        {
            r.name: _limit(file[r.name])
            for r in responses
            if LIMIT in file[r.name].attrs
        },
        {
            c.name: _assumed(file[c.name])
            for c in contributors
            if TOLERANCE in file[c.name].attrs
        },
        _stopped(file) if "until_stages" in attrs else None,
        read_audited(file.get(AUDIT), responses),
        read_evidence(file.get(EVIDENCE)),
        _reference(file[REFERENCE]) if REFERENCE in file else None,
        texts(file, "notes"),
        texts(file, "assumptions"),
        words,
        str(attrs["source_digest"]),
        {
            **facts_of(file),
            "ended_at": written_at(clock),
            "seconds": seconds_of(clock),
        },
        {n: str(d.attrs[SHOWN]) for n, d in datasets.items() if SHOWN in d.attrs},
        {name: _decoded(values) for name, values in columns.items()},
        tuple(_number(n, item) for n, item in file.get(NUMBERS, {}).items()),
        rerun=read_audited(file.get(RERUN), responses),
        rules=texts(file, "until"),
        complete=complete,
        damage=damage,
        study_file=_study_file(path, file),
        rare=str(attrs.get(RARE, "")),
    )


def _decoded(values: NDArray[Any]) -> NDArray[Any]:
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values


def _study_file(path: Path, file: h5py.File) -> Path | None:
    """Say where the study lies that a run was made from."""
    if "study_file" not in file.attrs:
        return None
    return Path(os.path.normpath(path.resolve().parent / file.attrs["study_file"]))


def _described(dataset: h5py.Dataset) -> tuple[str, str, str, str, str]:
    attrs = dataset.attrs
    name = dataset.name.removeprefix("/")
    return name, attrs["units"], attrs["symbol"], attrs["long_name"], attrs["source"]


def _contributor(dataset: h5py.Dataset) -> Contributor:
    part = dataset.attrs.get(PART, "")
    return Contributor(*_described(dataset), part=part, shown=_shown(dataset))


def _response(dataset: h5py.Dataset) -> Response:
    ends = tuple(dataset.attrs[RANGE].tolist()) if RANGE in dataset.attrs else None
    return Response(*_described(dataset), shown=_shown(dataset), range=ends)


def _shown(dataset: h5py.Dataset) -> str:
    return str(dataset.attrs.get(SHOWN, ""))


def _nominal(
    group: h5py.Group, responses: tuple[Response, ...], words: dict[int, str]
) -> dict[str, Any]:
    found: dict[str, Any] = {r.name: float(group[r.name][()]) for r in responses}
    found[STATUS] = words.get(int(group[STATUS][()]), "unknown")
    if STEPS in group:
        found[STEPS] = int(group[STEPS][()])
    return found


def _sampled(file: h5py.File) -> Sampled:
    attrs = file.attrs
    return Sampled(
        int(attrs["seed"]),
        str(attrs["promise"]),
        int(attrs["replicates"]),
        int(attrs["group"]),
        texts(file, "factors"),
    )


def _chosen(item: h5py.Dataset) -> Chosen:
    words, attrs = item.asstr()[()], item.attrs
    return Chosen(words, str(attrs["long_name"]), bool(attrs["given"]))


def _number(name: str, dataset: h5py.Dataset) -> StudyNumber:
    attrs, value = dataset.attrs, float(dataset[()])
    words = (attrs[key] for key in ("long_name", SHOWN, "of", "caveat"))
    return StudyNumber(name, attrs["units"], value, *words)


def _limit(dataset: h5py.Dataset) -> Limit:
    lower, upper = dataset.attrs[LIMIT].tolist()
    demanded, words = float(dataset.attrs[DEMANDED]), str(dataset.attrs[WRITTEN])
    return Limit(lower, upper, demanded, words)


def _assumed(dataset: h5py.Dataset) -> Assumed:
    lower, upper = dataset.attrs[TOLERANCE].tolist()
    words, batch = dataset.attrs[ASSUMED], dataset.attrs.get(BATCH, "")
    moments = (float(dataset.attrs.get(key, math.nan)) for key in ("mean", "sigma"))
    return Assumed((lower, upper), words, batch, *moments)


def _stopped(file: h5py.File) -> Stopped:
    attrs = file.attrs
    stages = tuple(attrs["until_stages"].tolist())
    reached, at_most = bool(attrs["until_reached"]), int(attrs["at_most"])
    wanted = float(attrs.get("until_wanted", 0.0))
    return Stopped(texts(file, "until"), reached, stages, at_most, wanted)


def _reference(group: h5py.Group) -> Reference:
    columns = {name: item[...] for name, item in group.items()}
    return Reference(str(group.attrs["label"]), columns)

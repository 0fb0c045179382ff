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

from tolstat.errors import RunFileError
from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.limit import Limit
from tolstat.store.attributes import plain, texts
from tolstat.store.audited import read_audited
from tolstat.store.evidence import read_evidence
from tolstat.store.layout import (
    ASSUMED,
    AUDIT,
    BATCH,
    CODES,
    DEMANDED,
    EVIDENCE,
    FORMAT,
    LIMIT,
    NOMINAL,
    NUMBERS,
    PART,
    RANGE,
    REFERENCE,
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
from tolstat.store.run import Run, StudyText


def open(path: str | os.PathLike[str]) -> Run:
    """Open a run file, also one that is still being written.

    Parameters
    ----------
    path : path
        As `tolstat run` wrote it.

    Returns
    -------
    Run
        Everything in it, read at once.

    Raises
    ------
    RunFileError
        If there is no such file or it holds no run.
    """
    path = Path(path)
    if path.suffix == ".toml":
        raise RunFileError(f"{path} is a study; `tolstat run {path}` makes a run of it")
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    try:
        with h5py.File(path, "r", locking=False) as file:
            _check_format(path, file)
            return _read(path, file)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read as HDF5: {error}") from error
    except (KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise RunFileError(f"{path} is no whole run: {error}") from error


def _check_format(path: Path, file: h5py.File) -> None:
    if "study" not in file.attrs or "format" not in file.attrs:
        raise RunFileError(f"{path} is an HDF5 file, but not a run of tolstat")
    if str(file.attrs["format"]) != str(FORMAT):
        version = file.attrs.get("version_tolstat", "of its time")
        raise RunFileError(
            f"{path} has format {file.attrs['format']}, this tolstat reads format "
            f"{FORMAT}; open it with tolstat {version}, or run its study again"
        )


def _read(path: Path, file: h5py.File) -> Run:
    attrs = file.attrs
    text = str(attrs["study"])
    datasets = {n: item for n, item in file.items() if isinstance(item, h5py.Dataset)}
    swept = {n: d for n, d in datasets.items() if d.attrs.get("role") == SWEPT}
    lengths = {len(item) for item in datasets.values()}
    if len(lengths) > 1:
        raise ValueError(f"its columns are of different lengths: {sorted(lengths)}")
    contributors = tuple(_contributor(file[n]) for n in texts(file, "contributors"))
    responses = tuple(_response(file[n]) for n in texts(file, "responses"))
    words = dict(
        zip(file[STATUS].attrs[CODES].tolist(), texts(file[STATUS], WORDS), strict=True)
    )
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
        _stopped(file) if "until" in attrs else None,
        read_audited(file.get(AUDIT), responses),
        read_evidence(file.get(EVIDENCE)),
        _reference(file[REFERENCE]) if REFERENCE in file else None,
        texts(file, "notes"),
        texts(file, "assumptions"),
        words,
        str(attrs["source_digest"]),
        _provenance(file),
        {n: str(d.attrs[SHOWN]) for n, d in datasets.items() if SHOWN in d.attrs},
        {name: _column(item) for name, item in datasets.items()},
        tuple(_number(n, item) for n, item in file.get(NUMBERS, {}).items()),
    )


def _column(dataset: h5py.Dataset) -> NDArray[Any]:
    values: NDArray[Any] = dataset[...]
    return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values


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
    found[STATUS] = words[int(group[STATUS][()])]
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


def _provenance(file: h5py.File) -> dict[str, Any]:
    known = ("processor", "platform", "command", "started_at", "ended_at", "seconds")
    return {
        name: plain(value)
        for name, value in file.attrs.items()
        if name in known or name.startswith(("version_", "trials_"))
    }

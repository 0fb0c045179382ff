"""A stored run, to be looked at."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import RunFileError
from tolstat.machines.description import Contributor, Response
from tolstat.status import WORDS, Status
from tolstat.store.assumed import Assumed
from tolstat.store.layout import (
    ASSUMED,
    AUDIT,
    BATCH,
    DEMANDED,
    FORMAT,
    LIMIT,
    NOMINAL,
    PART,
    REFERENCE,
    SETTING,
    STATUS,
    STEPS,
    TOLERANCE,
    TRIAL,
)

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class StudyText:
    """The study that a run was made from.

    Attributes
    ----------
    text : str
        As it was written.
    table : dict
        The same, read as TOML.
    """

    text: str
    table: dict[str, Any]


@dataclass(frozen=True)
class Audited:
    """Trials that were integrated again, more precisely.

    Attributes
    ----------
    trials : int64[n]
        Their numbers.
    rtol : float
        With which.
    status : uint8[n]
        How they ended then.
    responses : dict of str to float64[n]
        SI.
    """

    trials: NDArray[np.int64]
    rtol: float
    status: NDArray[np.uint8]
    responses: dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Run:
    """A stored run.

    Attributes
    ----------
    path : Path
        Its file.
    study : StudyText
        What was asked.
    facts : dict
        Model, seed, versions, times: the attributes of the file.
    contributors, responses : tuple
        The columns, in order, with units and sentences.
    limits : dict
        Least and greatest permitted value by response, SI.
    demanded : dict
        Share of the machines that is to be within, by limited response.
    nominal_values : dict
        Responses (SI), status (a word) and steps of the machine without deviations.
    assumed : dict of str to Assumed
        By contributor that deviates.
    audited : Audited or None
        None if the model integrates nothing.
    settings : dict
        Unit of each setting that a grid changes.
    reference : dict of str to float64[point]
        Known points to be shown beside a grid, SI: what is swept, then responses.
    """

    path: Path
    study: StudyText
    facts: dict[str, Any]
    contributors: tuple[Contributor, ...]
    responses: tuple[Response, ...]
    limits: dict[str, tuple[float, float]]
    demanded: dict[str, float]
    nominal_values: dict[str, Any]
    assumed: dict[str, Assumed]
    audited: Audited | None
    settings: dict[str, str]
    reference: dict[str, NDArray[np.float64]]
    _columns: dict[str, NDArray[Any]] = field(repr=False)

    @property
    def trials(self) -> int:
        """Number of trials asked for."""
        return len(self.status)

    @property
    def status(self) -> NDArray[np.uint8]:
        """Status of each trial, values of `Status`."""
        return self._columns[STATUS]

    @property
    def counts(self) -> dict[str, int]:
        """Number of trials of each status, by its word."""
        return {s.word: int(np.count_nonzero(self.status == s)) for s in Status}

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column; "1" where there is none."""
        described: list[Contributor | Response] = [*self.contributors, *self.responses]
        return {**self.settings, **{each.name: each.unit for each in described}}

    @property
    def grid(self) -> list[str]:
        """What a grid sweeps, the slowest first; empty for any other run."""
        return str(self.facts.get("grid", "")).split()

    @property
    def notes(self) -> list[str]:
        """What has to be known of the deviations."""
        return str(self.facts.get("notes", "")).splitlines()

    def column(self, name: str) -> NDArray[Any]:
        """Return a swept setting, contributor or response of all trials, SI."""
        return self._columns[name]

    @property
    def nominal(self) -> pd.Series[Any]:
        """The machine without deviations: its responses (SI), status and steps."""
        import pandas as pd

        series = pd.Series(self.nominal_values, name="nominal")
        series.attrs["units"] = self.units
        return series

    def frame(self) -> pd.DataFrame:
        """Return swept settings, contributors, responses, status and steps.

        Returns
        -------
        DataFrame
            Indexed by trial, SI; `attrs["units"]` holds the units, status is a word.
        """
        import pandas as pd

        columns = {name: self._columns[name] for name in self.units}
        status = pd.Categorical.from_codes(self.status.tolist(), pd.Index(WORDS))
        frame = pd.DataFrame({**columns, STATUS: status, STEPS: self._columns[STEPS]})
        frame.index.name = "trial"
        frame.attrs["units"] = self.units
        return frame


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
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    try:
        with h5py.File(path, "r", locking=False) as file:
            facts = {name: _plain(value) for name, value in file.attrs.items()}
            if "study" not in facts or "format" not in facts:
                raise RunFileError(f"{path} is an HDF5 file, but not a run of tolstat")
            if facts["format"] != FORMAT:
                raise RunFileError(
                    f"{path} has format {facts['format']}, this tolstat reads format "
                    f"{FORMAT}; open it with tolstat {facts['version_tolstat']}"
                )
            datasets = {
                name: item
                for name, item in file.items()
                if isinstance(item, h5py.Dataset)
            }
            columns = {name: _column(item) for name, item in datasets.items()}
            settings = {
                name: item.attrs["units"]
                for name, item in datasets.items()
                if item.attrs.get("role") == SETTING
            }
            reference = {
                name: item[...] for name, item in file.get(REFERENCE, {}).items()
            }
            if reference:
                facts["reference"] = file[REFERENCE].attrs["label"]
            group = file[NOMINAL]
            names = (*facts["responses"].split(), STEPS)
            nominal = {name: group[name][()].item() for name in names}
            nominal[STATUS] = WORDS[int(group[STATUS][()])]
            contributors = tuple(
                Contributor(*_words(file[name]), part=file[name].attrs.get(PART, ""))
                for name in facts["contributors"].split()
            )
            responses = tuple(
                Response(*_words(file[name])) for name in facts["responses"].split()
            )
            demanded = {
                each.name: float(file[each.name].attrs[DEMANDED])
                for each in responses
                if DEMANDED in file[each.name].attrs
            }
            assumed = {
                each.name: _assumed(file[each.name])
                for each in contributors
                if TOLERANCE in file[each.name].attrs
            }
            audited = _audited(file[AUDIT], responses) if AUDIT in file else None
            limits = {
                each.name: tuple(file[each.name].attrs[LIMIT].tolist())
                for each in responses
                if LIMIT in file[each.name].attrs
            }
    except OSError as error:
        raise RunFileError(f"{path} cannot be read as HDF5: {error}") from error
    text = facts.pop("study")
    study = StudyText(text, tomllib.loads(text))
    return Run(
        path, study, facts, contributors, responses, limits, demanded, nominal,
        assumed, audited, settings, reference, columns,
    )  # fmt: skip


def _assumed(dataset: h5py.Dataset) -> Assumed:
    lower, upper = dataset.attrs[TOLERANCE].tolist()
    return Assumed((lower, upper), dataset.attrs[ASSUMED], dataset.attrs.get(BATCH, ""))


def _audited(group: h5py.Group, responses: tuple[Response, ...]) -> Audited:
    return Audited(
        group[TRIAL][...],
        float(group.attrs["rtol"]),
        group[STATUS][...],
        {each.name: group[each.name][...] for each in responses},
    )


def _column(dataset: h5py.Dataset) -> NDArray[Any]:
    values: NDArray[Any] = dataset[...]
    return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values


def _words(dataset: h5py.Dataset) -> tuple[str, str, str, str, str]:
    attrs = dataset.attrs
    name = dataset.name.removeprefix("/")
    return name, attrs["units"], attrs["symbol"], attrs["long_name"], attrs["source"]


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value

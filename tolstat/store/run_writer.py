"""A run file being filled: data first, status last."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Protocol

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import RunFileError
from tolstat.machines.description import Description, Outcome
from tolstat.status import Status
from tolstat.store.assumed import Assumed
from tolstat.store.layout import (
    ASSUMED,
    AUDIT,
    BATCH,
    DEMANDED,
    FORMAT,
    LIMIT,
    NOMINAL,
    REFERENCE,
    STATUS,
    STEPS,
    TOLERANCE,
    lay_out,
    lay_out_audit,
    lay_out_setting,
)
from tolstat.store.provenance import now, provenance


class SweptSetting(NamedTuple):
    """A setting that is not the same in all trials.

    Attributes
    ----------
    values : float64[trial] or str[trial]
        SI, or words.
    unit, sentence : str
        As the model declares it.
    """

    values: NDArray[Any]
    unit: str
    sentence: str


class Audit(NamedTuple):
    """Trials to be integrated again, ascending, and how precisely."""

    trials: NDArray[np.int64]
    rtol: float


class KnownPoints(Protocol):
    """Points of a publication or a measurement, SI; the swept column first."""

    @property
    def label(self) -> str:
        """Where they come from."""
        ...

    @property
    def columns(self) -> Mapping[str, NDArray[np.float64]]:
        """By name, float64[point]."""
        ...


class Plan(NamedTuple):
    """What a run consists of before anything has run.

    Attributes
    ----------
    study_text : str
        The study file as it was written.
    facts : mapping
        Model, seed, sampling, ...: attributes of the run.
    description : Description
        Contributors and responses, in the order of the columns.
    deviations : float64[trial, contributor]
        All of them, drawn.
    limits : mapping
        Least and greatest permitted value by response, SI.
    demanded : mapping
        Share of the machines that is to be within, by limited response.
    assumed : mapping of str to Assumed
        By contributor that deviates.
    settings : mapping of str to SweptSetting
        What a grid changes besides deviations.
    audit : Audit, optional
        None for a model that integrates nothing.
    reference : KnownPoints, optional
        What is shown beside a grid.
    """

    study_text: str
    facts: Mapping[str, Any]
    description: Description
    deviations: NDArray[np.float64]
    limits: Mapping[str, tuple[float, float]]
    demanded: Mapping[str, float]
    assumed: Mapping[str, Assumed] = {}
    settings: Mapping[str, SweptSetting] = {}
    audit: Audit | None = None
    reference: KnownPoints | None = None


class RunWriter:
    """The one process that has a run file open for writing.

    Parameters
    ----------
    path : Path
        Made anew.
    plan : Plan
        Written first of all, with every trial "not run".
    force : bool
        Whether an existing file may be replaced.

    Raises
    ------
    RunFileError
        If the file exists and is not to be replaced, or cannot be written.
    """

    def __init__(self, path: Path, plan: Plan, *, force: bool = False) -> None:
        self.path = path
        self.plan = plan
        self.description = plan.description
        if path.exists() and not force:
            raise RunFileError(
                f"{path} exists already; give --force to replace it, or -o for another "
                "name"
            )
        # aside first: a file under its own name is whole
        aside = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with h5py.File(aside, "w") as file:
                self._write_plan(file, plan)
            os.replace(aside, path)
            self._file = h5py.File(path, "r+")
        except OSError as error:
            with suppress(OSError):
                aside.unlink()
            raise RunFileError(f"{path} cannot be written: {error}") from error

    def _write_plan(self, file: h5py.File, plan: Plan) -> None:
        contributors, responses = plan.description
        trials = len(plan.deviations)
        file.attrs["format"] = FORMAT
        file.attrs["study"] = plan.study_text
        # the order of the columns: HDF5 lists names by alphabet
        file.attrs["contributors"] = " ".join(c.name for c in contributors)
        file.attrs["responses"] = " ".join(r.name for r in responses)
        for name, fact in {**plan.facts, **provenance()}.items():
            file.attrs[name] = fact
        # room for what is known at the end: attributes are only overwritten then
        for status in Status:
            file.attrs[_count(status)] = np.int64(trials * (status == Status.NOT_RUN))
        file.attrs["ended_at"] = np.bytes_(now())
        file.attrs["seconds"] = np.float64(np.nan)
        lay_out(file, trials, contributors, responses)
        for column, contributor in enumerate(contributors):
            file[contributor.name][...] = plan.deviations[:, column]
            file[NOMINAL][contributor.name][...] = 0.0
        for name, limit in plan.limits.items():
            file[name].attrs[LIMIT] = limit
            file[name].attrs[DEMANDED] = plan.demanded[name]
        for name, (tolerance, words, batch) in plan.assumed.items():
            attrs = file[name].attrs
            attrs[TOLERANCE], attrs[ASSUMED] = tolerance, words
            if batch:
                attrs[BATCH] = batch
        for name, swept in plan.settings.items():
            lay_out_setting(file, name, swept.values, swept.unit, swept.sentence)
        if plan.audit:
            group = lay_out_audit(file, plan.audit.trials, responses)
            group.attrs["rtol"] = plan.audit.rtol
        if plan.reference:
            group = file.create_group(REFERENCE, track_order=True)
            group.attrs["label"] = plan.reference.label
            for name, values in plan.reference.columns.items():
                group[name] = values

    def write_nominal(self, outcome: Outcome) -> None:
        """Store the machine without deviations.

        Parameters
        ----------
        outcome : Outcome
            Of one trial.
        """
        nominal = self._file[NOMINAL]
        for column, response in enumerate(self.description.responses):
            nominal[response.name][...] = outcome.responses[0, column]
        if outcome.steps is not None:
            nominal[STEPS][...] = outcome.steps[0]
        self._sync()
        nominal[STATUS][...] = outcome.status[0]
        self._file.flush()

    def write_blocks(self, blocks: list[tuple[int, Outcome]]) -> None:
        """Store finished blocks: their data reach the disk before their status.

        Parameters
        ----------
        blocks : list of (int, Outcome)
            Each with the number of its first trial.
        """
        for first, outcome in blocks:
            trials = slice(first, first + len(outcome.status))
            for column, response in enumerate(self.description.responses):
                self._file[response.name][trials] = outcome.responses[:, column]
            if outcome.steps is not None:
                self._file[STEPS][trials] = outcome.steps
        self._sync()
        for first, outcome in blocks:
            self._file[STATUS][first : first + len(outcome.status)] = outcome.status
        self._file.flush()  # safe from a kill; from a power cut with the next block

    def write_audit(self, blocks: list[tuple[int, Outcome]]) -> None:
        """Store trials that were integrated again, numbered among these."""
        group = self._file[AUDIT]
        for first, outcome in blocks:
            chosen = slice(first, first + len(outcome.status))
            for column, response in enumerate(self.description.responses):
                group[response.name][chosen] = outcome.responses[:, column]
        self._sync()
        for first, outcome in blocks:
            group[STATUS][first : first + len(outcome.status)] = outcome.status
        self._file.flush()

    def keep(self, trials: int, audit: Audit | None, facts: Mapping[str, Any]) -> None:
        """Leave only the first trials, in a file written aside and renamed.

        Parameters
        ----------
        trials : int
            How many; all of them have run.
        audit : Audit or None
            Of these.
        facts : mapping
            Further attributes of the run.
        """
        plan = self.plan._replace(
            deviations=self.plan.deviations[:trials],
            facts={**self.plan.facts, **facts},
            audit=audit,
        )
        aside = self.path.with_name(self.path.name + ".part")
        names = [response.name for response in self.description.responses]
        with h5py.File(aside, "w") as file:
            self._write_plan(file, plan)
            file.attrs["started_at"] = self._file.attrs["started_at"]
            for name in (*names, STEPS, STATUS):
                file[name][...] = self._file[name][:trials]
                file[NOMINAL][name][...] = self._file[NOMINAL][name][()]
        self._file.close()
        os.replace(aside, self.path)
        self._file = h5py.File(self.path, "r+")
        self.plan = plan

    def write_end(self, seconds: float) -> None:
        """Store the counts of each status and how long the run took, s."""
        status = self._file[STATUS][...]
        for each in Status:
            count = np.count_nonzero(status == each)
            self._file.attrs.modify(_count(each), np.int64(count))
        self._file.attrs.modify("seconds", np.float64(seconds))
        self._file.attrs.modify("ended_at", np.bytes_(now()))
        self._sync()

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> RunWriter:
        """Return the writer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()


def _count(status: Status) -> str:
    return "trials_" + status.word.replace(" ", "_")

"""A run file being filled: data first, status last."""

from __future__ import annotations

import os
import time
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import h5py
import numpy as np

from tolstat.errors import RunFileError
from tolstat.model.contract import Answers
from tolstat.store.aside import aside_of, check_replaceable, check_room
from tolstat.store.audited import write_audited
from tolstat.store.evidence import write_evidence
from tolstat.store.layout import (
    AUDIT,
    EVIDENCE,
    NOMINAL,
    STATUS,
    STEPS,
    lay_out,
    write_facts,
)
from tolstat.store.plan import Ending, Plan, Stopped
from tolstat.store.provenance import now, provenance

SAFE_EVERY = 2.0  # s, between two times at which data are made safe from a power cut

Blocks = list[tuple[int, Answers]]


class RunWriter(AbstractContextManager["RunWriter"]):
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
        self.path = path = path.resolve()  # a link stays one
        self.plan = plan
        self._columns = [each.name for each in plan.description.responses]
        if plan.integrates:
            self._columns.append(STEPS)
        self._began, self._safe = time.perf_counter(), time.monotonic()
        self._facts = {**provenance(), "started_at": now()}
        self._unsafe: Blocks = []
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
        check_replaceable(path, force=force)
        self._file = self._replaced(None)

    def _replaced(self, ending: Ending | None) -> h5py.File:
        """Write the file aside and rename it: under its own name a file is whole."""
        trials = ending.trials if ending else len(self.plan.deviations)
        check_room(self.path.parent, self._bytes(trials))
        aside = aside_of(self.path)
        try:
            with h5py.File(aside, "x") as file:
                if ending is None:
                    self._write_plan(file, trials, None)
                else:
                    self._write_plan(file, trials, ending.stopped)
                    self._write_ending(file, ending)
                file.flush()
                os.fsync(file.id.get_vfd_handle())
            os.replace(aside, self.path)
            return h5py.File(self.path, "r+")
        except (OSError, RuntimeError, ValueError) as error:
            with suppress(OSError):
                aside.unlink()
            stored = "; its trials are stored, without evidence" if ending else ""
            message = f"{self.path} cannot be written: {error}{stored}"
            raise RunFileError(message) from error

    def _bytes(self, trials: int) -> int:
        """Estimate how large the file becomes."""
        contributors, responses = self.plan.description
        row = 8 * (len(contributors) + len(responses) + 3)
        return trials * row + 4096 * (len(contributors) + len(responses) + 64)

    def _write_plan(
        self, file: h5py.File, trials: int, stopped: Stopped | None
    ) -> None:
        write_facts(file, self.plan, stopped)
        for name, fact in self._facts.items():
            file.attrs[name] = fact
        # room for what is known at the end: attributes are only overwritten then
        for code, word in self.plan.words.items():
            file.attrs[_count(word)] = np.int64(trials * (code == 0))
        file.attrs["ended_at"] = np.bytes_(now())
        file.attrs["seconds"] = np.float64(np.nan)
        lay_out(file, self.plan, trials)

    def _write_ending(self, file: h5py.File, ending: Ending) -> None:
        for name in (*self._columns, STATUS):
            file[name][...] = self._file[name][: ending.trials]
            file[NOMINAL][name][...] = self._file[NOMINAL][name][()]
        if ending.audited:
            write_audited(
                file.create_group(AUDIT),
                ending.audited,
                self.plan.description.responses,
            )
        write_evidence(file.create_group(EVIDENCE), ending.evidence)

    def write_nominal(self, outcome: Answers) -> None:
        """Store the machine without deviations.

        Parameters
        ----------
        outcome : Answers
            Of one trial.
        """
        nominal = self._file[NOMINAL]
        for name, values in self._filled(outcome):
            nominal[name][...] = values[0]
        self._file.flush()
        nominal[STATUS][...] = outcome.status[0]
        self._file.flush()

    def write_blocks(self, blocks: Blocks) -> None:
        """Keep finished blocks; each two seconds, and at the end, what waits is stored.

        Parameters
        ----------
        blocks : list of (int, Answers)
            Each with the number of its first trial.
        """
        self._unsafe += blocks
        if time.monotonic() - self._safe > SAFE_EVERY:
            self._make_safe()

    def _make_safe(self) -> None:
        """Store what waits: its data are on the disk before its status is."""
        found = _in_a_row(self._unsafe)
        for trials, outcome in found:
            for name, values in self._filled(outcome):
                self._file[name][trials] = values
        self._sync()
        for trials, outcome in found:
            self._file[STATUS][trials] = outcome.status
        self._file.flush()
        self._unsafe, self._safe = [], time.monotonic()

    def finish(self, ending: Ending) -> None:
        """Leave the trials that are kept, and what is known at the end.

        Parameters
        ----------
        ending : Ending
            Stored with the trials in a file written aside and renamed.

        Raises
        ------
        RunFileError
            If it cannot be written; the trials are stored all the same.
        """
        self._make_safe()
        before = self._file
        self._file = self._replaced(ending)
        before.close()

    def _filled(self, outcome: Answers) -> list[tuple[str, np.ndarray]]:
        columns = [*outcome.responses.T]
        if outcome.steps is not None:
            columns.append(outcome.steps)
        return list(zip(self._columns, columns, strict=True))

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())

    def close(self) -> None:
        """Store the counts of each status and how long the run took; close the file."""
        try:
            self._make_safe()
            status = self._file[STATUS][...]
            for code, word in self.plan.words.items():
                count = np.count_nonzero(status == code)
                self._file.attrs.modify(_count(word), np.int64(count))
            seconds = np.float64(time.perf_counter() - self._began)
            self._file.attrs.modify("seconds", seconds)
            self._file.attrs.modify("ended_at", np.bytes_(now()))
            self._sync()
        finally:
            self._file.close()

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self.close()


def _in_a_row(blocks: Blocks) -> list[tuple[slice, Answers]]:
    """Join blocks that follow each other: each write costs more than its numbers."""
    rows: list[tuple[int, list[Answers]]] = []
    stop = -1
    for first, outcome in sorted(blocks, key=lambda block: block[0]):
        if first != stop:
            rows.append((first, []))
        rows[-1][1].append(outcome)
        stop = first + len(outcome.status)
    joined = [(first, Answers.joined(answers)) for first, answers in rows]
    return [(slice(first, first + len(a.status)), a) for first, a in joined]


def _count(word: str) -> str:
    return "trials_" + word.replace(" ", "_")

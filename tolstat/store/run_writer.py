"""A run file being filled: data and checksums first, status last.

A new file is written under another name and renamed: so under its name it is complete.
After that only its rows are written, as plain bytes.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import (
    Advice,
    BrokenError,
    ModelError,
    Remedy,
    RunFileError,
    TolstatError,
)
from tolstat.model.contract import Answers
from tolstat.store import layout, temporary_files
from tolstat.store.checksums import clock_of, fingerprints, seconds_of
from tolstat.store.layout import ALONE, CHECKSUM, CLOCK, NOMINAL, STATUS, STEPS, Rows
from tolstat.store.lock import Lock, is_still
from tolstat.store.stored_run import Run

SAFE_EVERY = 2.0  # s, between two writes to the disk

Blocks = list[tuple[int, Answers]]


class RunWriter(AbstractContextManager["RunWriter"]):
    """The one process that writes a run file: `made` or `opened`.

    Attributes
    ----------
    path : Path
        The file; a new one if it was removed or moved.
    run : Run
        What is written: the run as it is before its first trial, or at its end.
    given_up : bool
        Whether the run that was to be replaced has been put back.
    """

    _rows: Rows

    def __init__(self, lock: Lock, run: Run, before: Rows | None = None) -> None:
        self.path, self.run = lock.path, run
        self._place = lock.path.absolute()  # a model may change the working directory
        self._locks = ExitStack()  # also of the copy of a file that was moved
        self._broken = self.given_up = self._new = self._unwanted = False
        self._spent, self._began = 0.0, time.perf_counter()
        self._safe = time.monotonic()
        self._unsafe: Blocks = []
        self._replaced: Path | None = None  # what stood there, under another name
        self._replace(run, before)

    @classmethod
    def made(cls, lock: Lock, run: Run, *, force: bool = False) -> RunWriter:
        """Return the writer of a new file, with every trial "not run".

        `force` replaces an existing run, which is kept under another name until the new
        one is complete.
        """
        temporary_files.check_replaceable(lock.path, force=force)
        path, replaced = lock.path.resolve(), None  # a link stays one
        if path.exists():
            run = replace(run, replaces=temporary_files.kept_before(path))
            replaced = temporary_files.linked_aside(path)
        try:
            writer = cls(lock, run)
        except TolstatError:
            if replaced:
                temporary_files.forget_before(path, replaced)
                replaced.unlink()
            raise
        writer._new, writer._replaced = True, replaced
        return writer

    @classmethod
    def opened(cls, lock: Lock, run: Run, status: NDArray[np.uint8]) -> RunWriter:
        """Return the writer of a run to resume, with the rows that trials filled.

        The status says which rows are complete; the other trials have not run.
        """
        with h5py.File(lock.path, "r", locking=False) as file:
            places = layout.places_of(file)
        try:
            rows = Rows(lock.path.open("r+b", buffering=0), places)
            rows.write(STATUS, status)
        except OSError as error:
            raise BrokenError(f"{lock.path} cannot be written: {error}") from error
        writer = cls(lock, run, rows)
        writer._spent = np.nan_to_num(seconds_of(writer._rows.read(CLOCK)))
        return writer

    def _replace(self, run: Run, before: Rows | None) -> None:
        """Write a new file and rename it: under its name a file is complete.

        Rows of trials are copied from the file `before`.
        """
        try:
            draft, places = layout.draft_of(run, self._place.resolve())
        except UnicodeEncodeError as error:  # bytes of a name that are no text
            raise RunFileError(
                f"{self.path} cannot be written: a run keeps the name of its study and "
                f"the command as text, and '{error.object}' is not; rename that file"
            ) from None
        if not run.complete:
            temporary_files.check_room(self.path, draft.size)
        path = self._place.resolve()  # a link stays a link
        aside, file = temporary_files.aside_of(path), None
        try:
            file = aside.open("xb+", buffering=0)
            draft.copy_to(file)
            rows = Rows(file, places)
            for name, place in places.items():
                empty = np.nan if place.dtype.kind == "f" else 0
                values = run.columns.get(name, np.broadcast_to(empty, place.length))
                rows.write(name, layout.encoded(values))
            rows.write(CLOCK, clock_of(0.0))
            if before:
                for name in before.places.keys() - {*run.known}:  # columns of trials
                    rows.write(name, before.read(name)[: places[name].length])
            rows.sync()
            os.replace(aside, path)
        except OSError as error:
            with suppress(OSError):
                aside.unlink()
            if file:
                file.close()
            raise self._write_error(error) from error
        if before:
            before.file.close()
        self._rows = rows

    def _given(self, trials: slice) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield the columns of trials that are known before they run."""
        for name in self.run.known:
            yield name, layout.encoded(self.run.columns[name][trials])

    def write_drawn(self, trials: slice) -> None:
        """Store the deviations of trials sampled now, before they run."""
        with self._writing() as rows:
            for name, values in self._given(trials):
                rows.write(name, values, trials.start)
            rows.sync()

    def write_nominal(self, outcome: Answers) -> None:
        """Store the nominal trial."""
        values = {f"{NOMINAL}/{name}": v for name, v in self._filled(outcome).items()}
        with self._writing() as rows:
            for name in rows.of_nominal:
                rows.write(name, values[name])
            rows.write(ALONE, fingerprints([values[name] for name in rows.of_nominal]))
            rows.sync()

    def write_blocks(self, blocks: Blocks) -> None:
        """Keep finished blocks, and store them every two seconds."""
        self._unsafe += blocks
        if time.monotonic() - self._safe > SAFE_EVERY:
            self._make_safe()

    def _make_safe(self) -> None:
        """Store kept blocks: their data are on the disk before their status."""
        found = _in_a_row(self._unsafe)
        with self._writing() as rows:
            for trials, outcome in found:
                columns = self._filled(outcome)
                for name in columns.keys() - {STATUS}:
                    rows.write(name, columns[name], trials.start)
                columns |= self._given(trials)
                every = [columns[n].astype(rows.places[n].dtype) for n in rows.columns]
                rows.write(CHECKSUM, fingerprints(every, trials.start), trials.start)
            rows.sync()
            for trials, outcome in found:
                rows.write(STATUS, outcome.status, trials.start)
            spent = self._spent + time.perf_counter() - self._began
            rows.write(CLOCK, clock_of(spent))
        self._unsafe, self._safe = [], time.monotonic()

    def _filled(self, outcome: Answers) -> dict[str, NDArray[Any]]:
        """Return the columns that trials fill."""
        names = [each.name for each in self.run.responses]
        found = dict(zip(names, outcome.responses.T, strict=True))
        if outcome.steps is not None:
            found[STEPS] = outcome.steps
        return {**found, STATUS: outcome.status.astype(np.uint8)}

    @contextmanager
    def _writing(self) -> Iterator[Rows]:
        """Yield the rows to write to; a failure says how much is stored."""
        try:
            if not is_still(self._rows.file, self._place):
                self._continue_in_copy()
            yield self._rows
        except OSError as error:
            raise self._write_error(error) from error

    def _continue_in_copy(self) -> None:
        """Copy the file to another name, because it was removed or moved."""
        lost = self.path
        lock = Lock(temporary_files.free_name(self._place, "rescued"))
        self.path = self._place = self._locks.enter_context(lock).path
        self._replace(self.run, self._rows)
        warnings.warn(
            f"{lost} was removed or moved while it was written: the run continues in "
            f"{self.path}",
            RuntimeWarning,
            stacklevel=2,
        )

    def _write_error(self, error: OSError) -> BrokenError:
        """Return the error of a failed write, with how much is stored."""
        self._broken = True
        return self._error(f"{self.path} cannot be written: {error.strerror or error}")

    def _error(self, said: str) -> BrokenError:
        """Return an error with a message, and with how much is stored."""
        try:
            if self._puts_back:
                return BrokenError(f"{said}; the run in {self.path} is unchanged")
            over = np.count_nonzero(self._rows.read(STATUS))
        except (OSError, AttributeError):  # there are no rows yet
            return BrokenError(said)
        again = Advice(Remedy.RESUME, self.path, self.run.machine)
        stored = f"{over} of {self.run.trials} trials are stored"
        return BrokenError(f"{said}; {stored}", again)

    def failed(self, error: TolstatError) -> TolstatError:
        """Return an error with how much is stored; an unused file is removed."""
        self._make_safe()
        self._unwanted = isinstance(error, ModelError) and self._is_unused
        return error if self._unwanted else self._error(str(error))

    @property
    def _is_unused(self) -> bool:
        """Whether the file is new, and none of its trials has run."""
        return self._new and not self._rows.read(STATUS).any()

    @property
    def _puts_back(self) -> bool:
        """Whether the run that was to be replaced gets its name again."""
        return self._replaced is not None and self._is_unused

    def finish(self, run: Run) -> None:
        """Write the complete run.

        If that fails, its trials are stored all the same.
        """
        self._make_safe()
        self._replace(run, self._rows)
        self.run = run

    def __exit__(self, *_: object) -> None:
        """Store kept blocks; close the file."""
        try:
            if not self._broken:
                self._make_safe()
        finally:
            with suppress(OSError):
                self._leave_one()
            self._rows.file.close()
            self._locks.close()

    def _leave_one(self) -> None:
        """Remove the run that was replaced, keep it, or put it back if nothing ran."""
        before = temporary_files.before_of(self.path)
        kept = self.run.replaces == temporary_files.identity(before) != ""
        if self._replaced and self._puts_back:
            temporary_files.forget_before(self.path, self._replaced)
            os.replace(self._replaced, self._place.resolve())
            self._replaced, self.given_up = None, True
        elif self._unwanted:
            self.path.unlink()
        elif self.run.complete and kept:
            before.unlink()
        elif kept:
            warnings.warn(
                f"the earlier run is kept as {before} until {self.path} is complete",
                RuntimeWarning,
                stacklevel=2,
            )
        if self._replaced:
            self._replaced.unlink()


def _in_a_row(blocks: Blocks) -> list[tuple[slice, Answers]]:
    """Return blocks with consecutive ones joined: each write takes time."""
    rows: list[tuple[int, list[Answers]]] = []
    stop = -1
    for first, outcome in sorted(blocks, key=lambda block: block[0]):
        if first != stop:
            rows.append((first, []))
        rows[-1][1].append(outcome)
        stop = first + len(outcome.status)
    joined = [(first, Answers.joined(answers)) for first, answers in rows]
    return [(slice(first, first + len(a.status)), a) for first, a in joined]

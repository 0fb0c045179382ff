"""A run file being filled: data and checksums first, status last.

A file is made, or made again, under another name and renamed: under its own it is
whole. Between that only its rows are written, as plain bytes.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Truths
from tolstat.errors import Advice, BrokenError, RunFileError, TolstatError
from tolstat.model.contract import Answers
from tolstat.status import Status
from tolstat.store.draft import draft_of
from tolstat.store.fingerprint import clock_of, fingerprints, seconds_of
from tolstat.store.layout import (
    ALONE,
    CHECKSUM,
    CLOCK,
    NOMINAL,
    STATUS,
    STEPS,
    Rows,
    encoded,
    places_of,
)
from tolstat.store.lock import Lock, is_still
from tolstat.store.stored_run import Run
from tolstat.store.temporary_files import (
    aside_of,
    check_replaceable,
    check_room,
    free_name,
    rescued,
)

SAFE_EVERY = 2.0  # s, between two times at which data are made safe from a power cut

Blocks = list[tuple[int, Answers]]


class RunWriter(AbstractContextManager["RunWriter"]):
    """The one process that writes a run file: `made` or `opened`.

    Attributes
    ----------
    path : Path
        The file; another one once that was removed or moved.
    run : Run
        What is written: the run as it is before its first trial.
    given_up : bool
        Whether the run that was to be replaced has been put back.
    """

    def __init__(self, lock: Lock, run: Run) -> None:
        self.path, self.run = lock.path, run
        self._rows: Rows | None = None
        self._before: Path | None = None  # what was there, until this run is complete
        self._rescued: Lock | None = None
        self._broken = self.given_up = self._new = self._unwanted = False
        self._spent, self._began = 0.0, time.perf_counter()
        self._safe = time.monotonic()
        self._unsafe: Blocks = []

    @classmethod
    def made(cls, lock: Lock, run: Run, *, force: bool = False) -> RunWriter:
        """Make a file, with every trial "not run".

        An existing run may be replaced by `force`: it stays, under another name, until
        the new one is complete.
        """
        check_replaceable(lock.path, force=force)
        writer = cls(lock, run)
        writer._replace(run)
        writer._new = True
        return writer

    @classmethod
    def opened(cls, lock: Lock, run: Run, whole: Truths) -> RunWriter:
        """Open a file to resume its run.

        Trials that are not whole have not run. With more trials than the file holds, or
        with other notes, the file is made again and keeps its rows.
        """
        with h5py.File(lock.path, "r", locking=False) as file:
            places, notes = places_of(file), tuple(file.attrs.get("notes", ()))
        writer = cls(lock, run)
        try:
            writer._rows = rows = Rows(lock.path.open("r+b", buffering=0), places)
            status = rows.read(STATUS)
            rows.write(STATUS, np.where(whole, status, Status.NOT_RUN))
            for name, values in writer._given(slice(len(whole))):
                rows.write(name, values)  # as they were drawn, whatever became of them
            rows.sync()
        except OSError as error:
            raise BrokenError(f"{lock.path} cannot be written: {error}") from error
        writer._spent = np.nan_to_num(seconds_of(rows.read(CLOCK)))
        if len(whole) < run.trials or notes != run.notes:
            writer._replace(run)
        return writer

    def _replace(self, run: Run) -> None:
        """Write the file aside and rename it: under its own name a file is whole."""
        try:
            draft, places = draft_of(run, self.path.resolve())
        except UnicodeEncodeError as error:  # bytes of a name that are no text
            raise RunFileError(
                f"{self.path} cannot be written: a run keeps the name of its study and "
                f"the command as text, and '{error.object}' is none; rename that file"
            ) from None
        if not run.complete:
            check_room(self.path, draft.size)
        path = self.path.resolve()  # a link stays one
        aside, file = aside_of(path), None
        try:
            file = aside.open("xb+", buffering=0)
            draft.copy_to(file)
            rows = Rows(file, places)
            for name, place in places.items():
                empty = np.nan if place.dtype.kind == "f" else 0
                values = run.columns.get(name, np.broadcast_to(empty, place.length))
                rows.write(name, encoded(values))
            rows.write(CLOCK, clock_of(0.0))
            if before := self._rows:
                for name in before.places.keys() - {*run.known}:  # what trials fill
                    count = min(places[name].length, before.places[name].length)
                    rows.write(name, before.read(name, 0, count))
            rows.sync()
            if self._rows is None and path.exists():
                self._before = _moved_aside(path)
            os.replace(aside, path)
        except OSError as error:
            with suppress(OSError):
                aside.unlink()
            if file:
                file.close()
            raise self._lost_hope(error) from error
        if self._rows:
            self._rows.file.close()
        self._rows = rows

    def _given(self, trials: slice) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield what is known of trials before they run."""
        for name in self.run.known:
            yield name, encoded(self.run.columns[name][trials])

    def write_drawn(self, trials: slice) -> None:
        """Store the deviations of trials that are drawn now, before they run."""
        with self._writing() as rows:
            for name, values in self._given(trials):
                rows.write(name, values, trials.start)
            rows.sync()

    def write_nominal(self, outcome: Answers) -> None:
        """Store the machine without deviations."""
        values = {f"{NOMINAL}/{name}": v for name, v in self._filled(outcome).items()}
        with self._writing() as rows:
            for name in rows.of_nominal:
                rows.write(name, values[name])
            rows.write(ALONE, fingerprints([values[name] for name in rows.of_nominal]))
            rows.sync()

    def write_blocks(self, blocks: Blocks) -> None:
        """Keep finished blocks; each two seconds what waits is stored."""
        self._unsafe += blocks
        if time.monotonic() - self._safe > SAFE_EVERY:
            self._make_safe()

    def _make_safe(self) -> None:
        """Store what waits: its data are on the disk before its status is."""
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
        """Give the rows to be written to; say what is stored where that fails."""
        try:
            yield self._open_rows()
        except OSError as error:
            raise self._lost_hope(error) from error

    def _open_rows(self) -> Rows:
        """Return the rows; of a copy, if the file is no longer where it was."""
        assert self._rows
        if is_still(self._rows.file, self.path):
            return self._rows
        lock, file = rescued(self._rows.file, self.path)
        warnings.warn(
            f"{self.path} was removed or moved while it was written: the run goes on "
            f"in {lock.path}",
            RuntimeWarning,
            stacklevel=2,
        )
        self._rows.file.close()
        if self._rescued:
            self._rescued.__exit__()
        self._rescued, self.path, self._before = lock, lock.path, None
        self._rows = Rows(file, self._rows.places)
        return self._rows

    def _lost_hope(self, error: OSError) -> BrokenError:
        """Say what could not be written, and what is stored all the same."""
        self._broken = True
        said = f"{self.path} cannot be written: {error.strerror or error}"
        if self._rows:
            with suppress(OSError):
                return self._error(said)
        return BrokenError(said)

    def _error(self, said: str) -> BrokenError:
        """Say what is stored, beside what is wrong."""
        assert self._rows
        status = self._rows.read(STATUS)
        ended = np.count_nonzero(status != Status.NOT_RUN)
        if self._before and not ended:  # it is put back
            return BrokenError(f"{said}; the run in {self.path} is as it was")
        return BrokenError(
            f"{said}; {ended} of {len(status)} trials are stored",
            Advice("resume", self.path, self.run.machine),
        )

    def failed(self, error: TolstatError) -> BrokenError | None:
        """Say what a machine's failure leaves; None where that is no file at all."""
        self._make_safe()
        assert self._rows
        if self._new and not self._rows.read(STATUS).any():
            self._unwanted = True  # nothing was done
            return None
        return self._error(str(error))

    def cut_short(self, error: TolstatError) -> BrokenError:
        """Say what is stored where it cannot be gone on."""
        self._make_safe()
        return self._error(str(error))

    def finish(self, run: Run) -> None:
        """Leave the run as it is at its end.

        Where that cannot be written, the trials are stored all the same.
        """
        self._make_safe()
        self._replace(run)
        if self._before:
            with suppress(OSError):
                self._before.unlink()
            self._before = None

    def __exit__(self, *_: object) -> None:
        """Store what waits; close the file."""
        assert self._rows
        try:
            if not self._broken:
                self._make_safe()
        finally:
            self._give_up_before()
            self._rows.file.close()
            if self._unwanted and not self.given_up:
                self.path.unlink(missing_ok=True)
            if self._rescued:
                self._rescued.__exit__()

    def _give_up_before(self) -> None:
        """Put back the run that was to be replaced, if nothing of the new one ran."""
        if self._before is None or self._rows is None:
            return
        with suppress(OSError):
            if not self._rows.read(STATUS).any():
                os.replace(self._before, self.path.resolve())
                self.given_up = True
                return
        warnings.warn(
            f"the run that was there before is kept as {self._before}",
            RuntimeWarning,
            stacklevel=2,
        )


def _moved_aside(path: Path) -> Path:
    """Keep a run under another name; its own is never without one of them."""
    before = free_name(path, "before")
    try:
        os.link(path, before)
    except OSError:  # a file system without links
        os.replace(path, before)
    return before


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

"""A run file being filled: data and checksums first, status last.

A new file is written under another name and renamed: so under its name it is complete.
After that only its rows are written, as plain bytes.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import (
    Advice,
    BrokenError,
    ModelError,
    Remedy,
    RunFileError,
    StoppedError,
    TolstatError,
)
from tolstat.model.contract import TrialResults
from tolstat.operating_system import give_second_name
from tolstat.regular_files import opened_for_writing
from tolstat.store import files_beside, layout
from tolstat.store.files_beside import Lock, is_still
from tolstat.store.integrity import clock_of, fingerprints, times_of
from tolstat.store.layout import ALONE, CHECKSUM, CLOCK, NOMINAL, Rows
from tolstat.store.memory_recorder import MemoryRecorder
from tolstat.store.open_run import open as open_run
from tolstat.store.run_records import STATUS
from tolstat.store.stored_run import IN_MEMORY, Run

SAFE_EVERY = 2.0  # s, between two writes to the disk

Blocks = list[tuple[int, TrialResults]]


class Stoppable:
    """What long work is done by, here to its end; others may raise an error to end it.

    Their callers may leave before a long function ends.
    """

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a long function returns."""
        return function(*arguments)

    def check(self) -> None:
        """Raise the error if the work has to end."""


TO_THE_END = Stoppable()


class RunWriter(AbstractContextManager["RunWriter"]):
    """The one process that writes a run file: `made` or `opened`.

    A run that replaces another waits under another name until trials are stored: the
    other one is as it was until then, and stays if none ends.

    Attributes
    ----------
    path : Path
        The file; a new one if it was removed or moved.
    run : Run
        What is written: the run as it is before its first trial, or at its end.
    """

    _rows: Rows

    def __init__(
        self,
        lock: Lock,
        run: Run,
        before: Rows | None = None,
        *,
        new: bool = False,
        waiting: bool = False,
        by: Stoppable,
    ) -> None:
        self.path, self.run = lock.path, run
        self._place = lock.path.absolute()  # a model may change the working directory
        self._locks = ExitStack()  # also of the copy of a file that was moved
        self._new, self._broken, self._unwanted = new, False, False
        self._spent, self._began = 0.0, time.perf_counter()
        self._safe = time.monotonic()
        self._unsafe: Blocks = []
        self._waiting: Path | None = None  # the file, until it takes its name
        self._write_file(run, by, before, waiting=waiting)

    @classmethod
    def made(
        cls, lock: Lock, run: Run, *, force: bool = False, by: Stoppable
    ) -> RunWriter:
        """Return the writer of a new file, with every trial "not run".

        `force` replaces an existing run, which is kept under another name until the new
        one is complete. `by` may end it: no file remains then.
        """
        files_beside.check_replaceable(lock.path, force=force)
        path = lock.path.resolve()  # a link stays one
        if waiting := path.exists():
            replaced, _ = files_beside.run_before(path)
            run = replace(run, replaces=replaced)
        # rows of trials that ran have no checksums yet
        return cls(lock, run, new=True, waiting=waiting or run.ended > 0, by=by)

    @classmethod
    def opened(
        cls, lock: Lock, run: Run, status: NDArray[np.uint8], *, by: Stoppable
    ) -> RunWriter:
        """Return the writer of a run to resume, with the rows that trials filled.

        The status says which rows are complete; the other trials have not run. `by` may
        end it: the file stays then.
        """
        try:
            with layout.open_for_reading(lock.path) as file:
                extents = layout.extents_of(file)
            rows = Rows(opened_for_writing(lock.path.resolve()), extents)
            rows.write(STATUS, status)
            spent = times_of(rows.read(CLOCK))["seconds"]
        except (OSError, LookupError, RuntimeError) as error:  # of h5py, too
            raise BrokenError(f"{lock.path} cannot be written: {error}") from error
        writer = cls(lock, run, rows, by=by)
        writer._spent = np.nan_to_num(spent)
        return writer

    def _write_file(
        self,
        run: Run,
        by: Stoppable,
        before: Rows | None = None,
        *,
        waiting: bool = False,
    ) -> None:
        """Write a new file and rename it: under its name a file is complete.

        Rows of trials are copied from the file `before`.
        """
        path = self._place.resolve()  # a link stays a link
        try:
            draft, extents = by.call(layout.draft_of, run, path)
        except UnicodeEncodeError as error:  # bytes of a name that are no text
            raise RunFileError(
                f"{self.path} cannot be written: a run keeps the name of its study and "
                f"the command as text, and '{error.object}' is not; rename that file"
            ) from None
        if not run.complete:
            files_beside.check_room(self.path, draft.size)
        aside, file = None, None
        try:
            aside, file = files_beside.create_aside(
                path, before.file if before else None
            )
            draft.copy_to(file, [extent.hole for extent in extents.values()])
            rows = Rows(file, extents)
            for name, extent in extents.items():
                by.check()
                empty = np.nan if extent.dtype.kind == "f" else 0
                values = run.columns.get(name, np.broadcast_to(empty, extent.length))
                rows.write(name, layout.encoded(values))
            rows.write(CLOCK, clock_of(0.0))
            if before:
                for name in before.extents.keys() - {*run.input_names}:
                    by.check()
                    rows.write(name, before.read(name)[: extents[name].length])
                if before.columns != rows.columns:  # checksums hold all of them
                    rows.write(CHECKSUM, _checksums(rows))
            rows.sync()
            if not waiting:
                by.check()
                os.replace(aside, path)
        except Exception as error:
            if file:
                file.close()
            if aside:
                with suppress(OSError):
                    aside.unlink()
            if isinstance(error, OSError):
                raise self._write_error(error) from error
            raise
        if before:
            before.file.close()
        self._rows, self._waiting = rows, aside if waiting else None

    def _inputs(self, trials: slice) -> dict[str, NDArray[Any]]:
        """Return the columns of trials that are sampled before they run."""
        columns = self.run.columns
        names = self.run.input_names
        return {name: layout.encoded(columns[name][trials]) for name in names}

    def write_drawn(self, trials: slice) -> None:
        """Store the deviations of trials sampled now, before they run."""
        with self._writing() as rows:
            for name, values in self._inputs(trials).items():
                rows.write(name, values, trials.start)
            rows.sync()

    def write_nominal(self, outcome: TrialResults) -> None:
        """Store the nominal trial."""
        values = {
            f"{NOMINAL}/{name}": v for name, v in self.run.columns_of(outcome).items()
        }
        last = f"{NOMINAL}/{STATUS}"  # with it the nominal trial is stored
        with self._writing() as rows:
            checksum = fingerprints([values[name] for name in rows.of_nominal])
            rows.write(ALONE, checksum)
            for name in sorted(rows.of_nominal, key=lambda name: name == last):
                rows.write(name, values[name])
            rows.sync()

    def write_blocks(self, blocks: Blocks) -> None:
        """Keep finished blocks, and store them every two seconds."""
        self._unsafe += blocks
        if time.monotonic() - self._safe > SAFE_EVERY:
            self._make_safe()

    def _make_safe(self) -> None:
        """Store kept blocks: their data are on the disk before their status."""
        blocks = _in_a_row(self._unsafe)
        with self._writing() as rows:
            for trials, outcome in blocks:
                columns = self.run.columns_of(outcome)
                for name in columns.keys() - {STATUS}:
                    rows.write(name, columns[name], trials.start)
                columns |= self._inputs(trials)
                stored = [
                    columns[n].astype(rows.extents[n].dtype) for n in rows.columns
                ]
                rows.write(CHECKSUM, fingerprints(stored, trials.start), trials.start)
            rows.sync()
            for trials, outcome in blocks:
                rows.write(STATUS, outcome.status, trials.start)
            spent = self._spent + time.perf_counter() - self._began
            rows.write(CLOCK, clock_of(spent))
            if self._waiting and blocks:
                rows.sync()
                self._take_name(self._waiting)
        self._unsafe, self._safe = [], time.monotonic()

    def _take_name(self, aside: Path) -> None:
        """Give the file the name of the run that it replaces, which is kept."""
        path = self._place.resolve()
        if path.exists() and files_beside.run_before(path)[1]:
            second_name = files_beside.aside_of(path)
            give_second_name(path, second_name)
            os.replace(second_name, files_beside.before_of(path))
        os.replace(aside, path)
        self._waiting = None

    @contextmanager
    def _writing(self) -> Iterator[Rows]:
        """Yield the rows to write to; a failure says how much is stored."""
        try:
            if not is_still(self._rows.file, self._waiting or self._place):
                self._continue_in_copy()
            yield self._rows
        except OSError as error:
            raise self._write_error(error) from error

    def _continue_in_copy(self) -> None:
        """Copy the file to another name, because it was removed or moved."""
        lost = self.path
        lock = Lock(files_beside.free_name(self._place, "rescued"))
        self.path = self._place = self._locks.enter_context(lock).path
        self._write_file(self.run, TO_THE_END, self._rows)
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

    def _error(self, message: str) -> BrokenError:
        """Return an error with a message, and with how much is stored."""
        try:
            if self._waiting:
                old = f"; the run in {self.path} is unchanged"
                return BrokenError(message + old if self.run.replaces else message)
            ended = np.count_nonzero(self._rows.read(STATUS))
        except (OSError, AttributeError):  # there are no rows yet
            return BrokenError(message)
        advice = Advice(Remedy.RESUME, self.path, self.run.machine)
        stored = f"{ended} of {self.run.trials} trials are stored"
        return BrokenError(f"{message}; {stored}", advice)

    def failed(self, error: TolstatError) -> TolstatError:
        """Return an error with how much is stored; an unused file is removed."""
        self._make_safe()
        unused = self._new and not self._rows.read(STATUS).any()
        self._unwanted = isinstance(error, ModelError) and unused
        return error if self._unwanted else self._error(str(error))

    def write_again(self, run: Run, by: Stoppable) -> None:
        """Write the run with its trials again: complete, or with rows for more.

        If that fails, or `by` ends it, its trials are stored all the same.
        """
        self._make_safe()
        self._write_file(run, by, self._rows)
        self.run = run

    def recorded(self) -> Run:
        """Return the run as it is stored; StoppedError if the run before is there."""
        if self._waiting:
            raise StoppedError(
                f"stopped before any trial finished; the run in {self.path} is "
                "unchanged"
            )
        del self.run  # frees memory before the stored trials are read
        return open_run(self.path)

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
        """Remove the file if nothing ran, or the run that it replaced at its end."""
        before = files_beside.before_of(self.path)
        identity = files_beside.identity(before)
        is_ours = self.run.replaces == identity != ""
        if self._waiting or self._unwanted:
            (self._waiting or self.path).unlink()
        elif self.run.complete and is_ours:
            before.unlink()
        elif is_ours or identity == files_beside.UNREADABLE:
            until = (
                f"until {self.path} is complete" if is_ours else "as it is unreadable"
            )
            warnings.warn(
                f"the earlier run is kept as {before} {until}",
                RuntimeWarning,
                stacklevel=2,
            )


def _checksums(rows: Rows) -> NDArray[np.uint64]:
    """Return the checksums of the trials that ran, 0 of others."""
    checksums = fingerprints([rows.read(name) for name in rows.columns])
    checksums[rows.read(STATUS) == 0] = 0
    return checksums


Recorder = RunWriter | MemoryRecorder  # what a run is recorded with


def save(run: Run, path: str | os.PathLike[str], *, force: bool = False) -> Run:
    """Write a run in memory to a file.

    Parameters
    ----------
    run : Run
        As `tolstat.run` returns it without a file.
    path : path
        The run file.
    force : bool
        Whether an existing run file may be replaced.

    Returns
    -------
    Run
        The same run, with its file. It can be resumed and extended.

    Raises
    ------
    RunFileError
        If the run has a file already, or the file exists or cannot be written.

    Examples
    --------
    >>> study = {"model": "dimension_chain", "trials": 100, "seed": 1}
    >>> study["settings"] = {"gap": "A"}
    >>> study["links"] = {"A": {"nominal": "1 mm", "tolerance": "+-0.1 mm"}}
    >>> tolstat.save(tolstat.run(study), "saved.h5").path.name
    'saved.h5'
    """
    if run.path != IN_MEMORY:
        raise RunFileError(f"{run.path} is a file already; copy it")
    path = Path(path)
    with (
        Lock(path) as lock,
        RunWriter.made(lock, run, force=force, by=TO_THE_END) as writer,
    ):
        writer._spent = run.times["seconds"]
        writer.write_nominal(run.nominal_results)
        writer.write_blocks([(0, run.results())])
    return replace(run, path=path)


def _in_a_row(blocks: Blocks) -> list[tuple[slice, TrialResults]]:
    """Return blocks with consecutive ones joined: each write takes time."""
    rows: list[tuple[int, list[TrialResults]]] = []
    stop = -1
    for first, outcome in sorted(blocks, key=lambda block: block[0]):
        if first != stop:
            rows.append((first, []))
        rows[-1][1].append(outcome)
        stop = first + len(outcome.status)
    joined = [(first, TrialResults.joined(answers)) for first, answers in rows]
    return [(slice(first, first + len(a.status)), a) for first, a in joined]

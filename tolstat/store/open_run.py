"""Reading of run files."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import Advice, DamagedError, Remedy, RunFileError
from tolstat.model.contract import TrialResults
from tolstat.model.description import Response
from tolstat.status import Status
from tolstat.store import layout
from tolstat.store.codec import read_fields
from tolstat.store.integrity import Damage, check_seal, fingerprints, is_whole, times_of
from tolstat.store.run_records import STATUS, STEPS
from tolstat.store.run_rules import broken_rules
from tolstat.store.schema import check_schema
from tolstat.store.stored_fields import read_attribute
from tolstat.store.stored_run import IN_MEMORY, NO_FILE, Run

RunSource = Run | str | os.PathLike[str]  # a run file, or the run that was read from it


def open(path: RunSource, *, damaged: bool = False) -> Run:
    """Open a run file, also one that is still being written.

    Parameters
    ----------
    path : path or Run
        As `tolstat run` wrote it; a run that is open already is returned as it is.
    damaged : bool
        Whether to open a run although some of its trials are damaged; its attribute
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
        If the file has changed since it was written.

    Examples
    --------
    >>> tolstat.open("runs/stack-up.h5").frame()["gap"].max().round(6).item()
    0.000696
    """
    if isinstance(path, Run):
        return path
    path = existing(Path(path))
    try:
        before, unsealed = path.stat(), check_seal(path)
        with layout.open_for_reading(path) as file:
            if not os.path.samestat(path.stat(), before):  # replaced meanwhile
                return open(path, damaged=damaged)
            check_schema(file, before.st_size, unsealed)
            run = _read(path, file)
        wrong = next(broken_rules(run), "")
    except OSError as error:
        raise RunFileError(f"{path} cannot be read as HDF5: {error}") from error
    except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError,
            ValueError) as error:  # fmt: skip
        wrong = str(error)
    if wrong:
        raise RunFileError(f"{path} is not a complete run: {wrong}")
    if run.damage and not damaged:
        raise DamagedError(
            f"{path} is damaged: {run.damage.words}",
            Advice(Remedy.REPAIR, path, run.machine),
        )
    return run


def existing(path: Path) -> Path:
    """Return a path; refuse a study, and a file that does not exist."""
    if path.suffix == ".toml":
        raise RunFileError(f"{path} is a study, not a run", Advice(Remedy.RUN, path))
    if path == IN_MEMORY:
        raise RunFileError(NO_FILE)
    if not path.is_file():
        raise RunFileError(f"{path}: no such file")
    return path


def _read(path: Path, file: h5py.File) -> Run:
    # status first: trials that a writer adds meanwhile have not run yet
    status = file[STATUS][...]
    datasets = {n: item for n, item in file.items() if isinstance(item, h5py.Dataset)}
    columns = {name: item[...] for name, item in datasets.items()} | {STATUS: status}
    rows = {len(values) for values in (*columns.values(), file[layout.CHECKSUM])}
    if len(rows) > 1 or 0 in rows:
        raise ValueError("its columns have different numbers of rows, or none")
    clock = file[layout.CLOCK][...]
    fields = read_fields(file, Run)
    study = read_attribute(file, "study_file", None)
    return Run(
        path=path,
        nominal_results=_nominal(file[layout.NOMINAL], fields["responses"]),
        study_file=study and Path(os.path.normpath(path.resolve().parent / study)),
        damage=_damage_of(file, columns, complete=fields["complete"]),
        times=times_of(clock),
        columns={name: layout.decoded(values) for name, values in columns.items()},
        **fields,
    )


def _nominal(group: h5py.Group, responses: tuple[Response, ...]) -> TrialResults:
    values = [float(group[response.name][()]) for response in responses]
    steps = np.array([group[STEPS][()]]) if STEPS in group else None
    return TrialResults(np.array([values]), np.array([int(group[STATUS][()])]), steps)


def _damage_of(
    file: h5py.File, columns: Mapping[str, NDArray[Any]], *, complete: bool
) -> Damage:
    """Compare the checksums of a run with its columns, the status read first."""
    ran = columns[STATUS] != Status.NOT_RUN
    stored = file[layout.CHECKSUM][...]
    differs = fingerprints([columns[n] for n in layout.in_order(columns)]) != stored
    damaged = ~ran | differs if complete else ran & differs
    # a writer stores the status last
    stored_alone = complete or file[layout.NOMINAL][STATUS][()] != Status.NOT_RUN
    checksum = file[layout.ALONE][()]
    values = [np.atleast_1d(file[n][()]) for n in layout.nominal_columns_of(file)]
    nominal = stored_alone and fingerprints(values)[0] != checksum
    # while a run is being written, the checksum may not fit yet
    clock = complete and not is_whole(file[layout.CLOCK][...])
    return Damage(np.flatnonzero(damaged), bool(nominal), clock)

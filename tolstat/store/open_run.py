"""Reading of run files."""

import os
from pathlib import Path
from typing import Any

import h5py

from tolstat.errors import Advice, DamagedError, Remedy, RunFileError
from tolstat.model.description import Response
from tolstat.store import layout
from tolstat.store.checksums import damage_of, seconds_of, written_at
from tolstat.store.codec import fields_of, read
from tolstat.store.seal import check_seal
from tolstat.store.stored_run import Run

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
    check_seal(path)
    try:
        with h5py.File(path, "r", locking=False) as file:
            run = _read(path, file)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read as HDF5: {error}") from error
    except (KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise RunFileError(f"{path} is not a complete run: {error}") from error
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
    if not path.is_file():
        raise RunFileError(f"{path}: no such file")
    return path


def _read(path: Path, file: h5py.File) -> Run:
    # status first: trials that a writer adds meanwhile have not run yet
    status = file[layout.STATUS][...]
    columns = {
        n: each[...] for n, each in file.items() if isinstance(each, h5py.Dataset)
    }
    columns[layout.STATUS] = status
    clock = file[layout.CLOCK][...]
    fields = {each.name: read(file, each.stored.name, each) for each in fields_of(Run)}
    study = file.attrs.get("study_file")
    return Run(
        path=path,
        nominal_values=_nominal(
            file[layout.NOMINAL], fields["responses"], fields["words"]
        ),
        study_file=study and Path(os.path.normpath(path.resolve().parent / study)),
        damage=damage_of(file, columns, complete=fields["complete"]),
        times={"ended_at": written_at(clock), "seconds": seconds_of(clock)},
        columns={name: layout.decoded(values) for name, values in columns.items()},
        **fields,
    )


def _nominal(
    group: h5py.Group, responses: tuple[Response, ...], words: dict[int, str]
) -> dict[str, Any]:
    found: dict[str, Any] = {r.name: float(group[r.name][()]) for r in responses}
    found[layout.STATUS] = words.get(int(group[layout.STATUS][()]), "unknown")
    if layout.STEPS in group:
        found[layout.STEPS] = int(group[layout.STEPS][()])
    return found

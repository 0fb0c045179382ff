"""A run verified, on the screen."""

from __future__ import annotations

from pathlib import Path

from tolstat.cli.showing import screen
from tolstat.execution.verifying import findings, verify


def verify_run(path: Path, *, every: bool, workers: int | None) -> bool:
    """Print whether a run is as it was written, and what is not.

    Parameters
    ----------
    path : Path
        The run.
    every : bool
        Whether all its trials are evaluated again.
    workers : int, optional
        Threads.

    Returns
    -------
    bool
        Whether all of it is.
    """
    found = verify(path, every=every, workers=workers)
    console = screen()
    for line in findings(found):
        console.print(line)
    if found.whole:
        console.print(f"{path} is as it was written")
    else:
        console.print(f"{path} is damaged; `tolstat resume {path}` repairs it")
    return found.whole

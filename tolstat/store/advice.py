"""What to type next about a run."""

from __future__ import annotations

import shlex
from pathlib import Path


def to_resume(path: Path, machine: str = "") -> str:
    """Return the command that goes on with a run, as a shell takes it.

    Parameters
    ----------
    path : Path
        The run file.
    machine : str
        Where a machine of the user's own is, FILE.py:NAME.
    """
    own = f" --machine {shlex.quote(machine)}" if machine else ""
    return f"tolstat resume {shlex.quote(str(path))}{own}"

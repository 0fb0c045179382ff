"""What to type next about a run or a study."""

from __future__ import annotations

import shlex
from pathlib import Path


def command(*words: object, machine: str = "") -> str:
    """Return a command of tolstat as a shell takes it, in the folder of this one.

    Parameters
    ----------
    *words : object
        Its name, files as they were given, options.
    machine : str
        As of `--machine`; empty if it is installed.
    """
    own = ["--machine", machine] if machine else []
    return shlex.join(["tolstat", *map(str, words), *own])


def to_resume(path: Path, machine: str) -> str:
    """Return the command that goes on with a run."""
    return command("resume", path, machine=machine)


def to_replay(path: Path, trial: int, machine: str) -> str:
    """Return the command that simulates a stored trial again."""
    return command("trial", path, trial, machine=machine)

"""What to type next about a run."""

from __future__ import annotations

import shlex
from pathlib import Path


def to_resume(path: Path, machine: str) -> str:
    """Return the command that goes on with a run, as a shell takes it."""
    own = f" --machine {shlex.quote(machine)}" if machine else ""
    return f"tolstat resume {shlex.quote(str(path))}{own}"

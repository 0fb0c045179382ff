"""What to type next about a run or a study."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

from tolstat.store.stored_run import Run


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
    return shlex.join(["tolstat", *map(_word, words), *own])


def _word(given: object) -> str:
    """Return a word of a command; a file is no option, however it begins."""
    if isinstance(given, Path) and str(given).startswith("-"):
        return f".{os.sep}{given}"
    return str(given)


def to_resume(path: Path, machine: str) -> str:
    """Return the command that resumes a run."""
    return command("resume", path, machine=machine)


def to_replay(path: Path, trial: int, machine: str) -> str:
    """Return the command that simulates a stored trial again."""
    return command("trial", path, trial, machine=machine)


def to_run_again(run: Run, trials: int | None = None) -> str:
    """Say how a study is run again in place of its run; of as many trials, or more."""
    study = run.study_file
    if study is None or not study.is_file():
        return "run its study again, with --force or under another name (-o)"
    beside = study.with_suffix(".h5").resolve() == run.path.resolve()
    place = [] if beside else ["-o", run.path]
    again = command(
        "run", as_typed(study), *typed_options(run, trials), *place, "--force",
        machine=run.machine,
    )  # fmt: skip
    return f"run its study again: `{again}`, or under another name (-o)"


def typed_options(run: Run, trials: int | None = None) -> list[object]:
    """Return the options of a run whose trials or seed are not those of its study."""
    if run.sampled is None:
        return []
    typed: list[object] = []
    if trials or (not run.rules and run.study.trials != run.trials):
        typed += ["--trials", trials or run.trials]
    if run.study.seed != run.sampled.seed:
        typed += ["--seed", run.sampled.seed]
    return typed


def as_typed(path: Path) -> Path:
    """Return a path as it is typed in the folder of this process, or below it."""
    here = Path(os.path.relpath(path))
    return path if os.pardir in here.parts else here

"""Commands that documents and errors suggest as the next step."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from tolstat.answers.sweep.curves import responses_of_interest
from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.names import expand
from tolstat.errors import Advice, TolstatError
from tolstat.store.stored_run import Run
from tolstat.units.scale import figures

HALVED_NORMAL = re.compile("normal, [^,]+, cp 1")  # as distributions are worded
HALVED_UNIFORM = re.compile("uniform, [^,]+")
WORDS = {
    "custom model": "name a custom model by --machine FILE.py:NAME",
    "replace": "--force replaces it, -o gives another name",
}


def command(*words: object, machine: str = "") -> str:
    """Return a command of tolstat, quoted for a shell in this folder.

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
    """Return a word of a command; a file that begins with - is no option."""
    if isinstance(given, Path) and str(given).startswith("-"):
        return f".{os.sep}{given}"
    return str(given)


def to_resume(path: Path, machine: str) -> str:
    """Return the command that finishes or repairs a run."""
    return command("resume", path, machine=machine)


def to_replay(path: Path, trial: int, machine: str) -> str:
    """Return the command that simulates a stored trial again."""
    return command("trial", path, trial, machine=machine)


def to_run_again(run: Run, trials: int | None = None) -> str:
    """Return the command that replaces a run; empty where its study is gone.

    Parameters
    ----------
    run : Run
        Whose study is run again, with its trials and seed.
    trials : int, optional
        Instead of those of the run.
    """
    study = run.study_file
    if study is None or not study.is_file():
        return ""
    beside = study.with_suffix(".h5").resolve() == run.path.resolve()
    place = [] if beside else ["-o", run.path]
    return command(
        "run", as_typed(study), *typed_options(run, trials), *place, "--force",
        machine=run.machine,
    )  # fmt: skip


def to_extend(run: Run, trials: int) -> str:
    """Return the command that adds trials to a run; empty where none can be added."""
    if run.sampling not in ("random", "sobol") or trials <= run.trials:
        return ""
    return command("extend", run.path, "--trials", trials, machine=run.machine)


def halves_of(run: Run, parts: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return half of some tolerances by part, or by the name that all parts share.

    In words, and as an entry of [deviations]; towards zero, or the end nearest to it.
    Empty unless all are normal with Cp 1, or uniform: the user must choose any other.
    """
    halves = {}
    for name in parts:
        assumed, scale = run.assumed[name], run.scales[name]
        uniform = HALVED_UNIFORM.fullmatch(assumed.words)
        if not (uniform or HALVED_NORMAL.fullmatch(assumed.words)):
            return {}
        nearest = Tolerance(*assumed.tolerance).nearest
        ends = [scale.factor * (nearest + end) / 2 for end in assumed.tolerance]
        lower, upper = map(figures, ends)
        words = f"+-{upper}" if ends[0] == -ends[1] else f"{lower}..{upper}"
        words = f"{words} {scale.mark}"
        uniformly = f'{{ tolerance = "{words}", distribution = "uniform" }}'
        halves[name] = words, uniformly if uniform else words
    stem = parts[0].rpartition("_")[0]
    every = [each.name for each in run.contributors]
    if (
        set(expand(stem, every) if stem else ()) == set(parts)
        and len({*halves.values()}) == 1
    ):  # all parts of one name
        halves = {stem: halves[parts[0]]}
    return halves


def to_halve(run: Run, parts: Sequence[str]) -> str:
    """Return the command that writes a study with some tolerances halved, or ""."""
    entries = [f"{name}={half}" for name, (_, half) in halves_of(run, parts).items()]
    study = run.path.with_name(f"{run.path.stem}-halved.toml")
    words = "what-if", run.path, *entries, "--write", study
    return command(*words, machine=run.machine) if entries else ""


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


def worded(error: TolstatError) -> str:
    """Return the message of an error, and the command to type."""
    return "; ".join([str(error), *map(_typed, error.advice)])


def _typed(advice: Advice) -> str:
    path, trials = advice.path, advice.trials
    if advice.what in WORDS:
        return WORDS[advice.what]
    if advice.what == "run again":
        if typed := to_run_again(advice.run, trials or None):
            return f"`{typed}` runs its study again; -o gives it another name"
        return "run its study again, with --force or under another name (-o)"
    extend, resume = ("extend", path, "--trials", trials), ("resume", path)
    response = []
    if advice.what == "plot" and not responses_of_interest(advice.run):
        response = ["--response", advice.run.responses[0].name]
    table, picture = (path.parent / f"{path.stem}.{end}" for end in ("csv", "png"))
    commands: dict[str, tuple[tuple[object, ...], str]] = {
        "run": (("run", path), "runs it"),
        "replace run": (("run", path, "--force"), "replaces it"),
        "repair": (resume, "repairs it"),
        "resume": (resume, "continues it"),
        "resume regardless": (
            (*(extend if trials else resume), "--regardless"),
            "continues with what the run has stored",
        ),
        "extend": (extend, "adds them"),
        "report": (("report", path), "writes it"),
        "export": (("export", path, "-o", table), "shows them"),
        "plot": (("show", path, "--plot", picture, *response), "shows them"),
    }
    words, what = commands[advice.what]
    return f"`{command(*words, machine=advice.machine)}` {what}"

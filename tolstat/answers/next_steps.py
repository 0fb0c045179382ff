"""Commands that documents and errors suggest as the next step."""

import os
from collections.abc import Mapping
from pathlib import Path

from tolstat.document.inline import Typed
from tolstat.errors import Advice, Remedy, TolstatError
from tolstat.model.description import Description
from tolstat.statistics.sample_size import MOST_ROWS
from tolstat.store.files_beside import free_name
from tolstat.store.stored_run import IN_MEMORY, Run
from tolstat.study.editor import StudyEditor
from tolstat.study.memory_needed import too_large
from tolstat.units.scale import figures

SAVED = Path("run.h5")  # where commands look for a run in memory: a note says so
WORDS = {
    Remedy.CUSTOM_MODEL: "name a custom model by --machine FILE.py:NAME",
    Remedy.REPLACE: "--force replaces it, -o gives another name",
}


def command(*words: object, machine: str = "") -> Typed:
    """Return a command of tolstat; a run in memory has the name of a file.

    Parameters
    ----------
    *words : object
        Its name, files as they were given, options.
    machine : str
        As of `--machine`; empty if it is installed.
    """
    option = ["--machine", machine] if machine else []
    return Typed((*(SAVED if word == IN_MEMORY else word for word in words), *option))


def to_resume(path: Path, machine: str) -> Typed:
    """Return the command that finishes or repairs a run."""
    return command("resume", path, machine=machine)


def to_replay(path: Path, trial: int, machine: str) -> Typed:
    """Return the command that simulates a stored trial again."""
    return command("trial", path, trial, machine=machine)


def to_draw(run: Run, response: str) -> Typed:
    """Return the command that writes a report with the figures of a response."""
    return command("report", run.path, "--response", response, machine=run.machine)


def to_export(run: Run) -> Typed:
    """Return the command that writes all trials as a table beside the run."""
    return command("export", run.path, "-o", _file_of(run).with_suffix(".csv"))


def to_tables(run: Run) -> Typed:
    """Return the command that writes all tables of a report beside the run."""
    file = _file_of(run).with_suffix(".report.xlsx")
    return command("report", run.path, "-o", file, machine=run.machine)


def _file_of(run: Run) -> Path:
    """Return the run file; of a run in memory the one that commands name."""
    return SAVED if run.path == IN_MEMORY else run.path


def to_run_again(run: Run, trials: int | None = None) -> Typed | None:
    """Return the command that replaces a run; None where its study is gone.

    Parameters
    ----------
    run : Run
        Whose study is run again, with its trials and seed.
    trials : int, optional
        Instead of those of the run.
    """
    study = run.study_file
    if study is None or not study.is_file():
        return None
    by_default = study.with_suffix(".h5").resolve() == run.path.resolve()
    output = [] if by_default else ["-o", run.path]
    return command(
        "run", as_typed(study), *typed_options(run, trials), *output, "--force",
        machine=run.machine,
    )  # fmt: skip


def to_extend(run: Run, trials: int) -> Typed | None:
    """Return the command that adds trials to a run; None where none can be added."""
    if run.sampling not in ("random", "sobol") or trials <= run.trials or run.thinned:
        return None
    return command("extend", run.path, "--trials", trials, machine=run.machine)


def to_decide(run: Run, trials: int, *, slow: bool = False) -> Typed | None:
    """Return the command that decides the limits of a run; None where none can.

    `trials`: those that decide. `slow`: evaluating few trials, where it would not do so
    by itself.
    """
    if run.sampling != "random":
        return None
    options = ["--slow"] if slow else []
    if trials > MOST_ROWS:
        options += ["--at-most", str(trials)]
    return command("decide", run.path, *options, machine=run.machine)


def holds(run: Run, trials: int) -> bool:
    """Return whether the memory holds so many trials."""
    described = Description(tuple(run.contributors), tuple(run.responses))
    return not too_large(trials, described)


def to_prove(run: Run) -> Typed:
    """Return the command that proves the remedy of a run, with its custom model."""
    return command("report", run.path, machine=run.machine)


def to_change(run: Run, entries: Mapping[str, str]) -> tuple[Typed, ...]:
    """Return the commands that write a study with changed entries, and run it.

    None where the trials are rows of a file.
    """
    if run.listed:
        return ()
    study = run.study_file or _file_of(run).with_suffix(".toml")
    changed = as_typed(free_name(study, "remedy"))
    words = (f"{name}={entry}" for name, entry in entries.items())
    machine = run.machine
    return (
        command("what-if", run.path, *words, "--write", changed, machine=machine),
        command("run", changed, machine=machine),
    )


def to_allocate(run: Run) -> tuple[Typed, ...]:
    """Return the command that finds the cheapest tolerances; none without costs."""
    study = run.study_file
    entries = StudyEditor(run.study.table, run.contributors).entries()
    priced = any("cost" in entry.keys for entry in entries)
    if not (priced and study and study.is_file()):
        return ()
    path = as_typed(free_name(study, "allocated"))
    return (command("allocate", as_typed(study), "-o", path),)


def typed_setting(run: Run, name: str, value: float) -> str:
    """Return a tightened setting as a study types it: a truth value is stored as 1."""
    if run.settings[name].words in ("true", "false"):
        return "true" if value else "false"
    return f'"{figures(value)} s"' if name == "max_step" else figures(value)


def typed_options(run: Run, trials: int | None = None) -> list[object]:
    """Return the options of a run whose trials or seed are not those of its study."""
    if run.sampled is None or run.listed:
        return []
    typed: list[object] = []
    if trials or (not run.rules and run.study.trials != run.trials):
        typed += ["--trials", trials or run.trials]
    if run.study.seed != run.sampled.seed:
        typed += ["--seed", run.sampled.seed]
    return typed


def as_typed(path: Path) -> Path:
    """Return a path as it is typed in the folder of this process, or one above it."""
    relative = Path(os.path.relpath(path))
    above = os.pardir in relative.parent.parts
    return path if above and {*relative.parent.parts} != {os.pardir} else relative


def worded(error: TolstatError) -> str:
    """Return the message of an error, and the command to type."""
    return "; ".join([str(error), *map(_typed, error.advice)])


def _typed(advice: Advice) -> str:
    path, trials = advice.path, advice.trials
    if advice.remedy in WORDS:
        return WORDS[advice.remedy]
    if advice.remedy is Remedy.RUN_AGAIN:
        if typed := to_run_again(advice.run, trials or None):
            return f"`{typed}` runs its study again; -o gives it another name"
        return "run its study again, with --force or under another name (-o)"
    extend, resume = ("extend", path, "--trials", trials), ("resume", path)
    response = []
    if advice.remedy is Remedy.PLOT:
        from tolstat.answers.sweep.curves import responses_of_interest  # of grids alone

        if not responses_of_interest(advice.run):
            response = ["--response", advice.run.responses[0].name]
    table, picture = (path.parent / f"{path.stem}.{end}" for end in ("csv", "png"))
    commands: dict[Remedy, tuple[tuple[object, ...], str]] = {
        Remedy.RUN: (("run", path), "runs it"),
        Remedy.REPLACE_RUN: (("run", path, "--force"), "replaces it"),
        Remedy.REPAIR: (resume, "repairs it"),
        Remedy.RESUME: (resume, "continues it"),
        Remedy.DECIDE: (("decide", path), "adds trials until all limits are decided"),
        Remedy.DECIDE_REGARDLESS: (
            ("decide", path, "--regardless"),
            "continues with what the run has stored",
        ),
        Remedy.RESUME_REGARDLESS: (
            (*(extend if trials else resume), "--regardless"),
            "continues with what the run has stored",
        ),
        Remedy.EXTEND: (extend, "adds them"),
        Remedy.EXPORT: (("export", path, "-o", table), "shows them"),
        Remedy.PLOT: (("show", path, "--plot", picture, *response), "shows them"),
    }
    words, effect = commands[advice.remedy]
    return f"`{command(*words, machine=advice.machine)}` {effect}"

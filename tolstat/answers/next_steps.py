"""Next steps as data, and the commands that they are on the command line."""

import os
from collections.abc import Iterable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from tolstat.answers.remedy.remedy_finding import RemedyStep
from tolstat.document.inline import Typed
from tolstat.errors import Advice, Remedy, TolstatError
from tolstat.model.description import Description
from tolstat.statistics.limits.yields import PartsUncertainty
from tolstat.statistics.sample_size import MOST_ROWS
from tolstat.store.files_beside import free_name
from tolstat.store.stored_run import IN_MEMORY, Run
from tolstat.study.editor import Entries, StudyChange, StudyEditor
from tolstat.study.memory_needed import too_large
from tolstat.study.problems import toml_of
from tolstat.units.scale import figures

REGARDLESS = "continues with what the run has stored"
SAVED = Path("run.h5")  # where commands look for a run in memory: a note says so
WORDS = {
    Remedy.CUSTOM_MODEL: "name a custom model by --machine FILE.py:NAME",
    Remedy.REPLACE: "--force replaces it, -o gives another name",
}


class StepKind(StrEnum):
    """What a next step does."""

    RESUME = "run missing trials"
    FINISH = "finish audit and diagnostics"
    FINER_RUN = "run with finer settings"
    SEE_FAILED = "simulate a trial that failed when evaluated again"
    MEND_FORMULA = "mend formula"
    CHECK_FORMULA = "check formula"  # a machine may jump so
    REMEDY = "change nominal values and tolerances"
    MEASURE_PARTS = "measure more parts"
    DECIDE = "decide limits"
    ADD_TRIALS = "add trials"
    SEARCH_RARE = "search rare trials"
    ALLOCATE = "allocate tolerances"
    SEE_WORST = "simulate the worst trial again"
    DRAW_RESPONSE = "draw another response"
    WRITE_TABLE = "write all trials as a table"


class Step(NamedTuple):
    """A next step: a change of the study, or of the run."""

    kind: StepKind
    responses: tuple[str, ...] = ()
    causes_of: tuple[str, ...] = ()  # responses whose causes more trials would tell
    parts: tuple[str, ...] = ()  # contributors that change
    change: StudyChange = StudyChange()
    prediction: RemedyStep | None = None  # what the change does
    trials: int = 0  # in all; 0 as they are
    evaluated: int = 0  # of these where the others are thinned out; 0: all of them
    slow: bool = False  # whether `decide` has to be told so, to leave out others
    trial: int | None = None  # to simulate again
    measured: PartsUncertainty | None = None  # which parts, and how many
    # the same as a person types it: the change, and commands one after the other
    entries: Mapping[str, str] = {}
    settings: Mapping[str, str] = {}
    commands: tuple[Typed, ...] = ()


def with_commands(run: Run, steps: Iterable[Step]) -> tuple[Step, ...]:
    """Return next steps of a run with what a person types."""
    return tuple(
        step._replace(
            entries=typed_entries(step.change.deviations),
            settings={n: typed_value(x) for n, x in step.change.settings.items()},
            commands=_commands(run, step),
        )
        for step in steps
    )


def _commands(run: Run, step: Step) -> tuple[Typed, ...]:
    words: tuple[object, ...]
    match step.kind:
        case StepKind.RESUME | StepKind.FINISH:
            words = "resume", run.path
        case StepKind.SEE_FAILED | StepKind.SEE_WORST:
            words = "trial", run.path, step.trial
        case StepKind.DRAW_RESPONSE:
            return (to_draw(run, *step.responses),)
        case StepKind.DECIDE:
            needed, options = step.evaluated or step.trials, ["--slow"] * step.slow
            options += ["--at-most", str(needed)] * (needed > MOST_ROWS)
            words = "decide", run.path, *options
        case StepKind.ADD_TRIALS if can_extend(run, step.trials):
            words = "extend", run.path, "--trials", step.trials
        case StepKind.WRITE_TABLE:
            table = _file_of(run).with_suffix(".csv")
            return (command("export", run.path, "-o", table),)
        case StepKind.ALLOCATE if study := run.study_file:
            words = "allocate", as_typed(study), "-o", _free_name(study, "allocated")
        case StepKind.FINER_RUN if again := to_run_again(run):
            return (again,)
        case StepKind.REMEDY if step.change.deviations:
            return to_change(run, step.change)
        case _:
            return ()
    return (command(*words, machine=run.machine),)


def command(*words: object, machine: str = "") -> Typed:
    """Return a command of tolstat: its name, files as they were given, options.

    A run in memory has the name of a file. A model that is installed has no `machine`.
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


def to_tables(run: Run, response: str) -> Typed:
    """Return the command that writes all tables on a response beside the run."""
    file = _file_of(run).with_suffix(f".{response}.xlsx")
    chosen = "--response", response
    return command("report", run.path, *chosen, "-o", file, machine=run.machine)


def _file_of(run: Run) -> Path:
    """Return the run file; of a run in memory the one that commands name."""
    return SAVED if run.path == IN_MEMORY else run.path


def to_run_again(run: Run, trials: int | None = None) -> Typed | None:
    """Return the command that replaces a run; None where its study is gone.

    With its seed, and its trials or so many.
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


def can_extend(run: Run, trials: int) -> bool:
    """Return whether a run can have so many trials in all."""
    samples = run.sampling in ("random", "sobol")
    return samples and trials > run.trials and not run.thinned


def holds(run: Run, trials: int) -> bool:
    """Return whether the memory holds so many trials."""
    described = Description(tuple(run.contributors), tuple(run.responses))
    return not too_large(trials, described)


def to_change(run: Run, change: StudyChange, word: str = "remedy") -> tuple[Typed, ...]:
    """Return the commands that write a study with other entries or limits, and run it.

    None where the trials are rows of a file. `word` is part of the name of the study.
    """
    if run.listed:
        return ()
    study = run.study_file or _file_of(run).with_suffix(".toml")
    changed, machine = _free_name(study, word), run.machine
    words = [f"{n}={entry}" for n, entry in typed_entries(change.deviations).items()]
    for name, limit in typed_entries(change.limits).items():
        words += ["--limit", f"{name} {'' if limit[0] in '<>' else '= '}{limit}"]
    return (
        command("what-if", run.path, *words, "--write", changed, machine=machine),
        command("run", changed, machine=machine),
    )


def can_allocate(run: Run) -> bool:
    """Return whether the study of a run has costs, and is still there."""
    study = run.study_file
    entries = StudyEditor(run.study.table, run.contributors).entries()
    priced = any("cost" in entry.keys for entry in entries)
    return bool(priced and study and study.is_file())


def _free_name(study: Path, word: str) -> Path:
    return as_typed(free_name(study, word))


def finer_settings(run: Run, settings: Mapping[str, float]) -> StudyChange:
    """Return the change of a study to tightened settings."""
    return StudyChange(settings={n: _setting(run, n, x) for n, x in settings.items()})


def typed_setting(run: Run, name: str, value: float) -> str:
    """Return a tightened setting as a person types it."""
    return typed_value(_setting(run, name, value))


def _setting(run: Run, name: str, value: float) -> bool | float | str:
    """Return a tightened setting as a study has it: a truth value is stored as 1."""
    if run.settings[name].words in ("true", "false"):
        return bool(value)
    return f"{figures(value)} s" if name == "max_step" else value


def typed_value(value: object) -> str:
    """Return a value of a study as a person types it; a number has few figures."""
    return figures(value) if type(value) is float else toml_of(value)


def typed_entries(entries: Entries) -> dict[str, str]:
    """Return entries as a person types them."""
    return {n: x if isinstance(x, str) else toml_of(x) for n, x in entries.items()}


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
    goes_on, response = extend if trials else resume, []
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
        Remedy.DECIDE_REGARDLESS: (("decide", path, "--regardless"), REGARDLESS),
        Remedy.RESUME_REGARDLESS: ((*goes_on, "--regardless"), REGARDLESS),
        Remedy.EXTEND: (extend, "adds them"),
        Remedy.EXPORT: (("export", path, "-o", table), "shows them"),
        Remedy.PLOT: (("show", path, "--plot", picture, *response), "shows them"),
    }
    words, effect = commands[advice.remedy]
    return f"`{command(*words, machine=advice.machine)}` {effect}"

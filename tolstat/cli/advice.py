"""What is to be typed about an error."""

from __future__ import annotations

from tolstat.answers.next_steps import command, to_run_again
from tolstat.answers.sweep.curves import responses_of_interest
from tolstat.errors import Advice, TolstatError

WORDS = {
    "custom model": "a custom model is named by --machine FILE.py:NAME",
    "replace": "--force replaces it, -o gives another name",
}


def worded(error: TolstatError) -> str:
    """Say what is wrong, and what is to be typed."""
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

"""What is to be typed about an error."""

from __future__ import annotations

from tolstat.answers.next_steps import command, to_resume, to_run_again
from tolstat.errors import Advice, TolstatError


def worded(error: TolstatError) -> str:
    """Say what is wrong, and what is to be typed."""
    return "; ".join([str(error), *map(_typed, error.advice)])


def _typed(advice: Advice) -> str:
    path, machine = advice.path, advice.machine
    words: tuple[object, ...]
    match advice.what:
        case "run":
            return f"`{command('run', path, machine=machine)}` runs it"
        case "repair":
            return f"`{to_resume(path, machine)}` repairs it"
        case "resume":
            return f"`{to_resume(path, machine)}` continues it"
        case "resume regardless":
            words = ("resume", path)
            if advice.trials:
                words = ("extend", path, "--trials", advice.trials)
            typed = command(*words, "--regardless", machine=machine)
            return f"`{typed}` continues with what the run has stored"
        case "run again":
            if typed := to_run_again(advice.run, advice.trials or None):
                return f"`{typed}` runs its study again; -o gives it another name"
            return "run its study again, with --force or under another name (-o)"
        case "extend":
            typed = command("extend", path, "--trials", advice.trials, machine=machine)
            return f"`{typed}` adds them"
        case "replace run":
            return f"`{command('run', path, '--force', machine=machine)}` replaces it"
        case "report":
            return f"`{command('report', path, machine=machine)}` writes it"
        case "export" | "plot":
            words = ("export", path, "-o", path.with_suffix(".csv"))
            if advice.what == "plot":
                words = ("show", path, "--plot", path.with_suffix(".png"))
            return f"`{command(*words, machine=machine)}` shows them"
        case "custom model":
            return "a custom model is named by --machine FILE.py:NAME"
        case "replace":
            return "--force replaces it, -o gives another name"
    raise AssertionError(advice.what)

"""A run of its own, where a stored one does not tell: what is to be typed for it."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from shlex import join, quote

from tolstat.store.commands import as_typed, command, typed_options
from tolstat.store.stored_run import Run
from tolstat.store.temporary_files import free_name

AT_RANDOM = 'write there `sampling = "random"`'  # a change


def own_run(run: Run, change: str, word: str) -> str:
    """Say which study is copied and run, and what is changed there.

    Parameters
    ----------
    run : Run
        Whose study is copied, with its trials and seed.
    change : str
        What to do in the copy.
    word : str
        Of the name of the copy.
    """
    beside = study_beside(run)
    path = as_typed(free_name(beside, word))
    if _as_stored(beside, run):
        copy = f"copy {quote(str(as_typed(beside)))} as {quote(str(path))}"
    else:
        name = dumps(str(run.path), ensure_ascii=False)  # no quotes of a shell in it
        code = f"import tolstat; print(tolstat.open({name}).study.text)"
        python = join(["python", "-c", code])
        copy = f"`{python} > {quote(str(path))}` writes its study as it was run"
    typed = command("run", path, *typed_options(run), machine=run.machine)
    return f"a run of its own tells: {copy}; {change}; then `{typed}`"


def study_beside(run: Run) -> Path:
    """Return where the study of a run lies, or would beside it."""
    if run.study_file and run.study_file.parent.is_dir():
        return run.study_file
    return run.path.with_suffix(".toml")


def _as_stored(path: Path, run: Run) -> bool:
    """Tell whether a file is the study that a run was made from."""
    try:
        return path.read_text("utf-8") == run.study.text
    except (OSError, ValueError):
        return False

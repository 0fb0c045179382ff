"""A run of its own, where stored trials do not tell: what is to be typed for it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from json import dumps
from pathlib import Path
from typing import Any

from tolstat.errors import TolstatError
from tolstat.store.advice import as_typed, command, typed_options
from tolstat.store.aside import free_name
from tolstat.store.run import Run
from tolstat.study.deviations import Deviations
from tolstat.study.otherwise import Otherwise, with_deviations
from tolstat.study.problems import toml_of
from tolstat.study.study import Study, load


def own_run(
    given: Mapping[str, str | dict[str, Any]],
    asked: Deviations,
    study: Study,
    run: Run,
) -> str:
    """Say how a run tells what is asked: which study, which lines, which command.

    Parameters
    ----------
    given : mapping of str to str or dict
        Lines as of [deviations].
    asked : Deviations
        The same, read.
    study : Study
        Of the run.
    run : Run
        That does not tell.
    """
    beside = study_beside(run)
    path = as_typed(free_name(beside, "what-if"))
    if _as_stored(beside, run):
        copy = f"copy {as_typed(beside)} as {path}"
    else:
        name = dumps(str(run.path), ensure_ascii=False)  # no quotes of a shell in it
        code = f"import tolstat; print(tolstat.open({name}).study.text)"
        python = shlex.join(["python", "-c", code])
        copy = f"`{python} > {shlex.quote(str(path))}` writes its study as it was run"
    written = with_deviations(
        run.study.table, given, [c.name for c in run.contributors], study.model
    )
    lines = _lines(written) if _says(written, asked, study, run) else ""
    change = lines or f"change {', '.join(given)} there"
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


def _lines(of: Otherwise) -> str:
    """Say which lines are written, and in place of what."""
    said = []
    for section, lines in of.written.items():
        shown = ", ".join(f"`{name} = {toml_of(v)}`" for name, v in lines.items())
        said.append(f"in [{section}] {shown}")
    gone = f" in place of {', '.join(of.replaced)}" if of.replaced else ""
    return f"write there {' and '.join(said)}{gone}"


def _says(of: Otherwise, asked: Deviations, study: Study, run: Run) -> bool:
    """Tell whether a study is what is asked: its lines are said only then."""
    try:
        found = load(of.table, model=study.model, folder=study_beside(run).parent)
    except TolstatError:
        return False
    ours, drawn, new = found.deviating, study.deviating, asked.distributions
    return (
        ours.dependence == drawn.dependence
        and ours.distributions.keys() == drawn.distributions.keys() | new.keys()
        and all(ours.distributions[name] == each for name, each in new.items())
    )

"""Lines of a study that say what is asked of its run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tolstat.errors import TolstatError
from tolstat.store.own_run import study_beside
from tolstat.store.run import Run
from tolstat.study.deviations import Deviations
from tolstat.study.otherwise import Otherwise, with_deviations
from tolstat.study.problems import toml_of
from tolstat.study.study import Study, load


def lines_of_deviations(
    given: Mapping[str, str | dict[str, Any]],
    asked: Deviations,
    study: Study,
    run: Run,
) -> str:
    """Say which lines a copy of a study is given, and in place of which.

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
    names = [each.name for each in run.contributors]
    written = with_deviations(run.study.table, given, names, study.model)
    if not _says(written, asked, study, run):
        return f"change {', '.join(given)} there"
    sections = (in_section(name, lines) for name, lines in written.written.items())
    gone = f" in place of {', '.join(written.replaced)}" if written.replaced else ""
    return f"write there {' and '.join(sections)}{gone}"


def in_section(section: str, lines: Mapping[str, Any]) -> str:
    """Show lines of a section of a study."""
    shown = ", ".join(f"`{name} = {toml_of(line)}`" for name, line in lines.items())
    return f"in [{section}] {shown}"


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

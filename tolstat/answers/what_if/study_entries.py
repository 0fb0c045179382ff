"""Lines of a study that say what is asked of its run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from tolstat.errors import TolstatError
from tolstat.store.fresh_run_advice import own_run, study_beside
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations
from tolstat.study.edited_study import Lines, with_deviations, with_limits
from tolstat.study.problems import toml_of
from tolstat.study.study import Study, load


def run_that_tells(
    given: Mapping[str, str | dict[str, Any]],
    limits: Mapping[str, str | dict[str, Any]],
    asked: Deviations,
    study: Study,
    run: Run,
) -> str:
    """Say which lines a copy of a study is given, in place of which, and its run.

    Parameters
    ----------
    given : mapping of str to str or dict
        Lines as of [deviations].
    limits : mapping of str to str or dict
        Lines as of [limits].
    asked : Deviations
        Those that are given, read.
    study : Study
        Of the run.
    run : Run
        That does not tell.
    """
    names = [each.name for each in run.contributors]
    sections = with_deviations(run.study.table, given, names, study.model)
    if limits:
        sections["limits"] = lines_of_limits(limits, run)
    if not _says(sections, asked, study, run):
        return _unsaid(given, asked, study)
    written = (in_section(name, lines, run) for name, lines in sections.items())
    return own_run(run, f"write there {' and '.join(written)}", "what-if")


def lines_of_limits(limits: Mapping[str, Any], run: Run) -> Lines:
    """Return the section [limits] of a study with other limits."""
    return with_limits(run.study.table, limits, [each.name for each in run.responses])


def in_section(section: str, lines: Lines, run: Run) -> str:
    """Show new lines of a section of a study, and in place of which they stand."""
    where, start = f"in [{section}] ", ""
    if re.search(rf"^\s*{section}\s*\.", run.study.text, re.MULTILINE):
        where, start = "", f"{section}."  # the section has no head
    shown = (f"`{start}{name} = {toml_of(x)}`" for name, x in lines.written.items())
    gone = f" in place of {', '.join(lines.replaced)}" if lines.replaced else ""
    return f"{where}{', '.join(shown)}{gone}"


def _says(
    sections: Mapping[str, Lines], asked: Deviations, study: Study, run: Run
) -> bool:
    """Tell whether a study is what is asked: its lines are said only then."""
    table = {**run.study.table, **{name: x.every for name, x in sections.items()}}
    try:
        found = load(table, model=study.model, folder=study_beside(run).parent)
    except TolstatError:
        return False
    ours, drawn, new = found.deviating, study.deviating, asked.distributions
    return (
        ours.dependence == drawn.dependence
        and ours.distributions.keys() == drawn.distributions.keys() | new.keys()
        and all(ours.distributions[name] == each for name, each in new.items())
    )


def _unsaid(given: Mapping[str, Any], asked: Deviations, study: Study) -> str:
    """Say why no lines of a study say what is asked."""
    batches = study.deviating.dependence.batches
    some = {n: batches[n].name for n in asked.distributions if n in batches}
    if part := {n: batch for n, batch in some.items() if batch not in given}:
        whole = " and ".join(
            f"`{batch} = ...`" for batch in dict.fromkeys(part.values())
        )
        return (
            f"no study says that of {', '.join(part)} alone: a batch is one line; ask "
            f"it of all its parts, {whole}"
        )
    return f"no study says that with other lines of {', '.join(given)} alone"

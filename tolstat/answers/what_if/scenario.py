"""A scenario: other deviations than a run has, read as entries of its study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tolstat.deviations.names import expand
from tolstat.errors import DependenceError
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study import Study
from tolstat.study.study_schema import check_section

Entries = Mapping[str, str | dict[str, Any]]


def read_scenario(
    given: Entries, study: Study, run: Run, problems: Problems
) -> Deviations:
    """Read entries of [deviations]; data files are those beside the run's study."""
    check_section("deviations", given, problems)
    for name, entry in given.items():
        if isinstance(entry, dict) and "common" in entry:
            with problems.noting(f"[deviations] {name}", entry):
                raise DependenceError("batches stay as sampled; leave out common")
    contributors = study.description.contributors
    return read_deviations(given, {}, contributors, folder_of(run), problems)


def folder_of(run: Run) -> Path:
    """Return the folder of a run's study."""
    return (run.study_file or run.path).parent


def changed_kinds(
    given: Entries, scenario: Deviations, study: Study, run: Run
) -> Iterator[str]:
    """Say where a range alone, which is normal, replaces another distribution."""
    names = [each.name for each in run.contributors]
    table, sampled = run.study.table, study.deviating.distributions
    before = {
        member: entry
        for name, entry in (
            table.get("links", {}) | table.get("deviations", {})
        ).items()
        if isinstance(entry, dict) and "distribution" in entry
        for member in expand(name, names)
    }
    said = dict[str, None]()
    for name, entry in given.items():
        for member in expand(name, names) if isinstance(entry, str) else ():
            new, old = scenario.distributions[member], sampled.get(member)
            if member not in before or type(new) is type(old):
                continue
            kind = before[member]["distribution"]
            own = {k: v for k, v in before[member].items() if k in vars(old)}
            kept = toml_of({**own, "tolerance": entry, "distribution": kind})
            said[
                f"{name} was sampled {kind}; a range alone is normal: {kept} keeps it "
                f"{kind}"
            ] = None
    yield from said

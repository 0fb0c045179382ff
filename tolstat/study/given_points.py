"""Trials of a grid or a table, given and not sampled; reference points."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.deviations.names import expand
from tolstat.errors import (
    DataError,
    DistributionError,
    ModelError,
    UnitError,
    allowed_names,
)
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.description import Description
from tolstat.model.setting_kinds import Number, as_typed
from tolstat.model.settings import setting_of, settings_of
from tolstat.study import study_schema as schema
from tolstat.study.csv_table import read_csv
from tolstat.study.memory_needed import too_large
from tolstat.study.nominal_size import DeviationReader, Holds
from tolstat.study.problems import Problems
from tolstat.units.grammar import quantity, unit_of

MOST_CASES = 10_000  # of a grid: other settings
DEVIATIONS = "deviations"  # in [grid]: the table of names that are deviations
TAKEN = "settings."  # before the column of a setting that bears a contributor's name


class Swept(NamedTuple):
    """One axis of a grid: a setting or contributors, and their values."""

    name: str  # as the study has it
    # the contributors that take its values together; empty for a setting
    members: tuple[str, ...]
    values: list[Any]  # SI; for a setting as its dataclass holds it
    # a setting's values as written, where they are no plain numbers
    words: list[str] | None
    unit: str  # SI unit, "1" where there is none
    shown: str  # the unit in which it is written; empty where it has none
    warnings: tuple[str, ...] = ()  # about how its values were read


class Case(NamedTuple):
    """Trials from `first` to before `stop`, all with the same settings."""

    first: int
    stop: int
    settings: Any


def cases_among(cases: Sequence[Case], chosen: NDArray[np.int64]) -> list[Case]:
    """Return the cases of chosen trials, ascending, numbered among these."""
    found = []
    for case in cases:
        first, stop = np.searchsorted(chosen, (case.first, case.stop)).tolist()
        if first < stop:
            found.append(Case(first, stop, case.settings))
    return found


@dataclass(frozen=True)
class Points:
    """Trials as given."""

    deviations: Array  # float64[trial, contributor], SI
    cases: tuple[Case, ...]  # their settings, in the order of the trials
    shown: Mapping[str, str]  # the unit in which each contributor or setting is written
    # the axes of a grid, the slowest first; none for a table
    swept: tuple[Swept, ...] = ()
    # by swept setting, a value for each trial: SI, or a word
    settings: Mapping[str, NDArray[Any]] | None = None
    note: str = ""  # for the summary of the run
    warnings: tuple[str, ...] = ()  # about how the values were read


def read_grid(
    document: schema.Document,
    model: Model,
    settings: Any,
    description: Description,
    problems: Problems,
) -> Points | None:
    """Return the points of the section [grid]; None if something is wrong.

    Each contributor or setting has a list, or a table with from, to and points. A swept
    setting replaces that of the study.
    """
    axes: list[Swept] = []
    before = len(problems.found)
    for name, values, deviation in _axes(document.grid):
        with problems.noting(f"[grid] {name}", values):
            axes.append(_axis(name, values, deviation, model, description))
            taken = [m for axis in axes[:-1] for m in axis.members]
            if double := [m for m in axes[-1].members if m in taken]:
                raise ModelError(f"{double[0]} is given twice")
            swept = axes[-1].name
            if not axes[-1].members and setting_name(swept) in document.settings:
                problems.add(f"[grid] {swept}", None, "is also in [settings]")
    if len(problems.found) > before:
        return None
    # settings outermost: trials of the same settings are integrated together
    axes.sort(key=lambda axis: bool(axis.members))
    with problems.noting("[grid]", None):
        return _product(axes, model, settings, description)
    return None


def _product(
    axes: list[Swept], model: Model, settings: Any, description: Description
) -> Points:
    chosen = [axis for axis in axes if not axis.members]
    trials = math.prod(len(axis.values) for axis in axes)
    number = math.prod(len(axis.values) for axis in chosen)
    if number > MOST_CASES:
        raise ModelError(f"{number} combinations of settings; at most {MOST_CASES}")
    if trials > schema.MOST_TRIALS:
        raise ModelError(f"{trials} points; at most {schema.MOST_TRIALS}")
    if wrong := too_large(trials, description):
        raise ModelError(wrong)
    names = [contributor.name for contributor in description.contributors]
    index = np.unravel_index(np.arange(trials), [len(axis.values) for axis in axes])
    deviations = np.zeros((trials, len(names)))
    columns: dict[str, NDArray[Any]] = {}
    for axis, where in zip(axes, index, strict=True):
        column = np.array(axis.words or axis.values)[where]
        for member in axis.members:
            deviations[:, names.index(member)] = column
        if not axis.members:
            columns[axis.name] = column
    each, cases = trials // number, []
    for i, values in enumerate(product(*(axis.values for axis in chosen))):
        moved = (setting_name(axis.name) for axis in chosen)
        changes = dict(zip(moved, values, strict=True))
        case = Case(i * each, (i + 1) * each, replace(settings, **changes))
        if _columns(described(model, case.settings)) != _columns(description):
            raise ModelError(
                f"{', '.join(changes)}: these settings change which contributors or "
                "responses the model has; write a study for each"
            )
        cases.append(case)
    shown = {m: axis.shown for axis in axes for m in axis.members or (axis.name,)}
    warnings = tuple(sentence for axis in axes for sentence in axis.warnings)
    return Points(
        deviations, tuple(cases), shown, tuple(axes), columns, warnings=warnings
    )


def _columns(description: Description) -> list[tuple[str, str]]:
    """Return names and units: sizes and sentences may depend on settings."""
    return [(each.name, each.unit) for some in description for each in some]


def setting_name(column: str) -> str:
    """Return the name of a swept setting, of the column that holds its values."""
    return column.removeprefix(TAKEN)


def _axes(given: Mapping[str, Any]) -> Iterator[tuple[str, Any, bool]]:
    """Yield name and values of each axis, and whether it can only be a deviation."""
    for name, values in given.items():
        if name == DEVIATIONS and isinstance(values, dict) and "from" not in values:
            for each, of_it in values.items():
                yield each, of_it, True
        else:
            yield name, values, False


def _axis(
    name: str, given: Any, deviation: bool, model: Model, description: Description
) -> Swept:
    """Return the axis of a setting or contributor; a setting has precedence."""
    contributors = {each.name: each for each in description.contributors}
    units, known = (
        {n: each.unit for n, each in contributors.items()},
        settings_of(model),
    )
    if name in known and not deviation:
        return _setting_axis(name, given, model, taken=name in units)
    try:
        members = tuple(expand(name, list(units)))
    except ModelError:
        names = [*units, *(() if deviation else known)]
        raise ModelError(
            f"neither a contributor nor a setting; {allowed_names(name, names)}"
        ) from None
    unit, reader = units[members[0]], DeviationReader(contributors[members[0]])
    if isinstance(given, dict):
        values, first = _steps(given, reader.axis), _first(given)
    else:
        first = str(_listed(given)[0])
        values = reader.axis([*map(str, given)]).tolist()
    if reader.warnings and len({contributors[n].size for n in members}) > 1:
        raise ModelError(f"{', '.join(members)} have different sizes; give deviations")
    shown = reader.shown_unit(unit_of(first))
    return Swept(name, members, values, None, unit, shown, tuple(reader.warnings))


def _setting_axis(name: str, given: Any, model: Model, *, taken: bool) -> Swept:
    """Read the values of one setting; its name may be that of a contributor."""
    column, kind = TAKEN + name if taken else name, setting_of(model, name).kind
    unit = (kind.unit if isinstance(kind, Number) else "") or "1"
    if isinstance(given, dict):
        if not isinstance(kind, Number):
            raise ModelError(
                f"this setting is no number; give a list of values, see {schema.AXIS}"
            )
        steps = _steps(given, lambda ends: [quantity(end, unit) for end in ends])
        values = [kind.checked(value) for value in steps]
        return Swept(column, (), values, None, unit, unit_of(_first(given)))
    values = [kind.read(value) for value in _listed(given)]
    if isinstance(kind, Number) and not any(each in kind.presets for each in given):
        shown = unit_of(given[0]) if isinstance(given[0], str) else ""
        return Swept(column, (), values, None, unit, shown)
    return Swept(column, (), values, [as_typed(value) for value in given], unit, "")


def _listed(given: Any) -> list[Any]:
    if not isinstance(given, list) or not given:
        raise ModelError(f"values are expected, such as {schema.AXIS}")
    return given


def _first(given: Mapping[str, Any]) -> str:
    return str(given["from"])


def _steps(
    given: dict[str, Any], read: Callable[[Sequence[str]], Sequence[float] | Array]
) -> list[float]:
    """Return the steps of from, to and points; `read` reads both ends."""
    entry = schema.read_entry(schema.AxisEntry, given, "there is")
    first, last = read([str(entry.first), str(entry.last)])
    if first == last:
        raise ModelError("from and to are the same")
    steps: list[float] = np.linspace(first, last, entry.points).tolist()
    return steps


def read_table(
    folder: Path | None, name: str, settings: Any, description: Description
) -> Points:
    """Return the trials of a CSV file.

    Heads are contributors with their unit, `rod_length_1 [mm]`; a row is a trial, with
    its deviations, or sizes. `rod_length_1 sizes [mm]` says which.
    """
    table = read_csv(folder, name)
    path = table.path
    contributors = {each.name: each for each in description.contributors}
    deviations = np.zeros((len(table.lines), len(contributors)))
    names, shown, warnings = list(contributors), dict[str, str](), dict[str, None]()
    for head, written in table.units.items():
        called, holds = _called(head)
        try:
            members = expand(called, names)
        except ModelError as error:
            raise DataError(f"{path}, column {head}: {error}") from None
        for member in members:
            if member in shown:
                raise DataError(f"{path}: {member} is given twice")
            reader = DeviationReader(contributors[member])
            try:
                column, sizes = reader.column(
                    table.column(head), written, holds, table.places
                )
            except (UnitError, DistributionError) as error:
                raise DataError(f"{path}, column {head}: {error}") from None
            warnings |= dict.fromkeys(reader.warnings)
            shown[member] = reader.shown_unit(written)
            deviations[:, names.index(member)] = column
            if sizes and not holds:
                warnings[f"{path.name}: column {head} is taken as sizes"] = None
    note = f"{len(deviations)} trials of {path.name} (SHA-256 {table.digest[:12]})"
    cases = (Case(0, len(deviations), settings),)
    return Points(deviations, cases, shown, note=note, warnings=tuple(warnings))


def _called(head: str) -> tuple[str, Holds]:
    """Return the contributor of a column's head, and what it says that it holds."""
    name, _, holds = head.rpartition(" ")
    for word in ("sizes", "deviations"):
        if holds == word:
            return name.strip(), word
    return head, ""


def read_reference(
    given: Mapping[str, Any],
    swept: Sequence[Swept],
    description: Description,
    folder: Path | None,
) -> tuple[str, dict[str, Array]]:
    """Return the label of the section [reference], and the columns of its points, SI.

    The first column is swept. The others are responses, or swept too if the grid has
    several axes. Each head has its unit.
    """
    entry = schema.read_entry(schema.ReferenceEntry, given, "there is")
    table = read_csv(folder, entry.data)
    units = {axis.name: axis.unit for axis in swept if axis.words is None}
    if (first := next(iter(table.units))) not in units:
        raise DataError(
            f"{table.path}: the first column, '{first}', must be swept by [grid]; "
            f"{allowed_names(first, units)}"
        )
    units |= {each.name: each.unit for each in description.responses}
    if wrong := [head for head in table.units if head not in units]:
        known = allowed_names(wrong[0], units)
        raise DataError(f"{table.path}, column {wrong[0]}: {known}")
    columns = {head: table.values(head, units[head]) for head in table.units}
    return entry.label, columns

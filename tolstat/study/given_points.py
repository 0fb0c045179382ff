"""Trials of a grid or a table, given and not sampled; reference points."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.deviations.names import expand
from tolstat.deviations.samplers import Sampler
from tolstat.errors import DataError, ModelError, allowed_names
from tolstat.model.checked import described
from tolstat.model.contract import Model, TrialResults
from tolstat.model.description import Description
from tolstat.model.setting_kinds import Number, as_typed
from tolstat.model.settings import setting_of, settings_of
from tolstat.study import study_schema as schema
from tolstat.study.memory_needed import too_large
from tolstat.study.nominal_size import DeviationReader
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
    among = []
    for case in cases:
        first, stop = np.searchsorted(chosen, (case.first, case.stop)).tolist()
        if first < stop:
            among.append(Case(first, stop, case.settings))
    return among


@dataclass(frozen=True)
class Points:
    """Trials as given."""

    deviations: Array  # float64[trial, contributor], SI
    cases: tuple[Case, ...]  # their settings, in the order of the trials
    units: Mapping[str, str]  # in which each contributor or setting is written
    # the axes of a grid, the slowest first; none for a table
    swept: tuple[Swept, ...] = ()
    # by swept setting, a value for each trial: SI, or a word
    settings: Mapping[str, NDArray[Any]] | None = None
    note: str = ""  # for the summary of the run
    warnings: tuple[str, ...] = ()  # about how the values were read
    # how the rows of a file were sampled; None if they are no sample
    sampler: Sampler | None = None
    places: Sequence[str] = ()  # file and row of each row of a file
    # of results from elsewhere; None where a model evaluates the trials
    answers: TrialResults | None = None


class Setup(NamedTuple):
    """A study as it is read before its points."""

    document: schema.Document
    folder: Path | None  # of its data files
    model: Model
    settings: Any  # of the model
    description: Description  # with these settings


def read_grid(setup: Setup, problems: Problems) -> Points | None:
    """Return the points of the section [grid]; None if something is wrong.

    Each contributor or setting has a list, or a table with from, to and points. A swept
    setting replaces that of the study.
    """
    axes: list[Swept] = []
    before = len(problems.found)
    for name, values, deviation in _axes(setup.document.grid):
        with problems.noting(f"[grid] {name}", values):
            axes.append(_axis(name, values, deviation, setup))
            taken = [m for axis in axes[:-1] for m in axis.members]
            if double := [m for m in axes[-1].members if m in taken]:
                raise ModelError(f"{double[0]} is given twice")
            swept = axes[-1].name
            given = setting_name(swept) in setup.document.settings
            if not axes[-1].members and given:
                problems.add(f"[grid] {swept}", None, "is also in [settings]")
    if len(problems.found) > before:
        return None
    # settings outermost: trials of the same settings are integrated together
    axes.sort(key=lambda axis: bool(axis.members))
    with problems.noting("[grid]", None):
        return _product(axes, setup)
    return None


def _product(axes: list[Swept], setup: Setup) -> Points:
    description = setup.description
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
    size, cases = trials // number, []
    for i, values in enumerate(product(*(axis.values for axis in chosen))):
        swept = (setting_name(axis.name) for axis in chosen)
        changes = dict(zip(swept, values, strict=True))
        case = Case(i * size, (i + 1) * size, replace(setup.settings, **changes))
        if columns_of(described(setup.model, case.settings)) != columns_of(description):
            raise ModelError(
                f"{', '.join(changes)}: these settings change which contributors or "
                "responses the model has; write a study for each"
            )
        cases.append(case)
    return Points(
        deviations,
        tuple(cases),
        units={m: axis.shown for axis in axes for m in axis.members or (axis.name,)},
        swept=tuple(axes),
        settings=columns,
        warnings=tuple(sentence for axis in axes for sentence in axis.warnings),
    )


def columns_of(description: Description) -> list[tuple[str, str]]:
    """Return names and units: sizes and sentences may depend on settings."""
    return [(column.name, column.unit) for columns in description for column in columns]


def setting_name(column: str) -> str:
    """Return the name of a swept setting, of the column that holds its values."""
    return column.removeprefix(TAKEN)


def _axes(grid: Mapping[str, Any]) -> Iterator[tuple[str, Any, bool]]:
    """Yield name and values of each axis, and whether it can only be a deviation."""
    for name, values in grid.items():
        if name == DEVIATIONS and isinstance(values, dict) and "from" not in values:
            yield from ((part, axis, True) for part, axis in values.items())
        else:
            yield name, values, False


def _axis(name: str, values: Any, deviation: bool, setup: Setup) -> Swept:
    """Return the axis of a setting or contributor; a setting has precedence."""
    parts = {part.name: part for part in setup.description.contributors}
    settings = settings_of(setup.model)
    if name in settings and not deviation:
        return _setting_axis(name, values, setup.model, taken=name in parts)
    try:
        members = tuple(expand(name, [*parts]))
    except ModelError:
        names = [*parts, *(() if deviation else settings)]
        raise ModelError(
            f"neither a contributor nor a setting; {allowed_names(name, names)}"
        ) from None
    reader, (typed, points) = DeviationReader(parts[members[0]]), _typed(values)
    deviations = _steps(reader.axis(typed).tolist(), points)
    if reader.warnings and len({parts[member].size for member in members}) > 1:
        raise ModelError(f"{', '.join(members)} have different sizes; give deviations")
    return Swept(
        name,
        members,
        deviations,
        words=None,
        unit=reader.contributor.unit,
        shown=reader.shown_unit(unit_of(typed[0])),
        warnings=tuple(reader.warnings),
    )


def _setting_axis(name: str, values: Any, model: Model, *, taken: bool) -> Swept:
    """Read the values of one setting; its name may be that of a contributor."""
    kind = setting_of(model, name).kind
    unit = (kind.unit if isinstance(kind, Number) else "") or "1"
    swept = partial(Swept, TAKEN + name if taken else name, (), unit=unit)
    if isinstance(values, dict) and not isinstance(kind, Number):
        raise ModelError(
            f"this setting is no number; give a list of values, see {schema.AXIS}"
        )
    typed, points = _typed(values)
    if points:
        steps = _steps([quantity(end, unit) for end in typed], points)
        numbers = [kind.checked(step) for step in steps]
        return swept(numbers, words=None, shown=unit_of(typed[0]))
    read = [kind.read(value) for value in values]
    if isinstance(kind, Number) and not any(value in kind.presets for value in values):
        shown = unit_of(values[0]) if isinstance(values[0], str) else ""
        return swept(read, words=None, shown=shown)
    return swept(read, words=[as_typed(value) for value in values], shown="")


def _typed(values: Any) -> tuple[list[str], int]:
    """Return the values of an axis as typed; or its two ends, and how many points."""
    if isinstance(values, dict):
        entry = schema.read_entry(schema.AxisEntry, values, "there is")
        return [str(entry.first), str(entry.last)], entry.points
    if not isinstance(values, list) or not values:
        raise ModelError(f"values are expected, such as {schema.AXIS}")
    return [*map(str, values)], 0


def _steps(values: list[float], points: int) -> list[float]:
    """Return values as they are, or points between two ends."""
    if not points:
        return values
    first, last = values
    if first == last:
        raise ModelError("from and to are the same")
    steps: list[float] = np.linspace(first, last, points).tolist()
    return steps


def read_reference(
    setup: Setup, swept: Sequence[Swept]
) -> tuple[str, dict[str, Array]]:
    """Return the label of the section [reference], and the columns of its points, SI.

    The first column is swept. The others are responses, or swept too if the grid has
    several axes. Each head has its unit; `columns` renames heads, and others are not
    read then.
    """
    from tolstat.study.data_files import named_column, read_data, si_factor

    keys = setup.document.reference
    entry = schema.read_entry(schema.ReferenceEntry, keys, "there is")
    table = read_data(setup.folder, entry, [*entry.columns.values()])
    columns = {head: (head, unit) for head, unit in table.units.items()}
    if entry.columns:
        columns = {n: named_column(table, n, head) for n, head in entry.columns.items()}
    units = {axis.name: axis.unit for axis in swept if axis.words is None}
    if (first := next(iter(columns))) not in units:
        raise DataError(
            f"{table.path}: the first column, '{first}', must be swept by [grid]; "
            f"{allowed_names(first, units)}"
        )
    units |= {response.name: response.unit for response in setup.description.responses}
    if wrong := [name for name in columns if name not in units]:
        allowed = allowed_names(wrong[0], units)
        raise DataError(f"{table.path}, column {wrong[0]}: {allowed}")
    return entry.label, {
        name: si_factor(table, head, written, units[name]) * table.column(head)
        for name, (head, written) in columns.items()
    }

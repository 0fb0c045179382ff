"""A grid run as curves: a response over one axis, a curve for each other setting."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import QuestionError, allowed_names
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

TAKEN = "settings."  # before an axis whose name a contributor has too


class Sweep(NamedTuple):
    """One curve."""

    label: str  # what is the same along it: the other axes of the grid
    at: dict[str, Any]  # the same as values, SI, by axis
    x: Array  # float64[point], the swept values; words by number, see `words_along`
    y: Array  # float64[point], the response, SI; NaN where a trial failed


def swept_axis(run: Run) -> str:
    """Return the axis of the grid with most numbers, else with most words.

    Raises
    ------
    QuestionError
        If the run is no grid, or has no axis of two values.
    """
    if not run.grid:
        raise QuestionError(
            f'{run.path}: only a run with sampling = "grid" is shown as curves'
        )
    counts = {name: len(set(_values(run, name).tolist())) for name in run.grid}
    several = [name for name in run.grid if counts[name] > 1]
    if not several:
        raise QuestionError(f"{run.path}: nothing in its grid has two values or more")
    return max(several, key=lambda n: (_values(run, n).dtype.kind == "f", counts[n]))


def words_along(run: Run, axis: str) -> list[str]:
    """Return the words along an axis, in their order; none where it has numbers."""
    values = _values(run, axis)
    return [] if values.dtype.kind == "f" else list(dict.fromkeys(values.tolist()))


def places(run: Run, axis: str) -> Array:
    """Return where trials stand along an axis, SI; words by their number."""
    values, words = _values(run, axis), words_along(run, axis)
    numbers = [words.index(word) for word in values.tolist()] if words else values
    return np.array(numbers, dtype=float)


def sweeps(run: Run, axis: str, response: str) -> list[Sweep]:
    """Return the curves of a grid run along an axis, one for each other combination.

    Raises
    ------
    QuestionError
        If the run has no such response.
    """
    names = [each.name for each in run.responses]
    if response not in names:
        raise QuestionError(
            f"no response '{response}'; {allowed_names(response, names)}"
        )
    others = [name for name in run.grid if name != axis]
    x, y = places(run, axis), run.column(response)
    columns = [_values(run, name).tolist() for name in others]
    trials_at: dict[tuple[Any, ...], list[int]] = {}
    for trial in range(run.trials):
        trials_at.setdefault(tuple(each[trial] for each in columns), []).append(trial)
    curves = []
    for values, trials in trials_at.items():
        at = dict(zip(others, values, strict=True))
        rows = np.array(trials)[np.argsort(x[trials], kind="stable")]
        curves.append(Sweep(_label(run, at), at, x[rows], y[rows]))
    return curves


def responses_of_interest(run: Run) -> list[str]:
    """Return the responses with a reference or a limit."""
    columns = run.reference.columns if run.reference else ()
    referenced = [name for name in columns if name in run.units][1:]
    limited = [name for name in run.limits if name not in referenced]
    return [*referenced, *limited]


def point_words(run: Run, trial: int) -> str:
    """Return where a trial stands in the grid; of a table its number."""
    values = {name: _values(run, name).tolist()[trial] for name in run.grid}
    return _label(run, values) or f"trial {trial}"


def axis_scale(run: Run, axis: str) -> Scale:
    """Return how an axis of the grid is shown."""
    return run.scales[_moved(run, axis)]


def _values(run: Run, axis: str) -> Array:
    return run.column(_moved(run, axis))


def _moved(run: Run, axis: str) -> str:
    """Return the first column that an axis of the grid moved."""
    columns = [column.name for column in run.swept]
    columns += [column.name for column in run.contributors]
    if axis in columns:
        return axis
    return next(name for name in columns if name.rpartition("_")[0] == axis)


def _label(run: Run, values: Mapping[str, Any]) -> str:
    words = []
    for name, value in values.items():
        if not isinstance(value, str):
            scale = axis_scale(run, name)
            value = f"{scale.factor * value:.6g} {scale.mark}".strip()
        words.append(f"{name.removeprefix(TAKEN)} {value}")
    return ", ".join(words)

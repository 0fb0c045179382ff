"""A grid run as curves: a response over what was swept, one curve a machine."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import PictureError, allowed_names
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

Array = NDArray[np.float64]


class Sweep(NamedTuple):
    """One curve."""

    label: str  # what is the same along it: the other axes of the grid
    at: dict[str, Any]  # the same as values, SI, by axis
    x: Array  # float64[point], what was swept; words by number, see `words_along`
    y: Array  # float64[point], the response, SI; NaN where a trial failed


def swept_axis(run: Run) -> str:
    """Choose what goes along the axis: what has most numbers, else most words.

    Raises
    ------
    PictureError
        If the run is no grid, or has no axis of two values.
    """
    if not run.grid:
        raise PictureError(
            f'{run.path}: only a run with sampling = "grid" is shown as curves'
        )
    counts = {name: len(set(_values(run, name).tolist())) for name in run.grid}
    several = [name for name in run.grid if counts[name] > 1]
    if not several:
        raise PictureError(f"{run.path}: nothing in its grid has two values or more")
    return max(several, key=lambda n: (_values(run, n).dtype.kind == "f", counts[n]))


def words_along(run: Run, axis: str) -> list[str]:
    """List the words that go along an axis, as they come; none where it has numbers."""
    values = _values(run, axis)
    return [] if values.dtype.kind == "f" else list(dict.fromkeys(values.tolist()))


def sweeps(run: Run, axis: str, response: str) -> list[Sweep]:
    """Cut a grid run into curves along an axis: one for each combination of the others.

    Raises
    ------
    PictureError
        If the run has no such response.
    """
    names = [each.name for each in run.responses]
    if response not in names:
        raise PictureError(
            f"no response '{response}'; {allowed_names(response, names)}"
        )
    others = [name for name in run.grid if name != axis]
    x, y = _values(run, axis), run.column(response)
    if words := words_along(run, axis):
        x = np.array([words.index(word) for word in x.tolist()], dtype=float)
    labels = np.array([_label(run, others, i) for i in range(run.trials)])
    found = []
    for label in dict.fromkeys(labels.tolist()):
        rows = np.flatnonzero(labels == label)
        rows = rows[np.argsort(x[rows], kind="stable")]
        at = {name: _values(run, name)[rows[0]] for name in others}
        found.append(Sweep(label, at, x[rows], y[rows]))
    return found


def members(run: Run, name: str) -> list[str]:
    """List the columns that an axis of the grid moved."""
    known = [each.name for each in run.swept]
    known += [each.name for each in run.contributors]
    if name in known:
        return [name]
    return [each for each in known if each.rpartition("_")[0] == name]


def axis_scale(run: Run, name: str) -> Scale:
    """Return how an axis of the grid is shown."""
    return run.scales[members(run, name)[0]]


def _values(run: Run, name: str) -> NDArray[np.float64]:
    return run.column(members(run, name)[0])


def _label(run: Run, names: list[str], trial: int) -> str:
    words = []
    for name in names:
        value = _values(run, name)[trial]
        if isinstance(value, str):
            words.append(f"{name} {value}")
        else:
            scale = axis_scale(run, name)
            words.append(f"{name} {scale.factor * value:.6g} {scale.mark}".strip())
    return ", ".join(words)

"""How a run lies in its file.

At the root one dataset for each contributor and response and for status and steps,
with unit and sentence as attributes and `trial` as dimension scale; the nominal
machine, which is no trial, in the group `nominal`; everything about the run as a whole
in the attributes of the root. A grid has its swept settings as further datasets, and
known points to compare with in the group `reference`. Trials that were integrated a
second time, more precisely, lie in the group `audit`. All datasets are contiguous and
allocated when the file is made: afterwards only raw data change, and a kill cannot
tear the file.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.machines.description import Contributor, Response
from tolstat.status import WORDS

FORMAT = 1
TRIAL, STATUS, STEPS, NOMINAL = "trial", "status", "steps", "nominal"
REFERENCE = "reference"  # group of known points to be shown beside a grid
SETTING = "setting"  # role of a setting that a grid changes
DEMANDED = "demanded_yield"  # attribute beside it: share of machines within
TOLERANCE = "tolerance"  # attribute of a contributor that deviates: its ends, SI
ASSUMED = "assumed"  # attribute beside it: its distribution, in words
BATCH = "batch"  # attribute of a part that is as all parts of its batch
PART = "part"  # attribute of a contributor: the kind of part it belongs to
AUDIT = "audit"  # group of trials integrated again, more precisely
LIMIT = "limit"  # attribute of a response: least and greatest permitted value, SI


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once.

    Parameters
    ----------
    group : h5py.Group
        Where.
    name : str
        Of the dataset.
    shape : tuple of int
        Empty for one number.
    dtype
        NumPy type; floating numbers start as NaN, integers as 0.
    """
    fill = np.full((), np.nan if np.dtype(dtype).kind == "f" else 0, dtype)
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.CONTIGUOUS)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_ALLOC)
    plan.set_fill_value(fill)
    space = h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(np.dtype(dtype))
    made = h5py.h5d.create(group.id, name.encode(), kind, space, dcpl=plan)
    return h5py.Dataset(made)


def describe(dataset: h5py.Dataset, what: Contributor | Response, role: str) -> None:
    """Attach unit, symbol, sentence and source to a dataset."""
    dataset.attrs["role"] = role
    dataset.attrs["units"] = what.unit
    dataset.attrs["symbol"] = what.symbol
    dataset.attrs["long_name"] = what.sentence
    dataset.attrs["source"] = what.source
    if isinstance(what, Contributor) and what.part:
        dataset.attrs[PART] = what.part


def lay_out(
    file: h5py.File,
    trials: int,
    contributors: tuple[Contributor, ...],
    responses: tuple[Response, ...],
) -> None:
    """Make every dataset of a run."""
    index = allocate(file, TRIAL, (trials,), np.int64)
    index[...] = np.arange(trials)
    index.attrs["long_name"] = "number of the trial"
    index.make_scale(TRIAL)
    nominal = file.create_group(NOMINAL)
    nominal.attrs["long_name"] = "the machine without deviations; it is no trial"
    roles = [(c, "contributor") for c in contributors] + [
        (r, "response") for r in responses
    ]
    for what, role in roles:
        column = allocate(file, what.name, (trials,), np.float64)
        describe(column, what, role)
        column.dims[0].attach_scale(index)
        describe(allocate(nominal, what.name, (), np.float64), what, role)
    for group, shape in ((file, (trials,)), (nominal, ())):
        status = allocate(group, STATUS, shape, np.uint8)
        status.attrs["long_name"] = "how the trial ended"
        status.attrs["flag_values"] = np.arange(len(WORDS), dtype=np.uint8)
        status.attrs["flag_meanings"] = " ".join(
            word.replace(" ", "_") for word in WORDS
        )
        steps = allocate(group, STEPS, shape, np.int64)
        steps.attrs["long_name"] = "integration steps, rejected ones included"
        if shape:
            status.dims[0].attach_scale(index)
            steps.dims[0].attach_scale(index)


def lay_out_audit(
    file: h5py.File, trials: NDArray[np.int64], responses: tuple[Response, ...]
) -> h5py.Group:
    """Make the datasets of trials that are integrated again."""
    group = file.create_group(AUDIT)
    group.attrs["long_name"] = "trials integrated again with a smaller rtol"
    allocate(group, TRIAL, trials.shape, np.int64)[...] = trials
    for response in responses:
        column = allocate(group, response.name, trials.shape, np.float64)
        column.attrs["units"] = response.unit
    allocate(group, STATUS, trials.shape, np.uint8)
    return group


def lay_out_setting(
    file: h5py.File, name: str, values: NDArray[Any], unit: str, sentence: str
) -> None:
    """Make and fill the dataset of a setting that is not the same in all trials."""
    if values.dtype.kind == "U":
        values = np.char.encode(values, "utf-8")
    column = allocate(file, name, values.shape, values.dtype)
    column[...] = values
    column.attrs["role"] = SETTING
    column.attrs["units"] = unit
    column.attrs["long_name"] = sentence
    column.dims[0].attach_scale(file[TRIAL])

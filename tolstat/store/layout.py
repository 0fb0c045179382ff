"""How a run lies in its file.

At the root one dataset for each contributor and response, for status and, where
something is integrated, for steps, with unit and sentence as attributes and `trial` as
dimension scale; the nominal machine, which is no trial, in the group `nominal`; the
settings, as written, in the group `settings`, numbers of the study, alike for all its
machines, in the group `numbers`; everything about the run as a whole in
the attributes of the root. A grid has its swept settings as further datasets, and known
points to compare with in the group `reference`. A rare run has four further datasets
that say how each trial was drawn. All these datasets are contiguous and
allocated when the file is made: while trials run only the bytes of rows change, and a
kill cannot tear the file. The group `checks` holds a checksum of each trial, written
before its status, one of the nominal machine, the seal of all that is no row, and how
long the run took so far. What is known at the end lies in the groups `audit` (trials
evaluated again, more precisely), `rerun` (failed trials, likewise) and `evidence`; they
come with the whole file, written aside and renamed: a file with `evidence` is complete.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.store.plan import Plan
from tolstat.store.run_columns import (
    SHOWN,
    describe,
    write_assumed,
    write_limit,
    write_words,
)
from tolstat.store.seal import length_of

TRIAL, STATUS, STEPS = "trial", "status", "steps"
# groups
NOMINAL, SETTINGS, REFERENCE = "nominal", "settings", "reference"
NUMBERS = "numbers"
AUDIT, RERUN, EVIDENCE = "audit", "rerun", "evidence"
CHECKS = "checks"
CHECKSUM, ALONE = f"{CHECKS}/trial", f"{CHECKS}/nominal"  # of a trial, of the nominal
CLOCK = f"{CHECKS}/clock"
SEAL = f"{CHECKS}/seal"
SWEPT = "setting"  # role of a setting that a grid changes
# how the trials of a rare run were drawn; no response can be called so
STAGE, SPREAD, DISTANCE, WEIGHT = (
    "rare-stage", "rare-spread", "rare-distance", "rare-weight",
)  # fmt: skip
DRAWN = {
    STAGE: "stage that the trial belongs to; -1 before it is drawn",
    SPREAD: "times the spread of the study that the stage aimed at",
    DISTANCE: "distance from the middle machine, in normal scores",
    WEIGHT: "density in the study over that in the stage; NaN where only sought",
}


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.CONTIGUOUS)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(np.dtype(dtype))
    made = h5py.h5d.create(group.id, name.encode(), kind, space, dcpl=plan)
    return h5py.Dataset(made)


def lay_out(file: h5py.File, plan: Plan, trials: int) -> None:
    """Make the datasets of the first planned trials; rows are filled in by others."""
    contributors, responses = plan.description
    _lay_out_checks(file.create_group(CHECKS), plan, trials)
    index = allocate(file, TRIAL, (trials,), np.int64)
    index[...] = np.arange(trials)
    index.attrs["long_name"] = "number of the trial"
    index.make_scale(TRIAL)
    nominal = file.create_group(NOMINAL)
    nominal.attrs["long_name"] = "the machine without deviations; it is no trial"
    for contributor in contributors:
        shown = plan.shown.get(contributor.name)
        column = _column(file, contributor.name, trials)
        describe(column, contributor, shown)
        if assumed := plan.assumed.get(contributor.name):
            write_assumed(column, assumed)
        alone = allocate(nominal, contributor.name, (), np.float64)
        alone[...] = 0.0
        describe(alone, contributor, shown)
    for response in responses:
        shown = plan.shown.get(response.name)
        column = _column(file, response.name, trials)
        describe(column, response, shown)
        if limit := plan.limits.get(response.name):
            write_limit(column, limit)
        describe(allocate(nominal, response.name, (), np.float64), response, shown)
    for group, shape in ((file, (trials,)), (nominal, ())):
        _lay_out_status(group, shape, plan)
    for name, swept in plan.swept.items():
        column = _column(file, name, trials, encoded(swept.values).dtype)
        column.attrs["role"] = SWEPT
        column.attrs["units"], column.attrs["long_name"] = swept.unit, swept.sentence
        if swept.shown:
            column.attrs[SHOWN] = swept.shown
    for name in plan.drawn:
        column = _column(file, name, trials)
        column.attrs["units"], column.attrs["long_name"] = "1", DRAWN[name]


def _column(
    file: h5py.File, name: str, trials: int, dtype: Any = np.float64
) -> h5py.Dataset:
    """Make a dataset with a value for each trial."""
    column = allocate(file, name, (trials,), dtype)
    column.dims[0].attach_scale(file[TRIAL])
    return column


def encoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as a file holds them."""
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values


def decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values that a file holds; half a character is no reason to refuse it."""
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values


def _lay_out_checks(group: h5py.Group, plan: Plan, trials: int) -> None:
    """Make the datasets of checksums; the seal first, near the file's beginning."""
    group.attrs["long_name"] = "what tells whether the file is as it was written"
    contributors, responses = plan.description
    columns = len(contributors) + 2 * len(responses) + len(plan.swept) + 8
    columns += len(plan.drawn)
    allocate(file := group.file, SEAL, (), f"S{length_of(columns)}")
    each = allocate(file, CHECKSUM, (trials,), np.uint64)
    each.attrs["long_name"] = "checksum of all that is stored of a trial; 0 for none"
    alone = allocate(file, ALONE, (), np.uint64)
    alone.attrs["long_name"] = "checksum of the nominal machine"
    clock = allocate(file, CLOCK, (3,), np.float64)
    clock.attrs["long_name"] = "seconds the run took so far, last written at, checksum"


def _lay_out_status(group: h5py.Group, shape: tuple[int, ...], plan: Plan) -> None:
    """Make the datasets of how trials ended."""
    status = allocate(group, STATUS, shape, np.uint8)
    write_words(status, plan.words)
    columns = [status]
    if plan.integrates:
        columns.append(allocate(group, STEPS, shape, np.int64))
        columns[-1].attrs["long_name"] = "integration steps, rejected ones included"
    for column in columns if shape else ():
        column.dims[0].attach_scale(group[TRIAL])

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

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.model.description import Contributor, Response
from tolstat.store.attributes import write_texts
from tolstat.store.plan import Chosen, Plan, Stopped
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
# attributes of a column
SHOWN = "shown"  # the unit in which the study writes it, or the machine declares it
LIMIT = "limit"  # least and greatest permitted value, SI
WRITTEN = "limit_as_written"
DEMANDED = "demanded_yield"  # share of machines within
RANGE = "valid_range"  # what a response can never lie beyond; as netCDF has it
TOLERANCE = "tolerance"  # its ends, SI
ASSUMED = "assumed"  # its distribution, in words
BATCH = "batch"  # whose parts are all alike
PART = "part"  # the kind of part it belongs to
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
RARE = "rare"  # attribute: the response that it is about
# of the status
WORDS, CODES = "words", "flag_values"


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
        column = allocate(file, contributor.name, (trials,), np.float64)
        column.dims[0].attach_scale(index)
        _describe(column, contributor, plan)
        if assumed := plan.assumed.get(contributor.name):
            column.attrs[TOLERANCE] = assumed.tolerance
            column.attrs[ASSUMED] = assumed.words
            column.attrs["mean"], column.attrs["sigma"] = assumed.mean, assumed.sigma
            if assumed.batch:
                column.attrs[BATCH] = assumed.batch
        alone = allocate(nominal, contributor.name, (), np.float64)
        alone[...] = 0.0
        _describe(alone, contributor, plan)
    for response in responses:
        column = allocate(file, response.name, (trials,), np.float64)
        column.dims[0].attach_scale(index)
        _describe(column, response, plan)
        if limit := plan.limits.get(response.name):
            column.attrs[LIMIT] = limit.permitted
            column.attrs[WRITTEN], column.attrs[DEMANDED] = limit.words, limit.demanded
        _describe(allocate(nominal, response.name, (), np.float64), response, plan)
    for group, shape in ((file, (trials,)), (nominal, ())):
        _lay_out_status(group, shape, plan)
    for name, swept in plan.swept.items():
        column = allocate(file, name, (trials,), encoded(swept.values).dtype)
        column.attrs["role"] = SWEPT
        column.attrs["units"], column.attrs["long_name"] = swept.unit, swept.sentence
        if swept.shown:
            column.attrs[SHOWN] = swept.shown
        column.dims[0].attach_scale(index)
    for name in plan.drawn:
        column = allocate(file, name, (trials,), np.float64)
        column.attrs["units"], column.attrs["long_name"] = "1", DRAWN[name]
        column.dims[0].attach_scale(index)
    _lay_out_settings(file.create_group(SETTINGS, track_order=True), plan.settings)
    if plan.numbers:
        group = file.create_group(NUMBERS, track_order=True)
        group.attrs["long_name"] = "numbers of the study, alike for all its machines"
        for number in plan.numbers:
            alone = allocate(group, number.name, (), np.float64)
            alone[...] = number.value
            alone.attrs["units"], alone.attrs["long_name"] = (
                number.unit,
                number.sentence,
            )
            alone.attrs[SHOWN], alone.attrs["of"] = number.shown, number.of
            alone.attrs["caveat"] = number.caveat
    if plan.reference:
        group = file.create_group(REFERENCE, track_order=True)
        group.attrs["label"] = plan.reference.label
        for name, values in plan.reference.columns.items():
            group[name] = values


def encoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as a file holds them."""
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values


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


def _describe(dataset: h5py.Dataset, what: Contributor | Response, plan: Plan) -> None:
    """Attach unit, symbol, sentence and source to a dataset."""
    attrs = dataset.attrs
    attrs["role"] = "contributor" if isinstance(what, Contributor) else "response"
    attrs["units"], attrs["symbol"] = what.unit, what.symbol
    attrs["long_name"], attrs["source"] = what.sentence, what.source
    if shown := plan.shown.get(what.name) or what.shown:
        attrs[SHOWN] = shown
    if isinstance(what, Response) and what.range:
        attrs[RANGE] = what.range
    if isinstance(what, Contributor) and what.part:
        attrs[PART] = what.part


def _lay_out_status(group: h5py.Group, shape: tuple[int, ...], plan: Plan) -> None:
    """Make the datasets of how trials ended."""
    status = allocate(group, STATUS, shape, np.uint8)
    status.attrs["long_name"] = "how the trial ended"
    status.attrs[CODES] = np.array(list(plan.words), dtype=np.uint8)
    write_texts(status, WORDS, list(plan.words.values()))
    # as the CF conventions have it, for xarray: one text, which nothing here reads
    status.attrs["flag_meanings"] = " ".join(
        word.replace(" ", "_") for word in plan.words.values()
    )
    columns = [status]
    if plan.integrates:
        columns.append(allocate(group, STEPS, shape, np.int64))
        columns[-1].attrs["long_name"] = "integration steps, rejected ones included"
    for column in columns if shape else ():
        column.dims[0].attach_scale(group[TRIAL])


def _lay_out_settings(group: h5py.Group, settings: Mapping[str, Chosen]) -> None:
    """Store settings as they are written."""
    group.attrs["long_name"] = "settings of the machine, as the study writes them"
    for name, chosen in settings.items():
        group[name] = chosen.words
        group[name].attrs["long_name"] = chosen.sentence
        group[name].attrs["given"] = chosen.given


def write_facts(
    file: h5py.File, plan: Plan, path: Path, stopped: Stopped | None
) -> None:
    """Store what is known of the run as a whole, whose file will have this path."""
    attrs = file.attrs
    attrs["study"] = plan.study_text
    if plan.study_file:  # from here: both may be moved together
        attrs["study_file"] = os.path.relpath(plan.study_file, path.parent)
    attrs["title"], attrs["model"] = plan.title, plan.model
    attrs["sampling"], attrs["source_digest"] = plan.sampling, plan.source_digest
    attrs["machine"] = plan.machine
    contributors, responses = plan.description
    # the order of the columns: HDF5 lists names by alphabet
    write_texts(file, "contributors", [each.name for each in contributors])
    write_texts(file, "responses", [each.name for each in responses])
    write_texts(file, "grid", plan.grid)
    write_texts(file, "notes", plan.notes)
    write_texts(file, "assumptions", plan.assumptions)
    if plan.sampled:
        attrs["seed"], attrs["promise"] = plan.sampled.seed, plan.sampled.promise
        attrs["replicates"] = plan.sampled.replicates
        attrs["group"] = plan.sampled.group
        write_texts(file, "factors", plan.sampled.factors)
    if plan.rare:
        attrs[RARE] = plan.rare
    write_texts(file, "until", plan.rules)
    if stopped:
        attrs["until_reached"], attrs["until_stages"] = stopped.reached, stopped.stages
        attrs["at_most"], attrs["until_wanted"] = stopped.at_most, stopped.wanted

"""How a run lies in its file.

At the root one dataset for each contributor, response and swept setting, for status
and, where something is integrated, for steps, with unit and sentence as attributes and
`trial` as dimension scale; its sampler may add how each was drawn. All these are
contiguous and allocated when the file is made: while trials run only the bytes of rows
change, and a kill cannot tear the file. The nominal machine, which is no trial, lies in
the group `nominal`. The group `checks` holds a checksum of each trial, written before
its status, one of the nominal machine, the seal of all that is no row, and how long the
run took so far.

What else a run says lies as `codec` writes the fields of `Run`. What is known at the
end comes with the whole file, written aside and renamed.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

TRIAL, STATUS, STEPS = "trial", "status", "steps"
NOMINAL = "nominal"  # a group
CHECKS = "checks"  # a group
CHECKSUM, ALONE = f"{CHECKS}/trial", f"{CHECKS}/nominal"  # of a trial, of the nominal
CLOCK = f"{CHECKS}/clock"
SEAL = f"{CHECKS}/seal"


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, sentence: str = ""
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.CONTIGUOUS)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(np.dtype(dtype))
    made = h5py.Dataset(
        h5py.h5d.create(group.id, name.encode(), kind, space, dcpl=plan)
    )
    if sentence:
        made.attrs["long_name"] = sentence
    return made


def encoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as a file holds them."""
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values


def decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values that a file holds; half a character is no reason to refuse it."""
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values

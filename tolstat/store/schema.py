"""What a run file holds, checked before anything in it is read: it may be a stranger's.

HDF5 follows links and external files, fills what was never written, and ends the
process over some datasets. So only what tolstat writes is read: groups and datasets by
hard links, of the types and dimensions of `SCHEMA`, contiguous in the file itself, each
byte of it in one dataset at most.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import h5py
from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t

from tolstat.hdf5_heaps import check_sizes
from tolstat.store.integrity import Hole
from tolstat.store.layout import extents_of
from tolstat.store.tables import is_place


class Values(NamedTuple):
    """A dataset: its NumPy types, and how many dimensions it may have."""

    types: str
    dimensions: tuple[int, ...] = (1,)


MOST_ATTRIBUTES = 20_000  # of a group; reading more takes seconds
MOST_ITEMS = 60_000  # in a group


class Place(NamedTuple):
    """Where a dataset lies, bytes."""

    first: int
    stop: int
    path: str


class Group(dict[str, Any]):
    """A group: what it may hold by name; "*" is any other name."""


NUMBERS, TEXTS = Values("f8"), Group({"*": Group()})
INDEX = Values("i8")  # the dimension of a list
TABLE = Group({"*": Values("f8 i8 b1 text", (1, 2, 3))})
AUDITED = {
    "trials": Values("i8"), "status": Values("u1"), "at_random": Values("b1"),
    "settings": Group(), "responses": Group({"*": NUMBERS}),
    "chosen_by": Group({"*": Values("u1")}),
}  # fmt: skip
AUDIT = Group({**AUDITED, "third": Group(AUDITED)})
SCHEMA = Group({
    "*": Values("f8 i8 u1 S"),  # a column
    "trial": Values("i8"), "status": Values("u1"), "steps": Values("i8"),
    "checks": Group({
        "checksum": Values("u8"), "nominal": Values("u8", (0,)), "clock": NUMBERS,
    }),
    "nominal": Group({
        "*": Values("f8", (0,)), "status": Values("u1", (0,)),
        "steps": Values("i8", (0,)),
    }),
    "assumed": TABLE, "measured": Group({"*": Group({
        "values": NUMBERS, "order": Values("i8"), "lot": Values("i8"),
    })}),
    "rank-correlation": TABLE, "settings": TEXTS, "numbers": TEXTS,
    "provenance": Group(), "isolation": TEXTS, "title-block": Group(),
    "status-words": Group(),
    "reference": Group({"columns": Group({"*": NUMBERS})}),
    "audit": AUDIT, "rerun": AUDIT,
    "diagnostics": Group({"slopes": TABLE, "worst_cases": TABLE, "halved": TABLE}),
})  # fmt: skip


def check_schema(file: h5py.File, size: int, unsealed: Iterable[Hole]) -> None:
    """Refuse a file that holds anything else, or twice in the same place; ValueError.

    What is not sealed are the user block and rows.
    """
    check_sizes(file)
    places = sorted(_places_of(file.id, SCHEMA, "", size))
    for one, other in pairwise([Place(0, file.userblock_size, "its seal"), *places]):
        if other.first < one.stop:
            raise ValueError(f"{other.path} lies where {one.path} does")
    rows = {extent.hole for extent in extents_of(file).values()}
    if {*unsealed} - rows - {(0, file.userblock_size)}:
        raise ValueError("its seal leaves out more than rows")


def _places_of(
    group: h5g.GroupID, schema: Group, path: str, size: int
) -> Iterator[Place]:
    """Yield where all datasets in a group lie."""
    if group.get_num_objs() > (MOST_ATTRIBUTES if path else MOST_ITEMS):
        raise ValueError(f"{path or 'its root'} has too many parts")
    for name in group:
        inner = f"{path}/{name.decode(errors='replace')}"
        index = path and is_place(inner[len(path) + 1 :], path)
        others = INDEX if index else schema.get("*")
        expected = schema.get(name.decode(errors="replace"), others)
        if group.links.get_info(name).type != h5l.TYPE_HARD:
            raise ValueError(f"{inner} is a link to another place")
        item = h5o.open(group, name)
        if h5a.get_num_attrs(item) > MOST_ATTRIBUTES:
            raise ValueError(f"{inner} has more than {MOST_ATTRIBUTES} attributes")
        if isinstance(item, h5d.DatasetID) and isinstance(expected, Values):
            yield _place_of(item, expected, inner, size)
        elif isinstance(item, h5g.GroupID) and isinstance(expected, Group):
            yield from _places_of(item, expected, inner, size)
        else:
            raise ValueError(f"{inner} is not of a run")


def _place_of(dataset: h5d.DatasetID, expected: Values, path: str, size: int) -> Place:
    plan = dataset.get_create_plist()  # first: a virtual one is not looked into
    if plan.get_layout() != h5d.CONTIGUOUS or plan.get_external_count():
        raise ValueError(f"{path} does not lie in the file itself")
    kind, space = dataset.get_type(), dataset.get_space()
    if space.get_simple_extent_type() == h5s.NULL:
        raise ValueError(f"{path} has no values")
    if space.get_simple_extent_ndims() not in expected.dimensions:
        raise ValueError(f"{path} has other dimensions")
    if _type_of(kind) not in expected.types.split():
        raise ValueError(f"{path} has values of another type")
    used = space.get_simple_extent_npoints() * kind.get_size()
    offset = dataset.get_offset() if used else size
    if offset is None or not 0 <= offset <= size - used:
        raise ValueError(f"{path} is longer than the file")
    return Place(offset, offset + used, path)


def _type_of(kind: h5t.TypeID) -> str:
    """Return the NumPy type of values, "text" for texts of any length."""
    if kind.get_class() == h5t.STRING:
        return "text" if kind.is_variable_str() else "S"
    if kind.get_class() not in (h5t.INTEGER, h5t.FLOAT, h5t.ENUM):
        return "another"
    dtype = kind.dtype
    return f"{dtype.kind}{dtype.itemsize}" if dtype.isnative else "another"

"""Fields of a record that are stored, and how."""

from functools import cache
from types import NoneType
from typing import Any, NamedTuple, get_args, get_type_hints

NAMES = {"unit": "units", "sentence": "long_name", "range": "valid_range"}  # as in CF
ELSEWHERE = "elsewhere"  # annotation of a field that `codec` does not write
BETWEEN = ", "  # parts of a key


class Stored(NamedTuple):
    """How a field is stored if its type does not say it; used as an annotation."""

    name: str = ""  # its own if empty
    # records of columns are stored among the attributes of these, after this prefix;
    # another attribute lists the columns in order
    columns: str | None = None
    # what the keys of a mapping of mappings are: it is stored as arrays over these
    axes: tuple[str, ...] = ()
    sentence: str = ""  # what these arrays hold


class Field(NamedTuple):
    """A field of a record."""

    name: str
    kind: Any  # its type, without None
    optional: bool
    stored: Stored  # with its name in the file


@cache
def fields_of(record: Any) -> tuple[Field, ...]:
    """Return the fields of a record that are stored."""
    fields = []
    for name, hint in get_type_hints(record, include_extras=True).items():
        notes = getattr(hint, "__metadata__", ())
        if ELSEWHERE in notes:
            continue
        kind = get_args(hint)[0] if notes else hint
        if optional := NoneType in get_args(kind):
            kind = get_args(kind)[0]
        stored = next(iter(notes), Stored())
        if not stored.name:
            stored = stored._replace(name=NAMES.get(name, name))
        fields.append(Field(name, kind, optional, stored))
    return tuple(fields)

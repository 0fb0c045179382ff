"""The keys of a study file and of its tables: type of each, and what is expected."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tolstat.errors import StudyError, allowed_names
from tolstat.study.files import check_bounds, read_toml
from tolstat.study.problems import Problems, toml_of

MOST_SEED = 2**64 - 1
MOST_TRIALS = 10_000_000  # of a grid
LEAST_PRICE, MOST_PRICE = 1e-30, 1e30
TitleKey = Literal["project", "drawing", "revision", "author", "approval"]
NO_SUCH_KEY = "a study has no such key; "
MISSING = {
    "model": 'missing; name a machine, such as model = "stand"',
    "trials": "missing; say how many machines to build, such as trials = 4096",
    "seed": "missing; a whole number, such as seed = 75: it makes the run repeatable",
}
UNTIL = '{ until = "extra_loss p95 +-2 %", at_most = 200000 }'
AXIS = '{ from = "0 mm", to = "3 mm", points = 61 } or a list ["0 mm", "1 mm"]'


class Entry(BaseModel):
    """A table of a study; the description of a key says what is expected of it."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Document(Entry):
    """A study file before its names and quantities are read."""

    model: str = Field(description="the name of a machine is expected, in quotes")
    title: str = Field("", description="a text is expected")
    document: dict[TitleKey, str] = Field(
        {},
        description='a text in quotes is expected, such as revision = "B"; in '
        f"[document] may stand {', '.join(get_args(TitleKey))}",
    )
    trials: Annotated[int, Field(ge=1)] | dict[str, Any] | None = Field(
        None,
        description="a whole number from 1 is expected, or a stopping rule such as "
        f"{UNTIL}",
    )
    seed: int | None = Field(
        None, ge=0, le=MOST_SEED,
        description=f"a whole number from 0 to {MOST_SEED} is expected",
    )  # fmt: skip
    sampling: str | dict[str, Any] = Field(
        "random",
        description="the name of a sampling is expected, in quotes, or of what is "
        'rare: { rare = "extra_loss" }',
    )
    table: str | None = Field(
        None,
        description="the name of a CSV file is expected, such as table = "
        '"machines.csv"',
    )
    settings: dict[str, Any] = Field(
        {}, description="a table of settings is expected: in each line name = value"
    )
    links: dict[str, str | int | float | dict[str, Any]] = Field(
        {},
        description='a link is expected, such as { nominal = "60 mm", tolerance = '
        '"+-0.015 mm" }, or "2 mm" for one that does not deviate',
    )
    deviations: dict[str, str | dict[str, Any]] = Field(
        {},
        description='a tolerance such as "+-1.2 mm" or { tolerance = "+-1.2 mm", '
        "cp = 1.33 } is expected",
    )
    correlation: dict[str, dict[str, float]] = Field(
        {},
        description="a table of rank correlations is expected, such as "
        "{ rod_length_2 = 0.6 }",
    )
    grid: dict[str, Any] = Field(
        {},
        description="a table of contributors or settings and their values is expected",
    )
    reference: dict[str, Any] = Field(
        {},
        description='a table such as { data = "points.csv", label = "measured" } is '
        "expected",
    )
    limits: dict[str, str | dict[str, Any]] = Field(
        {},
        description='a limit such as "<= 3 %" or { limit = "<= 3 %", yield = "99 %" } '
        "is expected",
    )


class UntilEntry(Entry):
    """The key `trials` as a stopping rule."""

    until: str | Annotated[list[str], Field(min_length=1)] = Field(
        description=f"a rule or a list of them is expected: {UNTIL}"
    )
    at_most: int = Field(
        ge=1, description=f"a whole number from 1 is expected: {UNTIL}"
    )


class RareEntry(Entry):
    """The key `sampling`, where it names the response whose limit is sought."""

    rare: str = Field(
        min_length=1,
        description='a response with a limit is expected, such as { rare = "yaw" }',
    )


class LimitEntry(Entry):
    """A limit, and what is demanded of it."""

    limit: str = Field(description='a text is expected, such as "<= 3 %"')
    demanded: str | None = Field(
        None, alias="yield", description='a text is expected, such as "99 %"'
    )
    ppk: float | None = Field(
        None, description="a number is expected, such as ppk = 1.33"
    )
    ppm: float | None = Field(
        None, description="a number is expected, such as ppm = 100"
    )


class PartsEntry(Entry):
    """Measured parts of a contributor."""

    data: str = Field(description="the name of a CSV file is expected, in quotes")
    column: str = Field(description="the name of a column is expected, in quotes")
    unit: str | None = Field(None, description='a text is expected, such as "mm"')
    nominal: str | None = Field(
        None, description='a text is expected, such as "2450 mm"'
    )
    fit: Literal["normal", "lognormal"] | None = Field(
        None, description="one of normal, lognormal is expected"
    )


class AxisEntry(Entry):
    """Values of a grid between two ends."""

    first: str | int | float = Field(
        alias="from", description=f"from, to and points are expected: {AXIS}"
    )
    last: str | int | float = Field(
        alias="to", description=f"from, to and points are expected: {AXIS}"
    )
    points: int = Field(
        ge=2, le=MOST_TRIALS,
        description=f"a whole number from 2 is expected, at most {MOST_TRIALS}",
    )  # fmt: skip


class ReferenceEntry(Entry):
    """Known points of a publication or a measurement."""

    data: str = Field(description="the name of a CSV file is expected, in quotes")
    label: str = Field(description='a text is expected, such as "measured"')


class Reciprocal(Entry):
    """A price by tolerance: reciprocal to its width."""

    law: Literal["reciprocal", "exponential"] = Field(
        description="one of reciprocal, exponential is expected"
    )
    at: str = Field(description='a tolerance such as "+-0.02 mm" is expected')
    price: float = Field(
        ge=LEAST_PRICE, le=MOST_PRICE,
        description="a price is a number above 0, such as 10",
    )  # fmt: skip
    tightest: str | None = Field(
        None, description='a tolerance such as "+-0.005 mm" is expected'
    )
    loosest: str | None = Field(
        None, description='a tolerance such as "+-0.04 mm" is expected'
    )


class Exponential(Reciprocal):
    """A price by tolerance: e times as much for each `rate` that it is tighter."""

    rate: str = Field(description='a quantity such as "0.01 mm" is expected')


Kind = TypeVar("Kind", bound=Entry)


def read_entry(kind: type[Kind], given: Mapping[str, Any], what: str) -> Kind:
    """Read a table; refuse the first key that is unknown, missing or of another type.

    `what` begins the sentence about an unknown one: "a limit has".
    """
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        found = error.errors()
    wrong = min(found, key=lambda each: each["type"] != "extra_forbidden")
    key = str(wrong["loc"][0])
    expected = {f.alias or name: f.description for name, f in kind.model_fields.items()}
    if wrong["type"] == "extra_forbidden":
        raise StudyError(f"{what} no key {key}; {allowed_names(key, expected)}")
    if wrong["type"] == "missing":
        raise StudyError(f"the key {key} is missing; {expected[key]}")
    raise StudyError(f"{key} = {toml_of(given[key])}: {expected[key]}")


def read(
    source: Path | Mapping[str, Any], problems: Problems, **typed: int | None
) -> tuple[str, Document]:
    """Read a study and check its keys; return its text and content.

    Trials and seed that the caller gives stand instead of its own.
    """
    text, table = read_toml(source)
    table |= {key: value for key, value in typed.items() if value is not None}
    return text, _checked(table, problems)


def check_section(section: str, entries: object, problems: Problems) -> None:
    """Refuse entries given in Python that no section of a study can have."""
    _checked({"model": "", section: entries}, problems)


def _checked(table: dict[str, Any], problems: Problems) -> Document:
    check_bounds(table, problems)
    problems.raise_if_any()
    try:
        return Document.model_validate(table)
    except ValidationError as error:
        # of a value that may be of several types each refuses it
        wrong = {_place(each["loc"], table): each["type"] for each in error.errors()}
    for (section, *inner), kind in wrong.items():
        key, value = section, table.get(section)
        if inner:
            key, value = f"[{section}] {inner[0]}", table[section][inner[0]]
        if kind == "missing":
            problems.add(key, None, MISSING[section])
        elif kind == "extra_forbidden":
            known = allowed_names(section, Document.model_fields)
            problems.add(key, None, NO_SUCH_KEY + known)
        elif kind == "literal_error":
            known = allowed_names(inner[0], get_args(TitleKey))
            problems.add(key, None, NO_SUCH_KEY + known)
        else:
            expected = Document.model_fields[section].description
            problems.add(key, value, f"{expected}")
    problems.raise_if_any()
    raise AssertionError("a problem was noted")


def _place(where: tuple[Any, ...], table: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return section and name of a value that pydantic refuses; not which type did."""
    section, *inner = where
    named = bool(inner) and isinstance(table.get(section), dict)
    return where[: 2 if named and inner[0] in table[section] else 1]

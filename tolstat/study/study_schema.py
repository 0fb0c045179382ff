"""The keys of a study file and of its tables: types and expected values."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tolstat.errors import StudyError, allowed_names
from tolstat.study.files import check_bounds
from tolstat.study.problems import Problems, toml_of

MOST_SEED = 2**64 - 1
MOST_TRIALS = 10_000_000  # of a grid
LEAST_PRICE, MOST_PRICE = 1e-30, 1e30
TitleKey = Literal["project", "drawing", "revision", "author", "approval"]
TITLE_KEYS = get_args(TitleKey)
DATA_FILE = (
    "the name of a file in quotes: a table of text such as CSV, XLSX, XLSM, ODS, XLS, "
    "Parquet or HDF5"
)
MISSING = {
    "model": 'missing; name a model, such as model = "stand"',
    "trials": "missing; give the number of trials, such as trials = 4096",
    "seed": "missing; give a whole number, such as seed = 75; it makes runs repeatable",
}
CASES = "cases"  # a section
RESPONSES = "responses"
RESULTS = "results"  # the model whose answers are those of a file, with its rows
TABLES = (
    "gaps",
    "loops",
    RESPONSES,
)  # sections that are settings of the model, tables by name
# for the names of all other sections
DECISIVE = ("model", "settings", "links", *TABLES, CASES)
UNTIL = '{ until = "extra_loss p95 +-2 %", at_most = 200000 }'
Trials = Annotated[int, Field(ge=1)] | Literal["decide"] | dict[str, Any]
AXIS = '{ from = "0 mm", to = "3 mm", points = 61 } or a list ["0 mm", "1 mm"]'


def key(expected: str, default: Any = ..., **more: Any) -> Any:
    """Declare a key and its expected value in words; required without a default."""
    return Field(default, description=expected, **more)


class Entry(BaseModel):
    """A table of a study."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Document(Entry):
    """A study file before its names and quantities are read."""

    model: str = key("the name of a model, in quotes")
    title: str = key("a text", "")
    document: dict[TitleKey, str] = key(
        f'a text in quotes, such as revision = "B"; keys: {", ".join(TITLE_KEYS)}', {}
    )
    trials: Trials | None = key(
        f'a whole number from 1, "decide", or a stopping rule such as {UNTIL}', None
    )
    seed: int | None = key(
        f"a whole number from 0 to {MOST_SEED}", None, ge=0, le=MOST_SEED
    )
    sampling: str | dict[str, Any] = key(
        'the name of a sampling, in quotes, or a response, { rare = "extra_loss" }',
        "random",
    )
    longest_trial: str | None = key(
        'the time that a trial may last, such as longest_trial = "60 s"', None
    )
    audit: Literal["sure"] | None = key('only audit = "sure"', None)
    table: str | dict[str, Any] | None = key(
        'the name of a file, such as table = "machines.csv"', None
    )
    settings: dict[str, Any] = key("a table of settings, each name = value", {})
    links: dict[str, str | int | float | dict[str, Any]] = key(
        'a link such as { nominal = "60 mm", tolerance = "+-0.015 mm" }, or "2 mm" for '
        "one that does not deviate",
        {},
    )
    gaps: dict[str, str] = key(
        'a formula of links, in quotes, such as play = "housing - shaft"', {}
    )
    loops: dict[str, str] = key(
        'a vector loop, in quotes, such as main = "crank @ phi + rod @ theta - slide @ '
        '0 deg", or near which value an unknown is looked for, such as theta = '
        '"-17 deg"',
        {},
    )
    responses: dict[str, str] = key(
        'what is taken of an output, such as peak = "max force", or the unit of a '
        'column of results, such as stroke = "mm"',
        {},
    )
    deviations: dict[str, str | dict[str, Any]] = key(
        'a tolerance such as "+-1.2 mm" or { tolerance = "+-1.2 mm", cp = 1.33 }', {}
    )
    correlation: dict[str, dict[str, float | dict[str, float]]] = key(
        "a table of rank correlations, such as { rod_length_2 = 0.6 }, or of "
        "Pearson's, such as { rod_length_2 = { pearson = 0.6 } }",
        {},
    )
    cases: dict[str, Any] = key(
        'settings or sizes of links by case, such as cold = { dT = "-40 K" }', {}
    )
    grid: dict[str, Any] = key(
        "a table of contributors or settings and their values", {}
    )
    reference: dict[str, Any] = key(
        'a table such as { data = "points.csv", label = "measured" }', {}
    )
    limits: dict[str, str | dict[str, Any]] = key(
        'a limit such as "<= 3 %" or { limit = "<= 3 %", yield = "99 %" }', {}
    )


class UntilEntry(Entry):
    """The key `trials` as a stopping rule."""

    until: str | Annotated[list[str], Field(min_length=1)] = key(
        f"a rule or a list of them, as in {UNTIL}"
    )
    at_most: int = key(f"a whole number from 1, as in {UNTIL}", ge=1)


class DecideEntry(Entry):
    """The key `trials` of a run that ends when every limit is decided."""

    until: Literal["decide"] = key('"decide"')
    at_most: int | str | None = key(
        'a number of trials, or a time such as "60 s"', None
    )
    slow: bool | None = key(
        "whether few trials are evaluated: true or false; else by the kind of model",
        None,
    )


class RareEntry(Entry):
    """The key `sampling` of a rare study: the response whose limit it is for."""

    rare: str = key('a response with a limit, such as { rare = "yaw" }', min_length=1)


class LimitEntry(Entry):
    """A limit, and its demand."""

    limit: str = key('a text such as "<= 3 %"')
    demanded: str | None = key('a text such as "99 %"', None, alias="yield")
    ppk: float | None = key("a number, for example ppk = 1.33", None)
    ppm: float | None = key("a number, for example ppm = 100", None)


class CorrelationEntry(Entry):
    """A correlation with its kind; one of both."""

    pearson: float | None = key("a number such as pearson = 0.6", None)
    spearman: float | None = key("a number such as spearman = 0.6", None)


COLUMNS = 'heads by name of an input or a response, such as { stroke = "Hub [mm]" }'


class FileEntry(Entry):
    """A file with a table, and what it does not tell about itself."""

    data: str = key(DATA_FILE)
    decimal: Literal[".", ","] | None = key('one of ".", ","', None)
    delimiter: str | None = key('a character such as ";", or "tab" or "space"', None)
    encoding: str | None = key('a text such as "utf-8" or "cp1252"', None)
    sheet: str | None = key("the name of a sheet or of an HDF5 group, in quotes", None)
    rows: dict[str, str] = key(
        'what the rows to read have, by column, such as { id = "Bore 1" }', {}
    )
    no_value: list[str | int | float] | None = key(
        'a list of what cells without a value have, such as [-999, "9.9e37"]', None
    )


class TableEntry(FileEntry):
    """The rows of a file as trials."""

    sampled: Literal["random", "latin", "grid", "unknown"] = key(
        "one of random, latin, grid, unknown", "unknown"
    )
    columns: dict[str, str] = key(COLUMNS, {})
    repeats: bool = key("true if rows with the same numbers are units, too", False)
    # of results from elsewhere alone
    failed: str | None = key("the name of the column that tells failed rows", None)
    done: str | None = key("what that column has in rows that are done", None)


OF_RESULTS = ("failed", "done")  # keys of results from elsewhere


class PartsEntry(FileEntry):
    """Measured parts of a contributor."""

    data: str = key(f"{DATA_FILE}, or DFQ or DFD of Q-DAS")
    column: str = key("the name of a column or a characteristic, in quotes")
    part: str | None = key("the number of a part in a Q-DAS file, in quotes", None)
    unit: str | None = key('a text such as "mm"', None)
    nominal: str | None = key('a text such as "2450 mm"', None)
    holds: Literal["sizes", "deviations"] | None = key("one of sizes, deviations", None)
    fit: Literal["normal", "lognormal"] | None = key("one of normal, lognormal", None)
    # of the drawing, to judge the parts by; trials take the parts as they are
    tolerance: str | None = key('a tolerance such as "+-1.2 mm"', None)
    lots: str | None = key("the name of a column, in quotes", None)
    repeats: bool = key("true if rows pasted again are parts, too", False)


class AxisEntry(Entry):
    """Values of a grid between two ends."""

    first: str | int | float = key(f"from, to and points, as in {AXIS}", alias="from")
    last: str | int | float = key(f"from, to and points, as in {AXIS}", alias="to")
    points: int = key(
        f"a whole number from 2, at most {MOST_TRIALS}", ge=2, le=MOST_TRIALS
    )


class ReferenceEntry(FileEntry):
    """Known points of a publication or a measurement."""

    label: str = key('a text such as "measured"')
    columns: dict[str, str] = key(COLUMNS, {})


class ShiftKeys(Entry):
    """The permitted shift of a nominal: keys of any cost."""

    shift: str | None = key('the permitted shifts, such as "+-0.2 mm"', None)
    shift_price: float = key("a number from 0, such as 5", 0.0, ge=0, le=MOST_PRICE)


class Reciprocal(ShiftKeys):
    """A price by tolerance: a fixed one, and one reciprocal to a power of its width."""

    law: Literal["reciprocal", "exponential"] = key("one of reciprocal, exponential")
    at: str = key('a tolerance such as "+-0.02 mm"')
    price: float = key("a number above 0, such as 10", ge=LEAST_PRICE, le=MOST_PRICE)
    fixed: float = key("a number from 0, such as 2", 0.0, ge=0, le=MOST_PRICE)
    exponent: float = key("a number such as exponent = 2", 1.0, ge=0.1, le=10)
    tightest: str | None = key('a tolerance such as "+-0.005 mm"', None)
    loosest: str | None = key('a tolerance such as "+-0.04 mm"', None)


class Exponential(Reciprocal):
    """A price by tolerance: e times as much for each `rate` that it is tighter."""

    rate: str = key('a quantity such as "0.01 mm"')


Kind = TypeVar("Kind", bound=Entry)


def read_entry(kind: type[Kind], keys: Mapping[str, Any], subject: str) -> Kind:
    """Return a table; refuse the first key that is unknown, missing or of another type.

    `subject` begins the sentence about an unknown one: "a limit has".
    """
    try:
        return kind.model_validate(keys)
    except ValidationError as error:
        errors = error.errors()
    wrong = min(errors, key=lambda error: error["type"] != "extra_forbidden")
    key = str(wrong["loc"][0])
    expected = {
        f.alias or name: f"expected {f.description}"
        for name, f in kind.model_fields.items()
    }
    if wrong["type"] == "extra_forbidden":
        raise StudyError(f"{subject} no key {key}; {allowed_names(key, expected)}")
    if wrong["type"] == "missing":
        raise StudyError(f"the key {key} is missing; {expected[key]}")
    raise StudyError(f"{key} = {toml_of(keys[key])}: {expected[key]}")


def check_section(section: str, entries: object, problems: Problems) -> None:
    """Refuse entries given in Python that no section of a study can have."""
    checked({"model": "", section: entries}, problems)
    problems.raise_if_any()


def checked(
    table: dict[str, Any],
    problems: Problems,
    section_of: Callable[[str, Any, Mapping[str, Any]], str] = lambda *_: "",
) -> Document:
    """Return the keys of a study, checked; those that are wrong are left out.

    `section_of` says where an unknown key, its value and the study belong; empty where
    that is unknown.
    """
    check_bounds(table, problems)
    problems.raise_if_any()
    try:
        return Document.model_validate(table)
    except ValidationError as error:
        # each of several allowed types refuses the value
        wrong = {_value_of(e["loc"], table): e["type"] for e in error.errors()}
    readable = {**table}  # so that all problems are reported at once
    for (section, *inner), kind in wrong.items():
        key, value = section, table.get(section)
        if inner:
            key, value = f"[{section}] {inner[0]}", table[section][inner[0]]
        if kind == "missing":
            problems.add(key, None, MISSING[section])
        elif kind == "extra_forbidden" and (right := section_of(key, value, table)):
            problems.add(key, value, f"it belongs in [{right}], as {right}.{key} = ...")
        elif kind in ("extra_forbidden", "literal_error"):
            allowed = TITLE_KEYS if inner else tuple(Document.model_fields)
            hint = allowed_names([section, *inner][-1], allowed)
            problems.add(key, None, f"a study has no such key; {hint}")
        else:
            expected = Document.model_fields[section].description
            problems.add(key, value, f"expected {expected}")
        value = readable.pop(section, None)
        if inner:
            readable[section] = {k: v for k, v in value.items() if k != inner[0]}
    return Document.model_validate({"model": "", **readable})


def _value_of(where: tuple[Any, ...], table: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return section and name of a value that pydantic refuses; not which type did."""
    section, *inner = where
    named = bool(inner) and isinstance(table.get(section), dict)
    return where[: 2 if named and inner[0] in table[section] else 1]

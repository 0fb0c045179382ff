"""A commented study of a model, and a template of a custom model."""

import keyword
import textwrap
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from tolstat import catalogue
from tolstat.answers.next_steps import command
from tolstat.deviations.names import general
from tolstat.errors import ModelError
from tolstat.literal import visible
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, impossible
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Response
from tolstat.model.setting_kinds import Boolean, Kind, Number, Numbers, Rows
from tolstat.study.problems import toml_of
from tolstat.study.settings_section import NOMINAL, SETTING
from tolstat.study.study_schema import RESPONSES, RESULTS, TABLES

WIDTH = 88  # of the file; comments begin where the longest entries of theirs end
BEGIN = 34
SMALL = 1e-9  # SI: a deviation that any part may have on both sides
# example tolerances by SI unit; 1 of any other unit, 1 % of a relative one
EXAMPLES = {"m": "0.1 mm", "rad": "0.1 deg", "s": "1 ms", "N m": "1 N m"}


def new_study(model: str | Model) -> str:
    """Return a commented study of a model, as TOML.

    Parameters
    ----------
    model : str or Model
        A name of `tolstat.models()`, or a model object.

    Raises
    ------
    ModelError
        If there is no such model.

    Examples
    --------
    >>> print(tolstat.new_study("dimension_chain"))
    # a dimension chain: ...
    """
    model = catalogue.find(model)
    if model.name == RESULTS:  # what it has stands in a file
        return _template("results.toml")
    settings = model_settings.make(model)
    contributors, responses = described(model, settings)
    links = _links(model)
    parts = _parts(model, settings, contributors) if links is None else ()
    sections = (
        ("[settings]", _settings(model, linked=links is not None)),
        ("[links]", links or ()),
        (f"[{RESPONSES}]", _responses(model)),
        ("[deviations]  # +- is three sigma at Cp = 1", parts),
        ("[limits]  # 99.73 % within, unless said otherwise", _limits(responses)),
    )
    title = " ".join((model.title or model.name).split())
    run = command("run", "STUDY.toml", machine=catalogue.place_of(model))
    words = {"title": title, "run": visible(run.text), "name": toml_of(model.name)}
    lines = [_template("study.toml").format(**words)]
    for head, section in sections:
        if entries := [*section]:
            lines += [head, *entries, ""]
    return "\n".join(lines)


def _settings(model: Model, *, linked: bool) -> Iterator[str]:
    group = ""
    for setting in model_settings.settings_of(model).values():
        if setting.name in TABLES or (setting.name == SETTING and linked):
            continue
        if setting.group != group:
            yield f"# {setting.group}"
        kind, group, words = setting.kind, setting.group, setting.sentence
        if not isinstance(kind, Boolean | Rows) and kind.allowed:
            words = f"{words}; allowed: {kind.allowed}"
        value = toml_of(_as_toml(kind, setting.default))
        yield _entry(f"{setting.name} = {value}", words)


def _responses(model: Model) -> Iterator[str]:
    """Yield the responses that a study takes of outputs, if it may choose them."""
    if table := model_settings.settings_of(model).get(RESPONSES):
        yield textwrap.fill(
            table.sentence, WIDTH, initial_indent="# ", subsequent_indent="# "
        )
        for name, row in table.default.items():
            (taken,) = row.values()
            yield f"{name} = {toml_of(taken)}"


def _links(model: Model) -> list[str] | None:
    """Return the lines of [links]; None for a model without links."""
    table = model_settings.settings_of(model).get(SETTING)
    kind = table.kind if table else None
    if not (
        table and isinstance(kind, Rows) and kind.named and NOMINAL in kind.columns
    ):
        return None
    rows = _as_toml(kind, table.default)
    if [*kind.columns] == [NOMINAL]:
        sizes = {n: row[NOMINAL].replace(" ", " +-0.1 ") for n, row in rows.items()}
        return [
            _template("links.toml").rstrip(),
            *(f"{n} = {toml_of(size)}" for n, size in sizes.items()),
        ]
    links = {name: {**row, "tolerance": "+-0.1 mm"} for name, row in rows.items()}
    return [f"{name} = {toml_of(link)}" for name, link in links.items()]


def _parts(model: Model, settings: Any, parts: Sequence[Contributor]) -> Iterator[str]:
    names = dict.fromkeys(general(part.name) for part in parts)
    same = {name: [p for p in parts if general(p.name) == name] for name in names}
    for kind, families in groupby(same.items(), lambda family: family[1][0].part):
        if kind:
            yield f"# {kind}"
        for name, family in families:
            unit = family[0].unit
            size = family[0].size  # per cent of 0 are none
            relative = bool(size) or (unit == "1" and size is None)
            example = EXAMPLES.get(
                unit, "1 %" if relative else f"1 {unit}".removesuffix(" 1")
            )
            members = ", ".join(p.name for p in family) if len(family) > 1 else ""
            words = "; ".join(filter(None, [family[0].sentence, members]))
            negative = -SMALL * np.array([[part in family for part in parts]])
            one_sided = impossible(model, negative, settings).any()
            zone = f"0..{example}" if one_sided else f"+-{example}"
            yield _entry(f'# {name} = "{zone}"', words)


def _limits(responses: Sequence[Response]) -> Iterator[str]:
    for response in responses:
        unit = response.shown or response.unit
        bare = unit in ("1", "count")
        example = ("1" if response.shown else "1 %") if bare else f"1 {unit}"
        yield _entry(f'# {response.name} = "<= {example}"', response.sentence)


def _as_toml(kind: Kind, value: Any) -> Any:
    """Return a setting as a study holds it: numbers, texts, lists and tables."""
    if isinstance(kind, Numbers):
        return [_as_toml(kind.each, number) for number in value]
    if isinstance(kind, Rows):
        if isinstance(value, dict):
            return {name: _row(kind, row) for name, row in value.items()}
        return [_row(kind, row) for row in value]
    words = kind.words(value)
    number = isinstance(kind, Number) and words not in kind.presets
    bare = isinstance(kind, Boolean) or (number and " " not in words)
    return tomllib.loads(f"value = {words}")["value"] if bare else words


def _row(kind: Rows, row: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _as_toml(c.kind, row[name]) for name, c in kind.columns.items()}


def _entry(line: str, words: str) -> str:
    """Return an entry with its comment behind it, or above it where both are long."""
    if not words:
        return line
    column = max(BEGIN, len(line) + 2)
    above = column + 24 > WIDTH
    width = WIDTH - 2 - (0 if above else column)
    comment = textwrap.wrap(words, width, break_on_hyphens=False)
    if above:
        return "\n".join([*(f"# {text}" for text in comment), line])
    return "\n".join(
        f"{start:<{column}}# {text}".rstrip()
        for start, text in zip_longest([line], comment, fillvalue="")
    )


def new_model(path: Path | str) -> str:
    """Return a model that runs, for you to change: a slider-crank with a buffer.

    It has states, an integral, peaks, a time at which the rates jump, a crossing and a
    history.

    Parameters
    ----------
    path : path
        Its file; the name without `.py` is the name of the model.

    Raises
    ------
    ModelError
        If the file has no such name.
    """
    path = Path(path)
    name = path.stem
    if path.suffix != ".py" or not name.isidentifier() or keyword.iskeyword(name):
        raise ModelError(
            f"{path}: a name of letters, digits and _ that ends in .py is expected, "
            "such as slider_crank.py"
        )
    model = "".join(part.capitalize() for part in name.split("_"))
    text = _template("model.py")
    for key, value in {"name": name, "file": str(path), "model": model}.items():
        text = text.replace(f"{{{key}}}", value)
    return text


def _template(name: str) -> str:
    file = files("tolstat.answers").joinpath("templates", f"{name}.txt")
    return file.read_text("utf-8")

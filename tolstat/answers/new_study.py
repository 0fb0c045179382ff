"""A commented study of a model: every setting, contributor and response."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from tolstat import catalogue
from tolstat.deviations.names import general
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, impossible
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Response
from tolstat.model.setting_kinds import (
    Boolean,
    Kind,
    Number,
    Numbers,
    Rows,
    as_typed,
)
from tolstat.study.links_section import NOMINAL, SETTING

WIDTH = 88  # of the file; comments begin where the longest entries of theirs end
BEGIN = 34
# example tolerances by SI unit; 1 of any other unit, 1 % of a relative one
SMALL = 1e-9  # SI: a deviation that any part may have on both sides
EXAMPLES = {"m": "0.1 mm", "rad": "0.1 deg", "s": "1 ms", "N m": "1 N m"}
HEAD = """\
# {title}
# tolstat run STUDY.toml, then tolstat report STUDY.h5
# Settings have their default values: delete those that you keep. Remove the # before
# deviations and limits that you need, and set your numbers.

title = {name}
model = {name}
trials = 4096
seed = 1
"""


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
    found = catalogue.find(model)
    settings = model_settings.make(found)
    contributors, responses = described(found, settings)
    sections = (
        _section("[settings]", _settings(found)),
        _section("[links]", _links(found)),
        _section(
            "[deviations]  # +- is three sigma at Cp = 1",
            _parts(found, settings, contributors),
        ),
        _section(
            "[limits]  # 99.73 % within, unless said otherwise", _limits(responses)
        ),
    )
    title = " ".join((found.title or found.name).split())
    head = HEAD.format(title=title, name=as_typed(found.name, quoted=True))
    return "\n".join([head, *(part for each in sections for part in each)])


def _section(head: str, lines: Iterator[str]) -> Iterator[str]:
    found = list(lines)
    if found:
        yield "\n".join([head, *found, ""])


def _settings(model: Model) -> Iterator[str]:
    group = ""
    for each in model_settings.settings_of(model).values():
        if each.name == SETTING and _has_links(model):
            continue
        if each.group != group:
            yield f"# {each.group}"
        kind, group = each.kind, each.group
        allowed = "" if isinstance(kind, Boolean | Rows) else kind.allowed
        words = f"{each.sentence}; allowed: {allowed}" if allowed else each.sentence
        yield _entry(f"{each.name} = {_toml(kind, each.default)}", words)


def _has_links(model: Model) -> bool:
    kind = getattr(model_settings.settings_of(model).get(SETTING), "kind", None)
    return isinstance(kind, Rows) and kind.named and NOMINAL in kind.columns


def _links(model: Model) -> Iterator[str]:
    if _has_links(model):
        table = model_settings.settings_of(model)[SETTING]
        assert isinstance(table.kind, Rows)
        for name, row in table.default.items():
            cells = _cells(table.kind, row)
            yield f'{name} = {{ {cells}, tolerance = "+-0.1 mm" }}'


def _parts(model: Model, settings: Any, parts: Sequence[Contributor]) -> Iterator[str]:
    if _has_links(model):
        return
    names = dict.fromkeys(general(each.name) for each in parts)
    same = {name: [p for p in parts if general(p.name) == name] for name in names}
    for kind, those in groupby(same.items(), lambda each: each[1][0].part):
        if kind:
            yield f"# {kind}"
        for name, every in those:
            unit = every[0].unit
            example = EXAMPLES.get(unit, "1 %" if unit == "1" else f"1 {unit}")
            members = ", ".join(each.name for each in every) if len(every) > 1 else ""
            words = "; ".join(filter(None, [every[0].sentence, members]))
            negative = -SMALL * np.array([[each in every for each in parts]])
            one_sided = impossible(model, negative, settings).any()
            zone = f"0..{example}" if one_sided else f"+-{example}"
            yield _entry(f'# {name} = "{zone}"', words)


def _limits(responses: Sequence[Response]) -> Iterator[str]:
    for each in responses:
        unit = each.shown or each.unit
        bare = unit in ("1", "count")
        example = ("1" if each.shown else "1 %") if bare else f"1 {unit}"
        yield _entry(f'# {each.name} = "<= {example}"', each.sentence)


def _toml(kind: Kind, value: Any) -> str:
    """Return a setting as in a study, with quotes around all but numbers."""
    if isinstance(kind, Numbers):
        return "[" + ", ".join(_toml(kind.each, each) for each in value) + "]"
    if isinstance(kind, Rows):
        return _rows(kind, value)
    words = kind.words(value)
    bare = isinstance(kind, Boolean) or (
        isinstance(kind, Number) and words not in kind.presets and " " not in words
    )
    return words if bare else as_typed(words, quoted=True)


def _rows(kind: Rows, value: Any) -> str:
    if isinstance(value, dict):
        rows = (f"{k} = {{ {_cells(kind, row)} }}" for k, row in value.items())
        return "{ " + ", ".join(rows) + " }"
    return "[" + ", ".join(f"{{ {_cells(kind, row)} }}" for row in value) + "]"


def _cells(kind: Rows, row: Mapping[str, Any]) -> str:
    return ", ".join(f"{k} = {_toml(c.kind, row[k])}" for k, c in kind.columns.items())


def _entry(line: str, words: str) -> str:
    """Return an entry with its comment behind it, or above it where both are long."""
    place = max(BEGIN, len(line) + 2)
    if place + 24 > WIDTH:
        comment = textwrap.wrap(words, WIDTH - 2, break_on_hyphens=False)
        return "\n".join([*(f"# {each}" for each in comment), line])
    first, *others = textwrap.wrap(
        words, WIDTH - place - 2, break_on_hyphens=False
    ) or [""]
    lines = [
        f"{line:<{place}}# {first}",
        *(f"{'':<{place}}# {each}" for each in others),
    ]
    return "\n".join(each.rstrip() for each in lines)

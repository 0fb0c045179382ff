"""Placeholders of a command: {input}, {input.toml}, {input:TEMPLATE}, {output.csv}."""

import csv
import hashlib
import io
import json
import re
import shlex
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from tolstat.errors import ModelError, allowed_names
from tolstat.toml import toml_text

INPUT = re.compile(r"\{input(?:\.(json|toml)|:([^{}]+))?\}")
OUTPUT = re.compile(r"\{output(?:\.(json|csv))?\}")
# what looks like a placeholder of a command; ${X} belongs to a shell
PLACE = re.compile(r"(?<!\$)\{[^\W\d]\w*(?:[.:][^{}]*)?\}")
KINDS = "{input}", "{input.toml}", "{input:TEMPLATE}", "{output}", "{output.csv}"
NAMED = re.compile(r"(\\?)\{([^\W\d]\w*)\}")  # a value in a template; \{x} is none
EXAMPLE = "exec:solver --in {input} --out {output}"
JSON, TOML, CSV = "json", "toml", "csv"


class Command(NamedTuple):
    """A command whose program and files are named by their full paths."""

    words: tuple[str, ...]
    # "json", "toml", or the path of a template; and "json" or "csv"
    input_kind: str
    output_kind: str
    files: tuple[Path, ...]  # that decide its answers: program, scripts, template

    @classmethod
    def read(cls, text: str) -> "Command":
        """Read a command; ModelError if a placeholder or its program is wrong."""
        try:
            words = shlex.split(text)
        except ValueError as error:
            raise ModelError(f"exec:{text}: {error}") from None
        for place in (place for word in words for place in PLACE.findall(word)):
            if not (INPUT.fullmatch(place) or OUTPUT.fullmatch(place)):
                raise ModelError(
                    f"exec:{text}: {place} is no placeholder; allowed: "
                    f"{', '.join(KINDS)}; other braces need a space, such as {{ x }}"
                )
        inputs = [match for word in words for match in INPUT.finditer(word)]
        outputs = [match for word in words for match in OUTPUT.finditer(word)]
        if len(inputs) != 1 or len(outputs) != 1:
            raise ModelError(
                f"exec:{text}: {{input}} and {{output}} are expected once each, such "
                f"as {EXAMPLE}"
            )
        program = shutil.which(words[0])
        if program is None:
            raise ModelError(f"exec:{text}: no program {words[0]} is found")
        deck = inputs[0][2]
        if deck and not Path(deck).is_file():
            raise ModelError(f"exec:{text}: {deck}: no such file")
        given = [Path(p).resolve() if Path(p).is_file() else p for p in words[1:]]
        paths = [path for path in given if isinstance(path, Path)]
        files = [Path(program), *paths, *([Path(deck)] if deck else [])]
        return cls(
            (str(Path(program).absolute()), *map(str, given)),
            str(Path(deck).resolve()) if deck else inputs[0][1] or JSON,
            outputs[0][1] or JSON,
            tuple(path.resolve() for path in files),
        )

    @property
    def digest(self) -> str:
        """The digest of its words, and of the content of its files."""
        digest = hashlib.sha256(repr(self.words).encode())
        for path in self.files:
            with path.open("rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
        return digest.hexdigest()[:16]

    def filled(self, folder: Path) -> list[str]:
        """Return its words with the files of a folder."""
        paths = {INPUT: folder / self._input_name, OUTPUT: self.output_in(folder)}
        words = list(self.words)
        for pattern, path in paths.items():
            words = [pattern.sub(lambda _: str(path), word) for word in words]  # noqa: B023
        return words

    @property
    def _input_name(self) -> str:
        if self.input_kind in (JSON, TOML):
            return f"input.{self.input_kind}"
        return Path(self.input_kind).name

    def output_in(self, folder: Path) -> Path:
        """Return the path of its output in a folder."""
        return folder / f"output.{self.output_kind}"

    def write_input(self, folder: Path, values: Mapping[str, float]) -> None:
        """Write values as its input file in a folder."""
        path = folder / self._input_name
        match self.input_kind:
            case "json":
                path.write_text(json.dumps(values, indent=1))
            case "toml":
                path.write_text(toml_text(values))
            case deck:
                path.write_bytes(from_template(template(Path(deck)), values))

    def read_output(self, folder: Path, names: list[str]) -> list[float]:
        """Return responses by name from its output file in a folder.

        Raises
        ------
        ValueError
            If the file, a name or a number is missing, or one is given twice.
        """
        path = self.output_in(folder)
        try:
            text = path.read_text(encoding="utf-8-sig")
        except OSError as error:
            raise ValueError(f"{path.name}: {error.strerror}") from None
        try:
            if self.output_kind == JSON:
                values = json.loads(text, object_pairs_hook=_by_name)
            else:
                values = _last_row(text)
        except (ValueError, csv.Error) as error:
            raise ValueError(f"{path.name}: {error}") from None
        if not isinstance(values, dict):
            raise ValueError(f"{path.name}: numbers by name are expected")
        if missing := [name for name in names if values.get(name) is None]:
            raise ValueError(f"{path.name} has no {', '.join(missing)}")
        try:
            return [_number(values[name]) for name in names]
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(f"{path.name}: {error}") from None


def _last_row(text: str) -> dict[str, Any]:
    """Return the cells of the last row of a CSV file, by the names in the first."""
    rows = [*filter(None, csv.reader(io.StringIO(text), skipinitialspace=True))]
    heads = [head.strip() for head in rows[0]] if rows else []
    for number, row in enumerate(rows[1:], 1):
        if len(row) > len(heads):
            raise ValueError(
                f"row {number} has {len(row)} cells, but {len(heads)} names are given"
            )
    _by_name([(head, None) for head in heads if head])
    return dict(zip(heads, rows[-1], strict=False)) if len(rows) > 1 else {}


def _by_name(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return values by name; ValueError if a name is given twice."""
    values = dict[str, Any]()
    for name, value in pairs:
        if name in values:
            raise ValueError(f"{name} is given twice")
        values[name] = value
    return values


def _number(value: Any) -> float:
    """Return a number that a command has written; ValueError if it is none."""
    if isinstance(value, bool):
        raise ValueError(f"{str(value).lower()} is not a number")
    if isinstance(value, str) and "_" in value:  # Python reads 1_0 as 10
        raise ValueError(f"'{value}' is not a number")
    return float(value)


def template(path: Path) -> str:
    """Return a template; whatever its encoding, its other bytes stay."""
    return path.read_bytes().decode("utf-8", "surrogateescape")


def from_template(text: str, values: Mapping[str, float]) -> bytes:
    r"""Return a template with values at {name}; other braces stay, and \\{name}."""
    return NAMED.sub(
        lambda match: match[0][1:] if match[1] else repr(values[match[2]]), text
    ).encode("utf-8", "surrogateescape")


def check_template(path: Path, names: Sequence[str]) -> None:
    """Refuse a template with a place for another name, or without one for a name."""
    missing = [*names]
    for number, line in enumerate(template(path).split("\n"), 1):
        for name in (name for kept, name in NAMED.findall(line) if not kept):
            if name not in names:
                raise ModelError(
                    f"{path}, line {number}: {{{name}}} is no input of the study "
                    f"(\\{{{name}}} keeps such braces); {allowed_names(name, names)}"
                )
            missing = [other for other in missing if other != name]
    if missing:
        places = ", ".join(f"{{{name}}}" for name in missing)
        raise ModelError(
            f"{path} does not take {places}; write it where the program reads its "
            "value, or delete the input from the study"
        )

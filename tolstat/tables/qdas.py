"""Measured values of Q-DAS files: DFQ, or DFD with its values in DFX beside it.

Keys as in the AQDEF of Q-DAS: K0100 begins a part; K1001, K1002 its number and name;
K2001, K2002 those of a characteristic; K2101 nominal, K2110 and K2111 limits, K2112 and
K2113 allowances from the nominal; K2120 and K2121 0 for no limit, 2 for a natural one;
K2142 unit; K2004 0 for measured values. Index 0 is all. A line of values has a cell for
each characteristic; a cell has value, attribute, time, events, batch.

Not verified with the software of Q-DAS.
"""

import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tolstat.errors import DataError, UnitError, allowed_names
from tolstat.tables.encodings import text_of_data
from tolstat.tables.no_value import cells_with, refuse_codes
from tolstat.tables.numerals import COMMA, POINT
from tolstat.tables.raw_file import RawFile
from tolstat.tables.table import MeasuredColumn
from tolstat.units.grammar import bare_number

ENDINGS = (".dfq", ".dfd")
BETWEEN_CELLS, BETWEEN_FIELDS = "\x0f", "\x14"
NOT_COUNTED = ("255", "256")  # attributes of values that do not count
NO_LIMIT, NATURAL = "0", "2"
PLACES = {"K0001": 0, "K0002": 1, "K0004": 2, "K0006": 4}  # of a value, by key
TIME, BATCH = 2, 4
COUNTS = ("K0020", "K0021")  # of attributive characteristics
MOST = 10_000  # characteristics of a part
_LINE = re.compile(r"(K\d{4})(?:/(\d{1,6}))?(?:/\d+)?(?:\s(.*))?")


@dataclass
class _Value:
    """A value with its fields."""

    fields: list[str]
    place: str  # file and line

    def field(self, address: int) -> str:
        return self.fields[address].strip() if address < len(self.fields) else ""


@dataclass
class _Part:
    """A part: its keys, those of its characteristics and their values, by index."""

    number: int  # of characteristics
    keys: dict[str, str] = field(default_factory=dict)
    characteristics: dict[int, dict[str, str]] = field(default_factory=dict)
    values: dict[int, list[_Value]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Its number, and its name."""
        return self.keys.get("K1001") or self.keys.get("K1002", "")

    def key(self, index: int, name: str) -> str:
        """Return a key of a characteristic, or of all; empty without one."""
        both = self.characteristics.get(0, {}) | self.characteristics.get(index, {})
        return both.get(name, "")


class QdasFile:
    """The characteristics of a Q-DAS file, by name or number.

    Parameters
    ----------
    file : RawFile
        DFQ, or DFD.
    values : tuple of Path and bytes, optional
        The DFX file beside a DFD file.
    """

    def __init__(self, file: RawFile, values: tuple[Path, bytes] | None = None) -> None:
        self.path, form = file.path, file.form
        self.codes, self._has_code = form.no_value, cells_with(form.no_value or ())
        contents = {file.path: file.raw, **dict([values] if values else [])}
        self.digest = hashlib.sha256(b"".join(contents.values())).hexdigest()
        texts = {
            path: text_of_data(path, content, form.encoding)
            for path, content in contents.items()
        }
        self.encoding = texts[file.path].encoding
        self._parts: list[_Part] = []
        for path, decoded in texts.items():
            for number, line in enumerate(decoded.text.split("\n"), start=1):
                if line.strip():
                    self._read(line, f"{path}, line {number}")
        if not self._parts:
            raise DataError(f"{file.path} is no Q-DAS file: K0100 is missing")
        self.part = self._chosen(form.part)

    def names(self, lots: str = "") -> list[str]:
        """Return the characteristics of the part; lots are no column."""
        return [self._name(i) for i in sorted(self._indices)]

    def measured(self, name: str, lots: str = "") -> MeasuredColumn:
        """Return a characteristic by its name or number; values that count."""
        if lots:
            raise DataError(
                f"{self.path}: a Q-DAS file has the batch of each value (K0006), and "
                f"no columns; leave lots = '{lots}' out"
            )
        part, index = self.part, self._index(name)
        if part.key(index, "K2004") not in ("", "0"):
            raise DataError(
                f"{self.path}: {name} is attributive (K2004 is "
                f"{part.key(index, 'K2004')}); counts are no measured values"
            )
        counted = [
            value
            for value in part.values.get(index, [])
            if value.field(0)
            and value.field(1) not in NOT_COUNTED
            and not self._has_code(value.field(0))
        ]
        if not counted:
            raise DataError(f"{self.path}, {name}: no value that counts")
        left_out = len(part.values[index]) - len(counted)
        places = [value.place for value in counted]
        numbers = [
            self._as_number(value.field(0), address)
            for value, address in zip(counted, places, strict=True)
        ]
        if self.codes is None:
            refuse_codes(
                np.array(numbers), places, [text.rpartition(" ")[2] for text in places]
            )
        nominal = self._number(index, "K2101")
        lower, upper = (
            self._limit(index, nominal, keys)
            for keys in (("K2110", "K2112", "K2120"), ("K2111", "K2113", "K2121"))
        )
        if lower is not None and upper is not None and lower > upper:
            raise DataError(
                f"{self.path}, {name}: its lower limit {lower:g} is above its upper "
                f"limit {upper:g}; correct K2110 to K2113"
            )
        batches = [value.field(BATCH).lstrip("#") for value in counted]
        times = [value.field(TIME) for value in counted]
        encoding = [] if self.encoding == "UTF-8" else [self.encoding]
        words = ["Q-DAS", *encoding]
        words += [f"part {part.name}"] if len(self._parts) > 1 else []
        words += [f"{left_out} that do not count"] if left_out else []
        return MeasuredColumn(
            self.path,
            self._name(index),
            part.key(index, "K2142"),
            tuple(numbers),
            tuple(places),
            ", ".join(words),
            plain=False,
            digest=self.digest,
            left_out=left_out,
            nominal=nominal,
            lower=lower,
            upper=upper,
            lots=tuple(batches) if all(batches) and len({*batches}) > 1 else (),
            sequence=all(times),
        )

    def _read(self, line: str, address: str) -> None:
        """Take one line."""
        if not line.startswith("K"):
            self._read_values(line, address)
            return
        if not (match := _LINE.fullmatch(line)):
            raise DataError(f"{address}: '{line[:40]}' is no key of Q-DAS")
        key, index, value = match[1], int(match[2] or 0), (match[3] or "").strip()
        if key == "K0100":
            if not value.isdigit() or not 0 < int(value) <= MOST:
                raise DataError(f"{address}: K0100 is a number from 1 to {MOST}")
            self._parts.append(_Part(int(value)))
        elif not self._parts:
            if key[1] != "0":
                raise DataError(f"{address}: {key} stands before K0100")
        elif key[1] == "1":
            self._parts[-1].keys[key] = value
        elif key[1] == "2":
            self._parts[-1].characteristics.setdefault(index, {})[key] = value
        elif key in COUNTS:
            self._parts[-1].characteristics.setdefault(index or 1, {})["K2004"] = "1"
        elif key in PLACES:
            values = self._parts[-1].values.setdefault(index or 1, [])
            if key == "K0001":
                values.append(_Value([value, "", "", "", ""], address))
            elif values:
                values[-1].fields[PLACES[key]] = value

    def _read_values(self, line: str, address: str) -> None:
        """Take a line of values, one of each characteristic."""
        if not self._parts:
            raise DataError(f"{address}: values stand before K0100; no Q-DAS file")
        part = self._parts[-1]
        cells = line.removesuffix(BETWEEN_CELLS).split(BETWEEN_CELLS)
        if len(cells) != part.number:
            raise DataError(
                f"{address}: {len(cells)} values, and K0100 says {part.number} "
                "characteristics"
            )
        for index, cell in enumerate(cells, start=1):
            value = _Value(cell.split(BETWEEN_FIELDS), address)
            part.values.setdefault(index, []).append(value)

    @property
    def _indices(self) -> set[int]:
        part = self.part
        return {i for i in (*part.characteristics, *part.values) if i}

    def _name(self, index: int) -> str:
        return (
            self.part.key(index, "K2002") or self.part.key(index, "K2001") or f"{index}"
        )

    def _index(self, name: str) -> int:
        """Return the characteristic of a name; else of a number."""
        named = [i for i in self._indices if self._name(i) == name]
        named = named or [i for i in self._indices if self.part.key(i, "K2001") == name]
        if len(named) > 1:
            raise DataError(
                f"{self.path}: {len(named)} characteristics are called '{name}'; give "
                "the number (K2001)"
            )
        if not named:
            allowed = allowed_names(name, self.names())
            raise DataError(f"{self.path} has no characteristic '{name}'; {allowed}")
        return named[0]

    def _chosen(self, name: str) -> _Part:
        """Return the part of a name; the only one without a name."""
        names = [part.name for part in self._parts]
        fits = [part for part in self._parts if name in (part.name, "")]
        if len(fits) == 1:
            return fits[0]
        several = ", ".join(f"'{other}'" for other in dict.fromkeys(names))
        if not fits:
            raise DataError(f"{self.path} has no part '{name}'; it has {several}")
        if name or len({*names}) < 2:
            raise DataError(
                f"{self.path} has {len(fits)} parts of equal name: {several}"
            )
        raise DataError(
            f'{self.path} has several parts: {several}; give part = "{names[0]}"'
        )

    def _number(self, index: int, key: str) -> float | None:
        """Return a number of a characteristic; None without one."""
        text = self.part.key(index, key)
        return self._as_number(text, f"{self.path}, {key}/{index}") if text else None

    def _limit(
        self, index: int, nominal: float | None, keys: tuple[str, str, str]
    ) -> float | None:
        """Return a limit: absolute, or an allowance from the nominal; None for none."""
        absolute, allowance, kind = keys
        if self.part.key(index, kind) in (NO_LIMIT, NATURAL):
            return None
        limit = self._number(index, absolute)
        distance = self._number(index, allowance)
        if limit is None and nominal is not None and distance is not None:
            return nominal + distance
        return limit

    def _as_number(self, text: str, address: str) -> float:
        """Return a number; Q-DAS has no sign between thousands."""
        try:
            return bare_number(text.replace(COMMA, POINT))
        except UnitError:
            raise DataError(f"{address}: '{text}' is not a number") from None

"""Findings made plain: numbers, texts, lists and dicts, for JSON and CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from sys import float_info
from typing import Any

import numpy as np

from tolstat.literal import csv_cell


def share_words(share: float) -> str:
    """Name a typed share: 0.00135 is "0.135 %", and nothing but 1 "100 %"."""
    return f"{100 * share:.{float_info.dig}g} %"


def key_words(key: object) -> str:
    """Name one step on the way to a number: a quantile by its share."""
    return share_words(key) if isinstance(key, float) else str(key)


def plain(found: Any) -> Any:
    """Return findings as plain data.

    Parameters
    ----------
    found
        Dataclasses, named tuples, mappings, sequences, numbers, texts.

    Returns
    -------
    object
        SI. An estimate is a dict of value, lower, upper (its 95 % interval; None where
        there is none) and reason; NaN is None.
    """
    if dataclasses.is_dataclass(found) and not isinstance(found, type):
        names = [field.name for field in dataclasses.fields(found)]
        return {name: plain(getattr(found, name)) for name in names}
    if hasattr(found, "_asdict"):
        return {name: plain(value) for name, value in found._asdict().items()}
    if isinstance(found, Mapping):
        return {key_words(key): plain(value) for key, value in found.items()}
    if isinstance(found, Sequence) and not isinstance(found, str):
        return [plain(value) for value in found]
    if isinstance(found, np.generic):
        found = found.item()
    return None if isinstance(found, float) and math.isnan(found) else found


def as_json(found: Any) -> str:
    """Write findings as JSON: what is infinite is the text "inf" or "-inf"."""
    return json.dumps(_finite(plain(found)), indent=1, allow_nan=False) + "\n"


def _finite(found: Any) -> Any:
    if isinstance(found, dict):
        return {key: _finite(value) for key, value in found.items()}
    if isinstance(found, list):
        return [_finite(value) for value in found]
    if isinstance(found, float) and math.isinf(found):
        return "inf" if found > 0 else "-inf"
    return found


def csv_text(heads: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    """Write a table as CSV; no text in it is a formula to a spreadsheet.

    Parameters
    ----------
    heads : iterable of str
        Of the columns.
    rows : iterable of sequences
        Numbers and texts.
    """
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return buffer.getvalue()

"""Untrusted text, shown as it is: no medium executes anything in it.

Titles, names, paths and words come from study files, run files and custom models.
Each medium makes them safe in one place: the screen of the command line, the
environment of pages, the pictures before they are written, the cells of CSV files.

Of many names a sentence says the first, on every floor in the same words.
"""

import re
import unicodedata
from collections.abc import Sequence
from typing import Any

# controls and formats (ESC, changes of direction), half characters, separators
UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
KEPT = "\n\t"
FORMULA = ("=", "+", "-", "@", "\t", "\r")
# a number with a unit, such as a tolerance: no spreadsheet can calculate it
QUANTITY = re.compile(r"[+-]+[\d.]+(e[+-]?\d+)? [A-Za-zµμ°][\w/^ ]*")


def visible(text: str) -> str:
    r"""Return a text with control characters written out: ESC becomes \x1b.

    Line breaks and tabs stay.
    """
    if text.isprintable():
        return text
    return "".join(
        c.encode("unicode_escape").decode()
        if unicodedata.category(c) in UNSEEN and c not in KEPT
        else c
        for c in text
    )


def some_of(names: Sequence[str], most: int) -> str:
    """Return names in words; of many the first ones, and how many more there are."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def csv_cell(value: Any) -> Any:
    """Return the content of a CSV cell, so that no text becomes a formula.

    A number stays a number. A text that a spreadsheet would calculate gets an
    apostrophe in front.
    """
    if not isinstance(value, str):
        return value
    formula = value.startswith(FORMULA) and not QUANTITY.fullmatch(value)
    return f"'{visible(value)}" if formula else visible(value)

"""A file of data as bytes, with what a study says of how it is written."""

import hashlib
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple


class Form(NamedTuple):
    """What a study says of how a file is written; empty for what the file tells."""

    decimal: str = ""  # sign, "." or ","
    delimiter: str = ""  # between columns of a text
    encoding: str = ""  # of a text, as Python names it
    sheet: str = ""  # of a workbook, or the group of an HDF5 file
    part: str = ""  # of a Q-DAS file
    # codes of cells without a value; None: what looks like one is refused
    no_value: tuple[str, ...] | None = None
    only: tuple[tuple[str, str], ...] = ()  # what the rows have, by column


AS_IS = Form()


class RawFile:
    """A file of data before it is read.

    Parameters
    ----------
    path : Path
        Of the file.
    raw : bytes
        Its content.
    form : Form
        How it is written.
    requested : sequence of str
        Columns that will be read: they tell the head among similar lines, and the
        table among several.
    """

    def __init__(
        self, path: Path, raw: bytes, form: Form, requested: Sequence[str] = ()
    ) -> None:
        self.path, self.raw, self.form, self.requested = path, raw, form, requested

    @cached_property
    def digest(self) -> str:
        """SHA-256 of its content."""
        return hashlib.sha256(self.raw).hexdigest()

"""The text of a file by its bytes: a byte order mark, UTF-8, Windows-1252."""

import codecs
import io
import re
from pathlib import Path
from typing import NamedTuple

from tolstat.errors import DataError

BYTE_ORDER_MARKS = {  # that of UTF-16 begins one of UTF-32
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip
AS_UTF_8 = "save the file as UTF-8"
UTF_8 = "UTF-8"


class Decoded(NamedTuple):
    """The text of a file; every line ends as in Python."""

    text: str
    encoding: str  # as people call it


def as_text(path: Path, raw: bytes) -> str:
    """Return the text of a file: UTF-8, or what its byte order mark says.

    UTF-8, UTF-16 or UTF-32, as editors of Windows write them. No other encoding is
    guessed.
    """
    encoding = _marked(raw) or "utf-8"
    if encoding == "utf-8" and b"\0" in raw:
        raise DataError(
            f"{path} cannot be read: it contains NUL bytes, as UTF-16 without a byte "
            f"order mark does; {AS_UTF_8}"
        )
    try:
        return _decoded(raw, encoding)
    except UnicodeDecodeError as error:
        if not encoding.startswith("utf-8"):
            raise DataError(
                f"{path} cannot be read: it begins as {encoding.upper()} and is cut "
                f"off or damaged; {AS_UTF_8}"
            ) from None
        byte = raw[error.start : error.start + 1]
        raise DataError(
            f"{path}, line {_line(raw, error)}: byte 0x{byte.hex().upper()} is not "
            f"UTF-8 (in Windows-1252 it is '{byte.decode('cp1252', 'replace')}'); "
            f"{AS_UTF_8}"
        ) from None


def text_of_data(path: Path, raw: bytes, encoding: str = "") -> Decoded:
    """Return the text of a file of data.

    It is that of `as_text`; without mark and not UTF-8 it is Windows-1252. A typed
    encoding, as Python names it, replaces this rule.
    """
    if encoding:
        return Decoded(_as_typed(path, raw, encoding), encoding)
    marked = _marked(raw)
    if not marked and b"\0" not in raw:
        try:
            return Decoded(_decoded(raw, "utf-8"), UTF_8)
        except UnicodeDecodeError:
            pass
        try:
            return Decoded(_decoded(raw, "cp1252"), "Windows-1252")
        except UnicodeDecodeError as error:
            byte = raw[error.start : error.start + 1].hex().upper()
            raise DataError(
                f"{path}, line {_line(raw, error)}: byte 0x{byte} is neither UTF-8 nor "
                'Windows-1252; give the encoding, such as encoding = "cp850"'
            ) from None
    if not marked and not raw.lstrip(b"\0")[:1].isascii():
        raise DataError(f"{path} cannot be read: it contains NUL bytes and is no text")
    if not marked:
        raise DataError(
            f"{path} cannot be read: it contains NUL bytes, as UTF-16 without a byte "
            f'order mark does; give encoding = "utf-16-le", or {AS_UTF_8}'
        )
    return Decoded(as_text(path, raw), marked.removesuffix("-sig").upper())


def _as_typed(path: Path, raw: bytes, encoding: str) -> str:
    """Return the text of a file by a typed encoding."""
    try:
        codecs.lookup(encoding)
        return _decoded(raw, encoding).removeprefix("\ufeff")
    except LookupError:
        raise DataError(
            f'encoding = "{encoding}": unknown; allowed are those of Python, such as '
            "utf-8, utf-16, cp1252, latin-1"
        ) from None
    except UnicodeError as error:
        raise DataError(f"{path} cannot be read as {encoding}: {error}") from None


def _marked(raw: bytes) -> str:
    """Return the encoding that a byte order mark names; empty without a mark."""
    marks = (mark for mark in BYTE_ORDER_MARKS if raw.startswith(mark))
    return BYTE_ORDER_MARKS.get(next(marks, b""), "")


def _decoded(raw: bytes, encoding: str) -> str:
    return io.TextIOWrapper(io.BytesIO(raw), encoding).read()


def _line(raw: bytes, error: UnicodeDecodeError) -> int:
    """Return the line of a byte that cannot be decoded."""
    return len(re.findall(rb"\r\n|\r|\n", raw[: error.start])) + 1

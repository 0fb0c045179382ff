"""The text of a file of data by its bytes: also without a mark, and Windows-1252."""

import codecs
from pathlib import Path
from typing import NamedTuple

from tolstat.errors import DataError
from tolstat.regular_files import AS_UTF_8, as_text, decoded, line_of, marked_encoding

UTF_8 = "UTF-8"


class Decoded(NamedTuple):
    """The text of a file; every line ends as in Python."""

    text: str
    encoding: str  # as people call it


def text_of_data(path: Path, raw: bytes, encoding: str = "") -> Decoded:
    """Return the text of a file of data.

    It is that of `as_text`; without mark and not UTF-8 it is Windows-1252. A typed
    encoding, as Python names it, replaces this rule.
    """
    if encoding:
        return Decoded(_as_typed(path, raw, encoding), encoding)
    marked = marked_encoding(raw)
    if not marked and b"\0" not in raw:
        try:
            return Decoded(decoded(raw, "utf-8"), UTF_8)
        except UnicodeDecodeError:
            pass
        try:
            return Decoded(decoded(raw, "cp1252"), "Windows-1252")
        except UnicodeDecodeError as error:
            byte = raw[error.start : error.start + 1].hex().upper()
            raise DataError(
                f"{path}, line {line_of(raw, error)}: byte 0x{byte} is neither UTF-8 "
                'nor Windows-1252; give the encoding, such as encoding = "cp850"'
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
        return decoded(raw, encoding).removeprefix("\ufeff")
    except UnicodeError as error:
        raise DataError(f"{path} cannot be read as {encoding}: {error}") from None
    except (LookupError, ValueError):  # ValueError: NUL in its name
        raise DataError(
            f'encoding = "{encoding}": unknown; allowed are those of Python, such as '
            "utf-8, utf-16, cp1252, latin-1"
        ) from None

"""Files opened for reading: regular ones, with a bound, not by half; their text."""

import codecs
import errno
import io
import lzma
import os
import re
import zipfile
import zlib
from pathlib import Path
from typing import BinaryIO

from tolstat.errors import DataError
from tolstat.operating_system import open_regular

MEGABYTE = 1_000_000
BYTE_ORDER_MARKS = {  # that of UTF-16 begins one of UTF-32
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip
AS_UTF_8 = "save the file as UTF-8"
# of an archive that is damaged, encrypted or packed in an unknown way
UNREADABLE_ARCHIVE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError,
)  # fmt: skip


def opened(path: Path) -> BinaryIO:
    """Open a file for reading; a folder, a pipe or another device is an OSError."""
    return open_regular(path, os.O_RDONLY)


def opened_for_writing(path: Path) -> BinaryIO:
    """Open or create a file; a link is not followed, and no pipe waited for."""
    return open_regular(path, os.O_RDWR | os.O_CREAT)


def created(path: Path, mode: int) -> BinaryIO:
    """Create a file that does not exist, with these permissions but the umask's."""
    return open_regular(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)


def read_exactly(file: BinaryIO | io.RawIOBase, size: int) -> bytearray:
    """Return the next bytes of a file; OSError if there are fewer."""
    data, done = bytearray(size), 0
    while done < size:  # an unbuffered file may read a part
        count = file.readinto(memoryview(data)[done:])  # type: ignore[union-attr]
        if not count:
            raise OSError(errno.EIO, f"{done} of {size} bytes were read")
        done += count
    return data


def content(path: Path, megabytes: int) -> bytes:
    """Return the content of a file; OSError if it is larger, or is no file."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > megabytes * MEGABYTE:
            words = f"larger than {megabytes} MB, the most allowed"
            raise OSError(errno.EFBIG, words, str(path))
        return bytes(read_exactly(file, size))


def as_text(path: Path, raw: bytes) -> str:
    """Return the text of a file: UTF-8, or what its byte order mark says.

    UTF-8, UTF-16 or UTF-32, as editors of Windows write them. No other encoding is
    guessed.
    """
    encoding = marked_encoding(raw) or "utf-8"
    if encoding == "utf-8" and b"\0" in raw:
        raise DataError(
            f"{path} cannot be read: it contains NUL bytes, as UTF-16 without a byte "
            f"order mark does; {AS_UTF_8}"
        )
    try:
        return decoded(raw, encoding)
    except UnicodeDecodeError as error:
        if not encoding.startswith("utf-8"):
            raise DataError(
                f"{path} cannot be read: it begins as {encoding.upper()} and is cut "
                f"off or damaged; {AS_UTF_8}"
            ) from None
        byte = raw[error.start : error.start + 1]
        raise DataError(
            f"{path}, line {line_of(raw, error)}: byte 0x{byte.hex().upper()} is "
            f"not UTF-8 (in Windows-1252 it is '{byte.decode('cp1252', 'replace')}'); "
            f"{AS_UTF_8}"
        ) from None


def marked_encoding(raw: bytes) -> str:
    """Return the encoding that a byte order mark names; empty without a mark."""
    marks = (mark for mark in BYTE_ORDER_MARKS if raw.startswith(mark))
    return BYTE_ORDER_MARKS.get(next(marks, b""), "")


def decoded(raw: bytes, encoding: str) -> str:
    """Return the text of bytes; every line ends as in Python."""
    return io.TextIOWrapper(io.BytesIO(raw), encoding).read()


def line_of(raw: bytes, error: UnicodeDecodeError) -> int:
    """Return the line of a byte that cannot be decoded."""
    return len(re.findall(rb"\r\n|\r|\n", raw[: error.start])) + 1

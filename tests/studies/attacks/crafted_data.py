"""Crafted data files and FMUs times the commands that read them: how each ends.

    python -m tests.studies.attacks.crafted_data [FILE...]

A file is any part of a name in `FILES`; default: all. Each is changed as bytes, as an
archive and as the XML in it. Nothing may end in a traceback, by a signal, after ten
seconds or with 1.5 GB, and nothing may be written outside of the folder of the cache.
The exit code is 1 if anything is wrong.
"""

from __future__ import annotations

import io
import os
import random
import re
import shutil
import struct
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import odf.opendocument
import odf.table
import odf.text
import openpyxl
import pyarrow
import xlwt
from pyarrow import parquet

from tests.conftest import ROOT
from tests.fmu.building import build
from tests.studies.attacks.commands import ask, warm, words_of

BLOCK = 500_000_000  # bytes that a small archive unpacks to
ROWS = [["d", "Charge"], *([20.0 + 0.001 * i, 30.0 + i % 4] for i in range(40))]
MEASURED = """\
model = "dimension_chain"
trials = 50
seed = 1
settings.gap = "A - B"
links.A = {{ nominal = "20 mm", data = "{}", column = "d", unit = "mm" }}
links.B = {{ nominal = "19 mm", tolerance = "+-0.1 mm" }}
limits.gap = ">= 0.8 mm"
"""
RESULTS = """\
model = "results"
table = {{ data = "{}" }}
links.Charge = "31.5 +-5 mm"
responses.d = "mm"
limits.d = ">= 1 mm"
"""
DRIVE = (ROOT / "runs/fmu/drive.toml").read_text().replace("4096", "2")
HOSTILE = (  # values of an attribute, in turn
    "", "-1", "abc", "1e999", "nan", "99999999999999999999", "../../x", "\u202e",
    "0", "1048576", "<b>&amp;[red]", "A" * 100_000,
)  # fmt: skip
QDAS = (
    "K0100 1\nK1001 4711\nK2001 10\nK2002 d\nK2101 20\nK2110 19\nK2111 21\nK2142 mm\n"
)


def workbook() -> bytes:
    book = openpyxl.Workbook()
    for row in ROWS:
        book.active.append(row)
    return saved(book.save)


def open_document() -> bytes:
    book, table = odf.opendocument.OpenDocumentSpreadsheet(), odf.table.Table(name="a")
    for cells in ROWS:
        row = odf.table.TableRow()
        for x in cells:
            number = isinstance(x, float)
            kind = {"valuetype": "float", "value": x} if number else {}
            cell = odf.table.TableCell(**kind or {"valuetype": "string"})
            cell.addElement(odf.text.P(text=str(x)))
            row.addElement(cell)
        table.addElement(row)
    book.spreadsheet.addElement(table)
    return saved(book.write)


def old_workbook() -> bytes:
    book = xlwt.Workbook()
    sheet = book.add_sheet("a")
    for i, row in enumerate(ROWS):
        for j, value in enumerate(row):
            sheet.write(i, j, value)
    return saved(book.save)


def text() -> bytes:
    return "\n".join(";".join(map(str, row)) for row in ROWS).encode()


def columns() -> bytes:
    heads, *rows = ROWS
    arrays = dict(zip(heads, np.array(rows).T, strict=True))
    return saved(lambda file: parquet.write_table(pyarrow.table(arrays), file))


def datasets(**more) -> bytes:
    def write(file):
        with h5py.File(file, "w") as data:
            for name, values in zip(ROWS[0], np.array(ROWS[1:]).T, strict=True):
                data[name] = values
            for name, (shape, dtype) in more.items():
                data.create_dataset(name, shape, dtype, chunks=True, compression="gzip")

    return saved(write)


def qdas() -> bytes:
    return (QDAS + "\n".join(str(row[0]) for row in ROWS[1:])).encode()


def fmu() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return build("Backlash", 2, folder).read_bytes()


def saved(save: Callable[[io.BytesIO], object]) -> bytes:
    file = io.BytesIO()
    save(file)
    return file.getvalue()


DATA = "parts {}", "run measured.toml", "run results.toml"
FILES = {  # how it is made, what reads it
    "d.xlsx": (workbook, DATA),
    "d.ods": (open_document, DATA),
    "d.xls": (old_workbook, DATA),
    "d.csv": (text, DATA),
    "d.parquet": (columns, DATA[1:]),
    "d.hdf5": (datasets, DATA[1:]),
    "d.dfq": (qdas, DATA[:2]),
    "d.fmu": (fmu, ("new --machine {} -o n.toml", "run drive.toml --machine {}")),
}


def as_bytes(raw: bytes, dice: random.Random) -> Iterator[tuple[str, bytes]]:
    """Yield changes that know nothing of the format."""
    yield "empty", b""
    yield "only zeros", bytes(len(raw))
    yield "twice", raw + raw
    for _ in range(8):
        place = dice.randrange(len(raw))
        bit = bytearray(raw)
        bit[place] ^= 1 << dice.randrange(8)
        yield f"bit in {place}", bytes(bit)
        hole = bytearray(raw)
        hole[place : place + 40] = dice.randbytes(len(hole[place : place + 40]))
        yield f"noise at {place}", bytes(hole)
    for _ in range(4):
        place = dice.randrange(len(raw))
        yield f"cut at {place}", raw[:place]


def as_archive(raw: bytes, dice: random.Random) -> Iterator[tuple[str, bytes]]:
    """Yield changes of a ZIP archive."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        files = {info.filename: archive.read(info) for info in archive.infolist()}
    for name in files:
        yield f"without {name}", zipped({n: x for n, x in files.items() if n != name})
        yield f"empty {name}", zipped(files | {name: b""})
        yield f"noise as {name}", zipped(files | {name: dice.randbytes(1000)})
        yield f"bomb as {name}", zipped(files | {name: bytes(BLOCK)})
    for name in ("../../out", "/tmp/out", "resources/../../out", "binaries\\..\\out"):
        yield f"with {name}", zipped(files | {name: b"out"})
    packed = zipped(files)
    for word, place, value in (
        ("encrypted", 6, 1),
        ("method 99", 8, 99),
        ("method 14", 8, 14),
    ):
        changed = bytearray(packed)
        for sign, more in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
            for found in re.finditer(re.escape(sign), packed):
                struct.pack_into("<H", changed, found.start() + place + more, value)
        yield word, bytes(changed)
    for sign, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24), (b"PK\x01\x02", 16)):
        changed = bytearray(packed)
        for found in re.finditer(re.escape(sign), packed):
            struct.pack_into("<I", changed, found.start() + place, 7)
        yield f"{sign!r}: 7 at {place}", bytes(changed)


def as_xml(raw: bytes, most: int = 40) -> Iterator[tuple[str, bytes]]:
    """Yield changes of the XML in an archive."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        files = {info.filename: archive.read(info) for info in archive.infolist()}
    number = 0
    for name in ("xl/workbook.xml", "xl/worksheets/sheet1.xml", "xl/_rels/workbook.xml.rels",
                 "xl/styles.xml", "content.xml", "modelDescription.xml"):  # fmt: skip
        if name not in files:
            continue
        page = files[name].decode()
        change = lambda new, name=name: zipped(files | {name: new.encode()})  # noqa: E731
        root = page.index("<", page.index("?>") if "?>" in page else 0)
        root = page.index("<", root) if page[root + 1] != "?" else root
        body = page[root:]
        laughs = "".join(
            f'<!ENTITY a{i} "{f"&a{i - 1};" * 10 if i else "ha" * 50}">'
            for i in range(9)
        )
        outside = '<!ENTITY a8 SYSTEM "file:///etc/passwd">'
        for word, entities in (
            ("billion laughs", laughs),
            ("external entity", outside),
        ):
            inner = re.sub(r"(<[^>/]+>)", r"\1&a8;", body, count=1)
            yield f"{name}: {word}", change(f"<!DOCTYPE x [{entities}]>{inner}")
        for code in ("utf-16", "ebcdic-nothing", "cp037"):
            yield (
                f"{name}: {code}",
                change(f'<?xml version="1.0" encoding="{code}"?>{body}'),
            )
        deep = "<a>" * 200_000 + "</a>" * 200_000
        yield (
            f"{name}: deep",
            change(re.sub(r"(<[^>/]+>)", rf"\1{deep}", body, count=1)),
        )
        wide = "<a b='1'/>" * 1_000_000
        yield (
            f"{name}: wide",
            change(re.sub(r"(<[^>/]+>)", rf"\1{wide}", body, count=1)),
        )
        pairs = {
            (m[1], m[2]): m
            for m in re.finditer(
                r"<([\w:]+)(?: [^>]*?)? ([\w:]+)=[\"'][^\"']*[\"']", body
            )
        }
        step = max(1, len(pairs) * len(HOSTILE) // most)
        for (tag, key), match in pairs.items():
            for value in HOSTILE:
                number += 1
                if number % step:
                    continue
                begin, rest = body[: match.start()], body[match.start() :]
                quoted = value.replace("&", "&amp;").replace("<", "&lt;")
                rest = re.sub(
                    rf' {key}=(["\'])[^"\']*["\']', f' {key}="{quoted}"', rest, count=1
                )
                yield f"{name}: {tag} {key}={value[:12]!r}", change(begin + rest)


def as_columns(_: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield Parquet and HDF5 files that are larger than they look."""
    rows = 30_000_000
    numbers = pyarrow.table({"d": np.zeros(rows), "Charge": np.zeros(rows)})
    yield (
        "30 million rows",
        saved(lambda f: parquet.write_table(numbers, f, compression="zstd")),
    )
    long = pyarrow.array(["x" * 1_000_000]).dictionary_encode().take([0] * 100_000)
    words = pyarrow.table({"d": long, "Charge": np.zeros(100_000)})
    yield (
        "long texts",
        saved(lambda f: parquet.write_table(words, f, compression="zstd")),
    )
    nested = pyarrow.table({"d": [[{"a": 1}]] * 9, "Charge": [None] * 9})
    yield "nested", saved(lambda f: parquet.write_table(nested, f))
    many = pyarrow.table({f"c{i}": [1.0, 2.0] for i in range(20_000)})
    yield "20 000 columns", saved(lambda f: parquet.write_table(many, f))


def as_datasets(_: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield HDF5 files that are larger than they look, or of odd types."""
    million = 1_000_000
    yield "long texts", datasets(x=((40,), f"S{50 * million}"))
    yield (
        "40 columns of 19 million",
        datasets(**{f"c{i}": ((19 * million,), "f8") for i in range(40)}),
    )
    yield (
        "fields of texts",
        datasets(x=((40,), [("d", f"S{20 * million}"), ("e", "f8")])),
    )
    yield (
        "fields of fields",
        datasets(x=((40,), [("d", [("a", "f8")]), ("e", "f8", (3,))])),
    )
    yield "complex", datasets(x=((40,), "c16"))
    yield "no rows", datasets(x=((0,), "f8"))


def zipped(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return file.getvalue()


def changes(name: str) -> Iterator[tuple[str, bytes]]:
    """Yield what is changed in a file, and its bytes."""
    raw, dice = FILES[name][0](), random.Random(5)
    yield "nothing", raw
    yield from as_bytes(raw, dice)
    if raw.startswith(b"PK"):
        yield from as_archive(raw, dice)
        yield from as_xml(raw)
    if name == "d.parquet":
        yield from as_columns(raw)
    if name == "d.hdf5":
        yield from as_datasets(raw)


def main(words: list[str]) -> int:
    chosen = [name for name in FILES if not words or any(w in name for w in words)]
    warm()
    counts, wrong = Counter(), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(os.path.realpath(name))
        os.environ["XDG_CACHE_HOME"] = str(folder / "cache")  # where FMUs are unpacked
        for file in chosen:
            for change, data in changes(file):
                place = folder / "a" / "b"
                shutil.rmtree(folder / "a", ignore_errors=True)
                place.mkdir(parents=True)
                (place / file).write_bytes(data)
                (place / "measured.toml").write_text(MEASURED.format(file))
                (place / "results.toml").write_text(RESULTS.format(file))
                (place / "drive.toml").write_text(DRIVE)
                for command in FILES[file][1]:
                    ended = ask(command.format(file), place)
                    kind = ended.kind
                    if (folder / "a" / "out").exists() or Path("/tmp/out").exists():
                        kind = "out of its folder"
                    if change == "nothing" and kind != "worked":
                        kind = f"{kind}, unchanged"
                    counts[kind] += 1
                    if kind not in ("worked", "sentence"):
                        wrong += 1
                        print(
                            f"{kind} | {file}: {change} | {command} | {ended.last_line}",
                            flush=True,
                        )
    print(f"\n{words_of(counts)}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

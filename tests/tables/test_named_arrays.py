"""Parquet and HDF5 files that unpack to more than they look."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

from tolstat.errors import DataError
from tolstat.tables.read import read_table

MILLION = 1_000_000


def of_parquet(**columns):
    file = io.BytesIO()
    parquet.write_table(
        pyarrow.table(columns), file, compression="zstd", store_schema=False
    )
    return file.getvalue()


def of_hdf5(*shapes):
    """Compressed datasets without data."""
    file = io.BytesIO()
    with h5py.File(file, "w") as data:
        for number, (rows, kind) in enumerate(shapes):
            data.create_dataset(f"g/d{number}", rows, kind, chunks=True)
    return file.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.parquet", of_parquet(d=np.zeros(21 * MILLION, "i1"))),
        ("a.h5", of_hdf5(((40,), f"S{5 * MILLION}"))),
        ("a.h5", of_hdf5(*[((11 * MILLION,), "f8")] * 2)),
        ("a.h5", of_hdf5(((40,), [("d", f"S{5 * MILLION}"), ("e", "f8")]))),
    ],
)
def test_what_unpacks_to_much_is_refused(name, content):
    assert len(content) < MILLION
    with pytest.raises(DataError, match=r"unpacks to .* at most 160 MB are allowed"):
        read_table(Path(name), content)


PEAK = """
import pathlib, sys, pyarrow
from tolstat.errors import DataError
from tolstat.tables.read import read_table
path = pathlib.Path(sys.argv[1])
try:
    read_table(path, path.read_bytes())
except DataError as error:
    print(pyarrow.default_memory_pool().max_memory(), error)
"""


def test_a_long_text_is_refused_before_each_row_holds_it(tmp_path):
    path = tmp_path / "a.parquet"
    long = pyarrow.array(["x" * MILLION]).dictionary_encode().take([0] * 500)
    path.write_bytes(of_parquet(d=np.arange(500.0), words=long))
    command = [sys.executable, "-c", PEAK, str(path)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    peak, words = told.split(maxsplit=1)
    assert "a cell has 1000000 characters; at most 1000" in words
    assert int(peak) < 50 * MILLION


def test_an_empty_text_is_an_empty_cell():
    content = of_parquet(d=[1.0, 2.0, 3.0], lot=[b"a", None, b"b"])
    rows = read_table(Path("a.parquet"), content).grid.rows
    assert [row.cells[1] for row in rows[1:]] == ["a", "", "b"]


def test_times_are_no_numbers_and_lists_no_columns():
    """Nanoseconds were read as numbers without a unit; lists may unpack without end."""
    days = pyarrow.array([0, 1], pyarrow.timestamp("ns"))
    content = of_parquet(d=[0.1, 0.2], lists=[[1.0] * 9, [2.0]], day=days)
    table = read_table(Path("a.parquet"), content)
    assert table.head.names == ("d", "day")
    assert [row.cells[0] for row in table.rows] == [0.1, 0.2]
    assert all(row.cells[1].startswith("1970-01-01") for row in table.rows)

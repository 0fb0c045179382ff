"""HDF5 files of other programs, and crafted ones."""

from __future__ import annotations

import io
import tracemalloc
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from tolstat.errors import DataError
from tolstat.hdf5_heaps import HEAP, longest_object
from tolstat.tables.raw_file import AS_IS
from tolstat.tables.read import read_table

MILLION = 1_000_000
TEXT = h5py.string_dtype()


def file_of(fill, **how):
    """The bytes of a file that a function fills."""
    file = io.BytesIO()
    with h5py.File(file, "w", **how) as data:
        fill(data)
    return file.getvalue()


def table_of(content, *requested, form=AS_IS):
    return read_table(Path("a.h5"), bytes(content), form, requested)


def refused(content, words, *requested):
    with pytest.raises(DataError, match=words):
        table_of(content, *requested)


def test_a_heap_without_an_end_is_refused():
    """Followed by the library it hangs, deaf to signals."""
    file = io.BytesIO()
    with h5py.File(file, "w") as data:
        data["d"] = np.array(["a", "bc"] * 300, dtype=h5py.string_dtype())
        data["e"] = np.arange(600.0)
    whole = file.getvalue()
    assert longest_object(whole) == 2 and whole.count(b"GCOL") == 1
    assert len(read_table(Path("a.h5"), whole).rows) == 600
    for place in [heap.start() + 16 for heap in HEAP.finditer(whole)]:
        damaged = bytearray(whole)
        damaged[place : place + 16] = bytes(16)
        with pytest.raises(DataError, match="a heap of its texts has no end"):
            read_table(Path("a.h5"), bytes(damaged))


def test_a_text_that_all_rows_refer_to_is_read_in_parts():
    """A file of 3 MB took 10 GB."""
    file = io.BytesIO()
    with h5py.File(file, "w") as data:
        rows = data.create_dataset("d", 10_000, h5py.string_dtype())
        rows[:2] = "x" * MILLION, "y"
        place = rows.id.get_offset()
    whole = bytearray(file.getvalue())
    whole[place : place + 160_000] = whole[place : place + 16] * 10_000
    tracemalloc.start()
    with pytest.raises(DataError, match=r"unpacks to 320 MB; at most 160 MB"):
        read_table(Path("a.h5"), bytes(whole))
    assert tracemalloc.get_traced_memory()[1] < 400 * MILLION
    tracemalloc.stop()


def test_a_heap_is_looked_at_as_the_library_does():
    """Whatever stands in its reserved bytes; heaps in heaps were followed each."""

    def fill(data):
        data["d"] = np.array(["a", "bc"] * 300, dtype=TEXT)

    damaged = bytearray(file_of(fill))
    heap = HEAP.search(damaged).start()
    damaged[heap + 5] = 7
    damaged[heap + 16 : heap + 32] = bytes(16)
    refused(damaged, "a heap of its texts has no end")
    head = b"GCOL\x01\0\0\0" + (4096).to_bytes(8, "little")
    inner = (1).to_bytes(8, "little") + (16).to_bytes(8, "little") + head
    free = bytes(8) + (4096 - 16 - 32).to_bytes(8, "little")
    nested = head + inner + free
    refused(nested + bytes(9000), "over each other")


def test_sizes_of_other_lengths_are_refused():
    """Of such a file the sizes in heaps would be looked at in the wrong places."""
    plan = h5py.h5p.create(h5py.h5p.FILE_CREATE)
    plan.set_sizes(8, 4)
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fapl_core(backing_store=False)
    file = h5py.h5f.create(b"a.h5", fcpl=plan, fapl=access)
    with h5py.File(file) as data:
        data["d"] = np.zeros(9)
        data.flush()
        refused(file.get_file_image(), "its sizes have other than 8 bytes")


def test_groups_in_circles_end():
    def fill(data):
        data["d"] = np.zeros(9)
        for number in range(30):
            data[f"g{number}"] = data["/"]

    refused(file_of(fill), "more than 10000 groups and datasets")


def chunk(data, packed, **how):
    rows = data.create_dataset("d", 10, "f8", chunks=(10,), **how)
    rows.id.write_direct_chunk((0,), packed)


@pytest.mark.parametrize(
    ("how", "packed", "words"),
    [
        ({"compression": "gzip"}, zlib.compress(bytes(MILLION)), "unpacks to more"),
        ({"compression": "gzip", "fletcher32": True},
         zlib.compress(bytes(MILLION)) + bytes(4), "unpacks to more"),
        ({"fletcher32": True}, b"ab", "a chunk that is cut off"),
    ],
)  # fmt: skip
def test_a_chunk_that_is_not_what_it_says_is_refused(how, packed, words):
    """It took gigabytes, or ended the process by SIGSEGV."""
    refused(file_of(lambda data: chunk(data, packed, **how)), words)


@pytest.mark.parametrize("packing", [
    {}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"},
    {"compression": "gzip", "fletcher32": True},
])  # fmt: skip
def test_chunks_of_other_programs_are_read(packing):
    values = np.random.default_rng(1).normal(size=3000)  # some do not pack
    rows = table_of(file_of(lambda data: data.create_dataset(
        "d", data=values, chunks=(7,), **packing))).rows  # fmt: skip
    assert [row.cells[0] for row in rows] == values.tolist()


def test_numbers_that_netcdf_packed_are_unpacked():
    """Parts of 10.05 mm were 50 mm, and what stands for none a part."""

    def fill(data):
        data["d"] = np.array([50, 60, -1, 70], "i2")
        data["d"].attrs.update(
            scale_factor=[0.001], add_offset=10.0, _FillValue=np.int16(-1)
        )

    cells = [row.cells[0] for row in table_of(file_of(fill)).rows]
    assert cells == pytest.approx([10.05, 10.06, 10.07])
    data = file_of(lambda data: data.create_dataset("d", data=[1.0]).attrs.update(
        scale_factor=[1.0, 2.0]))  # fmt: skip
    refused(data, "its scale_factor is not one number")


def test_a_unit_is_one_text():
    def fill(units):
        return lambda data: data.create_dataset("d", data=[1.0]).attrs.update(
            units=np.array(units, TEXT)
        )

    assert table_of(file_of(fill(["mm"]))).head.units == ("mm",)
    refused(file_of(fill(["mm", "m"])), "its units is not one text")


def test_only_the_table_with_requested_columns_is_looked_at():
    """As pandas writes tables: with an index whose datasets have several lengths."""

    def fill(data):
        data["index/a"], data["index/b"] = np.zeros(3), np.zeros(5)
        kind = [("d", "f8"), ("block", "f8", (2,))]
        data["table"] = np.zeros(4, kind)

    table = table_of(file_of(fill), "d")
    assert table.head.names == ("d",) and len(table.rows) == 4
    refused(file_of(fill), "several tables: /table, /index")


def test_fields_that_hide_texts_are_no_columns():
    """The library reads them whatever is asked for: gigabytes of a megabyte."""

    def fill(data):
        hidden = np.dtype([("text", TEXT)])
        data.create_dataset("d", 5, [("d", "f8"), ("hidden", hidden)])

    refused(file_of(fill), "has no table")


def test_a_column_of_a_type_that_numpy_has_not_is_a_sentence():
    file = io.BytesIO()
    with h5py.File(file, "w") as data:
        space = h5py.h5s.create_simple((3,))
        h5py.h5d.create(data.id, b"t", h5py.h5t.UNIX_D32LE, space)
    with pytest.raises(DataError, match=r"cannot be read as HDF5: .*TypeTimeID"):
        read_table(Path("a.h5"), file.getvalue())

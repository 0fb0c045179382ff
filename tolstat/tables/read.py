"""Tables of files by their kind: text, workbook, Parquet or HDF5."""

from collections.abc import Sequence
from pathlib import Path

from tolstat.errors import DataError
from tolstat.tables import named_arrays, qdas, workbook_reader
from tolstat.tables.delimited import read_delimited
from tolstat.tables.no_value import without_codes
from tolstat.tables.raw_file import AS_IS, Form, RawFile
from tolstat.tables.table import Table

HDF5 = (".h5", ".hdf5", ".hdf", ".he5")
MOST_MEGABYTES = 32  # of a file


def read_table(
    path: Path, raw: bytes, form: Form = AS_IS, requested: Sequence[str] = ()
) -> Table:
    """Return the table of a text, a workbook, a Parquet or an HDF5 file.

    Arguments are those of `RawFile`.

    Raises
    ------
    DataError
        If it cannot be read, or in two ways.
    """
    file, ending = RawFile(path, raw, form, requested), path.suffix.lower()
    if ending in qdas.ENDINGS:
        raise DataError(
            f"{path}: a Q-DAS file has measured parts, and no rows of trials"
        )
    if ending in workbook_reader.ENDINGS or raw.startswith(workbook_reader.ZIP):
        grid = workbook_reader.read_workbook(file)
    elif ending in named_arrays.PARQUET:
        grid = named_arrays.read_parquet(file)
    elif ending in HDF5:
        from tolstat.tables.hdf5_tables import read_hdf5  # HDF5 is slow to load

        grid = read_hdf5(file)
    else:
        grid = read_delimited(file)
    if form.no_value:
        grid = without_codes(grid, form.no_value)
    return Table(grid, form)

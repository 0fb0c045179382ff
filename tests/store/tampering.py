"""Run files changed on purpose, as a disk or another program might."""

from __future__ import annotations

from contextlib import contextmanager

import h5py

from tolstat.store.integrity import fingerprints, write_seal
from tolstat.store.layout import CHECKSUM, columns_of, extents_of


@contextmanager
def resealed(path):
    """Change a run as if tolstat had written it so: seal and checksums fit again."""
    with h5py.File(path, "r+") as file:
        yield file
    with h5py.File(path, "r+") as file:
        columns = [file[name][...] for name in columns_of(file)]
        if len({len(each) for each in columns}) == 1:
            file[CHECKSUM][...] = fingerprints(columns)
        block, extents = file.userblock_size, extents_of(file).values()
    holes = [extent.hole for extent in extents]
    with path.open("r+b", buffering=0) as file:
        write_seal(file, block, holes)


def everything(run):
    """All that a run says, in words that NaN does not divide."""
    columns = {name: run.column(name).tobytes() for name in (*run.units, "status")}
    rest = (
        run.nominal_values,
        run.diagnostics,
        run.audited,
        run.provenance,
        run.limits,
    )
    words = (run.study, run.settings, run.assumed, run.notes, run.contributors)
    return repr((columns, rest, words, run.responses, run.sampled, run.title))

"""Checks that a run file is unchanged."""

from __future__ import annotations

import io
import random

import h5py
import numpy as np
import pytest

import tolstat
from tests.store.tampering import everything, resealed
from tolstat.errors import DamagedError, RunFileError
from tolstat.store.integrity import fingerprints, ranges_of
from tolstat.store.layout import MemoryFile

STUDY = {
    "model": "toy", "trials": 300, "seed": 1, "deviations": {"part": "+-1 mm"},
    "limits": {"gap": "<= 2 mm"},
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    from tests.conftest import Toy

    return tolstat.run(
        STUDY, model=Toy(), output=tmp_path_factory.mktemp("run") / "r.h5"
    )


def test_every_flipped_bit_changes_the_checksum_of_its_row_alone():
    rng = np.random.default_rng(4)
    columns = [
        rng.standard_normal(5), rng.integers(0, 9, 5), rng.integers(0, 5, 5, np.uint8),
        np.array([b"plain", b"odd", b"", b"odd", b"x"]),
    ]  # fmt: skip
    before = fingerprints(columns)
    assert len(set(before.tolist())) == 5 and before.all()
    for column in columns:
        size = column.dtype.itemsize
        for bit in range(8 * size):
            column.view(np.uint8)[2 * size + bit // 8] ^= 1 << bit % 8
            changed = fingerprints(columns) != before
            column.view(np.uint8)[2 * size + bit // 8] ^= 1 << bit % 8
            assert changed.tolist() == [False, False, True, False, False]


def test_swapped_signs_and_rows_are_detected():
    one, other = np.array([1.0, 2.0]), np.array([3.0, 4.0])
    before = fingerprints([one, other])
    assert np.all(fingerprints([-one, -other]) != before)
    assert np.all(fingerprints([one[::-1], other[::-1]]) != before)
    assert np.all(fingerprints([one, other], first=7) != before)
    assert fingerprints([one[1:], other[1:]], first=1)[0] == before[1]


def test_a_file_in_memory_is_a_file():
    rng, ours, known = random.Random(3), MemoryFile(), io.BytesIO()
    for _ in range(400):
        place, data = rng.randrange(40_000), rng.randbytes(rng.randrange(9000))
        for file in (ours, known):
            file.seek(place)
            file.write(data)
        place, count = rng.randrange(60_000), rng.randrange(9000)
        ours.seek(place), known.seek(place)
        assert ours.read(count) == known.read(count) and ours.tell() == known.tell()
    copy = io.BytesIO()
    ours.copy_to(copy)
    assert copy.getvalue() == known.getvalue()
    ours.truncate(100_000)
    assert ours.seek(0, 2) == 100_000 and ours.read() == b""


def test_flipped_bytes_are_found_without_a_crash(run, tmp_path):
    """460 of them, everywhere in the file: found, or nothing of the run is another."""
    data, path = run.path.read_bytes(), tmp_path / "flipped.h5"
    rng, asked, harmless = random.Random(9), everything(run), 0
    with h5py.File(run.path) as file:
        gap = file["gap"].id.get_offset()
    places = [rng.randrange(len(data)) for _ in range(455)]
    for place in [*places, 0, 8, 20, gap, len(data) - 1]:
        flipped = bytearray(data)
        flipped[place] ^= 1 << rng.randrange(8)
        path.write_bytes(flipped)
        try:
            harmless += 1
            assert everything(tolstat.open(path)) == asked, place
        except RunFileError as error:
            harmless -= 1
            assert str(path) in str(error)
    assert harmless < 46  # bytes between the datasets, and of nobody


def test_a_damaged_trial_is_named_and_others_are_read(run, tmp_path):
    path = tmp_path / "damaged.h5"
    path.write_bytes(run.path.read_bytes())
    with h5py.File(path, "r+") as file:
        file["gap"][17] *= 2
        file["part_1"][[40, 41, 42]] = 0.0
        file["status"][200] = 0
        file["nominal/gap"][...] = 1.0
    with pytest.raises(DamagedError, match=r"trials 17, 40-42, 200, the nominal trial"):
        tolstat.open(path)
    found = tolstat.open(path, damaged=True)
    assert found.damage.trials.tolist() == [17, 40, 41, 42, 200]
    np.testing.assert_array_equal(found.column("gap")[18:], run.column("gap")[18:])
    with pytest.raises(DamagedError):
        tolstat.report(path)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_no_run(run, tmp_path, share):
    data, path = run.path.read_bytes(), tmp_path / "short.h5"
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(RunFileError, match=r"bytes of|cannot be read"):
        tolstat.open(path)
    path.write_bytes(data + b"more")
    with pytest.raises(DamagedError, match="changed by another program"):
        tolstat.open(path)


def test_changes_by_another_program_are_detected(run, tmp_path):
    path = tmp_path / "changed.h5"
    path.write_bytes(run.path.read_bytes())
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = "mine"
    with pytest.raises(DamagedError, match="changed by another program"):
        tolstat.open(path)
    with resealed(path):
        pass
    assert tolstat.open(path).title == "mine"


def test_numbers_of_trials_as_text():
    assert ranges_of([3, 17, 18, 19, 21]) == "3, 17-19, 21"
    assert ranges_of(range(0, 100, 2)).endswith("38, and 30 more ranges")

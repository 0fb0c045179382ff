"""Run files of strangers: sealed, and not what tolstat writes."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import sys
import tomllib
from dataclasses import replace
from unittest import mock

import h5py
import numpy as np
import pytest

import tolstat
from tests.conftest import TOY_STUDY, Toy
from tolstat.errors import RunFileError, StudyError
from tolstat.execution.compatibility import study_differs, study_of
from tolstat.hdf5_heaps import HEAP
from tolstat.store import integrity, open_run
from tolstat.store.assumed import SCORES
from tolstat.store.integrity import clock_of, write_seal
from tolstat.store.layout import CLOCK

TRIALS = 1000
ENTRY = "from tolstat.cli.entry import entry; entry()"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    study = tomllib.loads(TOY_STUDY)
    return tolstat.run(study, model=Toy(), output=folder / "run.h5").path


@pytest.fixture
def crafted(good, tmp_path):
    """Return a run that a function changes, sealed again."""

    def craft(change):
        path = tmp_path / "run.h5"
        shutil.copy(good, path)
        with h5py.File(path, "r+") as file:
            change(file)
            block = file.userblock_size
        with path.open("r+b", buffering=0) as file:
            write_seal(file, block, [])
        return path

    return craft


def instead(name, *data, **how):
    """Return a change that puts another dataset, or a link, in the place of one."""

    def change(file):
        attributes = {
            key: value
            for key, value in file[name].attrs.items()
            if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME")
        }
        del file[name]
        if how:
            file.create_dataset(name, *data, **how).attrs.update(attributes)
        else:
            file[name] = data[0]

    return change


def virtual(source):
    def change(file):
        layout = h5py.VirtualLayout((TRIALS,), "f8")
        layout[...] = h5py.VirtualSource(source, "part_1", (TRIALS,))
        del file["part_1"]
        file.create_virtual_dataset("part_1", layout)

    return change


def attributes(owner, **values):
    return lambda file: file[owner].attrs.update(values)


def assumed(**values):
    def change(file):
        for name, value in values.items():
            file["assumed"][name][...] = value

    return change


def texts(**values):
    def change(file):
        for name, words in values.items():
            kind = h5py.string_dtype()
            file.attrs.create(name, np.array(words, object), dtype=kind)

    return change


def clock(seconds, written):
    def change(file):
        with mock.patch("time.time", return_value=written):
            file[CLOCK][...] = clock_of(seconds)

    return change


def many_attributes(file):
    for number in range(20_001):
        file["provenance"].attrs[f"a{number}"] = 0


LISTS = np.array([np.zeros(2), np.zeros(3)], object)
ROWS = {"shape": (TRIALS,), "dtype": "f8"}
LARGE = {"shape": (10**9,), "dtype": "f8", "fillvalue": 1.0}
OUTSIDE = "not a complete run: /part_1 does not lie in the file itself"
LINK = "/part_1 is a link"
TYPE, ATTRIBUTE = "of another type", "its attribute .* is of another type"
CHANGES = {
    "external": (instead("part_1", external=[("a.bin", 0, 8000)], **ROWS), OUTSIDE),
    "external pipe": (instead("part_1", external=[("pipe", 0, 8000)], **ROWS), OUTSIDE),
    "virtual": (virtual("secret.h5"), OUTSIDE),
    "virtual of itself": (virtual("."), OUTSIDE),
    "soft link": (instead("part_1", h5py.SoftLink("/gap")), LINK),
    "link to itself": (instead("part_1", h5py.SoftLink("/part_1")), LINK),
    "external link": (instead("part_1", h5py.ExternalLink("secret.h5", "/gap")), LINK),
    "circle": (lambda file: file["settings"].__setitem__("a", file["/"]), "of a run"),
    "twice": (lambda file: file.__setitem__("b", file["part_1"]), "/part_1 lies where"),
    "fill value": (instead("part_1", **LARGE), "longer than the file"),
    "chunks": (instead("part_1", chunks=(1000,), **LARGE), OUTSIDE),
    "attributes": (many_attributes, "/provenance has more than 20000 attributes"),
    "filter": (instead("part_1", chunks=(10,), compression="gzip", **ROWS), OUTSIDE),
    "another type": (instead("part_1", np.zeros(TRIALS, "f4")), TYPE),
    "another order": (instead("part_1", np.zeros(TRIALS, ">f8")), TYPE),
    "integers": (instead("part_1", data=np.zeros(TRIALS, "i8")), "have other numbers"),
    "texts of any length": (instead("part_1", np.array(["x"] * TRIALS, "O")), TYPE),
    "sequences": (instead("part_1", shape=(9,), dtype=h5py.vlen_dtype("f8")), TYPE),
    "references": (instead("part_1", shape=(TRIALS,), dtype=h5py.ref_dtype), TYPE),
    "records": (instead("part_1", np.zeros(TRIALS, [("a", "f8")])), TYPE),
    "named type": (lambda file: file.__setitem__("a", np.dtype("f8")), "not of a run"),
    "two dimensions": (instead("part_1", np.zeros((TRIALS, 2))), "other dimensions"),
    "short": (instead("part_1", np.zeros(3)), "complete run"),
    "no values": (instead("part_1", h5py.Empty("f8")), "has no values"),
    "group": (lambda file: file.create_group("settings/mode/a"), "not of a run"),
    "more": (lambda file: file.create_dataset("a", data=np.zeros(9)), "columns"),
    "columns doubled": (texts(contributors=["part_1", "part_1"]), "its columns"),
    "column outside": (texts(contributors=["part_1", "checks/clock"]), "complete run"),
    "text for a number": (attributes("/", sampled_seed="3"), ATTRIBUTE),
    "reference": (lambda file: file.attrs.update(title=file["gap"].ref), ATTRIBUTE),
    "sequence": (
        lambda file: file.attrs.create("title", LISTS, dtype=h5py.vlen_dtype("f8")),
        ATTRIBUTE,
    ),
    "limit NaN": (attributes("gap", limit_lower=np.nan), "a limit is wrong"),
    "limit upside down": (attributes("gap", limit_lower=9.0), "a limit is wrong"),
    "demand": (attributes("gap", limit_typed_ppk=np.inf), "a limit is wrong"),
    "tolerance": (assumed(tolerance_lower=np.nan), "an assumption"),
    "shares in common": (assumed(common=2.0), "an assumption"),
    "centre": (assumed(centre=np.inf), "an assumption"),
    "quantiles that descend": (assumed(quantiles=SCORES[::-1]), "an assumption"),
    "few quantiles": (instead("assumed/quantiles", np.zeros((3, 9))), "an assumption"),
    "many contributors": (instead("assumed/centre", np.zeros(9)), "complete run"),
    "unit": (attributes("gap", units="zorkmid"), "zorkmid"),
    "sampling": (attributes("/", sampling="zorkmid"), "of its sampling"),
    "deep table": (attributes("/", study_text=".".join("a" * 9000) + " = 1"), "tables"),
    "deep list": (attributes("/", study_text="a = " + "[" * 9000), "complete run"),
    "study": (attributes("/", study_text="links = 5"), "its study is wrong"),
    "clock": (clock(1e300, 1e300), "its clock is wrong"),
    "duration": (clock(1e300, 1e9), "its duration is wrong"),
    "infinite": (lambda file: file["part_1"].write_direct(np.full(TRIALS, np.inf)), ""),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_a_crafted_run_is_refused_in_one_sentence(change, crafted, tmp_path, good):
    craft, words = CHANGES[change]
    (tmp_path / "a.bin").write_bytes(b"secret  " * TRIALS)
    shutil.copy(good, tmp_path / "secret.h5")
    os.mkfifo(tmp_path / "pipe")
    path = crafted(craft)
    if not words:  # its checksums do not fit
        assert len(tolstat.open(path, damaged=True).damage.trials) == TRIALS
        return
    with pytest.raises(RunFileError, match=words) as refused:
        tolstat.open(path, damaged=True)
    assert refused.value.exit_code == 2 and len(str(refused.value).splitlines()) == 1


def resealed(path, change):
    """Change the bytes of a run and seal it again, but for what the change returns."""
    with h5py.File(path) as file:
        block = file.userblock_size
    content = bytearray(path.read_bytes())
    unsealed = change(content)
    path.write_bytes(content)
    with path.open("r+b", buffering=0) as file:
        write_seal(file, block, unsealed)


def no_size(content):
    place = HEAP.search(content).start() + 16
    content[place : place + 16] = bytes(16)
    return []


def cut_by_a_hole(content):
    place = HEAP.search(content).start() + 100
    return [(place, place + 8)]


def in_a_hole(content):
    place = HEAP.search(content).start()
    return [(place + 1, place + 4096)]


def elsewhere(content):
    place = content.index(b"attribute that is long")
    return [(place, place + 8)]


def of_one_text(content):
    """Let all 3000 texts of a list be the only long one, as one of them is."""
    place = content.index(struct.pack("<I", 100_001))
    long = content[place : place + 16]
    short = re.compile(re.escape(struct.pack("<I", 3)) + b".{12}", re.DOTALL)
    start = place
    while match := short.match(content, start + 16):
        start = match.start()
        content[start : start + 16] = long
    assert start - place > 2900 * 16
    return []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (no_size, "a heap of its texts has no end"),
        (cut_by_a_hole, "a heap of its texts has no end"),
        (in_a_hole, "texts lie where its trials do"),
        (elsewhere, "leaves out more than rows"),
        (of_one_text, "its texts are longer than the file"),
    ],
)
def test_heaps_of_a_run_are_looked_at_before_the_library_reads_them(
    change, words, crafted
):
    """It follows them for ever, or reads 300 MB of 100 kB."""

    def craft(file):
        several = np.array(["x" * 100_001, *["abc"] * 3000], object)
        kind = h5py.string_dtype()
        file["settings"].attrs.create("a", several, dtype=kind)
        file["settings"].attrs["b"] = np.bytes_(b"attribute that is long")

    path = crafted(craft)
    resealed(path, lambda content: [])
    assert tolstat.open(path).trials == TRIALS
    resealed(path, change)
    with pytest.raises(RunFileError, match=words):
        tolstat.open(path)


def test_a_run_that_is_replaced_while_it_is_opened_is_read_whole(good, tmp_path):
    """Its seal belongs to another file than its datasets, which lie elsewhere."""
    path, other = shutil.copy(good, tmp_path / "run.h5"), tmp_path / "other.h5"
    tolstat.run(tomllib.loads(TOY_STUDY), model=Toy(), output=other, trials=2000)

    def replacing(path):
        unsealed = integrity.check_seal(path)
        if other.exists():
            other.replace(path)
        return unsealed

    with mock.patch.object(open_run, "check_seal", replacing):
        assert tolstat.open(path).trials == 2000


@pytest.mark.parametrize("value", [np.inf, np.nan, 1e308, -1e308])
def test_a_response_no_model_may_have_is_refused(value, tmp_path):
    """Figures and squares of such numbers end in NaN; checksums fit them."""
    run = tolstat.run(tomllib.loads(TOY_STUDY), model=Toy())
    columns = {**run.columns, "gap": np.full(run.trials, value)}
    path = tmp_path / "a.h5"
    tolstat.save(replace(run, columns=columns), path)
    with pytest.raises(RunFileError, match="numbers"):
        tolstat.open(path)


def test_all_columns_share_the_scale_of_trials(good):
    """Its list is written once: written for each column again, it is quadratic."""
    with mock.patch.object(h5py.h5ds, "attach_scale") as attach:
        run = tolstat.run(tomllib.loads(TOY_STUDY), model=Toy(), output=f"{good}.2")
    scales = {h5py.h5i.get_name(call.args[1]) for call in attach.call_args_list}
    assert b"/trial" not in scales
    with h5py.File(run.path) as file:
        names = [name for name in run.columns if name != "trial"]
        for name in names:
            assert h5py.h5ds.is_attached(file[name].id, file["trial"].id, 0)
            assert file[name].dims[0][0].name == "/trial"
        users = file["trial"].attrs["REFERENCE_LIST"]
        assert {file[user].name[1:] for user, _ in users} == {*names, "checks/checksum"}


def test_a_crafted_run_ends_a_command_with_one_sentence(crafted):
    """In a process of its own: a virtual dataset of itself ended it by a signal."""
    path = crafted(virtual("."))
    for words in (["show", path], ["export", path, "-o", path.with_suffix(".csv")]):
        command = [sys.executable, "-c", ENTRY, *map(str, words)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert ended.returncode == 2 and "Traceback" not in ended.stderr


def test_a_file_that_a_run_names_is_not_quoted(crafted, tmp_path):
    """Neither a file beside it nor a study elsewhere, unless it has the run's text."""
    (tmp_path / "secret.toml").write_text(f'{TOY_STUDY}\npassword = "x"')
    run = tolstat.open(crafted(attributes("/", study_file="secret.toml")))
    (words,) = study_differs(run)
    assert "password" not in words and "differs" in words
    (tmp_path / "run.toml").write_text('password = "x"\n')
    run = tolstat.open(crafted(attributes("/", study_file="run.toml")))
    assert study_differs(run) and "password" not in str(study_differs(run))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    study = elsewhere / "study.toml"
    study.write_text(run.study.text)
    run = tolstat.open(crafted(attributes("/", study_file="elsewhere/study.toml")))
    assert study_differs(run) == [] and run.data_folder == elsewhere
    study.write_text(f'{run.study.text}\npassword = "x"')
    run = tolstat.open(run.path)
    (words,) = study_differs(run)
    assert "password" not in words and run.data_folder == tmp_path
    os.mkfifo(tmp_path / "pipe")
    run = tolstat.open(crafted(attributes("/", study_file="pipe")))
    assert study_differs(run) == [] and run.data_folder == tmp_path


def test_data_are_read_beside_the_run_alone(crafted, tmp_path):
    """A run without a study file may name no table of another folder."""
    secret = tmp_path.with_name("secret.csv")
    secret.write_text("x\n" + "1\n" * 20)
    part = f'part_1 = {{ data = "{secret}", column = "x", unit = "mm" }}'
    text = TOY_STUDY.replace('part = "+-1 mm"', part)
    run = tolstat.open(crafted(attributes("/", study_text=text)))
    with pytest.raises(StudyError, match="lies outside the folder"):
        study_of(run, model=Toy())

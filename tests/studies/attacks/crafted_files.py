"""Run files that a stranger made: sealed, and wrong inside.

`CHANGES` has a function by name; each changes an open run file. The folder of the run
holds what a stranger would like to read: `SECRET`, as numbers and as text.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path
from unittest import mock

import h5py
import numpy as np

from tests.studies.attacks.commands import STUDY
from tolstat.store.integrity import clock_of, fingerprints, write_seal
from tolstat.store.layout import ALONE as NOMINAL_CHECKSUM
from tolstat.store.layout import (
    CHECKSUM,
    CLOCK,
    TRIAL,
    Extent,
    columns_of,
    nominal_columns_of,
)

NUMBER, WORDS = 0.000314159265358, "SECRET7Q"  # eight bytes, as a number has
SECRET = b"3141592653", np.float64(NUMBER).tobytes(), WORDS.encode(), b"root:x:0"
TRIALS = 200
CODE = f"open({'CODE RAN'!r}, 'w')\n"
ROWS = "A", "B", "gap", "status"


def secrets(folder: Path) -> None:
    """Write what no answer may contain, and what may hang or run."""
    (folder / "secret.bin").write_bytes(np.full(4096, NUMBER).tobytes())
    (folder / "secret.txt").write_text(WORDS * 500)
    (folder / "secret.toml").write_text(f'title = "{WORDS}"\n{STUDY}')
    with h5py.File(folder / "secret.h5", "w") as file:
        file["x"] = np.full(TRIALS, NUMBER)
        file.attrs["x"] = WORDS
        file.create_group("group").attrs["A"] = NUMBER
    os.mkfifo(folder / "fifo")
    os.symlink("/dev/zero", folder / "zero")
    (folder / "evil.py").write_text(CODE)


def craft(good: Path, path: Path, change: str) -> None:
    """Make a changed copy of a run; sealed first, and with checksums if that works."""
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        CHANGES[change](file)
    _seal(path)
    other = path.with_suffix(".tmp")
    shutil.copy(path, other)
    with contextlib.suppress(Exception):
        with h5py.File(other, "r+") as file:
            columns = [file[name][...] for name in columns_of(file)]
            file[CHECKSUM][...] = fingerprints(columns)
            values = [np.atleast_1d(file[n][()]) for n in nominal_columns_of(file)]
            file[NOMINAL_CHECKSUM][...] = fingerprints(values)[0]
        _seal(other)
        os.replace(other, path)
    other.unlink(missing_ok=True)


def _seal(path: Path) -> None:
    holes = []
    with h5py.File(path, "r") as file:
        block = file.userblock_size
        with contextlib.suppress(Exception):
            names = (
                *columns_of(file),
                CHECKSUM,
                NOMINAL_CHECKSUM,
                CLOCK,
                *nominal_columns_of(file),
            )
            for name in dict.fromkeys(names):
                with contextlib.suppress(Exception):
                    data = file[name]
                    if (offset := data.id.get_offset()) is not None:
                        holes.append(Extent(offset, data.dtype, data.size).hole)
    with path.open("r+b", buffering=0) as raw:
        write_seal(raw, block, sorted({*holes}))


def replaced(name, data=None, **how):
    """Return a change that makes a dataset again, with its attributes."""

    def change(file):
        attributes = {
            key: value for key, value in file[name].attrs.items()
            if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME")
        }  # fmt: skip
        del file[name]
        new = file.create_dataset(name, data=data, **how)
        new.attrs.update(attributes)

    return change


def external(name, source, dtype="f8", shape=(TRIALS,)):
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    return replaced(name, shape=shape, dtype=dtype, external=[(source, 0, size)])


def virtual(name, source, key, dtype="f8", shape=(TRIALS,)):
    def change(file):
        layout = h5py.VirtualLayout(shape, dtype)
        layout[...] = h5py.VirtualSource(source, key, shape)
        attributes = dict(file[name].attrs)
        attributes.pop("DIMENSION_LIST", None)
        del file[name]
        file.create_virtual_dataset(name, layout).attrs.update(attributes)

    return change


def linked(name, link):
    def change(file):
        del file[name]
        file[name] = (
            link(file) if callable(link) and not isinstance(link, type) else link
        )

    return change


def filled(**values):
    def change(file):
        for name, value in values.items():
            file[name.replace("__", "/")][...] = value

    return change


def attribute(owner="/", **values):
    """Return a change of attributes; None removes one."""

    def change(file):
        for name, value in values.items():
            if value is None:
                file[owner].attrs.pop(name, None)
            else:
                file[owner].attrs[name] = value

    return change


def texts(owner="/", **values):
    """Return a change of attributes that are lists of texts."""

    def change(file):
        for name, words in values.items():
            array = np.array(words, dtype=object)
            file[owner].attrs.create(name, array, dtype=h5py.string_dtype())

    return change


def together(*changes):
    def change(file):
        for change in changes:
            change(file)

    return change


def clock(seconds, written):
    def change(file):
        with mock.patch("time.time", return_value=written):
            file[CLOCK][...] = clock_of(seconds)

    return change


def nested(depth):
    def change(file):
        group = file["settings"]
        for _ in range(depth):
            group = group.create_group("a")

    return change


def many(owner, number, kind):
    def change(file):
        for i in range(number):
            if kind == "groups":
                file[owner].create_group(f"g{i}")
            else:
                file[owner].attrs[f"a{i}"] = "text"

    return change


def unknown_filter(file):
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((TRIALS,))
    plan.set_filter(32013, h5py.h5z.FLAG_OPTIONAL, (1, 2, 3))
    del file["A"]
    space = h5py.h5s.create_simple((TRIALS,))
    h5py.h5d.create(file.id, b"A", h5py.h5t.IEEE_F64LE, space, dcpl=plan)


def compact(file):
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.COMPACT)
    del file["A"]
    space = h5py.h5s.create_simple((TRIALS,))
    h5py.h5d.create(file.id, b"A", h5py.h5t.IEEE_F64LE, space, dcpl=plan)


def group_cycle(file):
    file["diagnostics/halved/gap/C"] = file["diagnostics"]
    file["settings/again"] = file["settings"]


def audit(**values):
    """Return a change that adds audited trials, with these values instead of good ones."""
    good = {
        "trials": np.arange(5), "status": np.ones(5, "u1"),
        "at_random": np.ones(5, bool), "gap": np.full(5, 0.001),
        "reasons": np.ones(5, "u1"),
    }  # fmt: skip

    def change(file):
        file.pop("audit", None)
        data = good | values
        group = file.create_group("audit")
        group.create_group("settings").attrs["rtol"] = 1e-6
        for name in ("trials", "status", "at_random"):
            group[name] = data[name]
        group.create_group("responses")["gap"] = data["gap"]
        group["responses/gap"].attrs["units"] = "m"
        group.create_group("chosen_by")["gap"] = data["reasons"]

    return change


HUGE = {"fillvalue": 1, "chunks": (1 << 20,)}
MARKUP = "<script>alert(1)</script>[red]\x1b[31m$\\frac{$=cmd|' /C calc'!A0"
LIMIT, SEED = "/gap", "sampled_seed"
CHANGES = {
    "nothing": lambda file: None,
    # storage
    "external column": external("A", "secret.bin"),
    "external response": external("gap", "secret.bin"),
    "external status": external("status", "secret.bin", "u1"),
    "external trial numbers": external(TRIAL, "secret.bin", "i8"),
    "external nominal": external("nominal/gap", "secret.bin", shape=(1,)),
    "external checksums": external(CHECKSUM, "secret.bin", "u8"),
    "external text": external("A", "secret.txt", "S8"),
    "external /etc/passwd": external("A", "/etc/passwd", "S8"),
    "external FIFO": external("A", "fifo"),
    "external FIFO as status": external("status", "fifo", "u1"),
    "external endless": external("A", "/dev/zero"),
    "external unknown dataset": lambda file: file.create_dataset(
        "extra", (TRIALS,), "S8", external=[("secret.txt", 0, 8 * TRIALS)]
    ),
    "virtual of another file": virtual("A", "secret.h5", "x"),
    "virtual response": virtual("gap", "secret.h5", "x"),
    "virtual of itself": virtual("A", ".", "A"),
    "virtual status of itself": virtual("status", ".", "status", "u1"),
    "virtual circle": together(virtual("A", ".", "B"), virtual("B", ".", "A")),
    "virtual of a FIFO": virtual("A", "fifo", "x"),
    "virtual checksums of themselves": virtual(CHECKSUM, ".", CHECKSUM, "u8"),
    # links
    "soft link": linked("A", h5py.SoftLink("/B")),
    "soft link to nothing": linked("A", h5py.SoftLink("/nothing")),
    "soft link to itself": linked("A", h5py.SoftLink("/A")),
    "external link": linked("A", h5py.ExternalLink("secret.h5", "/x")),
    "external link of a group": linked("settings", h5py.ExternalLink("secret.h5", "/group")),
    "external link to a FIFO": linked("A", h5py.ExternalLink("fifo", "/x")),
    "external link to itself": linked("A", h5py.ExternalLink("r.h5", "/A")),
    "hard link to another column": linked("A", lambda file: file["B"]),
    "groups in a circle": group_cycle,
    "group for a column": together(lambda file: file.pop("A"), lambda file: file.create_group("A")),
    "named type": lambda file: file.__setitem__("type", np.dtype("f8")),
    # layout
    "chunked": replaced("A", np.zeros(TRIALS), chunks=(10,)),
    "compressed": replaced("A", np.zeros(TRIALS), chunks=(10,), compression="gzip"),
    "compressed status of a billion": replaced("status", shape=(10**9,), dtype="u1", compression="gzip", **HUGE),
    "column of 10^12": replaced("A", shape=(10**12,), dtype="f8", **HUGE),
    "status of 10^9": replaced("status", shape=(10**9,), dtype="u1", **HUGE),
    "all rows of 10^9": together(*(replaced(n, shape=(10**9,), dtype="f8" if n != "status" else "u1", **HUGE) for n in ROWS)),
    "checksums of 10^9": replaced(CHECKSUM, shape=(10**9,), dtype="u8", **HUGE),
    "clock of 10^9": replaced(CLOCK, shape=(10**9,), dtype="f8", **HUGE),
    "unknown dataset of 10^9": lambda file: file.create_dataset("extra", (10**9,), "f8", **HUGE),
    "unlimited": replaced("A", np.zeros(TRIALS), maxshape=(None,)),
    "unknown filter": unknown_filter,
    "compact": compact,
    "50 000 groups": many("diagnostics", 50_000, "groups"),
    "50 000 attributes": many("provenance", 50_000, "attributes"),
    "nested groups": nested(5000),
    # types and shapes
    **{
        f"column of {name}": replaced("A", data)
        for name, data in {
            "float32": np.zeros(TRIALS, "f4"), "integers": np.zeros(TRIALS, "i8"),
            "big-endian": np.zeros(TRIALS, ">f8"), "complex": np.zeros(TRIALS, "c16"),
            "records": np.zeros(TRIALS, [("a", "f8"), ("b", "i4")]),
            "fixed texts": np.full(TRIALS, b"=cmd()"), "truths": np.zeros(TRIALS, bool),
            "arrays": np.zeros(TRIALS, [("a", "f8", (3,))]),
            "long doubles": np.zeros(TRIALS, "g"), "opaque": np.zeros(TRIALS, "V8"),
            "float16": np.zeros(TRIALS, "f2"), "two dimensions": np.zeros((TRIALS, 2)),
            "one number": 0.0, "nothing": h5py.Empty("f8"), "half length": np.zeros(TRIALS // 2),
            "no length": np.zeros(0),
        }.items()
    },
    "column of long texts": replaced("A", np.array(["x" * 1000] * TRIALS, object), dtype=h5py.string_dtype()),
    "column of references": lambda file: replaced("A", np.array([file["B"].ref] * TRIALS, object), dtype=h5py.ref_dtype)(file),
    "column of ragged arrays": replaced("A", shape=(TRIALS,), dtype=h5py.vlen_dtype("f8")),
    "status of int64": replaced("status", np.ones(TRIALS, "i8")),
    "status of floats": replaced("status", np.ones(TRIALS)),
    "status of texts": replaced("status", np.full(TRIALS, b"done")),
    "status too short": replaced("status", np.ones(7, "u1")),
    "no trials": together(*(replaced(n, np.zeros(0, "f8" if n != "status" else "u1")) for n in ROWS), replaced(CHECKSUM, np.zeros(0, "u8"))),
    "one trial": together(*(replaced(n, np.ones(1, "f8" if n != "status" else "u1")) for n in ROWS), replaced(CHECKSUM, np.zeros(1, "u8")), replaced(TRIAL, np.zeros(1, "i8"))),
    "checksums of floats": replaced(CHECKSUM, np.zeros(TRIALS)),
    "clock of integers": replaced(CLOCK, np.zeros(3, "i8")),
    "clock of two": replaced(CLOCK, np.zeros(2)),
    "clock of none": replaced(CLOCK, np.zeros(0)),
    "trial numbers as floats": replaced(TRIAL, np.arange(TRIALS) + 0.5),
    "trial numbers equal": filled(trial=7),
    "nominal of texts": replaced("nominal/gap", b"1 mm"),
    "nominal of 10 numbers": replaced("nominal/gap", np.zeros(10)),
    "extra column": lambda file: file.create_dataset("extra", data=np.zeros(TRIALS)),
    "extra short column": lambda file: file.create_dataset("extra", data=np.zeros(3)),
    "extra column of steps": lambda file: file.create_dataset("steps", data=np.full(TRIALS, b"many")),
    # values
    "column NaN": filled(A=np.nan),
    "response NaN": filled(gap=np.nan),
    "response infinite": filled(gap=np.inf),
    "response 1e300": filled(gap=1e300),
    "response +-1e308": filled(gap=np.resize([1e308, -1e308], TRIALS)),
    "response 5e-324": filled(gap=5e-324),
    "columns 1e300": filled(A=1e300, B=-1e300),
    "columns infinite": filled(A=np.inf, B=-np.inf),
    "columns constant": filled(A=0.0, B=0.0),
    "nominal NaN": filled(nominal__gap=np.nan),
    "nominal 1e300": filled(nominal__gap=1e300),
    "nominal status 77": filled(nominal__status=77),
    "status unknown": filled(status=200),
    "status not run": filled(status=0),
    "status failed": filled(status=2, gap=np.nan),
    "clock 1e300": clock(1e300, 1e300),
    "clock infinite": clock(np.inf, np.inf),
    "clock NaN": clock(np.nan, np.nan),
    "clock negative": clock(-1e15, -1e15),
    # attributes of columns
    "limit NaN": attribute(LIMIT, limit_lower=np.nan, limit_upper=np.nan),
    "limit upside down": attribute(LIMIT, limit_lower=1.0, limit_upper=-1.0),
    "limit open": attribute(LIMIT, limit_lower=-np.inf, limit_upper=np.inf),
    "limit 1e300": attribute(LIMIT, limit_lower=1e300),
    "limit a text": attribute(LIMIT, limit_lower="0.8 mm"),
    "limit a list": attribute(LIMIT, limit_lower=[1.0, 2.0]),
    "yield 2": attribute(LIMIT, limit_demanded=2.0),
    "yield NaN": attribute(LIMIT, limit_demanded=np.nan),
    "yield 1": attribute(LIMIT, limit_demanded=1.0),
    "yield 0": attribute(LIMIT, limit_demanded=0.0),
    "limit without words": attribute(LIMIT, limit_words=None),
    "limit without a number": attribute(LIMIT, limit_lower=None),
    "unit unknown": attribute(LIMIT, units="zorkmid"),
    "unit of another kind": attribute(LIMIT, units="kg", shown="mm"),
    "unit a power tower": attribute(LIMIT, units="9**9**9**9", shown="9**9**9"),
    "shown unknown": attribute(LIMIT, shown="zorkmid"),
    "size NaN": attribute("/A", size=np.nan),
    "tolerance NaN": filled(assumed__tolerance_lower=np.nan, assumed__tolerance_upper=np.nan),
    "tolerance 1e300": filled(assumed__tolerance_lower=-1e300, assumed__tolerance_upper=1e300),
    "tolerance of more": replaced("assumed/tolerance_lower", np.zeros(99)),
    "tolerance of fewer": replaced("assumed/tolerance_lower", np.zeros(1)),
    "tolerance of texts": replaced("assumed/tolerance_lower", np.array(["a", "b"], "S1")),
    "sigma NaN": filled(assumed__sigma=np.nan, assumed__mean=np.nan),
    "sigma negative": filled(assumed__sigma=-1.0),
    "quantiles NaN": filled(assumed__quantiles=np.nan),
    "parts negative": filled(assumed__parts=-1),
    "assumptions on another": filled(assumed__contributor="Z"),
    "name of another": attribute("/A", name="B"),
    "names of markup": attribute(LIMIT, name=MARKUP, long_name=MARKUP, limit_words=MARKUP),
    # attributes of the run
    **{
        f"no {name}": attribute(**{name: None})
        for name in ("model", "study_text", "contributors", "responses", SEED, "complete", "limits", "sampled_factors")
    },
    "all texts are numbers": attribute(title=1.5, model=2, sampling=3, source_digest=4, study_text=5),
    "all texts are lists": texts(title=["a"], model=["a"], sampling=["a"], study_text=["a", "b"]),
    "texts are references": lambda file: file.attrs.__setitem__("title", file["A"].ref),
    "complete is a text": attribute(complete="no"),
    "complete is a list": attribute(complete=[True, False]),
    "model unknown": attribute(model="nothing"),
    "model a path": attribute(model="../../evil", machine="evil.py:Machine"),
    "sampling unknown": attribute(sampling="zorkmid"),
    "sampling sobol": attribute(sampling="sobol", sampled_replicates=16),
    "seed negative": attribute(sampled_seed=-1),
    "seed a text": attribute(sampled_seed="3"),
    "replicates 10^9": attribute(sampled_replicates=10**9),
    "replicates -1": attribute(sampled_replicates=-1),
    "group 0": attribute(sampled_group=0),
    "group 10^9": attribute(sampled_group=10**9),
    "search of an unknown response": attribute(sampled_aim="zorkmid"),
    "search": attribute(sampled_aim="gap"),
    "columns doubled": texts(contributors=["A", "A"], responses=["gap", "gap"]),
    "columns unknown": texts(contributors=["A", "Z"]),
    "columns outside": texts(contributors=["A", "../../x"], responses=["nominal/gap"]),
    "no columns": texts(contributors=[], responses=[]),
    "column without a name": texts(contributors=["A", ""]),
    "response a contributor": texts(responses=["A"]),
    "limits of a contributor": texts(limits=["A"]),
    "factors unknown": texts(sampled_factors=["Z"]),
    "swept unknown": texts(swept=["Z"], grid=["Z"]),
    "swept contributor": texts(swept=["A"], grid=["A"]),
    "grid of a column": texts(grid=["A"]),
    "details unknown": texts(details=["Z"]),
    "stopped": together(texts(stopped_rules=["x"], rules=["x"]), attribute(stopped_reached=True, stopped_stages=[10**18, -1], stopped_at_most=-5, stopped_wanted=np.nan)),
    "text of deep TOML": attribute(study_text="a = " + "[" * 20_000 + "]" * 20_000),
    "text of deep tables": attribute(study_text="[" + ".".join("a" * 25_000) + "]\n"),
    "text not TOML": attribute(study_text="\x00\x1b[2J = "),
    "text a huge number": attribute(study_text=f'{STUDY}x = {"9" * 30_000}\n'),
    "text of wrong types": attribute(study_text="trials = 'x'\nseed = []\nmodel = 3\n"),
    "text of 10^15 trials": attribute(study_text=STUDY.replace("200", "1" + "0" * 15)),
    "markup in every text": attribute(title=MARKUP, sampled_promise=MARKUP, model=MARKUP, sampling=MARKUP),
    "bytes that are no text": lambda file: file.attrs.create("title", b"\xff\xfe\x00\xff", dtype="S4"),
    "title of 60 kB": attribute(title="x" * 60_000),
    # the study beside the run
    "study a secret": attribute(study_file="secret.toml"),
    "study /etc/passwd": attribute(study_file="/etc/passwd"),
    "study outside": attribute(study_file="../../../../../../etc/passwd"),
    "study a FIFO": attribute(study_file="fifo"),
    "study endless": attribute(study_file="zero"),
    "study a folder": attribute(study_file="."),
    "study markup": attribute(study_file=MARKUP),
    "study a number": attribute(study_file=7),
    "study with NUL": lambda file: file.attrs.create("study_file", b"a\x00b", dtype="S3"),
    "study a long name": attribute(study_file="x/" * 5000),
    "machine of a stranger": attribute(machine="evil.py:Machine"),
    "machine a FIFO": attribute(machine="fifo:Machine"),
    # what follows the trials
    "slopes of unknown": attribute("diagnostics/slopes/gap", Z=1.0),
    "slopes NaN": attribute("diagnostics/slopes/gap", A=np.nan, B=np.inf),
    "slopes of texts": attribute("diagnostics/slopes/gap", A="steep"),
    "slopes of an unknown response": lambda file: file["diagnostics/slopes"].create_group("Z"),
    "worst case of a text": attribute("diagnostics/worst_cases/gap/least", value="x"),
    "worst case 1e300": attribute("diagnostics/worst_cases/gap/least", value=1e300),
    "worst case of an unknown side": lambda file: file["diagnostics/worst_cases/gap"].move("least", "zorkmid"),
    "worst case of unknown": attribute("diagnostics/worst_cases/gap/least/deviations", Z=1.0),
    "halved of unknown": lambda file: file["diagnostics/halved/gap"].move("A", "Z"),
    "halved NaN": attribute("diagnostics/halved/gap/A", beyond_value=np.nan, beyond_reason=""),
    "halved upside down": attribute("diagnostics/halved/gap/A", beyond_lower=2.0, beyond_value=0.5, beyond_upper=-1.0, beyond_reason=""),
    "idle unknown": texts("diagnostics", idle=["Z"]),
    "diagnostics a dataset": linked("diagnostics", 1.0),
    "status words not numbered": attribute("status-words", x="done"),
    "status words beyond a byte": attribute("status-words", **{"300": "x"}),
    "status words negative": attribute("status-words", **{"-1": "x"}),
    "no status words": lambda file: file.pop("status-words"),
    "status words doubled": attribute("status-words", **{"7": "done", "8": "not run"}),
    "number of an unknown response": attribute("numbers/rss_mean", of="Z", worst="zorkmid"),
    "number NaN": attribute("numbers/rss_mean", value=np.nan),
    "number of unknown unit": attribute("numbers/rss_mean", units="zorkmid"),
    "setting without words": attribute("settings/gap", words=None),
    "rank correlation unknown": lambda file: file.create_group("rank-correlation/Z").attrs.__setitem__("A", 5.0),
    "title block of markup": lambda file: file.create_group("title-block").attrs.update({MARKUP: MARKUP, "project": MARKUP}),
    "reference of other lengths": lambda file: (file.create_group("reference").attrs.__setitem__("label", "x"), file["reference"].create_group("columns"), file["reference/columns"].update({"A": np.zeros(3), "gap": np.zeros(2)})),
    "audit": audit(),
    "audit outside": audit(trials=np.array([0, 1, 2, 3, 10**9])),
    "audit negative": audit(trials=np.arange(-5, 0)),
    "audit unordered": audit(trials=np.array([4, 4, 1, 0, 2])),
    "audit of other lengths": audit(gap=np.zeros(3)),
    "audit of texts": audit(gap=np.full(5, b"x")),
    "audit NaN": audit(gap=np.full(5, np.nan)),
    "audit of 10^9": audit(trials=np.zeros(0, "i8"), gap=np.zeros(0), status=np.zeros(0, "u1")),
    "audit in itself": together(audit(), lambda file: file["audit"].__setitem__("third", file["audit"])),
    "provenance of markup": attribute("provenance", processor=MARKUP, command=MARKUP, started_at=MARKUP),
    "provenance of numbers": attribute("provenance", processor=1.0, started_at=[1, 2], version_tolstat=7),
    "started in no year": attribute("provenance", started_at="99999-99-99"),
}  # fmt: skip

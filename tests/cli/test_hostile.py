"""Hostile titles, names and packages on the command line."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from tests.conftest import ROOT
from tests.fmu.building import without_library
from tolstat.cli.main import main
from tolstat.errors import ModelError
from tolstat.fmu.unpacked import unpacked

TOLSTAT = Path(sys.executable).with_name("tolstat")
STACK = "stack.py:Stack"


@pytest.fixture
def folder(tmp_path):
    for name in ("stack.py", "stack.toml"):
        text = (ROOT / "runs" / "own" / name).read_text()
        (tmp_path / name).write_text(text.replace("20000", "500"))
    return tmp_path


def call(folder, *words, code=0):
    """Call a command in this process; an error that it lets through is a code of 1."""
    with contextlib.chdir(folder):
        done = CliRunner().invoke(main, words)
    assert done.exit_code == code and "Traceback" not in done.stderr, done.output
    return done.stdout + done.stderr


def typed(folder, *words, code=0, **environment):
    done = subprocess.run(
        [TOLSTAT, *words], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip
    assert done.returncode == code and "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def test_markup_stays_text(folder):
    study = folder / "stack.toml"
    title = "=1+1 a[/nope] [bold]b :warning: $\\\\frac{a$ \\u001b[31mred"
    study.write_text(study.read_text().replace("Gap in a housing", title))
    shown = typed(folder, "run", "stack.toml", "--machine", STACK, "-o", "o[red]ut.h5")
    assert "a[/nope] [bold]b :warning:" in shown and "o[red]ut.h5" in shown
    assert "\\x1b[31mred" in shown
    shown += call(folder, "show", "o[red]ut.h5") + call(folder, "report", "o[red]ut.h5")
    table = call(folder, "report", "o[red]ut.h5", "--csv")
    assert "\n'=1+1 a[/nope]" in table
    page = (folder / "o[red]ut.html").read_text()
    assert "\x1b" not in shown + table + page


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_an_undecodable_name_is_refused_before_the_run(folder):
    odd = os.fsdecode(b"\xff.toml"), os.fsdecode(b"\xfe.h5")
    (folder / odd[0]).write_bytes((folder / "stack.toml").read_bytes())
    before = set(folder.iterdir())
    for words, named in (
        ([odd[0]], "\\udcff.toml"),
        (["stack.toml", "-o", odd[1]], "\\udcfe.h5"),
    ):
        said = typed(folder, "run", *words, "--machine", STACK, code=2)
        assert named in said and "rename that file" in said
        assert {each for each in folder.iterdir() if each.is_file()} <= before


def test_a_model_file_that_ends_the_process(folder):
    (folder / "quits.py").write_text("import sys\nsys.exit(0)\n")
    said = typed(folder, "run", "stack.toml", "--machine", "quits.py:Stack", code=2)
    assert "quits.py cannot be run: SystemExit: 0" in said


def test_a_name_that_is_taken(folder):
    text = (folder / "stack.py").read_text().replace('"stack"', '"stand"')
    (folder / "stack.py").write_text(text)
    said = call(folder, "show", "stand", "--machine", STACK, code=2)
    assert "'stand' is the name of an installed model" in said


def test_a_broken_package_does_not_affect_others(folder):
    info = folder / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n"
    )
    (info / "entry_points.txt").write_text("[tolstat.machines]\nbroken = nothing:X\n")
    shown = typed(folder, "models", PYTHONPATH=str(folder))
    assert "stand" in shown and "ModuleNotFoundError" in shown
    said = typed(folder, "show", "broken", code=2, PYTHONPATH=str(folder))
    assert "nothing:X cannot be loaded: ModuleNotFoundError" in said


def test_an_error_in_a_model_is_one_line_with_its_place(folder):
    text = (folder / "stack.py").read_text()
    (folder / "stack.py").write_text(text.replace("gap < 0", "gop < 0"))
    said = call(folder, "run", "stack.toml", "--machine", STACK, code=2)
    assert (
        "evaluate fails: NameError: name 'gop' is not defined (stack.py, line" in said
    )


def test_damaged_compiled_code_is_compiled_again(folder):
    """Python's own words for it would blame the machine."""
    code = (
        "import sys, warnings\n"
        "from tolstat.lanes.compiled import compiled\n"
        "import small\n"
        "print(small.add(1.0, 2.0))\n"
    )
    (folder / "small.py").write_text(
        "from numba import types\n"
        "from tolstat.lanes.compiled import compiled\n\n\n"
        "@compiled(types.float64(types.float64, types.float64))\n"
        "def add(a, b):\n    return a + b\n"
    )
    cache = folder / "cache"

    def once():
        return subprocess.run(
            [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(cache)}, check=False,
        )  # fmt: skip

    assert once().stdout == "3.0\n"
    kept = [path for path in cache.rglob("*") if path.suffix in (".nbi", ".nbc")]
    assert kept
    for path in kept:
        path.write_bytes(b"garbage")
    again = once()
    assert again.stdout == "3.0\n" and "is damaged" in again.stderr
    assert once().stderr == ""
    (code_file,) = cache.rglob("*.nbc")
    flipped = bytearray(code_file.read_bytes())
    flipped[len(flipped) // 2] ^= 1  # in machine code, which is believed whatever it is
    code_file.write_bytes(flipped)
    again = once()
    assert again.stdout == "3.0\n" and f"({code_file.name}): compi" in again.stderr


@pytest.mark.parametrize("backend", ["nonsense", "module://not.installed", ""])
def test_pictures_need_no_backend(folder, backend):
    code = (
        "import os, tolstat.render.picture; from matplotlib.figure import Figure; "
        "Figure().savefig('own.svg'); print(os.environ['MPLBACKEND'])"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True,
        env={**os.environ, "MPLBACKEND": backend}, check=True,
    )  # fmt: skip
    assert ended.stdout == f"{backend}\n" and (folder / "own.svg").exists()


def test_a_report_is_the_same_whatever_the_backend(folder):
    call(folder, "run", "stack.toml", "--machine", STACK)
    call(folder, "report", "stack.h5", "-o", "own.html")
    said = typed(folder, "report", "stack.h5", MPLBACKEND="nonsense")
    assert "report in stack.html" in said
    names = re.compile(r"\bp\d+-")  # of pictures, numbered in a process
    pages = {
        names.sub("", (folder / f"{n}.html").read_text()) for n in ("own", "stack")
    }
    assert len(pages) == 1


def test_a_full_disk_during_output_is_reported(folder):
    code = "from tolstat.cli.entry import entry; entry()"
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [sys.executable, "-c", code, "models"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert ended.returncode == 1
    assert ended.stderr.startswith("tolstat: the disk of standard output is full")
    assert len(ended.stderr.splitlines()) == 1


def test_a_working_directory_that_was_removed(folder, tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    with contextlib.chdir(gone):
        gone.rmdir()
        done = CliRunner().invoke(main, ["run", str(folder / "stack.toml")])
    assert done.exit_code == 2
    assert "the working directory cannot be used: No such file" in done.stderr


def test_a_file_that_cannot_be(folder):
    long = "x" * 300
    for words in (
        ["new", "--model", f"{long}.py"], ["new", "stand", "-o", long], ["show", long],
        ["resume", long],
    ):  # fmt: skip
        said = call(folder, *words, code=1)
        assert ": File name too long" in said, said
    said = call(folder, "batch", "stack.toml/x.toml", code=2)
    assert "stack.toml is no folder; name another for the index" in said


@pytest.mark.parametrize(
    ("place", "value"), [(6, 1), (8, 99)], ids=["encrypted", "odd"]
)
def test_an_archive_that_cannot_be_unpacked(folder, place, value):
    path = without_library("Backlash", 2, folder)
    raw = bytearray(path.read_bytes())
    for sign, more in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
        raw[raw.index(sign) + place + more] = value
    path.write_bytes(raw)
    said = call(folder, "new", "--machine", path.name, code=2)
    assert "Backlash2.fmu is not an FMU, a ZIP archive with" in said


def test_a_library_that_others_may_have_written_is_not_loaded(tmp_path, monkeypatch):
    """Its folder is made again; it was taken as it lay there."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = without_library("Backlash", 2, tmp_path)
    file = SimpleNamespace(path=path, sha256="0123")
    home = tmp_path / "tolstat" / "fmu"
    laid = home / file.sha256 / "binaries" / "linux64" / "Backlash.so"
    laid.parent.mkdir(parents=True)
    laid.write_text("of another user")
    home.chmod(0o777)
    with pytest.raises(ModelError, match="has no library"):
        unpacked(file)
    assert not laid.exists()

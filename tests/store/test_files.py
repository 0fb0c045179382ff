"""Files that are read and replaced: regular ones, whole, with their permissions."""

from __future__ import annotations

import os
import re
import signal
import stat
import subprocess
import sys

import pytest

import tolstat
from tests.conftest import TOY_STUDY, Toy
from tolstat.answers.output_file import check_output, replace
from tolstat.errors import BrokenError, RunFileError, TolstatError
from tolstat.operating_system import process_exists
from tolstat.store.files_beside import aside_of, writer_of


@pytest.fixture(autouse=True)
def _nothing_is_waited_for():
    def late(*_):
        raise AssertionError("a file is waited for")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def run(toy, toy_study, tmp_path):
    return tolstat.run(toy_study, model=toy, output=tmp_path / "run.h5")


def test_a_pipe_in_a_folder_above_is_no_study(tmp_path):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    page = tmp_path / "folder" / "page.html"
    page.write_text("earlier")
    check_output(page)


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_pipes_and_devices_are_never_read(kind, run, toy, tmp_path):
    def put(name):
        path = tmp_path / name
        os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
        return path

    study = put("study.toml")
    with pytest.raises(TolstatError, match="is a folder or a device"):
        tolstat.run(study, model=toy)
    with pytest.raises(TolstatError):
        tolstat.open(put("other.h5"))
    text = TOY_STUDY.replace(
        'part = "+-1 mm"', 'part = { data = "table.csv", column = "x" }'
    )
    (tmp_path / "measured.toml").write_text(text)
    put("table.csv")
    with pytest.raises(TolstatError, match=r"table\.csv (is a folder|lies outside)"):
        tolstat.run(tmp_path / "measured.toml", model=toy)
    before = put("run.h5.before")
    with pytest.raises(RunFileError, match="is in the way"):
        tolstat.run(run.study_file, model=toy, output=run.path, force=True)
    assert os.path.lexists(before)
    put("run.h5.lock")
    assert writer_of(run.path) == ""
    with pytest.raises(RunFileError, match="cannot be written"):
        tolstat.resume(run.path, model=toy)


def test_a_lock_is_read_with_a_bound(run, toy):
    lock = run.path.with_name("run.h5.lock")
    with lock.open("wb") as file:
        file.write(b"process 1 on another computer since ")
        file.truncate(8 << 30)
    assert len(writer_of(run.path)) <= 1000


def test_nothing_is_replaced_by_what_was_not_read_whole(toy_study, tmp_path):
    """While a run is resumed, its file loses its end."""
    path, cut = tmp_path / "run.h5", []
    stopping = tolstat.run(toy_study, model=Toy(), output=path)
    whole = path.stat().st_size

    def tell(progress):
        if progress.over and not cut:
            os.truncate(path, whole - 4000)
            cut.append(path.read_bytes()[: whole - 8000])

    with pytest.raises(BrokenError, match="bytes were read"):
        tolstat.extend(stopping.path, 2000, model=Toy(), progress=tell)
    assert [*tmp_path.glob("*.part")] == [] and path.stat().st_size < 2 * whole


def mode_of(path):
    return oct(stat.S_IMODE(path.stat().st_mode))


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666])
def test_what_is_replaced_keeps_its_permissions(mode, run, toy, tmp_path):
    page = tmp_path / "page.html"
    page.write_text("earlier")
    for path in (page, run.path):
        path.chmod(mode)
    tolstat.extend(run.path, 1200, model=toy)
    assert mode_of(run.path) == oct(mode)
    replace(page, b"page")
    assert mode_of(page) == oct(mode)
    tolstat.run(run.study_file, model=toy, output=run.path, force=True)
    assert mode_of(run.path) == oct(mode)


def test_a_new_file_has_the_permissions_of_a_new_file(toy, toy_study, tmp_path):
    before = os.umask(0o027)
    try:
        run = tolstat.run(toy_study, model=toy, output=tmp_path / "run.h5")
        replace(tmp_path / "page.html", b"page")
    finally:
        os.umask(before)
    assert mode_of(run.path) == mode_of(tmp_path / "page.html") == oct(0o640)


def test_temporary_names_cannot_be_predicted(run, tmp_path):
    precious, page = tmp_path / "precious", tmp_path / "page.html"
    precious.write_text("precious")
    for number in range(300):
        name = f"page.html.{os.getpid()}-{number}.part"
        (tmp_path / name).symlink_to(precious)
    replace(page, b"page")
    assert precious.read_text() == "precious" and page.exists()
    assert re.fullmatch(r"page\.html\.\d+-[0-9a-f]{16}\.part", aside_of(page).name)


def test_only_files_of_this_user_are_removed(tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    path, left = tmp_path / "run.h5", []
    for number in range(4):
        left.append(tmp_path / f"run.h5.{gone.pid}-{number}{number}ab.part")
    link, folder, foreign, own = left
    link.symlink_to("/etc/passwd")
    folder.mkdir()
    own.write_text("left behind")
    foreign.write_text("of another user")
    if os.getuid() == 0:
        os.chown(foreign, 12345, 12345)
    aside_of(path)
    assert link.is_symlink() and folder.is_dir() and not own.exists()
    assert foreign.exists() or os.getuid() != 0


def test_no_process_has_a_number_that_systems_do_not_have():
    assert not process_exists(2**31) and not process_exists(10**30)
    assert process_exists(os.getpid())

"""Files that answers replace: pages and tables, but no run, study or data."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

import tolstat
from tolstat.answers.answer import ENDINGS
from tolstat.answers.output_file import check_ending, check_output, replace
from tolstat.answers.run_entries import RunIndex
from tolstat.answers.views.animation import ANIMATIONS, Animation
from tolstat.answers.views.view_file import VIEWS, save_view
from tolstat.cli.main import main
from tolstat.errors import RunFileError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study with a table that it reads, its run, and the run under other names."""
    folder = tmp_path_factory.mktemp("kept")
    text = Path("runs/wave-gear.toml").read_text()
    (folder / "gear.toml").write_text(text)
    (folder / "rods.csv").write_text("rod [mm]\n0.1\n")
    (folder / "rods.toml").write_text('[deviations]\nrod = { data = "rods.csv" }\n')
    run = tolstat.run(folder / "gear.toml", trials=400, output=folder / "gear.h5")
    tolstat.report(run).save(folder / "page.html")
    for name in ("other.h5", "run.html", "run.csv", "run.png", "run.json"):
        shutil.copy(run.path, folder / name)
    os.symlink("other.h5", folder / "link.html")
    return folder


@pytest.mark.parametrize(
    "arguments",
    [
        "what-if gear.h5 R_out={change} --csv -o gear.h5",
        "what-if gear.h5 R_out={change} --json -o gear.toml",
        "what-if gear.h5 R_out={change} -o new.TOML",
        "compare gear.h5 other.h5 -o other.h5",
        "compare gear.h5 other.h5 --csv -o rods.csv",
        "report gear.h5 -o new.h5",
        "report gear.h5 -o run.html",
        "report gear.h5 -o link.html",
        "report gear.h5 --json -o run.json",
        "report gear.h5 --csv -o rods.csv",
        "show gear.h5 --plot run.png",
        "trial gear.h5 3 --plot run.csv",
        "trial gear.toml --nominal --plot rods.csv",
        "view gear.toml chain -o rods.csv",
        "export gear.h5 -o run.csv --force",
        "allocate gear.toml --plot rods.csv",
    ],
)
def test_runs_studies_and_data_are_not_replaced(folder, monkeypatch, arguments):
    monkeypatch.chdir(folder)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    change = '{ tolerance = "+-0.012 mm", distribution = "uniform" }'
    words = [each.format(change=change) for each in arguments.split()]
    found = CliRunner().invoke(main, words)
    assert found.exit_code == 2, found.output
    assert "give another name" in found.output, found.output
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_an_old_answer_is_replaced_and_a_link_stays_a_link(folder):
    for name in ("page.html", "new.csv", "gear.html"):
        check_output(folder / name)
    with pytest.raises(RunFileError, match="named in"):
        check_output(folder / "rods.csv")
    (folder / "to-page.html").symlink_to("page.html")
    tolstat.report(folder / "gear.h5").save(folder / "to-page.html")
    assert (folder / "to-page.html").is_symlink()
    assert "<html" in (folder / "page.html").read_text()


@pytest.mark.parametrize(
    "content",
    ['data = "parts.csv"'.encode("utf-16"), 'data = "parts.csv"'.encode("utf-32"),
     b'data = "p\\u0061rts.csv"',
     b'data = "link.csv"'],
)  # fmt: skip
def test_data_are_kept_however_a_study_names_them(content, tmp_path):
    """By UTF-16 or 32, by an escape, by a link: a study reads them all."""
    (tmp_path / "cut.toml").write_bytes(b"\xff\xfea")  # cut off: it names nothing
    (tmp_path / "parts.csv").write_text("a\n1\n")
    (tmp_path / "link.csv").symlink_to("parts.csv")
    (tmp_path / "study.toml").write_bytes(content)
    with pytest.raises(RunFileError, match="named in"):
        check_output(tmp_path / "link.csv")
    (tmp_path / "study.toml").write_bytes(b'data = "other.csv"')
    check_output(tmp_path / "link.csv")


def test_what_is_replaced_keeps_its_owner(tmp_path, monkeypatch):
    page, given = tmp_path / "page.html", []
    page.write_text("old")
    monkeypatch.setattr(os, "chown", lambda path, *owner: given.append(owner))
    replace(page, b"new")
    status = page.stat()
    assert given == [(status.st_uid, status.st_gid)]


def test_a_full_disk_leaves_the_old_page(tmp_path, monkeypatch):
    page = tmp_path / "page.html"
    page.write_text("old")
    write = Path.write_bytes

    def full(path, content):
        write(path, content[:3])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(RunFileError, match=r"cannot be written.*No space"):
        replace(page, b"new page")
    assert page.read_text() == "old" and [*tmp_path.iterdir()] == [page]


def test_a_pipe_that_no_program_reads_is_not_waited_for(folder):
    pipe = folder / "pipe.html"
    os.mkfifo(pipe)
    with pytest.raises(
        RunFileError, match=r"pipe\.html .* a pipe that no program reads"
    ):
        replace(pipe, b"a page")
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert replace(pipe, b"a page") == pipe
        assert os.read(reader, 100) == b"a page"
    finally:
        os.close(reader)


@pytest.mark.parametrize("name", ["batch.html", "batch.csv"])
def test_an_index_that_is_a_link_to_itself_is_refused(name, tmp_path):
    (tmp_path / name).symlink_to(name)
    study = shutil.copy("runs/wave-gear.toml", tmp_path / "gear.toml")
    result = CliRunner().invoke(main, ["batch", str(study)])
    assert result.exit_code == 2
    assert name in result.output and "is not replaced" in result.output


def test_a_figure_of_a_page_alone(folder, tmp_path):
    def call(*words):
        return CliRunner().invoke(main, [str(word) for word in words])

    run, picture = folder / "gear.h5", tmp_path / "chain.svg"
    done = call("report", run, "--figure", "Waterfall", "-o", picture)
    assert done.exit_code == 0 and f"figure in {picture}" in done.output
    assert picture.read_bytes().startswith(b"<?xml")
    what_if = tmp_path / "wider.png"
    assert call("what-if", run, "d=+-0.02 mm", "-o", what_if).exit_code == 0
    assert what_if.read_bytes().startswith(b"\x89PNG")
    for words, more in (
        ("did you mean 'Waterfall of gap'", ("--figure", "Water of", "-o", picture)),
        ("--figure needs -o", ("--figure", "Histogram")),
        ("--figure needs -o", ("--figure", "Histogram", "-o", tmp_path / "x.html")),
        ("--figure needs -o", ("--figure", "Histogram", "--json", "-o", picture)),
    ):
        done = call("report", run, *more)
        assert done.exit_code == 2 and words in done.stderr
    done = call("runs", folder, "-o", picture)
    assert done.exit_code == 2 and "no figure" in done.stderr


@pytest.mark.parametrize(
    ("kind", "endings", "save"),
    [
        ("an answer", ENDINGS, RunIndex("", Path(), ()).save),
        ("an animation", ANIMATIONS, Animation("", "", None).save),
        ("a view", VIEWS, lambda path: save_view(None, path, "")),
    ],
)
def test_endings_that_commands_check_are_those_that_are_written(
    tmp_path, kind, endings, save
):
    path = tmp_path / "page.txt"
    with pytest.raises(RunFileError) as early:
        check_ending(path, kind, endings)
    with pytest.raises(RunFileError) as late:
        save(path)
    assert str(early.value) == str(late.value)

"""Queues of studies, and lists of what is stored."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

import tolstat
from tests.answers.browser import asked
from tests.cli.command_line import TOLSTAT, call, chain, wait_for_trials
from tests.cli.conftest import PAGE
from tests.conftest import ROOT
from tolstat.answers.index_memory import memory_of
from tolstat.answers.run_entries import Entry, RunIndex
from tolstat.cli.batch import Queue
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.render.screen import Screen
from tolstat.store.files_beside import identity
from tolstat.study.study import load


def index(folder):
    with (folder / "batch.csv").open(newline="") as file:
        return {row["study"]: row for row in csv.DictReader(file)}


def test_each_study_of_a_queue_is_started_extended_or_resumed(no_pages, tmp_path):
    """One finished before, one stopped half way, one refused, one that is new."""
    before, half, new = (chain(tmp_path, n) for n in ("before", "half", "new"))
    wrong = chain(tmp_path, "wrong", limit=">= 1 kN")
    tolstat.run(before)
    finished = before.with_suffix(".h5").read_bytes()
    looked = []
    with Workers(1, lambda: len(looked) > 20 or looked.append(0), block=50) as crew:
        execute(load(half), half.with_suffix(".h5"), crew)
    assert 0 < tolstat.open(half.with_suffix(".h5")).ended < 1000

    done = call("batch", before, wrong, half, new, new)
    assert done.exit_code == 2, done.output
    assert (
        "gap" in done.stderr and "kN" in done.stderr and "Traceback" not in done.output
    )
    rows = index(tmp_path)
    states = {name: row["state"] for name, row in rows.items()}
    assert states == {
        "before": "finished before", "half": "resumed", "new": "finished",
        "wrong": "failed",
    }  # fmt: skip
    assert before.with_suffix(".h5").read_bytes() == finished
    whole = tolstat.open(before.with_suffix(".h5"))
    for path in (half, new):
        run = tolstat.open(path.with_suffix(".h5"))
        assert run.complete
        np.testing.assert_array_equal(run.column("gap"), whole.column("gap"))
    page = (tmp_path / "batch.html").read_text()
    for name in ("before", "half", "new"):
        assert f'href="{name}.html"' in page
        assert (tmp_path / f"{name}.html").read_text().endswith("a page")
    assert 'href="wrong' not in page
    assert rows["new"]["verdicts"] == "undecided: gap"


def test_studies_of_one_name_are_told_apart(no_pages, tmp_path):
    studies = [tmp_path / name for name in ("left", "right")]
    for folder in studies:
        folder.mkdir()
    done = call("batch", *(chain(folder, "gap") for folder in studies),
                chain(tmp_path, "other"))  # fmt: skip
    assert done.exit_code == 0, done.output
    assert [*index(tmp_path)] == ["left/gap", "right/gap", "other"]
    assert "left/gap" in done.stdout and "right/gap" in done.stdout
    assert 'href="left/gap.html"' in (tmp_path / "batch.html").read_text()


def test_a_finished_run_whose_data_have_changed_is_refused(no_pages, tmp_path):
    path, data = chain(tmp_path, "data"), tmp_path / "parts.csv"
    measured = 'data = "parts.csv", column = "A", unit = "mm"'
    text = path.read_text().replace('tolerance = "+-0.1 mm"', measured, 1)
    path.write_text(text)
    data.write_text("A\n" + "\n".join(f"{9.8 + 0.01 * i:.2f}" for i in range(40)))
    assert call("batch", path).exit_code == 0
    data.write_text(data.read_text().replace("9.90\n", "9.95\n"))
    again = call("batch", path)
    assert again.exit_code == 2 and "its data" in again.stderr


def test_exit_codes_of_a_queue(no_pages, tmp_path):
    good = chain(tmp_path, "good")
    assert call("batch", good).exit_code == 0
    bad = chain(tmp_path, "bad", limit=">= 1.2 mm")
    assert call("batch", good, bad).exit_code == 0
    assert call("batch", good, bad, "--check").exit_code == 3
    good.with_suffix(".h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(5000))
    broken = call("batch", good, bad)
    assert broken.exit_code == 2 and "not a run of tolstat" in broken.stderr
    assert index(tmp_path)["bad"]["state"] == "finished before"


@pytest.mark.parametrize(
    ("key", "was", "now"),
    [
        ("seed", "seed = 3", "seed = 4"),
        ("trials", "trials = 1000", "trials = 2000"),
        ("links.A.tolerance", '"+-0.1 mm" }\nB', '"+-0.2 mm" }\nB'),
    ],
)
def test_a_run_of_another_study_is_kept_and_named(tmp_path, key, was, now):
    path = chain(tmp_path, "study")
    tolstat.run(path)
    before = path.with_suffix(".h5").read_bytes()
    assert was in path.read_text()
    path.write_text(path.read_text().replace(was, now))
    done = call("batch", path)
    assert done.exit_code == 2
    assert key in done.stderr and "--force" in done.stderr
    assert path.with_suffix(".h5").read_bytes() == before


@pytest.mark.parametrize(
    ("sampling", "was", "now", "offered"),
    [
        ("random", "", "", ["extend", "run"]),
        ("random", "trials = 1000", "trials = 1200", ["run"]),
        ("random", "+-0.05 mm", "+-0.06 mm", ["run"]),
        ("latin", "", "", ["run"]),
    ],
)
def test_commands_in_a_refusal_work(no_pages, tmp_path, sampling, was, now, offered):
    """With the machine of one's own, and more trials only where they can be added."""
    own = ROOT / "runs" / "own"
    study, machine = tmp_path / "stack.toml", f"{own / 'stack.py'}:Stack"
    text = (own / "stack.toml").read_text().replace("20000", "1000")
    text = f'sampling = "{sampling}"\n{text}'
    for name in offered:
        study.write_text(text)
        call("run", study, "--trials", 500, "--force", "--machine", machine)
        study.write_text(text.replace(was, now))
        refused = call("batch", study, "--machine", machine)
        typed = [shlex.split(each) for each in re.findall("`([^`]*)`", refused.stderr)]
        assert [words[1] for words in typed] == offered
        (words,) = (words[1:] for words in typed if words[1] == name)
        assert words[-2:] == ["--machine", machine]
        assert call(*words).exit_code == 0
        done = call("batch", study, "--machine", machine)
        assert done.exit_code == 0, done.stderr


def test_an_extended_run_is_finished(no_pages, tmp_path):
    path = chain(tmp_path, "study")
    run = tolstat.extend(tolstat.run(path).path, 1500)
    assert call("batch", path).exit_code == 0
    assert tolstat.open(run.path).trials == 1500
    assert index(tmp_path)["study"]["state"] == "finished before"


def test_an_index_replaces_nothing_else(tmp_path):
    path = chain(tmp_path, "study")
    own = tmp_path / "batch.csv"
    own.write_text("my own numbers\n")
    refused = call("batch", path)
    assert refused.exit_code == 2 and "batch.csv" in refused.stderr
    assert own.read_text() == "my own numbers\n"
    assert not path.with_suffix(".h5").exists()
    called = chain(tmp_path, "batch")
    own.unlink()
    assert call("batch", called).exit_code == 2  # its report has the name of the index
    assert call("batch", path, "-o", tmp_path / "no" / "where").exit_code == 2
    for name in ("nothing", "loop"):
        (tmp_path / "loop").unlink(missing_ok=True)
        (tmp_path / "loop").symlink_to(name)
        assert call("batch", path, "-o", tmp_path / "loop").exit_code == 2
    assert call("batch", path, "-o", path).exit_code == 2  # a file
    assert not path.with_suffix(".h5").exists()


def test_a_page_of_another_run_is_written_again(no_pages, tmp_path):
    """Also if it is younger than the run: after `run --force`, or of other limits."""
    path = chain(tmp_path, "study")
    page = path.with_suffix(".html")
    assert call("batch", path).exit_code == 0
    written = page.read_text()
    page.write_text(written + " kept")
    assert call("batch", path).exit_code == 0
    assert page.read_text() == written + " kept"
    tolstat.run(path, force=True)
    page.touch()
    assert call("batch", path).exit_code == 0
    assert page.read_text() != written and "kept" not in page.read_text()
    page.write_text(PAGE)  # of `tolstat report`, perhaps with other limits
    assert call("batch", path).exit_code == 0
    assert page.read_text() != PAGE


def test_a_page_that_is_no_report_is_kept_and_named(no_pages, tmp_path):
    path = chain(tmp_path, "study")
    page = path.with_suffix(".html")
    page.write_text("my own page")
    refused = call("batch", path)
    assert refused.exit_code == 2 and "study.html is not a report" in refused.stderr
    assert page.read_text() == "my own page"
    assert index(tmp_path)["study"]["report"] == ""


def test_the_page_of_a_run_names_it(tmp_path):
    path = chain(tmp_path, "study")
    assert call("batch", path).exit_code == 0
    page = path.with_suffix(".html")
    head = page.read_text().partition("</head>")[0]
    assert f'<meta name="run" content="{identity(path.with_suffix(".h5"))}">' in head
    before = page.stat().st_mtime_ns
    assert call("batch", path).exit_code == 0
    assert page.stat().st_mtime_ns == before


def test_where_every_study_is_refused_nothing_is_written(tmp_path, monkeypatch):
    folder = tmp_path / "inner"
    folder.mkdir()
    monkeypatch.chdir(folder)
    wrong = chain(folder, "wrong", limit=">= 1 kN")
    for arguments in (["."], [wrong, "."], [wrong, "-o", folder / "index"]):
        assert call("batch", *arguments).exit_code == 2
        assert [*tmp_path.iterdir()] == [folder] and [*folder.iterdir()] == [wrong]


def test_titles_are_texts_in_an_index(no_pages, tmp_path):
    path = chain(tmp_path, "study", title="=1+1 <b>[/]")
    assert call("batch", path).exit_code == 0
    assert index(tmp_path)["study"]["title"] == "'=1+1 <b>[/]"
    assert "<b>" not in (tmp_path / "batch.html").read_text()


def test_ctrl_c_ends_a_queue_and_the_same_command_resumes(small_study):
    folder = small_study.parent
    text = small_study.read_text().replace("trials = 24", "trials = 20_000")
    small_study.write_text(text)
    after = chain(folder, "z_after")
    command = [TOLSTAT, "batch", small_study, after]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_trials(small_study.with_suffix(".h5"), process, 1)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, shown = process.communicate(timeout=30)
    assert process.returncode == 130 and "continues" in shown, shown
    assert time.monotonic() - began < 10.0
    states = {name: row["state"] for name, row in index(folder).items()}
    assert states == {"small": "stopped", "z_after": "waiting"}


def test_runs_lists_stored_runs(tmp_path, monkeypatch):
    (tmp_path / "inner").mkdir()
    tolstat.run(chain(tmp_path, "good", limit=">= 1.2 mm"))
    damaged = tolstat.run(chain(tmp_path / "inner", "damaged")).path
    monkeypatch.chdir(tmp_path)  # paths leave room for each row in one line
    listed = call("runs", ".")
    assert listed.exit_code == 0, listed.output
    (row,) = [line for line in listed.stdout.splitlines() if "good.h5" in line]
    for word in ("dimension_chain", "complete", "1000", "not met: gap", "MB"):
        assert word in row
    column = tolstat.open(damaged).column("gap")
    content = bytearray(damaged.read_bytes())
    content[content.index(column.tobytes()) + 8 * 17] ^= 1
    damaged.write_bytes(content)
    (tmp_path / "other.h5").write_text("no run at all")
    content = (tmp_path / "good.h5").read_bytes()
    content = re.sub(rb"(tolstat seal, format )\d+", rb"\g<1>99", content, count=1)
    (tmp_path / "later.h5").write_bytes(content)
    with h5py.File(tmp_path / "early.h5", "w") as file:  # of format 1 or 2
        file.attrs.update(format=2, study="", version_tolstat="0.1.0")
    listed = call("runs", ".")
    assert listed.exit_code == 1
    states = {
        line.split()[0]: line for line in listed.stdout.splitlines() if line.split()
    }
    assert " complete " in states["good.h5"]
    assert " damaged " in states["inner/damaged.h5"]
    assert " no run " in states["other.h5"]
    assert " other format " in states["later.h5"]
    assert " other format " in states["early.h5"]
    assert "early.h5: has format 1 or 2, this tolstat reads" in listed.stdout
    assert "later.h5: has format 99, this tolstat reads" in listed.stdout
    assert "or run its study again" in listed.stdout
    assert "17" in next(
        t for t in listed.stdout.splitlines() if t.startswith("inner/damaged.h5:")
    )
    assert call("runs", tmp_path / "nowhere").exit_code == 2


def test_an_index_that_cannot_be_written_ends_no_batch(no_pages, tmp_path, monkeypatch):
    """Its folder became a file meanwhile; the runs are there."""
    studies = [chain(tmp_path, name) for name in ("a", "b")]
    (tmp_path / "index").write_text("taken")
    monkeypatch.setattr("tolstat.cli.batch.check_folder", lambda folder: None)
    monkeypatch.setattr(
        "tolstat.cli.batch._index_in", lambda folder, files: folder / "batch.html"
    )
    done = call("batch", *studies, "-o", tmp_path / "index")
    assert done.exit_code == 1 and "the index is not written" in done.stderr
    assert all(path.with_suffix(".h5").exists() for path in studies)


def test_a_page_that_was_replaced_meanwhile_is_not_linked(
    no_pages, tmp_path, monkeypatch
):
    first, second = studies = [chain(tmp_path, name) for name in ("a", "b")]
    work_off = Queue.work_off

    def replacing(queue, study, workers):
        work_off(queue, study, workers)
        if study.stem == "b":
            first.with_suffix(".html").write_text("hello")

    monkeypatch.setattr(Queue, "work_off", replacing)
    done = call("batch", *studies)
    assert done.exit_code == 1 and "a: its run or its page was replaced" in done.stderr
    linked = (tmp_path / "batch.html").read_text()
    assert 'href="b.html"' in linked and 'href="a.html"' not in linked
    assert second.with_suffix(".html").exists()


def test_what_is_no_study_does_not_move_the_index(no_pages, tmp_path):
    """Of /dev/null and a study in a folder it was written to the root."""
    study = chain(tmp_path, "a")
    assert call("batch", study, "/dev/null", tmp_path / "b" / "none.toml").exit_code
    assert "finished" in (tmp_path / "batch.csv").read_text()


def test_what_was_laid_in_the_place_of_the_index_is_kept(
    no_pages, tmp_path, monkeypatch
):
    page, work_off = tmp_path / "batch.html", Queue.work_off

    def laying(queue, study, workers):
        page.write_text("mine")
        work_off(queue, study, workers)

    monkeypatch.setattr(Queue, "work_off", laying)
    done = call("batch", chain(tmp_path, "a"))
    assert done.exit_code == 1 and "is not written: " in done.stderr
    assert "index in" not in done.stderr and page.read_text() == "mine"


def test_a_study_edited_since_its_run_is_named(no_pages, tmp_path):
    study = chain(tmp_path, "edited")
    call("run", study, "--trials", 500, "--seed", 3)
    assert not call("check", study.with_suffix(".h5")).stderr
    study.write_text(study.read_text().replace(">= 0.5 mm", ">= 0.9 mm"))
    for command in ("check", "report"):
        edited = call(command, study.with_suffix(".h5")).stderr
        assert "0.5 mm" in edited and "is '>= 0.9 mm'" in edited, edited
    answer = call("check", study.with_suffix(".h5"), "--json").stdout
    (warning,) = json.loads(answer)["warnings"]
    assert "is '>= 0.9 mm'; answers are of the run" in warning


def test_of_many_studies_a_terminal_has_the_lines_that_fit(tmp_path):
    """What runs is among them, also the first and the last."""
    screen = Screen(width=100, height=24, file=io.StringIO(), force_terminal=True)
    entries = {tmp_path / f"{i}.toml": Entry(f"study_{i}") for i in range(1, 301)}
    queue = Queue(entries, tmp_path / "batch.html", memory_of(tmp_path), screen)
    for begun in (1, 150, 300):
        queue.begun = begun
        screen.print(queue.table())
        lines = screen.file.getvalue().splitlines()
        screen.file = io.StringIO()
        assert 18 < len(lines) <= 24
        assert any(f"study_{begun} " in line for line in lines)
        assert f"study {begun} of 300" in lines[-1]


def test_an_index_fits_its_window(tmp_path):
    """Four studies with limits, and names as long as those of this package."""
    long = ", ".join(f"amplification_{i}" for i in (12, 23, 34, 35, 46, 47, 58, 59))
    entry = Entry(
        "elastic-machine-rule", "Elastic machine: how long to start, by which law",
        "elastic_machine", "finished before", 10000, 10000, 0,
        f"not met: speed_margin; undecided: free_speed_range; met: {long}",
        "2026-11-23T18:28:00+00:00", 25.93, 2_600_000,
    )  # fmt: skip
    path = tmp_path / "index.html"
    path.write_text(RunIndex("tolstat batch", tmp_path, (entry,) * 4).html())
    over = "(e => e.scrollWidth - e.clientWidth)(document.querySelector('.table'))"
    assert asked(path, tmp_path, 1100, over) == 0
    assert asked(path, tmp_path, 390, "document.documentElement.scrollWidth") <= 390


def test_a_link_in_a_circle_is_a_sentence(tmp_path):
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    done = call("batch", tmp_path / "loop.toml")
    assert done.exit_code == 2 and "loop.toml" in done.output, done.output

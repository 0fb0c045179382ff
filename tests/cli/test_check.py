"""Exit codes for scripts: tolstat check, and --check of commands that run trials."""

from __future__ import annotations

import json
import shlex

import pytest

import tolstat
from tests.answers.conftest import chain as gap_of
from tests.answers.page_checks import blocks_of
from tests.cli.command_line import call, chain
from tolstat.render.screen import as_text

MET, NOT_MET, UNDECIDED = ">= 0.5 mm", ">= 1.2 mm", ">= 0.87 mm"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checked")
    limits = {"met": MET, "missed": NOT_MET, "open": UNDECIDED}
    paths = {n: chain(folder, n, limit=x, trials=5000) for n, x in limits.items()}
    return {n: tolstat.run(path, progress=None).path for n, path in paths.items()}


def test_exit_code_of_the_worst_verdict(runs):
    met, missed, undecided = runs.values()
    for given, code in (
        ((met,), 0), ((missed,), 3), ((undecided,), 4), ((met, undecided), 4),
        ((undecided, missed, met), 3),
    ):  # fmt: skip
        assert call("check", *given).exit_code == code
    assert call("check").exit_code == 2


def test_a_line_for_each_limit_and_the_same_as_json(runs):
    done = call("check", *runs.values())
    assert done.stdout.splitlines() == [
        f"met.h5: gap {MET}: met",
        f"missed.h5: gap {NOT_MET}: not met",
        f"open.h5: gap {UNDECIDED}: undecided",
    ]
    again = call("check", *runs.values(), "--json")
    found = json.loads(again.stdout)
    assert again.exit_code == 3 and (found["schema"], found["answer"]) == (3, "check")
    assert [each["verdict"] for each in found["limits"]] == [
        "met", "not met", "undecided",
    ]  # fmt: skip
    assert found["conditions"] == []  # the third one is undecided
    assert found["limits"][0] == {
        "run": "met.h5", "response": "gap", "limit": MET, "verdict": "met",
        "reason": "",
    }  # fmt: skip


def test_commands_that_run_trials_end_with_0(runs, tmp_path, no_pages):
    study = chain(tmp_path, "missed", limit=NOT_MET)
    assert call("run", study).exit_code == 0
    run = study.with_suffix(".h5")
    assert call("resume", run).exit_code == call("batch", study).exit_code == 0
    assert call("extend", run, "--trials", 1200).exit_code == 0
    assert call("report", run).exit_code == 0


@pytest.mark.parametrize(("limit", "code"), [(MET, 0), (NOT_MET, 3), (UNDECIDED, 4)])
def test_the_option_ends_as_the_command(tmp_path, no_pages, limit, code):
    study = chain(tmp_path, "study", limit=limit, trials=5000)
    run = study.with_suffix(".h5")
    for words in (
        ("run", study), ("resume", run), ("extend", run, "--trials", 5050),
        ("batch", study),
    ):  # fmt: skip
        done = call(*words, "--check")
        assert done.exit_code == code, (words, done.output)


def test_no_limit_is_refused_before_anything_runs(tmp_path, no_pages):
    study = chain(tmp_path, "free")
    text = study.read_text()
    study.write_text(text[: text.index("[limits]")])
    done = call("run", study, "--check")
    assert done.exit_code == 2 and "no limit to check; write one into" in done.stderr
    assert study.name in done.stderr  # not the run, which there is not yet
    run = study.with_suffix(".h5")
    assert not run.exists() and call("run", study).exit_code == 0
    for words in (("check", run), ("resume", run, "--check"), ("batch", study)):
        done = call(
            *words, *(() if "--check" in words or words[0] == "check" else ("--check",))
        )
        assert done.exit_code == 2 and "no limit to check" in done.stderr


def test_a_run_in_part_is_refused_with_its_command(half):
    done = call("check", half.path)
    assert (
        done.exit_code == 2 and f"{half.ended} of 1000 trials have run" in done.stderr
    )
    (command,) = [x for x in done.stderr.split("`") if x.startswith("tolstat resume")]
    assert shlex.split(command)[2] == str(half.path)


def test_a_grid_has_no_verdicts(tmp_path):
    study = gap_of("<= 2417 mm", sampling="grid", grid={"a": ["0 mm", "1 mm"]})
    for name in ("trials", "seed", "links"):
        del study[name]
    study |= {
        "settings": {"gap": "H - a"},
        "links": {"H": {"nominal": "2450 mm"}, "a": {"nominal": "33.33 mm"}},
    }
    run = tolstat.run(study, output=tmp_path / "grid.h5", progress=None)
    done = call("check", run.path)
    assert done.exit_code == 2 and "are no sample" in done.stderr


def test_a_rare_run_judges_one_limit(tmp_path):
    limit = {"limit": "<= 2417 mm", "ppm": 100}
    run = tolstat.run(gap_of(limit, sampling="rare"), output=tmp_path / "rare.h5")
    done = call("check", run.path)
    said = "rare.h5: gap <= 2417 mm: met (if no kind of failure was missed)\n"
    assert (done.exit_code, done.stdout) == (0, said)
    done = json.loads(call("check", run.path, "--json").stdout)
    assert done["conditions"] == ["if no kind of failure was missed"]
    found = tolstat.summary(run)
    assert found.reason == "if no kind of failure was missed"
    assert json.loads(found.json())["reason"] == found.reason
    roles = {getattr(block, "role", ""): block for block in blocks_of(found.document())}
    assert as_text(roles["lead"].parts).startswith(
        f"The limit is met ({found.reason}). "
    )

"""A command as a model: its input and output files, and how it fails."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import tolstat
from tolstat import catalogue
from tolstat.cli.main import main
from tolstat.command.placeholders import Command
from tolstat.errors import ModelError, StudyError
from tolstat.model.checked import LONGEST_OUTPUT
from tolstat.operating_system import BLAS_THREADS, limit_blas

# a deck of assignments in, a table out: the size in mm, doubled
SOLVER = """\
. "$1"
echo "solving for $size, BLAS threads: ${OPENBLAS_NUM_THREADS-as before}"
awk -v x="$size" -v out="$2" 'BEGIN {
  if (x > 20.08) exit 3
  if (x < 19.92) exit 0
  printf "time, force\\n0, 0\\n1, %.17g\\n", 2 * x > out }'
"""
STUDY = """\
model = "command"
trials = 60
seed = 2
longest_trial = "20 s"
[links]
size = "20 mm +-0.12 mm"
[responses]
force = "kN"
[limits]
force = "<= 40.1 kN"
"""


@pytest.fixture
def source(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.delenv(BLAS_THREADS, raising=False)
    limit_blas()  # as the command line does
    Path("solver.sh").write_text(SOLVER)
    Path("deck.txt").write_text("other={a: 1}\nsize={size}\n".replace("other", "# o"))
    Path("beam.toml").write_text(STUDY)
    return "exec:sh solver.sh {input:deck.txt} {output.csv}"


def test_a_run_of_a_command(source, tmp_path):
    catalogue.load(source)
    run = tolstat.run("beam.toml")
    size = 20 + 1e3 * run.column("size")
    crashed, silent = size > 20.08, size < 19.92
    assert crashed.any()
    assert silent.any()
    words = np.array([run.ended_as(trial) for trial in range(run.trials)])
    assert (words[crashed] == "crashed").all()
    assert (words[silent] == "no answer").all()
    done = ~(crashed | silent)
    assert np.allclose(run.column("force")[done], 2e3 * size[done], rtol=1e-14)
    text = run.isolation.output[int(np.flatnonzero(crashed)[0])]
    assert "exit code 3" in text
    assert "solving for 20.0" in text
    assert "BLAS threads: as before" in text
    folder = Path(text.partition("its folder is ")[2].splitlines()[0])
    assert (folder / "deck.txt").is_file()
    kept = [path for path in tmp_path.glob("tolstat-trial-*") if path.is_dir()]
    assert kept
    assert all((path / "log.txt").is_file() for path in kept)


def test_a_long_log_leaves_the_reason_and_the_folder(source):
    Path("solver.sh").write_text("yes trouble | head -9999\n" + SOLVER)
    catalogue.load(source)
    run = tolstat.run("beam.toml")
    texts = [text for text in run.isolation.output.values() if "exit code" in text]
    assert texts
    for text in texts:
        assert "its folder is " in text.splitlines()[0]
        assert "solving for" in text
        assert len(text) <= LONGEST_OUTPUT


def test_a_nominal_trial_without_an_answer_is_refused(source):
    Path("solver.sh").write_text("echo 'time, load\\n0, 0' > \"$2\"")
    catalogue.load(source)
    with pytest.raises(ModelError, match=r"has no answer: output\.csv has no force;"):
        tolstat.run("beam.toml")


def test_a_command_that_hangs_is_ended(source, tmp_path):
    Path("solver.sh").write_text('. "$1"; sleep 1000 & sleep 1000')
    Path("beam.toml").write_text(STUDY.replace("20 s", "0.4 s"))
    catalogue.load(source)
    began = time.monotonic()
    with pytest.raises(ModelError, match=r"longer than 0.4 s\nits folder"):
        tolstat.run("beam.toml")
    assert time.monotonic() - began < 60


def test_inputs_of_all_kinds(tmp_path):
    deck = tmp_path / "deck"
    deck.write_bytes(b"{ size = {size} }\r\n\\{other} \xff")
    for typed, name, text in [
        ("{input}", "input.json", '{\n "size": 0.1\n}'),
        ("{input.toml}", "input.toml", "size = 0.1\n"),
        (f"{{input:{deck}}}", "deck", "{ size = 0.1 }\r\n{other} \xff"),
    ]:
        command = Command.read(f"sh {typed} {{output}}")
        folder = tmp_path / f"of {name}"
        folder.mkdir()
        command.write_input(folder, {"size": 0.1})
        assert command.filled(folder)[1:] == [
            str(folder / name), str(folder / "output.json"),
        ]  # fmt: skip
        assert (folder / name).read_bytes() == text.encode("latin-1")


@pytest.mark.parametrize(
    ("kind", "text", "wrong"),
    [
        ("json", None, "No such file"),
        ("json", "{", "Expecting"),
        ("json", "[1]", "by name"),
        ("json", '{"b": 1}', "has no a"),
        ("json", '{"a": "x"}', "could not convert"),
        ("csv", "a\n", "has no a"),
        ("csv", "a,b\n1", ""),
        ("csv", "\ufeffb, a ,\n2, 1,\n", ""),
        ("json", '\ufeff{"a": 1}', ""),
        ("csv", "a\n1,5\n", "row 1 has 2 cells, but 1 names"),
        ("csv", "a,b,a\n1,2,3\n", "output.csv: a is given twice"),
        ("csv", "a\n1_0\n", "'1_0' is not a number"),
        ("csv", "a\n" + "1" * 200_000, "field larger"),
        ("json", '{"a": 1, "a": 2}', "output.json: a is given twice"),
        ("json", '{"a": true}', "true is not a number"),
        ("json", '{"a": "1_0"}', "'1_0' is not a number"),
        ("json", '{"a": 1' + "0" * 400 + "}", "too large"),
    ],
)
def test_outputs_that_cannot_be_read(tmp_path, kind, text, wrong):
    command = Command.read(f"sh {{input}} {{output.{kind}}}")
    if text is not None:
        (tmp_path / f"output.{kind}").write_text(text, encoding="utf-8")
    if not wrong:
        assert command.read_output(tmp_path, ["a"]) == [1.0]
        return
    with pytest.raises(ValueError, match=wrong):
        command.read_output(tmp_path, ["a"])


@pytest.mark.parametrize(
    ("command", "wrong"),
    [
        ("sh {inptu} {output}", r"{inptu} is no placeholder; allowed: {input}, "),
        ("sh {input} {output.json5}", r"{output.json5} is no placeholder"),
        ("sh -c 'echo ${HOME}' {input}", "expected once each"),
        ("sh {input}", "expected once each"),
        ("sh {input} {input} {output}", "expected once each"),
        ("no-such-program {input} {output}", "no program"),
        ("sh {input:nowhere.txt} {output}", "no such file"),
        ("sh '", "No closing quotation"),
    ],
)
def test_wrong_commands(command, wrong):
    with pytest.raises(ModelError, match=wrong):
        catalogue.load(f"exec:{command}")


def test_a_new_study_runs(source):
    Path("solver.sh").write_text('echo \'{"force": 0.5}\' > "$2"')
    source = source.replace("output.csv", "output")
    runner = CliRunner()
    for words in (["new", "-o", "new.toml"], ["run", "new.toml", "--trials", "20"]):
        ended = runner.invoke(main, [*words, "--machine", source])
        assert ended.exit_code == 0, ended.output
    assert tolstat.open("new.h5").counts["done"] == 20


def test_its_files_count_in_its_digest(source):
    before = catalogue.load(source).source_digest
    assert catalogue.load(source).source_digest == before
    Path("solver.sh").write_text(SOLVER + "# changed\n")
    changed = catalogue.load(source).source_digest
    assert changed != before
    Path("deck.txt").write_text("size={size} # changed")
    assert catalogue.load(source).source_digest not in (before, changed)


@pytest.mark.parametrize(
    ("deck", "wrong"),
    [
        ("size=20", r"does not take \{size\}; write it where"),
        ("a={size}\nb={szie}", r"deck.txt, line 2: \{szie\} .* did you mean 'size'"),
        (r"\{size}", r"does not take \{size\}"),
    ],
)
def test_a_template_with_other_places_is_refused(source, deck, wrong):
    Path("deck.txt").write_text(deck)
    catalogue.load(source)
    with pytest.raises(StudyError, match=wrong):
        tolstat.run("beam.toml")


def test_json_numbers_keep_their_bits(tmp_path):
    command = Command.read("sh {input} {output}")
    value = 0.1 + 0.2
    command.write_input(tmp_path, {"a": value})
    assert json.loads((tmp_path / "input.json").read_text()) == {"a": value}

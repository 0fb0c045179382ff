"""Files as editors of Windows write them are read, or refused in words."""

import numpy as np
import pytest
from click.testing import CliRunner

import tolstat
from tolstat.cli.main import main
from tolstat.errors import DataError, StudyError
from tolstat.execution.compatibility import study_differs
from tolstat.study.data_files import read_data, si_factor
from tolstat.study.study import load
from tolstat.study.study_schema import FileEntry

TEXT = """model = "dimension_chain"
trials = 64
seed = 1
title = "Spalt µ ü °"
settings.gap = "A - B"
links.A = { nominal = "10 mm", tolerance = "+-50 µm" }
links.B = "9 mm"
"""
CSV = "rod,length [µm]\n1,0.1\n2,0.3\n"
MARKED = ["utf-8", "utf-8-sig", "utf-16", "utf-32"]
ENDS = ["\n", "\r\n", "\r"]


@pytest.mark.parametrize("end", ENDS, ids=repr)
@pytest.mark.parametrize("encoding", MARKED)
def test_a_byte_order_mark_names_the_encoding(tmp_path, encoding, end):
    path = tmp_path / "study.toml"
    path.write_bytes(TEXT.replace("\n", end).encode(encoding))
    study = load(path)
    assert (study.text, study.title) == (TEXT, "Spalt µ ü °")
    (tmp_path / "rods.csv").write_bytes(CSV.replace("\n", end).encode(encoding))
    table = read_data(tmp_path, FileEntry(data="rods.csv"))
    factor = si_factor(table, "length", table.units["length"], "m")
    assert factor * table.column("length") == pytest.approx([1e-7, 3e-7])


def test_both_orders_of_utf_16(tmp_path):
    for mark, encoding in ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")):
        (tmp_path / "study.toml").write_bytes(mark + TEXT.encode(encoding))
        assert load(tmp_path / "study.toml").text == TEXT


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (TEXT.encode("cp1252"), ["line 4", "byte 0xB5", "'µ'", "as UTF-8"]),
        (TEXT.replace("µ", "u").encode("latin-1"), ["line 4", "0xFC", "'ü'"]),
        (TEXT.replace("\n", "\r\n").encode("cp1252"), ["line 4", "0xB5"]),
        (TEXT.encode("utf-16-le"), ["NUL bytes", "as UTF-8"]),
        (TEXT.encode("utf-16-be"), ["NUL bytes", "as UTF-8"]),
        (TEXT.encode("utf-16")[:-1], ["UTF-16", "cut off", "as UTF-8"]),
        (b"\0" + TEXT.encode(), ["NUL bytes"]),
    ],
)
def test_what_no_mark_tells_is_refused_with_its_place(tmp_path, content, words):
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    with pytest.raises(StudyError) as refused:
        load(path)
    assert [w for w in [str(path), *words] if w not in str(refused.value)] == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (CSV.encode("utf-16-le"), ["NUL bytes", 'encoding = "utf-16-le"']),
        (CSV.encode("utf-16")[:-1], ["UTF-16", "cut off"]),
        (
            CSV.encode("cp1252").replace(b"1", b"\x81"),
            ["line 2", "0x81", "Windows-1252"],
        ),
    ],
)
def test_data_whose_encoding_no_rule_tells_are_refused(tmp_path, content, words):
    (tmp_path / "rods.csv").write_bytes(content)
    with pytest.raises(DataError) as refused:
        read_data(tmp_path, FileEntry(data="rods.csv"))
    assert [w for w in ["rods.csv", *words] if w not in str(refused.value)] == []


def test_data_of_windows_are_read_without_a_mark(tmp_path):
    (tmp_path / "rods.csv").write_bytes(CSV.encode("cp1252"))
    table = read_data(tmp_path, FileEntry(data="rods.csv"))
    assert table.units["length"] == "µm" and "Windows-1252" in table.words


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (r'"C:\parts\rods.csv"', "write / between folders"),
        (r'"C:\users\rods.csv"', "write / between folders"),
        (r'"parts\new.csv"', "write / between folders"),
        (r'"parts\table.csv"', "a control"),
        (r"'parts\rods.csv'", "write / between folders, not"),
    ],
)
def test_backslashes_in_the_name_of_a_file(tmp_path, data, words):
    path = tmp_path / "study.toml"
    entry = f'{{ nominal = "1 mm", data = {data}, column = "length" }}'
    path.write_text(f"{TEXT}links.C = {entry}\n", encoding="utf-8")
    with pytest.raises(StudyError) as refused:
        load(path)
    assert words in str(refused.value)


def test_another_fault_of_toml_says_nothing_about_escapes(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(f"{TEXT}links.C = 9 mm\n", encoding="utf-8")
    with pytest.raises(StudyError) as refused:
        load(path)
    assert "escape" not in str(refused.value)


def test_a_run_of_a_marked_study_is_compared_edited_and_run_again(tmp_path):
    path = tmp_path / "study.toml"
    path.write_bytes(TEXT.replace("\n", "\r\n").encode("utf-8-sig"))
    run = tolstat.run(path)
    assert study_differs(run) == []
    path.write_bytes(TEXT.replace("seed = 1", "seed = 2").encode("utf-16"))
    assert len(study_differs(run)) == 1
    fresh = tmp_path / "fresh.toml"
    typed = ["what-if", str(run.path), "A=+-20 um", "--write", str(fresh)]
    answer = CliRunner().invoke(main, typed)
    assert answer.exit_code == 0, answer.output
    assert load(fresh).title == "Spalt µ ü °"
    assert np.isfinite(run.column("gap")).all()

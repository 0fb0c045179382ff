"""Trials and answers in files of other programs: CSV, Parquet, XLSX."""

import csv
import io
import json

import numpy as np
import openpyxl
import pandas as pd
import pyarrow.parquet
import pytest
from click.testing import CliRunner

import tolstat
from tolstat.answers.export.trials_table import export
from tolstat.cli.main import main
from tolstat.errors import RunFileError
from tolstat.render import workbook

SHEETS = ["trials", "limits", "responses", "contributors", "provenance"]
STUDY = {
    "model": "dimension_chain",
    "title": "=cmd|' /C calc'!A0",
    "trials": 300,
    "seed": 1,
    "settings": {"gap": "A - B"},
    "links": {
        "A": {"nominal": "10 mm", "tolerance": "+-0.1 mm"},
        "B": {"nominal": "9 mm", "tolerance": "+-0.1 mm"},
    },
    "limits": {"gap": "0.9..1.1 mm"},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return tolstat.run(STUDY, output=tmp_path_factory.mktemp("export") / "run.h5")


def opened(path):
    return openpyxl.load_workbook(path)


def rows_of(sheet):
    return [[cell.value for cell in row] for row in sheet]


def test_a_workbook_has_all_trials_in_the_units_of_the_study(run, tmp_path):
    path = tmp_path / "run.xlsx"
    export(run, path)
    book = opened(path)
    assert book.sheetnames == SHEETS
    head, *rows = rows_of(book["trials"])
    assert head == ["trial", "A [mm]", "B [mm]", "gap [mm]", "status"]
    assert [row[0] for row in rows] == list(range(300))
    gaps = [row[3] for row in rows]
    np.testing.assert_allclose(gaps, 1e3 * run.column("gap"), rtol=1e-15)
    head, limit = rows_of(book["limits"])
    cells = dict(zip(head, limit, strict=True))
    assert (cells["lower [unit]"], cells["unit"]) == (0.9, "mm")
    assert cells["out of limit"] == run.beyond("gap").sum()
    assert cells["verdict"] == tolstat.summary(run).frame()["verdict"].item()
    head, first, _ = rows_of(book["contributors"])
    assert dict(zip(head, first, strict=True))["upper [unit]"] == pytest.approx(0.1)
    provenance = [row[:2] for row in rows_of(book["provenance"])]
    assert ["study", "trials = 300"] in provenance


def test_text_is_never_a_formula(run, tmp_path):
    export(run, tmp_path / "run.xlsx")
    tolstat.report(run).save(tmp_path / "report.xlsx")
    for name in ("run.xlsx", "report.xlsx"):
        book = opened(tmp_path / name)
        cells = [cell for sheet in book for row in sheet for cell in row]
        assert not [cell for cell in cells if cell.data_type == "f"]
        titled = [c for c in cells if c.value == STUDY["title"]]
        assert titled and all(cell.data_type in ("s", "inlineStr") for cell in titled)


def test_all_tables_of_a_report(run, tmp_path):
    report = tolstat.report(run)
    book = opened(report.save(tmp_path / "report.xlsx"))
    head, row = rows_of(book["report"])
    wide = dict(zip(head, row, strict=True))
    assert wide["mean [unit]"] == pytest.approx(
        1e3 * report.responses["gap"].mean.value
    )
    head, row = rows_of(book["Responses"])
    cells = dict(zip(head, row, strict=True))
    ends = cells["mean * lower"], cells["mean * upper"]
    assert ends == pytest.approx([1e3 * x for x in report.responses["gap"].mean[1:3]])
    assert {"Limits", "Worst trials", "Numbers of the study"} <= {*book.sheetnames}


def test_the_same_run_gives_the_same_bytes(run, tmp_path):
    for name in ("a.xlsx", "b.xlsx"):
        export(run, tmp_path / name)
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()


def test_more_trials_than_rows_name_parquet(run, tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.answers.export.run_workbook.MOST_ROWS", 299)
    path = tmp_path / "run.xlsx"
    with pytest.raises(RunFileError, match=r"300 trials; name a file .* \.parquet"):
        export(run, path)
    assert not path.exists()
    assert workbook.MOST_ROWS == 2**20 - 1


def test_units_in_csv_and_in_the_metadata_of_parquet(run, tmp_path):
    export(run, tmp_path / "si.csv")
    # by csv: the pandas of the lowest versions reads the last bit wrongly
    with (tmp_path / "si.csv").open(newline="") as file:
        gaps = [float(row["gap [m]"]) for row in csv.DictReader(file)]
    np.testing.assert_array_equal(gaps, run.column("gap"))
    export(run, tmp_path / "study.csv", units="shown")
    table = pd.read_csv(tmp_path / "study.csv", index_col="trial")
    np.testing.assert_allclose(table["gap [mm]"], 1e3 * run.column("gap"))
    export(run, tmp_path / "run.parquet", units="shown")
    schema = pyarrow.parquet.read_schema(tmp_path / "run.parquet")
    assert schema.field("gap [mm]").metadata == {b"unit": b"mm"}
    assert json.loads(schema.metadata[b"units"])["A [mm]"] == "mm"


def test_failed_trials_have_empty_cells_and_their_status(toy, toy_study, tmp_path):
    run = tolstat.run(toy_study, model=toy)
    assert run.failed
    export(run, tmp_path / "run.xlsx")
    head, *rows = rows_of(opened(tmp_path / "run.xlsx")["trials"])
    status = head.index("status")
    failed = [row for row in rows if row[status] != "done"]
    assert len(failed) == run.failed
    assert all(None in row for row in failed)


def test_names_of_sheets_are_allowed_and_different():
    sheets = [
        workbook.Sheet(name, ["a"], [[1.0], [np.nan], [np.inf], ["=1+1"], [True]])
        for name in ("x" * 40, "x" * 40, "a:b/c", "A B C", "'", "")
    ]
    book = openpyxl.load_workbook(io.BytesIO(workbook.workbook_of(sheets)))
    assert len({name.casefold() for name in book.sheetnames}) == 6
    assert rows_of(book["a b c"]) == [["a"], [1], [None], ["inf"], ["=1+1"], [True]]


def test_the_command(run, tmp_path):
    path = tmp_path / "run.xlsx"
    done = CliRunner().invoke(main, ["export", str(run.path), "-o", str(path)])
    assert done.exit_code == 0 and "300 trials in" in done.output
    typed = ["export", str(run.path), "-o", str(path), "--units", "inch"]
    assert CliRunner().invoke(main, typed).exit_code == 2

"""Workbooks as other libraries write them."""

import datetime
import io
import zipfile
from pathlib import Path

import numpy as np
import odf.opendocument
import odf.table
import odf.text
import openpyxl
import pandas as pd
import pytest
import xlsxwriter
import xlwt

from tolstat.errors import DataError
from tolstat.tables import workbook_reader
from tolstat.tables.raw_file import Form
from tolstat.tables.read import read_table

LENGTHS = [20.01, 20.003, 19.998]


def by_openpyxl(rows, title="Messung", **more):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = title
    for row in rows:
        sheet.append(row)
    for name, others in more.items():
        book.create_sheet(name)
        for row in others:
            book[name].append(row)
    return saved(book)


def saved(book):
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def by_odfpy(rows):
    book = odf.opendocument.OpenDocumentSpreadsheet()
    table = odf.table.Table(name="Messung")
    for cells in rows:
        row = odf.table.TableRow()
        for cell in cells:
            row.addElement(
                cell if isinstance(cell, odf.table.Element) else odf_cell(cell)
            )
        table.addElement(row)
    book.spreadsheet.addElement(table)
    file = io.BytesIO()
    book.write(file)
    return file.getvalue()


def odf_cell(value):
    if isinstance(value, str) and value.startswith("of:"):
        return odf.table.TableCell(formula=value)
    kind = {"valuetype": "string"}
    if isinstance(value, float):
        kind = {"valuetype": "float", "value": repr(value)}
    cell = odf.table.TableCell(**kind)
    cell.addElement(odf.text.P(text=str(value)))
    return cell


def by_xlwt(rows):
    book = xlwt.Workbook()
    sheet = book.add_sheet("Messung")
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            sheet.write(i, j, value)
    return saved(book)


def measured(content, column="d", name="parts.xlsx", **form):
    table = read_table(Path(name), content, Form(**form), (column,))
    return table.measured(column)


def refusal(content, column="d", name="parts.xlsx", **form):
    with pytest.raises(DataError) as refused:
        measured(content, column, name, **form)
    return str(refused.value)


ROWS = [["Protokoll"], [], ["Nr", "d [mm]"], *([i, x] for i, x in enumerate(LENGTHS))]


def test_xlsx_by_openpyxl():
    column = measured(by_openpyxl(ROWS))
    assert column.numbers == tuple(LENGTHS) and column.unit == "mm"
    assert column.words == "sheet Messung, 1 row skipped"
    assert column.places[0] == "parts.xlsx, Messung, row 4"


def test_xlsx_by_pandas():
    file, values = io.BytesIO(), np.random.default_rng(1).normal(20, 0.01, 200)
    pd.DataFrame({"d": values}).to_excel(file, engine="openpyxl")
    # openpyxl writes 16 digits
    assert measured(file.getvalue()).numbers == pytest.approx(values, rel=1e-15)


def test_ods_and_xls():
    rows = [["Nr", "d [mm]"], *([float(i), x] for i, x in enumerate(LENGTHS))]
    for content, name in ((by_odfpy(rows), "a.ods"), (by_xlwt(rows), "a.xls")):
        assert measured(content, name=name).numbers == tuple(LENGTHS)


def test_texts_follow_the_rule_of_texts():
    rows = [["Nr", "d"], [1, "20,01"], [2, "20,003"]]
    column = measured(by_openpyxl(rows))
    assert column.numbers == (20.01, 20.003) and "decimal comma" in column.words
    said = refusal(by_openpyxl([["Nr", "d"], [1, "20,003"], [2, 20.1]]))
    assert "Messung!B2" in said and "20003 or 20.003" in said


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("#DIV/0!", "#DIV/0! is an error"),
        ("=1+B2", "never calculated"),
        (True, "TRUE is a truth value"),
        (datetime.datetime(2025, 12, 24), "2025-12-24 is a date or a time"),
        ("x", "'x' is not a number"),
    ],
)
def test_cells_that_are_no_numbers_are_named(value, words):
    said = refusal(by_openpyxl([["Nr", "d"], [1, 20.1], [2, value], [3, 20.2]]))
    assert f"parts.xlsx, Messung!B3: {words}" in said or words in said
    assert "Messung!B3" in said


def test_lots_may_be_dates():
    days = [datetime.date(2025, 12, 23), datetime.date(2025, 12, 24)]
    rows = [["day", "d"], *zip(days, [20.1, 20.2], strict=True)]
    table = read_table(Path("parts.xlsx"), by_openpyxl(rows))
    assert table.measured("d", lots="day").lots == ("2025-12-23", "2025-12-24")


def test_formulas_by_xlsxwriter():
    """It writes 0 where it was given no value."""
    file = io.BytesIO()
    with xlsxwriter.Workbook(file) as book:
        sheet = book.add_worksheet("Messung")
        sheet.write_row(0, 0, ["Nr", "d"])
        sheet.write_row(1, 0, [1, 20.5])
        sheet.write(2, 0, 2)
        sheet.write_formula(2, 1, "=B2+1", None, 21.5)
    content = file.getvalue()
    assert measured(content).numbers == (20.5, 21.5)
    file = io.BytesIO()
    with xlsxwriter.Workbook(file) as book:
        sheet = book.add_worksheet("Messung")
        sheet.write_row(0, 0, ["Nr", "d"])
        sheet.write_row(1, 0, [1, 20.5])
        sheet.write(2, 0, 2)
        sheet.write_formula(2, 1, "=B2+1")
    assert "Messung!B3" in refusal(file.getvalue())


def test_errors_and_formulas_of_ods():
    rows = [["Nr", "d"], [1.0, 20.1], [2.0, "of:=[.B2]+1"]]
    assert "Messung!B3" in refusal(by_odfpy(rows), name="a.ods")


def test_equal_cells_of_ods_side_by_side():
    """They are written as one cell, repeated."""
    error = odf.table.TableCell(formula="of:=NA()", numbercolumnsrepeated=2,
                                valuetype="string")  # fmt: skip
    error.addElement(odf.text.P(text="#N/A"))
    rows = [["c", "d"], [5.0, 20.1], [error], [5.1, 20.2]]
    said = refusal(by_odfpy(rows), name="a.ods")
    assert "Messung!B3: #N/A is an error" in said


def test_a_number_shown_in_per_cent_is_read_as_shown():
    rows = [["Nr", "slip [%]"], *([i, x] for i, x in enumerate((0.005, 0.07, 0.006)))]
    book = openpyxl.load_workbook(io.BytesIO(by_openpyxl(rows)))
    for row, form in zip((2, 3, 4), ("0.0%", "0%", "[Red]0.00 %"), strict=True):
        book["Messung"].cell(row, 2).number_format = form
    column = measured(saved(book), "slip")
    assert column.numbers == (0.5, 7.0, 0.6) and column.unit == "%"
    book["Messung"].cell(4, 2).number_format = '0.00" %"'  # 0.01 %: a text beside it
    assert "Messung!B4" in refusal(saved(book), "slip")
    cells = []
    for text, value in (("0.5%", "0.005"), ("7%", "0.07")):
        cells.append(odf.table.TableCell(valuetype="percentage", value=value))
        cells[-1].addElement(odf.text.P(text=text))
    column = measured(by_odfpy([["slip"], *([x] for x in cells)]), "slip", "a.ods")
    assert column.numbers == (0.5, 7.0) and column.unit == "%"


def test_an_empty_cell_of_xls_may_be_an_error():
    said = refusal(by_xlwt([["Nr", "d"], [1, 20.1], [2, xlwt.Formula("1/0")]]),
                   name="a.xls")  # fmt: skip
    assert "Messung!B3 is empty, or an error" in said


def test_hidden_rows_are_said_and_not_left_out():
    book = openpyxl.load_workbook(io.BytesIO(by_openpyxl(ROWS)))
    book["Messung"].row_dimensions[5].hidden = True
    column = measured(saved(book))
    assert len(column.numbers) == 3 and "hidden row 5 not left out" in column.words


def test_several_sheets():
    others = {"Zweite": [["Nr", "d"], [1, 5.0], [2, 5.1]], "Deckblatt": [["Kunde"]]}
    content = by_openpyxl(ROWS, **others)
    said = refusal(content)
    assert "'Messung', 'Zweite'" in said and 'sheet = "Messung"' in said
    assert measured(content, sheet="Zweite").numbers == (5.0, 5.1)
    assert "no sheet 'Dritte'" in refusal(content, sheet="Dritte")
    book = openpyxl.load_workbook(io.BytesIO(content))
    book["Zweite"].sheet_state = "hidden"
    assert len(measured(saved(book)).numbers) == 3


def test_files_that_are_none_or_grow(monkeypatch):
    assert "cannot be read" in refusal(b"PK\x03\x04 no zip")
    assert "cannot be read" in refusal(b"\xd0\xcf\x11\xe0 no book", name="a.xls")
    content = by_openpyxl(ROWS)
    damaged = bytearray(content)
    at = content.index(b"xl/worksheets/sheet1.xml") + 40
    damaged[at : at + 4] = b"\xff\xff\xff\xff"
    assert "parts.xlsx" in refusal(bytes(damaged))
    monkeypatch.setattr(workbook_reader, "MOST_UNPACKED", 1000)
    assert "unpacks to" in refusal(content)


def test_a_far_cell_is_no_reason_to_fill_the_memory():
    book = openpyxl.load_workbook(io.BytesIO(by_openpyxl(ROWS)))
    book["Messung"]["XFD1048576"] = 1
    assert "cells lie between" in refusal(saved(book))


def test_a_zip_that_says_less_than_it_holds():
    file = io.BytesIO(by_openpyxl(ROWS))
    with zipfile.ZipFile(file, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/media/large.bin", b"0" * 100_000)
    content = file.getvalue().replace(
        (100_000).to_bytes(4, "little"), (10).to_bytes(4, "little")
    )
    assert "parts.xlsx" in refusal(content)


ODD = '<?xml version="1.0" encoding="odd"?>'


@pytest.mark.parametrize(
    ("file", "before", "after"),
    [
        ("xl/workbook.xml", "<workbook", f"{ODD}<workbook"),
        ("xl/workbook.xml", ' r:id="rId1"', ""),
        ("xl/worksheets/sheet1.xml", 'r="4"', 'r="abc"'),
    ],
)
def test_crafted_xml_is_refused(file, before, after):
    """Values and encodings that python-calamine does not look at."""
    content = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(by_openpyxl(ROWS))) as archive,
        zipfile.ZipFile(content, "w") as crafted,
    ):
        for name in archive.namelist():
            text = archive.read(name)
            if name == file:
                assert before.encode() in text
                text = text.replace(before.encode(), after.encode(), 1)
            crafted.writestr(name, text)
    assert "cannot be read as a workbook" in refusal(content.getvalue())

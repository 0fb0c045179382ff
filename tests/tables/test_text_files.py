"""Texts of other systems, byte by byte: read in the one possible way, or refused."""

import cProfile
from pathlib import Path
from pstats import Stats

import pytest

from tolstat.errors import DataError
from tolstat.tables.raw_file import Form
from tolstat.tables.read import read_table

SPIEL = "Wanddicke [mm]"
FILES = {  # content, column, its values, words of how it was read
    "a CMM in English": (
        b"# program HOUSING\r\nPart,X [mm],Diameter [mm]\r\n1,10.0021,8.0004\r\n"
        b"2,9.9987,8.0011\r\n",
        "Diameter", [8.0004, 8.0011], "commas, decimal point, UTF-8",
    ),
    "a supplier in German": (
        "Prüfprotokoll;;\r\nKunde;Müller & Söhne;\r\nDatum;24.12.2025;\r\n;;\r\n"
        "Teil;Wanddicke;Prüfer\r\n-;mm;-\r\n1;2,013;Groß\r\n2;1,99;Groß\r\n"
        .encode("cp1252"),
        "Wanddicke", [2.013, 1.99],
        "semicolons, decimal comma, Windows-1252, 3 lines skipped",
    ),
    "Excel, text in Unicode": (
        ("Nr\tØ außen [mm]\tBemerkung\r\n1\t12,5\tok\r\n2\t12,49\tok\r\n")
        .encode("utf-16"),
        "Ø außen", [12.5, 12.49], "tabs, decimal comma, UTF-16",
    ),
    "big-endian UTF-16": (
        b"\xfe\xff" + "n|d\n1|20.01\n2|20.5\n".encode("utf-16-be"),
        "d", [20.01, 20.5], "vertical bars, decimal point, UTF-16",
    ),
    "a mark and semicolons": (
        "part;length [in]\n1;0.50\n2;0.51\n".encode("utf-8-sig"),
        "length", [0.5, 0.51], "semicolons, decimal point, UTF-8",
    ),
    "Excel names its separator": (
        b"sep=|\r\nn|d\r\n1|7,5\r\n2|7,25\r\n", "d", [7.5, 7.25],
        "vertical bars, decimal comma, UTF-8",
    ),
    "a CMM that says where it ends": (
        b"id\tactual\nBore\t20,01\nBore\t20,02\nEND\n", "actual", [20.01, 20.02],
        "tabs, decimal comma, UTF-8, 1 line below skipped",
    ),
    "NumPy, its head in a remark": (
        b"# made by savetxt\n# d [mm];F [N]\n2.5e+01;1\n2.6e+01;2\n", "d",
        [25.0, 26.0], "semicolons, decimal point, UTF-8",
    ),
    "doubles of Fortran": (
        b"n,d\n1,2.5D+01\n2,0.26d2\n", "d", [25.0, 26.0],
        "commas, decimal point, UTF-8",
    ),
    "ends of lines of an old Macintosh": (
        b"n;d\r1;7,5\r2;7,25\r", "d", [7.5, 7.25], "semicolons, decimal comma, UTF-8",
    ),
    "numbers of a bank": (
        b"n;F [N]\n1;1.250,5\n2;10.300\n3;980\n", "F", [1250.5, 10300.0, 980.0],
        "semicolons, decimal comma, UTF-8",
    ),
    "numbers of a bank, in English": (
        b'n,F [N]\n1,"1,250.5"\n2,"10,300"\n3,980\n', "F", [1250.5, 10300.0, 980.0],
        "commas, decimal point, UTF-8",
    ),
    "numbers of a Swiss bank": (
        "n;F\n1;1’250.50\n2;10'300\n".encode(), "F", [1250.5, 10300.0],
        "semicolons, decimal point, UTF-8",
    ),
    "thin blanks between thousands": (
        "n;F\n1;1\u202f250,5\n2;10\u00a0300\n".encode(), "F", [1250.5, 10300.0],
        "semicolons, decimal comma, UTF-8",
    ),
    "millions": (
        b"n;F\n1;1.250.000\n2;2.000\n", "F", [1250000.0, 2000.0],
        "semicolons, decimal comma, UTF-8",
    ),
    "powers of ten": (
        b"n;k\n1;2,5E+04\n2;1.000\n3;-3,75e-2\n", "k", [25000.0, 1000.0, -0.0375],
        "semicolons, decimal comma, UTF-8",
    ),
    "three decimals between commas": (
        b"n,d\n1,20.001\n2,20.003\n", "d", [20.001, 20.003],
        "commas, decimal point, UTF-8",
    ),
    "three decimals, one below 1": (
        b"n;d\n1;20,001\n2;0,998\n", "d", [20.001, 0.998],
        "semicolons, decimal comma, UTF-8",
    ),
    "signs of word processors": (
        "n;e [µm]\n1;−4,5\n2;+3,0\n".encode(), "e", [-4.5, 3.0],
        "semicolons, decimal comma, UTF-8",
    ),
    "empty, missing, and not": (
        b"n;d\n1;5,5\n2;\n3;n/a\n4;-\n5;nan\n6;6,5\n", "d", [5.5, 6.5],
        "semicolons, decimal comma, UTF-8, 4 empty",
    ),
    "a line separator in a cell": (
        "n;d;note\n1;5,5;a\u2028b\n2;6,5;\n".encode(), "d", [5.5, 6.5],
        "semicolons, decimal comma, UTF-8",
    ),
    "a head over two lines": (
        b'n;"wall\n[mm]"\n1;5,5\n2;6,5\n', "wall", [5.5, 6.5],
        "semicolons, decimal comma, UTF-8",
    ),
    "the index of pandas": (
        b",d\n0,5.5\n1,6.5\n", "d", [5.5, 6.5], "commas, decimal point, UTF-8",
    ),
    "a separator at the end of each line": (
        b"n;d;\n1;5,5;\n2;6,5;\n", "d", [5.5, 6.5], "semicolons, decimal comma, UTF-8",
    ),
    "lots of a digit and a letter": (
        b"n;d;lot\n1;5,5;1A\n2;6,5;2A\n", "d", [5.5, 6.5],
        "semicolons, decimal comma, UTF-8",
    ),
    "cavities as heads": (
        b"shot;1;2;3\n1;5,51;5,62;5,7\n2;5,5;5,61;5,73\n", "2", [5.62, 5.61],
        "semicolons, decimal comma, UTF-8",
    ),
    "units in round brackets": (
        b"n,gap (mm),lot\n1,0.11,A\n2,0.12,B\n", "gap", [0.11, 0.12],
        "commas, decimal point, UTF-8",
    ),
    "the decimal sign of a column beside": (
        b"n;d;t\n1;20,001;21,5\n2;20,003;21,7\n", "d", [20.001, 20.003],
        "semicolons, decimal comma, UTF-8",
    ),
    "dates, times and article numbers beside": (
        b"Datum;Zeit;Art.;d\n24.12.2025;12:01:00;47/11;20,01\n"
        b"24.12.2025;12:02:10;47/12;20,02\n",
        "d", [20.01, 20.02], "semicolons, decimal comma, UTF-8",
    ),
    "one column": (b"d [mm]\n5.5\n6.5\n", "d", [5.5, 6.5],
                   "one column, decimal point, UTF-8"),
    "a bar in a text": (
        b"id,d\nA|1,20.01\nA|2,20.02\n", "d", [20.01, 20.02],
        "commas, decimal point, UTF-8",
    ),
    "units in the cells": (
        "Nr;Länge;Schlupf\n1;12,34 mm;0,5 %\n2;;0,25%\n3;12,3 mm;1 %\n".encode(),
        "Länge", [12.34, 12.3], "semicolons, decimal comma, UTF-8, 1 empty",
    ),
    "a table as it is": (
        b"n,d\n1,5\n2,6\n", "d", [5.0, 6.0], "commas, UTF-8",
    ),
}  # fmt: skip

REFUSED = {  # content, column, words of the refusal
    "three decimals or thousands": (
        b"n;d\n1;20,001\n2;20,003\n", "d",
        ["line 2, column d", "20001 or 20.001", 'decimal = "."', 'decimal = ","'],
    ),
    "thousands or three decimals": (
        b"n;d\n1;20.001\n2;20.003\n", "d", ["20.001 or 20001", "decimal ="],
    ),
    "whole thousands in quotes": (
        b'n,F\n1,"1,250"\n2,"10,300"\n', "F", ["1250 or 1.25", "decimal ="],
    ),
    "three decimals beside days": (
        b"day;d\n24.12;20,001\n25.12;20,003\n", "d",
        ["line 2, column d", "20001 or 20.001", "of the column", "decimal ="],
    ),
    "both signs": (
        b"n;d\n1;20,01\n2;20.02\n", "d",
        ["line 3, column d: '20.02' has a decimal point",
         "line 2, column d: '20,01' has a decimal comma", "decimal ="],
    ),
    "one column or two": (
        b"d\n20,01\n20,02\n", "d", ["'20,01'", 'decimal = ","', 'delimiter = ","'],
    ),
    "a comma in its head": (
        b"length, mm\n20,01\n20,02\n", "length", ["'20,01'", "decimal", "delimiter"],
    ),
    "a word in the first row": (
        b"n;d\n1;(20,01)\n2;20,02\n", "d", ["line 2, column d: '(20,01)'"],
    ),
    "two separators": (
        b"a;b|c\n1;x|3\n5;y|7\n", "a",
        ["semicolons or vertical bars", 'delimiter = ";"'],
    ),
    "no mark": ("n;d\n1;20,01\n".encode("utf-16-le"), "d", ['encoding = "utf-16-le"']),
    "no text": (bytes(range(256)) * 4, "d", ["NUL bytes"]),
    "numbers without a head": (b"5.5\n6.5\n", "d", ["no head"]),
    "no number": (b"a;b\nx;y\n", "b", ["no head"]),
    "a word": (
        b"n;d\n1;5,5\n2;5,6 mm\n3;6,5\n4;6,1\n", "d",
        ["line 3, column d", "'5,6 mm' is not a number"],
    ),
    "two units in cells": (
        "n;d [mm]\n1;5.5 mm\n2;5.6 mm\n3;5600 µm\n".encode(), "d",
        ["line 4, column d", "'5600 µm'", "the unit mm", "the same unit"],
    ),
    "a head against its cells": (
        "n;d [mm]\n1;5.5 µm\n2;5.6 µm\n".encode(), "d",
        ["column d", "in µm", "its head says mm"],
    ),
    "units in cells without a head": (b"5.5 mm\n5.6 mm\n5.7 mm\n", "d", ["no head"]),
    "write.table of R, by tabs": (
        b'"d"\t"lot"\n"1"\t20.01\t"A"\n"2"\t20.02\t"B"\n', "d",
        ["line 1: 2 heads above 3 columns; add", "col.names = NA"],
    ),
    "a date": (
        b"day;d\n24.12.2025;5,5\n25.12.2025;6,5\n", "day", ["line 2", "24.12.2025"],
    ),
    "too few cells": (b"n;d\n1;5,5\n2\n3;6,5\n", "d", ["line 3: 1 cells under 2"]),
    "a mean below": (
        b"n;d\n1;5,5\n2;6,5\nMittelwert;6,0\n", "d", ["line 4", "'Mittelwert'"],
    ),
    "limits above": (
        b"n;d\nUSL;7,0\nLSL;5,0\n1;5,5\n2;6,5\n", "d", ["line 2", "'USL'", "drawing"],
    ),
    "another column": (b"n;d\n1;5,5\n2;6,5\n", "D1", ["no column 'D1'", "n, d"]),
    "equal heads": (b"d;d\n1;5,5\n2;6,5\n", "d", ["a different name"]),
    "nothing": (b"", "d", ["is empty"]),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_as_it_was_meant(name):
    content, column, values, words = FILES[name]
    table = read_table(Path("parts.csv"), content, requested=(column,))
    measured = table.measured(column)
    assert list(measured.numbers) == values
    assert measured.words == words


@pytest.mark.parametrize("name", REFUSED)
def test_what_may_be_read_in_two_ways_or_none_is_refused(name):
    content, column, words = REFUSED[name]
    with pytest.raises(DataError) as refused:
        read_table(Path("parts.csv"), content, requested=(column,)).measured(column)
    said = str(refused.value)
    assert [word for word in ["parts.csv", *words] if word not in said] == []


@pytest.mark.parametrize(
    ("name", "form", "values"),
    [
        ("three decimals or thousands", Form(decimal=","), [20.001, 20.003]),
        ("three decimals or thousands", Form(decimal="."), [20001.0, 20003.0]),
        ("thousands or three decimals", Form(decimal="."), [20.001, 20.003]),
        ("whole thousands in quotes", Form(decimal="."), [1250.0, 10300.0]),
        ("one column or two", Form(decimal=","), [20.01, 20.02]),
        ("two separators", Form(delimiter=";"), [1.0, 5.0]),
        ("no mark", Form(encoding="utf-16-le"), [20.01]),
    ],
)
def test_the_key_of_a_refusal_settles_it(name, form, values):
    content, column, _ = REFUSED[name]
    table = read_table(Path("parts.csv"), content, form, (column,))
    assert list(table.measured(column).numbers) == values


def test_wrong_keys_are_refused():
    for form, word in (
        (Form(encoding="klingon"), "unknown"),
        (Form(encoding="cp\0"), "unknown"),
        (Form(delimiter="::"), "one character"),
        (Form(decimal=","), "'5.5' is not a number (with a decimal comma it is none)"),
    ):
        with pytest.raises(DataError) as refused:
            read_table(Path("a.csv"), b"n;d\n1;5.5\n2;6.5\n", form).measured("d")
        assert word in str(refused.value)


def test_columns_separated_by_blanks():
    content = b" n     d [mm]\n 1   20.01\n12   20.023\n"
    with pytest.raises(DataError, match='delimiter = "space"'):
        read_table(Path("a.txt"), content)
    content = content.replace(b" [mm]", b"")
    table = read_table(Path("a.txt"), content, Form(delimiter="space"))
    assert table.measured("d").numbers == (20.01, 20.023)


def test_the_wanted_column_tells_the_head():
    """Above it the protocol looks like a table of its own."""
    content = b"Pruefer;Auftrag\nMueller;4711\nTeil;d\nA;5,5\nB;6,5\n"
    with pytest.raises(DataError, match="'d' is not a number"):
        read_table(Path("a.csv"), content).measured("Auftrag")
    measured = read_table(Path("a.csv"), content, requested=("d",)).measured("d")
    assert measured.numbers == (5.5, 6.5) and "2 lines skipped" in measured.words


@pytest.mark.parametrize("cell", ["-9.999,00", "-9.999", "-9999 mm", "−9999"])
def test_a_code_is_known_however_it_is_written(cell):
    unit = " mm" * cell.endswith("mm")
    content = f"n;d\n1;5,5{unit}\n2;{cell}\n3;6,5{unit}\n".encode()
    table = read_table(Path("a.csv"), content, Form(no_value=("-9999",)))
    assert table.measured("d").numbers == (5.5, 6.5)


def test_a_first_row_with_a_word_is_no_head():
    table = read_table(Path("a.csv"), b"n;d\n1;>5,4\n2;5,5\n3;5,6\n")
    with pytest.raises(DataError, match=r"line 1 may be the head, and line 2 .*: >5,4"):
        table.measured("1")


def test_rows_of_one_characteristic_among_others():
    """As Calypso writes them: a row for each characteristic of each part."""
    rows = "".join(
        f"{part}\tBore {bore}\t{20 * bore},0{part}1\t{20 * bore}\n"
        for part in (1, 2, 3)
        for bore in (1, 2)
    )
    content = f"partnb\tid\tactual\tnominal\n{rows}END\n".encode()
    form = Form(only=(("id", "Bore 2"),), decimal=",")
    measured = read_table(Path("chr.txt"), content, form).measured("actual")
    assert measured.numbers == (40.011, 40.021, 40.031)
    assert measured.places[0] == "chr.txt, line 3"
    assert "rows with id = Bore 2" in measured.words
    with pytest.raises(DataError, match=r"column id has no 'Bore 3'; .*Bore 2"):
        read_table(Path("chr.txt"), content, Form(only=(("id", "Bore 3"),))).measured(
            "actual"
        )


def test_a_lot_has_no_control_characters():
    """Stored in a run, `GCOL` and one looked like a part of HDF5."""
    table = read_table(Path("a.csv"), b"d,lot\n1,A\n2,GCOL\x01\n")
    with pytest.raises(DataError, match="line 3, column lot: a lot is a text"):
        table.measured("d", lots="lot")


def test_lots_stand_beside_their_parts():
    content = b"n;d;lot\n1;5,5;A\n2;;A\n3;6,5;B\n"
    measured = read_table(Path("a.csv"), content).measured("d", lots="lot")
    assert measured.lots == ("A", "B") and measured.left_out == 1
    assert measured.places[1] == "a.csv, line 4"


def test_twice_the_rows_take_twice_the_work():
    def calls(rows):
        content = "n;d;w\n" + "".join(
            f"{i};5,{i % 7};{'x' if i % 3 else '6,5'}\n" for i in range(rows)
        )
        with cProfile.Profile() as profile:
            read_table(Path("a.csv"), content.encode()).measured("d")
        return Stats(profile).total_calls

    few = calls(100)
    assert calls(200) < 2.2 * few

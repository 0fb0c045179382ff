"""Files of Q-DAS, in the bytes of several systems."""

from pathlib import Path

import pytest

from tolstat.errors import DataError
from tolstat.tables.qdas import QdasFile
from tolstat.tables.raw_file import Form, RawFile

SI, DC4 = "\x0f", "\x14"
HEAD = [
    "K0100 3", "K1001 4711-A", "K1002 Kurbelwelle",
    "K2001/1 10", "K2002/1 Bohrung Ø20", "K2101/1 20.000", "K2110/1 19.980",
    "K2111/1 20.020", "K2142/1 mm",
    "K2001/2 20", "K2002/2 Länge", "K2101/2 55.5", "K2112/2 -0.05", "K2113/2 0.05",
    "K2142/2 mm",
    "K2001/3 30", "K2002/3 Rauheit Rz", "K2110/3 0", "K2120/3 2", "K2111/3 6.3",
    "K2142/3 µm",
]  # fmt: skip
VALUES = [[20.004, 55.51, 4.25], [19.991, 55.48, 3.5], [20.013, 55.52, 5.125]]


def compact(left_out=(), decimal="."):
    rows = []
    for i, values in enumerate(VALUES):
        cells = [
            DC4.join([
                f"{value:.4f}".replace(".", decimal),
                "255" if (i, j) in left_out else "0",
                f"24.12.2025/12:0{i}:00", "", f"#B{i // 2}", "1",
            ])
            for j, value in enumerate(values)
        ]  # fmt: skip
        rows.append(SI.join(cells))
    return rows


def by_keys():
    return [
        line
        for i, values in enumerate(VALUES)
        for j, value in enumerate(values, start=1)
        for line in (
            f"K0001/{j} {value}", f"K0002/{j} 0", f"K0004/{j} 24.12.2025/12:0{i}:00",
        )
    ]  # fmt: skip


def file(lines, encoding="latin-1", end="\r\n", name="a.dfq", values=None, part=""):
    raw = (end.join(lines) + end).encode(encoding)
    return QdasFile(RawFile(Path(name), raw, Form(part=part)), values)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("rows", [compact(), by_keys()], ids=["compact", "keys"])
@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"], ids=repr)
def test_a_file_tells_values_nominal_limits_and_unit(encoding, rows, end):
    read = file([*HEAD, *rows], encoding, end)
    assert read.names() == ["Bohrung Ø20", "Länge", "Rauheit Rz"]
    bore, length = read.measured("Bohrung Ø20"), read.measured("20")
    assert bore.numbers == (20.004, 19.991, 20.013)
    assert (bore.nominal, bore.lower, bore.upper, bore.unit) == (20, 19.98, 20.02, "mm")
    assert length.name == "Länge"
    assert (length.lower, length.upper) == pytest.approx((55.45, 55.55))
    rough = read.measured("Rauheit Rz")
    assert (rough.nominal, rough.lower, rough.upper) == (None, None, 6.3)  # natural
    assert bore.sequence


def test_lots_and_values_that_do_not_count():
    read = file([*HEAD, *compact(left_out={(1, 1)})])
    assert read.measured("Bohrung Ø20").lots == ("B0", "B0", "B1")
    length = read.measured("Länge")
    assert length.numbers == (55.51, 55.52) and length.left_out == 1
    assert length.words == "Q-DAS, Windows-1252, 1 that do not count"


def test_decimal_commas():
    head = [line.replace(".", ",") if line[:3] == "K21" else line for line in HEAD]
    bore = file([*head, *compact(decimal=",")]).measured("10")
    assert bore.numbers[0] == 20.004 and bore.lower == 19.98


def test_values_in_a_file_beside():
    values = "\r\n".join(compact()).encode("latin-1")
    read = file(HEAD, name="a.dfd", values=(Path("a.dfx"), values))
    length = read.measured("Länge")
    assert length.numbers == (55.51, 55.48, 55.52)
    assert length.places[1] == "a.dfx, line 2"


def test_several_parts():
    one = ["K0100 1", "K1001 A", "K2002/1 d", "K0001/1 1.5", "K0001/1 1.25"]
    two = [line.replace(" A", " B").replace("1.5", "2.5") for line in one]
    with pytest.raises(DataError, match=r"several parts: 'A', 'B'; give part = \"A\""):
        file([*one, *two])
    assert file([*one, *two], part="B").measured("d").numbers == (2.5, 1.25)
    with pytest.raises(DataError, match="no part 'C'"):
        file([*one, *two], part="C")


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["K0100 1", "K2002/1 d", "K2004/1 1", "K0001/1 3"], "attributive"),
        (["K0100 1", "K2002/1 d", "K0020/1 100", "K0021/1 3"], "attributive"),
        (["K0100 3", "K2002/1 d", "1.0" + SI + "2.0"], "line 3: 2 values"),
        (["K0100 1", "K2002/1 d", "abc"], "line 3: 'abc' is not a number"),
        (["K0100 1", "K2002/1 d"], "no value that counts"),
        (["K0100 1", "K2002/1 d", "K0001/1 1,000.5"], "not a number"),
        (["K0100 1", "KX/1 d"], "no key of Q-DAS"),
        (["K0100 1", "K2002/1 d", "20.1", "-1E+20", "20.2"], "line 4: -1e+20 may mean"),
        (["K0100 1", "K2002/1 d", "K2110/1 2", "K2111/1 1", "1.5"], "above its upper"),
        (["K0100 -1"], "a number from 1"),
        (["part;d", "1;2"], "no Q-DAS file"),
        ([""], "K0100 is missing"),
    ],
)
def test_what_is_no_measured_value_is_refused(lines, words):
    with pytest.raises(DataError) as refused:
        file(lines).measured("d")
    assert words in str(refused.value) and "a.dfq" in str(refused.value)


def test_an_unknown_characteristic():
    with pytest.raises(DataError, match="no characteristic 'Breite'; allowed: Bohrung"):
        file([*HEAD, *compact()]).measured("Breite")

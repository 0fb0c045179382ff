"""`tolstat parts`: measured parts of a file, on screen, page, JSON and CSV."""

import io
import json

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import tolstat
from tolstat.answers.parts.judged_parts import (
    CoarseStep,
    Copies,
    FarParts,
    FewParts,
    NotNear,
    NotNormal,
    OtherLots,
    judged_parts_of,
)
from tolstat.answers.parts.parts_figures import figures_of
from tolstat.answers.report.report_warnings import PartsWarning, UnusualParts
from tolstat.cli.main import main
from tolstat.document.plot import Histogram
from tolstat.errors import DataError, TolstatError
from tolstat.statistics.estimate import Lack
from tolstat.statistics.limits.yields import UNDECIDED
from tolstat.study.study import load

HEAD = "Protokoll;;;\nTeil;Länge [mm];Breite [mm];Charge\n"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    rng = np.random.default_rng(2)
    rows = [HEAD]
    for i in range(90):
        lot = "ABC"[i // 30]
        length = 60 + 0.004 * rng.standard_normal() + 0.006 * (lot == "B")
        width = 20.08 if i == 40 else 20 + 0.01 * rng.standard_normal()
        rows.append(f"{i + 1};{length:.4f};{width:.2f};{lot}\n".replace(".", ","))
    path = tmp_path_factory.mktemp("parts") / "teile.csv"
    path.write_bytes("".join(rows).encode("cp1252"))
    return path


@pytest.fixture(scope="module")
def judged(file):
    return tolstat.parts(file, nominal="60 mm", tolerance="+-0.02 mm", lots="Charge",
                         columns=["Länge"])  # fmt: skip


def call(*words):
    return CliRunner().invoke(main, ["parts", *map(str, words)])


def test_numbers_are_of_the_drawing(judged):
    part = judged.characteristics["Länge"]
    assert part.tolerance == pytest.approx((59.98e-3, 60.02e-3))
    numbers, values = part.capability, part.values
    assert numbers.parts == 90
    half = values.std(ddof=1) * 3
    assert numbers.ppk.value == pytest.approx((60.02e-3 - values.mean()) / half)
    assert numbers.cpk.value > 1.2 * numbers.ppk.value
    assert [lot.parts for lot in part.lots.values()] == [30, 30, 30]
    (warning,) = part.warnings
    assert isinstance(warning, OtherLots) and warning.lots.highest == "B"


def test_all_columns_of_numbers_but_a_counter(file):
    answer = tolstat.parts(file)
    assert [*answer.characteristics] == ["Länge", "Breite"]
    far, coarse = answer.characteristics["Breite"].warnings[:2]
    assert isinstance(far, FarParts) and far.places == (f"{file}, line 43",)
    assert isinstance(coarse, CoarseStep) and coarse.step == pytest.approx(1e-5)


def test_screen_page_json_and_csv(file, judged, tmp_path):
    typed = (file, "--column", "Länge", "--nominal", "60 mm", "--tolerance",
             "+-0.02 mm", "--lots", "Charge")  # fmt: skip
    page = tmp_path / "parts.html"
    shown = call(*typed, "-o", page)
    assert shown.exit_code == 0, shown.output
    for words in ("59.98..60.02 mm", "semicolons, decimal comma, Windows-1252, 1 line",
                  "Lots differ: C is lowest, B highest."):  # fmt: skip
        assert words in shown.output
    html = page.read_text()
    assert html.count("<svg") == 2 and "in the order of the parts" in html
    numbers = json.loads(call(*typed, "--json").stdout)["characteristics"]["Länge"]
    assert numbers["capability"]["parts"] == 90 and "values" not in numbers
    table = pd.read_csv(io.StringIO(call(*typed, "--csv").stdout))
    assert table["Ppk"].item() == pytest.approx(
        judged.characteristics["Länge"].capability.ppk.value
    )
    assert judged.frame()["Ppk"]["Länge"] == pytest.approx(table["Ppk"].item())


def test_a_limit_with_one_end_and_deviations(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("d [um]\n" + "\n".join(f"{x}.5" for x in range(-8, 9)))
    part = tolstat.parts(path, tolerance="<= 10 um").characteristics["d"]
    assert part.tolerance.finite == [pytest.approx(10e-6)]
    # of a known nominal, the file holds deviations
    part = tolstat.parts(path, tolerance="+-9 um", nominal="20 mm").characteristics["d"]
    assert part.tolerance == pytest.approx((-9e-6, 9e-6))
    assert isinstance(part.warnings[0], FewParts)
    part = tolstat.parts(path, tolerance="H7", nominal="20 mm").characteristics["d"]
    assert part.tolerance == pytest.approx((0, 21e-6), abs=1e-12)  # ISO 286-1
    link = {"nominal": "20 mm", "data": str(path), "column": "d", "tolerance": "H7"}
    study = load({
        "model": "dimension_chain", "trials": 9, "seed": 1,
        "settings": {"gap": "d"}, "links": {"d": link},
    })  # fmt: skip
    typed = study.deviating.measured["d"].tolerance
    assert typed == pytest.approx((0, 21e-6), abs=1e-12)


def test_bars_are_of_equal_width_on_both_sides_of_the_tolerance(tmp_path):
    """Evenly spread parts have even bars, though an edge lies on the tolerance."""
    path = tmp_path / "a.csv"
    path.write_text("d [um]\n" + "\n".join(f"{x / 100:.3f}" for x in range(1601)))
    part = tolstat.parts(path, tolerance="<= 11.2 um").characteristics["d"]
    bars = [
        layer
        for layer in figures_of("d", part)[0].picture.panels[0].layers
        if isinstance(layer, Histogram)
    ]
    heights = sum(layer.heights for layer in bars)
    assert np.ptp(heights) < 0.1 * heights.mean()


def test_skewed_parts_have_no_interval_of_normal_ones(tmp_path):
    values = np.random.default_rng(1).exponential(1.0, 200)
    path = tmp_path / "a.csv"
    path.write_text("d [um]\n" + "\n".join(f"{x:.4f}" for x in values))
    part = tolstat.parts(path, tolerance="<= 5 um").characteristics["d"]
    assert any(isinstance(warning, NotNormal) for warning in part.warnings)
    assert not part.capability.ppk.sure and part.capability.outside.sure


def test_what_cannot_be_read_is_said(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("n;d\n1;20,001\n2;20,003\n")
    refused = call(path)
    assert refused.exit_code == 2 and "20001 or 20.001" in refused.output
    assert call(path, "--decimal", ",", "--unit", "mm").exit_code == 0
    path.write_text("n;d\n1;5,5\n2;x\n3;6,5\n4;7\n5;6,1\n")
    with pytest.raises(DataError, match="line 3, column d: 'x'"):
        tolstat.parts(path)
    assert "no such file" in call(tmp_path / "b.csv").output


def test_units_that_differ_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("d [mm]\n20.01\n20.02\n")
    for words, typed in (
        ("column d in mm, the key unit in in", {"unit": "in"}),
        ("unit is missing", {"nominal": "20"}),
        ("nominal = \"20 kg\": 'kg' is of another kind", {"nominal": "20 kg"}),
        ('tolerance = "20+-1 mm": cannot be read', {"tolerance": "20+-1 mm"}),
    ):
        with pytest.raises(TolstatError) as refused:
            tolstat.parts(path, **typed)
        assert words in str(refused.value)


def test_a_unit_in_other_letters_is_the_same_and_an_unknown_one_is_typed(tmp_path):
    path = tmp_path / "a.csv"
    for head in ("d (inch)", "d (MM)", "d (ksi)"):
        path.write_text(f"n;{head}\n1;0.02\n2;0.03\n")
        with pytest.raises(DataError, match=r"its unit .* is unknown"):
            tolstat.parts(path, tolerance="<= 0.03 mm")
    path.write_text("d [µm];w [Grad]\n20.01;1\n20.02;3\n")
    for name, unit in (("d", "um"), ("w", "deg")):
        assert tolstat.parts(path, [name], unit=unit).characteristics[name]
    with pytest.raises(DataError, match="unit 'Grad' is unknown; give its unit"):
        tolstat.parts(path)


def test_a_column_with_one_cell_in_another_unit_is_not_left_out(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("d;w\n20.1 mm;1.5\n20.2 mm;2.5\n20.3;1.5\n")
    with pytest.raises(DataError, match=r"line 4, column d: '20.3' .* the unit mm"):
        tolstat.parts(path)


def test_numbers_of_lots_are_no_measured_parts(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("d [mm],lot\n20.01,1\n20.04,1\n20.02,3\n")
    assert [*tolstat.parts(path, lots="lot").characteristics] == ["d"]


@pytest.fixture(scope="module")
def run(file, tmp_path_factory):
    part = {"nominal": "60 mm", "data": str(file), "column": "Länge",
            "tolerance": "+-0.02 mm", "lots": "Charge"}  # fmt: skip
    study = {
        "model": "dimension_chain", "trials": 300, "seed": 1,
        "settings": {"gap": "A - B"}, "limits": {"gap": "0.95..1.05 mm"},
        "links": {"A": part, "B": {"nominal": "59 mm", "tolerance": "+-0.03 mm"}},
    }  # fmt: skip
    path = tmp_path_factory.mktemp("run") / "run.h5"
    tolstat.run(study, output=path)
    return tolstat.open(path)


def test_a_run_holds_order_lots_and_tolerance(run, judged):
    (sample,) = run.measured
    part = judged.characteristics["Länge"]
    np.testing.assert_allclose(sample.values[sample.order], part.values - 60e-3)
    assert [sample.lot_names[lot] for lot in sample.lot] == [*part.lot_of_each]
    assert (sample.lower, sample.upper) == pytest.approx((-20e-6, 20e-6))
    assert "semicolons, decimal comma" in sample.source


def test_the_report_judges_the_parts_as_the_command_does(run, judged, tmp_path):
    part, alone = judged_parts_of(run)["A"], judged.characteristics["Länge"]
    assert part.capability.ppk == pytest.approx(alone.capability.ppk, nan_ok=True)
    assert part.capability.cpk == pytest.approx(alone.capability.cpk, nan_ok=True)
    assert [type(warning) for warning in part.warnings] == [OtherLots]
    page = tolstat.report(run).html()
    assert "Numbers are deviations from the nominal." in page
    assert "A in the order of the parts" in page


def test_what_is_unusual_in_parts_is_a_warning_of_the_study(run):
    report = tolstat.report(run)
    (warning,) = (x for x in report.warnings if isinstance(x, UnusualParts))
    assert warning.entry == "A" and isinstance(warning.finding, OtherLots)
    assert "Lots differ" in report.html().partition("<h2")[0]
    (stored,) = (
        x for x in json.loads(report.json())["warnings"] if x["kind"] == warning.kind
    )
    assert stored["finding"]["lots"]["highest"] == "B"


def test_the_data_of_a_report_have_the_measured_parts(run):
    report = tolstat.report(run)
    part, numbers = judged_parts_of(run)["A"], json.loads(report.json())
    stored = numbers["measured_parts"]["A"]
    assert stored["capability"]["parts"] == 90
    assert stored["capability"]["ppk"]["value"] == part.capability.ppk.value
    assert [w["kind"] for w in stored["warnings"]] == [w.kind for w in part.warnings]
    table = pd.read_csv(io.StringIO(report.csv()))
    assert table["A Ppk"][0] == pytest.approx(part.capability.ppk.value)
    mean = part.scale.factor * part.capability.mean.value
    assert table[f"A mean [{part.scale.shown}]"][0] == pytest.approx(mean)
    assert table["A parts"][0] == 90 and "A outside [%]" in table
    assert report.frame()["A_sigma"].iloc[0] == part.capability.sigma.value


def test_equal_parts_decide_nothing(tmp_path):
    """Read in coarse steps, five agree by chance."""
    (tmp_path / "a.csv").write_text("d\n" + 5 * "20.0\n")
    part = {"nominal": "20 mm", "data": str(tmp_path / "a.csv"), "column": "d"}
    study = {
        "model": "dimension_chain", "trials": 5000, "seed": 1,
        "settings": {"gap": "A - B"}, "limits": {"gap": ">= 0.01 mm"},
        "links": {"A": {"nominal": "20.1 mm", "tolerance": "+-0.045 mm"},
                  "B": {**part, "unit": "mm"}},
    }  # fmt: skip
    summary = tolstat.summary(tolstat.run(study, output=tmp_path / "a.h5"))
    assert summary.limits["gap"].yields.verdict == UNDECIDED
    (warning,) = (x for x in summary.warnings if isinstance(x, PartsWarning))
    assert warning.share.for_any.reason == Lack.EQUAL_PARTS.value


def test_trials_take_the_parts_and_not_their_tolerance(run):
    (sample,) = run.measured
    assert {*run.column("A")} <= {*sample.values}
    assert "tolerance +-0.02 mm" in run.assumed["A"].words


def test_a_drawing_in_a_file_of_qdas(tmp_path):
    lines = ["K0100 1", "K1001 X", "K2001/1 7", "K2002/1 bore", "K2101/1 20.0",
             "K2112/1 -0.02", "K2113/1 0.03", "K2142/1 mm"]  # fmt: skip
    rng = np.random.default_rng(3)
    values = [f"{20 + 0.005 * x:.4f}" for x in rng.standard_normal(60)]
    path = tmp_path / "a.dfq"
    path.write_text("\n".join([*lines, *values]) + "\n")
    part = tolstat.parts(path).characteristics["bore"]
    assert part.tolerance == pytest.approx((19.98e-3, 20.03e-3))
    assert part.nominal == pytest.approx(20e-3)
    with pytest.raises(DataError, match="leave lots = 'batch' out"):
        tolstat.parts(path, lots="batch")
    study = {
        "model": "dimension_chain", "trials": 100, "seed": 1,
        "settings": {"gap": "A - B"},
        "links": {
            "A": {"nominal": "20 mm", "data": str(path), "column": "7"},
            "B": "19 mm",
        },
    }  # fmt: skip
    (sample,) = tolstat.run(study).measured
    assert (sample.lower, sample.upper) == pytest.approx((-20e-6, 30e-6))
    np.testing.assert_allclose(
        sample.values, np.sort([float(x) - 20 for x in values]) * 1e-3, atol=1e-12
    )


@pytest.mark.parametrize("nominal", ["25 mm", "2450 mm"])
def test_parts_of_another_column_are_not_near_the_tolerance(file, nominal):
    """Neither sizes nor deviations of that nominal; the answer comes at once."""
    found = tolstat.parts(file, ["Länge"], nominal=nominal, tolerance="+-0.02 mm")
    assert isinstance(found.characteristics["Länge"].warnings[0], NotNear)
    said = call(
        file, "--column", "Länge", "--nominal", nominal, "--tolerance", "+-0.02 mm"
    )
    assert "not near the tolerance" in said.output


def test_copied_rows_are_said(file, tmp_path):
    lines = file.read_bytes().splitlines(keepends=True)
    path = tmp_path / "copies.csv"
    path.write_bytes(b"".join([*lines, *lines[20:24]]))
    part = tolstat.parts(path, ["Länge"]).characteristics["Länge"]
    (copies,) = [x for x in part.warnings if isinstance(x, Copies)]
    assert len(copies.places) == 4 and copies.first[0].endswith("line 21")
    output = call(path, "--column", "Länge").output
    assert "A copy counts twice" in " ".join(output.split())
    whole = tolstat.parts(file, ["Länge"]).characteristics["Länge"]
    assert not any(isinstance(x, Copies) for x in whole.warnings)


def test_a_row_of_means_is_refused_wherever_its_word_stands(file, tmp_path):
    path = tmp_path / "mean.csv"
    path.write_bytes(file.read_bytes() + b";60,0020;20,00;Mittelwert\n")
    with pytest.raises(DataError, match="line 93: 'Mittelwert' names a row of a"):
        tolstat.parts(path, ["Länge"])

"""Sizes where deviations belong, the reverse, and per cent: at every entrance.

Right values are computed here by hand or by normal and uniform distributions.
"""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import tomli_w
from scipy.stats import norm

import tolstat
from tests.study.chains import chain, zone
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.errors import DataError, ModelError, StudyError
from tolstat.study.study import load


# what is typed, and what it means, mm
@pytest.mark.parametrize(
    ("nominal", "typed", "lower", "upper", "warned"),
    [
        ("50 mm", "49.950..49.975 mm", -0.050, -0.025, True),  # f7 as sizes
        ("50 mm", "50.009..50.034 mm", 0.009, 0.034, True),  # m7 as sizes
        ("50 mm", "49.9..50.1 mm", -0.1, 0.1, True),
        ("5 cm", "49950..49975 um", -0.050, -0.025, True),
        ("-20 mm", "-20.1..-19.9 mm", -0.1, 0.1, True),  # a coordinate
        ("50 mm", "-0.050..-0.025 mm", -0.050, -0.025, False),
        ("50 mm", "0.009..0.034 mm", 0.009, 0.034, False),
        ("50 mm", "+-0.1 mm", -0.1, 0.1, False),
        ("50 mm", "+-1 %", -0.5, 0.5, False),
        ("50 mm", "-1..2 %", -0.5, 1.0, False),
        ("-20 mm", "0..1 %", -0.2, 0.0, False),
        ("50 mm", "99..101 %", -0.5, 0.5, True),
        ("1 mm", "+-0.8 mm", -0.8, 0.8, True),  # may be meant; is said
        ("1 mm", "+1.6..+1.7 mm", 1.6, 1.7, True),
    ],
)
def test_a_zone_of_a_length(nominal, typed, lower, upper, warned):
    part, warnings = zone(nominal, typed)
    np.testing.assert_allclose(
        np.array(part.tolerance) * 1e3, (lower, upper), rtol=0, atol=1e-9
    )
    assert bool(warnings) is warned


@pytest.mark.parametrize(
    ("nominal", "typed", "half"),
    [
        ("1000", "+-5 %", 50.0),
        (1000, "+-5 %", 50.0),
        ("0.15", "+-10 %", 0.015),
        ("25 N/mm", "+-10 %", 2500.0),
        ("10 kg", "+-2 %", 0.2),
        ("210 GPa", "+-3 %", 6.3e9),
        ("30 deg", "+-1 %", np.deg2rad(0.3)),
        ("12 mm", "+-100 ppm", 1.2e-6),
        ("0.15", "+-0.1", 0.1),  # plain numbers stay what they are
        ("20 %", "+-2 %", 0.02),  # a share itself
    ],
)
def test_per_cent_of_a_link_is_of_its_nominal(nominal, typed, half):
    part, _ = zone(nominal, typed)
    np.testing.assert_allclose(part.tolerance, (-half, half), rtol=1e-12)


def test_a_share_in_per_cent_is_said():
    assert "difference" in zone("20 %", "+-2 %")[1][0]


@pytest.mark.parametrize(
    ("nominal", "typed", "keys", "words"),
    [
        ("0 mm", "+-5 %", {}, ["nominal value is 0", "in mm"]),
        ("0", "+-5 %", {}, ["nominal value is 0", "plain number"]),
        ("0.05 mm", "0..0.1 mm", {}, ['"0..+0.1 mm"', '"-0.05..+0.05 mm"']),
        ("10 mm", "4..6 mm", {}, ["more than half"]),
        ("50 mm", "+49.950..+49.975 mm", {}, ["may be sizes"]),
        ("0.98", "97..99 %", {}, ['"0.97..0.99"']),
        ("0.15", "13..17 %", {}, ['"0.13..0.17"']),
        ("-50 mm", "49.95..50.05 mm", {}, ["more than half"]),
        ("10 mm", "+-0.1 mm", {"cp": 133}, ["a ratio such as 1.33"]),
        ("10 mm", "+-0.1 mm", {"cpk": 167}, ["a ratio such as 1.33"]),
        ("10 mm", "20..20.1 mm", {}, ["more than half", "about the nominal"]),
        ("50 mm", "+-0.1 mm", {"shift": "50.02 mm"}, ["not a size"]),
        ("50 mm", "+-0.1 mm", {"nominal_shift": "99 mm"}, ["more than half"]),
    ],
)
def test_what_may_be_either_is_refused(nominal, typed, keys, words):
    with pytest.raises(StudyError) as refused:
        zone(nominal, typed, **keys)
    for word in words:
        assert word in str(refused.value)


def test_each_key_of_a_deviation_may_be_a_size_or_per_cent():
    for typed in ("50.02 mm", "0.02 mm", "0.04 %"):
        part, _ = zone("50 mm", "+-0.1 mm", nominal_shift=typed)
        assert part.by == pytest.approx(0.02e-3)
        part, _ = zone("50 mm", "+-0.1 mm", distribution="triangular", mode=typed)
        assert part.mode == pytest.approx(0.02e-3)
        keys = {"distribution": "lognormal", "median": typed}
        part, _ = zone("50 mm", "49.9..50.2 mm", **keys)
        assert part.median == pytest.approx(0.02e-3)
        link = {"nominal": "50 mm", "distribution": "constant", "value": typed}
        (part,) = load(chain("a", {"a": link})).deviating.distributions.values()
        assert part.value == pytest.approx(0.02e-3)
    part, _ = zone("50 mm", "+-0.1 mm", shift="0.04 %")
    assert part.shift == pytest.approx(0.02e-3)
    keys = {"distribution": "trapezoidal", "plateau": "49.95..50.05 mm"}
    part, warnings = zone("50 mm", "+-0.1 mm", **keys)
    np.testing.assert_allclose(part.plateau, (-0.05e-3, 0.05e-3))
    assert len(warnings) == 1


def test_costs_read_per_cent_too():
    cost = {"law": "reciprocal", "at": "+-10 %", "price": 4, "loosest": "+-20 %"}
    link = {"nominal": "25 N/mm", "tolerance": "+-10 %", "cost": cost}
    (priced,) = load(chain("a", {"a": link})).deviating.priced
    assert priced.law.at == pytest.approx(2500.0)
    assert priced.law.loosest == pytest.approx(5000.0)
    assert priced.text(priced.ends[1]) == "+-5 N/mm"


def test_an_interference_typed_as_sizes(tmp_path):
    """A hole of 50 H7, a shaft of 50 f7 written as sizes: a clearance of 62.5 um."""
    links = {
        "hole": {"nominal": "50 mm", "tolerance": "H7"},
        "shaft": {"nominal": "50 mm", "tolerance": "49.950..49.975 mm"},
    }
    study = chain("hole - shaft", links, limits={"gap": ">= 25 um"})
    run = tolstat.run(study, output=tmp_path / "fit.h5")
    assert run.column("gap").mean() == pytest.approx(50e-6, abs=1e-6)
    (warning,) = tolstat.summary(run).warnings
    assert "sizes of 50 mm: -0.05..-0.025 mm" in warning.sentence


def test_a_spring_and_a_resistor_in_per_cent(tmp_path):
    """Uniform within +-5 % of 1000: a fifth lies outside 960 to 1040."""
    links = {"R": {"nominal": "1000", "tolerance": "+-5 %", "distribution": "uniform"}}
    run = tolstat.run(
        chain("R", links, limits={"gap": "960..1040"}, trials=4000),
        output=tmp_path / "R.h5",
    )
    share = tolstat.summary(run).limits["gap"].yields.fraction_out_of_limit
    assert share.lower < 0.2 < share.upper
    links = {"k": {"nominal": "25 N/mm", "tolerance": "+-10 %"}, "x": "4 mm"}
    run = tolstat.run(
        chain("k*x", links, limits={"gap": "94..106 N"}, trials=4000),
        output=tmp_path / "k.h5",
    )
    share = tolstat.summary(run).limits["gap"].yields.fraction_out_of_limit
    assert share.lower < 2 * norm.cdf(-6 / (10 / 3)) < share.upper
    what = tolstat.what_if(run, {"k": "+-8 %"})
    assert what.responses["gap"].scenario.sigma.value == pytest.approx(8 / 3, rel=0.05)
    what = tolstat.what_if(run, {"k": "23..27 N/mm"})
    assert "taken as sizes" in what.notes[0]
    again = load(
        tomllib.loads(tolstat.fresh_study(run, {"k": "+-8 %"}))
    ).deviating.distributions["k"]
    np.testing.assert_allclose(again.tolerance, (-2000, 2000))


def given(tmp_path, rows, links, gap="a - b", **keys):
    (tmp_path / "parts.csv").write_text("\n".join(rows))
    (tmp_path / "study.toml").write_text(tomli_w.dumps(chain(gap, links, **keys)))
    return load(tmp_path / "study.toml")


def table(tmp_path, *rows):
    (tmp_path / "parts.csv").write_text("\n".join(rows))
    study = {
        "model": "dimension_chain", "sampling": "table", "table": "parts.csv",
        "settings": {"gap": "a - b"}, "links": {"a": "10 mm", "b": "9 mm"},
        "limits": {"gap": "0.2..0.35 mm"},
    }  # fmt: skip
    (tmp_path / "table.toml").write_text(tomli_w.dumps(study))
    return tmp_path / "table.toml"


def test_a_table_of_sizes_or_deviations(tmp_path):
    truth = [0.01e-3, 0.22e-3, -0.1e-3]
    for rows, warned in (
        (("a [mm]", "10.01", "10.22", "9.9"), True),
        (("a sizes [mm]", "10.01", "10.22", "9.9"), False),
        (("a deviations [mm]", "0.01", "0.22", "-0.1"), False),
        (("a [mm]", "0.01", "0.22", "-0.1"), False),
        (("a [um]", "10", "220", "-100"), False),
        (("a [%]", "0.1", "2.2", "-1"), False),
    ):
        study = load(table(tmp_path, *rows))
        np.testing.assert_allclose(study.points.deviations[:, 0], truth, atol=1e-12)
        assert bool(study.reading_warnings) is warned, rows
    for rows, words in (
        (("a [mm]", "10.01", "0.22"), "line 2"),
        (("a [mm]", "10.01", "9999"), "line 3"),
        (("a deviations [mm]", "10.01", "10.22"), "line 2"),
        (("a sizes [mm]", "0", "0.1"), "line 2"),
    ):
        with pytest.raises(StudyError, match=words):
            load(table(tmp_path, *rows))


def test_the_table_of_the_issue_meets_once(tmp_path):
    rows = ("a [mm],b [mm]", "10.01,9.5", "10.22,9.5", "10.1,9.91")
    gaps = tolstat.run(table(tmp_path, *rows)).column("gap")
    np.testing.assert_allclose(gaps * 1e3, [0.51, 0.72, 0.19], atol=1e-9)


def test_the_stand_takes_rods_as_sizes(tmp_path):
    study = {"model": "stand", "trials": 8, "seed": 1}
    for typed in ("2449..2451 mm", "+-1 mm"):
        deviating = load({**study, "deviations": {"rod_length": typed}}).deviating
        np.testing.assert_allclose(
            deviating.distributions["rod_length_2"].tolerance, (-1e-3, 1e-3), atol=1e-12
        )
    (tmp_path / "rods.csv").write_text("rod_length_1 [m],rod_length_2 [m]\n2.451,2.45")
    (tmp_path / "stand.toml").write_text(
        'model = "stand"\nsampling = "table"\ntable = "rods.csv"\n'
    )
    rows = load(tmp_path / "stand.toml").points.deviations
    np.testing.assert_allclose(rows[0, :2], [1e-3, 0.0], atol=1e-12)
    for wrong in ('"+-0.1"', '"0.04..0.06"', '"90..110 %"'):
        (tmp_path / "stand.toml").write_text(
            f'model = "stand"\ntrials = 8\nseed = 1\ndeviations.friction = {wrong}\n'
        )
        with pytest.raises(StudyError, match="relative to its nominal"):
            load(tmp_path / "stand.toml")


@pytest.mark.parametrize(
    ("axis", "deviations"),
    [
        (["9.9 mm", "10 mm", "10.1 mm"], [-0.1, 0.0, 0.1]),
        (["-0.1 mm", "0 mm", "0.1 mm"], [-0.1, 0.0, 0.1]),
        (["-1 %", "0 %", "1 %"], [-0.1, 0.0, 0.1]),
        ({"from": "9.9 mm", "to": "10.1 mm", "points": 3}, [-0.1, 0.0, 0.1]),
        ({"from": "0 mm", "to": "0.2 mm", "points": 3}, [0.0, 0.1, 0.2]),
        ({"from": "0 mm", "to": "+8 mm", "points": 3}, [0.0, 4.0, 8.0]),
        ({"from": "0 mm", "to": "8 mm", "points": 3}, None),
        (["9.9 mm", "0.1 mm"], None),
    ],
)
def test_an_axis_of_a_grid(axis, deviations):
    study = chain("a", {"a": "10 mm"}, sampling="grid", grid={"a": axis})
    del study["trials"], study["seed"]
    if deviations is None:
        with pytest.raises(StudyError, match="more than half"):
            load(study)
        return
    rows = load(study).points.deviations[:, 0]
    np.testing.assert_allclose(rows * 1e3, deviations, atol=1e-9)


def test_measured_parts(tmp_path):
    """A spring's rate, measured as rates or as deviations from 25 N/mm."""
    rates = np.array([24.3, 24.9, 25.0, 25.4, 25.9])
    for numbers, keys, sizes in (
        (rates, {}, True),
        (rates - 25, {}, False),
        (rates, {"holds": "sizes"}, True),
        (rates - 25, {"holds": "deviations"}, False),
    ):
        link = {"nominal": "25 N/mm", "data": "parts.csv", "column": "k", **keys}
        rows = ["k [N/mm]", *(f"{x:.6g}" for x in numbers)]
        study = given(tmp_path, rows, {"k": link}, "k")
        values = study.deviating.distributions["k"].values
        np.testing.assert_allclose(values, 1e3 * (rates - 25), atol=1e-6)
        assert ("sizes of 5 parts" in study.notes[-1]) is sizes
    for wrong, line in (
        (["25.1", "9999", "24.9"], 3),
        (["25.1", "24.9", "0"], 4),
        (["0.1", "25.1", "-0.2", "0.1"], 3),
    ):
        link = {"nominal": "25 N/mm", "data": "parts.csv", "column": "k"}
        with pytest.raises(StudyError, match=f"line {line}"):
            given(tmp_path, ["k [N/mm]", *wrong], {"k": link}, "k")
    link |= {"holds": "deviations"}
    with pytest.raises(StudyError, match="line 3: 8888"):
        given(tmp_path, ["k [N/mm]", "1", "8888"], {"k": link}, "k")


class Absolute(Model):
    """A model whose contributor is a plain number of unknown nominal value."""

    name = "absolute"

    def __init__(self, shown="1", size=None):
        self.shown, self.size = shown, size

    def describe(self, settings):
        part = Contributor("x", "1", size=self.size, shown=self.shown)
        return Description((part,), (Response("y", "1", shown="1"),))

    def evaluate(self, deviations, settings):
        return Outcome(deviations)


def test_contributors_of_a_custom_model():
    study = {"model": "absolute", "trials": 8, "seed": 1}

    def half(typed, **declared):
        given = {**study, "deviations": {"x": typed}}
        return load(given, model=Absolute(**declared)).deviating.distributions["x"]

    assert half("+-0.3").tolerance.upper == 0.3
    assert half("+-5 %", size=40.0).tolerance.upper == 2.0
    assert half("+-5 %", shown="").tolerance.upper == 0.05
    for typed, declared in (("+-5 %", {}), ("+-0.3", {"shown": ""})):
        with pytest.raises(StudyError):
            half(typed, **declared)


def test_python_refuses_sizes():
    with pytest.raises(ModelError, match=r"sizes less 2\.45"):
        tolstat.evaluate("stand", {"rod_length": [2.451, 2.449]})


@pytest.mark.parametrize(
    ("nominal", "typed", "words"),
    [
        ("4 mm", "3.9..4.1 um", "far from zero"),  # of mm
        ("50 mm", "20..24 mm", "48 % of the nominal"),
        ("30 deg", "+-0.1 rad", "38 % of the nominal"),  # of mrad
        ("50 mm", "+-0.02 m", "80 % of the nominal"),
        ("1000", "+-0.05", "write per cent"),
    ],
)
def test_what_looks_wrong_has_a_warning(nominal, typed, words):
    (warning,) = zone(nominal, typed)[1]
    assert words in warning


@pytest.mark.parametrize(
    ("nominal", "typed"),
    [
        ("50 mm", "-0.025..-0.009 mm"), ("50 mm", "0.009..0.034 mm"),
        ("50 mm", "+0.3..+0.32 mm"), ("1000", "+-20"), ("0.15", "+-0.01"),
        ("30 deg", "0..360 deg"), ("2 mm", "+-15 %"),
    ],
)  # fmt: skip
def test_what_drawings_have_is_quiet(nominal, typed):
    assert zone(nominal, typed)[1] == ()


def test_values_of_relative_contributors_are_no_deviations():
    """Friction of 5 % +-1 %, damping of 2 % +-1 %: a share of that, or the value?"""
    for model, name, typed in (
        ("stand", "friction", "4..6 %"), ("rolling_block", "damping", "1..3 %"),
        ("stand", "mesh_stiffness", "98..102 %"),
    ):  # fmt: skip
        study = {"model": model, "trials": 8, "seed": 1, "deviations": {name: typed}}
        with pytest.raises(StudyError, match="with its sign"):
            load(study)
    study["deviations"] = {"friction": "+4..+6 %"}
    part = load(study).deviating.distributions["friction"]
    np.testing.assert_allclose(part.tolerance, (0.04, 0.06))


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["12", "-5", "8", "-3", "4"], "line 2"),  # um under a head of mm
        (["50.01", "49.98", "50.02", "54.99"], "line 5"),
    ],
)
def test_rows_that_look_wrong_are_named(tmp_path, rows, words):
    link = {"nominal": "50 mm", "data": "parts.csv", "column": "s"}
    study = given(tmp_path, ["s [mm]", *rows], {"s": link}, "s")
    (warning,) = study.reading_warnings
    assert words in warning


@pytest.mark.parametrize("factor", [10, 25.4, 1000])
def test_sizes_in_another_unit_are_no_deviations(tmp_path, factor):
    """Bores of 20 mm in cm, inches and m under a head of mm."""
    sizes = 20 + 0.004 * np.random.default_rng(5).standard_normal(30)
    link = {"nominal": "20 mm", "data": "parts.csv", "column": "s"}
    rows = ["s [mm]", *map(repr, (sizes / factor).tolist())]
    words = f"parts.csv, line 2 .* mean of .*{factor} times as large .* of 20 mm"
    with pytest.raises(StudyError, match=words):
        given(tmp_path, rows, {"s": link}, "s")
    with pytest.raises(DataError, match=f"{factor} times as large"):
        tolstat.parts(tmp_path / "parts.csv", nominal="20 mm", tolerance="+-0.1 mm")
    given(tmp_path, rows, {"s": {**link, "holds": "deviations"}}, "s")
    rows[1:] = [f"{x - 19.7:.4f}" for x in sizes]
    (warning,) = given(tmp_path, rows, {"s": link}, "s").reading_warnings
    assert "far from zero for their width" in warning and "none of 20 mm" in warning


def test_decimal_commas_without_quotes_are_said(tmp_path):
    link = {"nominal": "30 mm", "data": "parts.csv", "column": "d"}
    rows = [f"30,{x:03d}" for x in (12, 8, 15, 9, 11, 10)]
    study = given(tmp_path, ["d [mm],note", *rows], {"d": link}, "d")
    assert "decimal comma" in study.reading_warnings[0]
    rows = ["30,9", "30,12", "30,7", "30,10", "30,8"]  # whole numbers of their own
    study = given(tmp_path, ["d [mm],count", *rows], {"d": link}, "d")
    assert not study.reading_warnings


@pytest.mark.parametrize("demand", ["1 %", "0.27 %", "100 ppm"])
def test_a_share_out_of_limit_is_no_yield(demand):
    limits = {"gap": {"limit": "0..20 mm", "yield": demand}}
    with pytest.raises(StudyError, match="permits"):
        load(chain("a", {"a": "10 mm"}, limits=limits))


def test_per_cent_of_a_plain_number_is_said():
    """100 (s - L)/L is a number of per cent already."""
    links = {"s": {"nominal": "50 mm", "tolerance": "+-0.1 mm"}, "L": "50.02 mm"}
    study = load(chain("100*(s - L)/L", links, limits={"gap": "<= 0.2 %"}))
    (warning,) = study.reading_warnings
    assert '"<= 0.2 %" is 0.002' in warning
    assert not load(
        chain("(s - L)/L", links, limits={"gap": "<= 0.002"})
    ).reading_warnings


def test_a_price_far_from_the_tolerance_has_a_warning():
    cost = {"law": "reciprocal", "at": "+-0.02 m", "price": 10}
    link = {"nominal": "50 mm", "tolerance": "+-0.05 mm", "cost": cost}
    _, warning = load(chain("a", {"a": link})).reading_warnings
    assert "400 times" in warning


def test_a_minus_sign_of_a_word_processor_is_one():
    np.testing.assert_allclose(
        zone("50 mm", "\N{MINUS SIGN}5..+20 um")[0].tolerance, (-5e-6, 20e-6)
    )
    with pytest.raises(StudyError, match="a dash is no sign"):
        zone("50 mm", "0.000\N{EN DASH}0.021 mm")


def test_rows_of_a_table_that_look_wrong_are_named(tmp_path):
    """Deviations in um under a head of mm, of a part of 10 mm."""
    (warning,) = load(table(tmp_path, "a [mm]", "3", "-2", "1")).reading_warnings
    assert "line 2" in warning


def test_measured_ratios_are_sizes_of_the_whole(tmp_path):
    """Springs measured at 98 to 103 % of their stiffness."""
    (tmp_path / "k.csv").write_text("k [%]\n98\n101\n103\n")
    entry = '{ data = "k.csv", column = "k", holds = "sizes" }'
    (tmp_path / "k.toml").write_text(
        'model = "stand"\ntrials = 8\nseed = 1\n'
        f"deviations.mesh_stiffness_1 = {entry}\n"
    )
    study = load(tmp_path / "k.toml")
    (part,) = study.deviating.distributions.values()
    np.testing.assert_allclose(part.values, [-0.02, 0.01, 0.03])
    assert not study.reading_warnings

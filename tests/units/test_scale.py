"""Display units of a quantity: as typed, as declared, or by its size."""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np
import pytest

import tolstat
from tests.answers.page_checks import rows_of, table_under, words_in
from tests.model.rich import Rich
from tolstat.document.inline import in_cell, plain
from tolstat.render.screen import as_text
from tolstat.units.scale import (
    PART,
    PER_CENT,
    Ratio,
    Scale,
    figures,
    scale_of,
)  # fmt: skip


@pytest.mark.parametrize(
    ("unit", "size", "shown"),
    [
        ("J", 45e3, "kJ"), ("J", 3e-8, "nJ"), ("J", 3e-7, "uJ"), ("J", 1e-11, "nJ"), ("J", 2e8, "MJ"),
        ("N", 1e5, "kN"), ("N", 3.0, "N"), ("N", 12.0, "N"), ("N", 1e3, "kN"), ("m", 2.45, "mm"), ("m", 5e-6, "um"),
        ("m", 1e-10, "nm"), ("m", 3e3, "m"), ("rad", 2e-3, "mrad"), ("rad", 40.0, "rad"),
        ("Pa", 2e8, "MPa"), ("Hz", 20.0, "Hz"), ("s", 2e-3, "ms"), ("N m", 3e3, "kN m"),
        ("1", 1e-9, "%"), ("kg", 3.0, "kg"), ("m/s", 1e-6, "m/s"),
    ],
)  # fmt: skip
def test_the_prefix_follows_the_size(unit, size, shown):
    found = scale_of(unit, "", size)
    assert found == Scale(unit, shown)
    if unit not in ("1", "kg", "m/s"):
        assert 1e-3 <= found.factor * size < 1e6


def test_without_a_size_the_unit_is_the_engineers_one():
    for unit, shown in (("m", "mm"), ("J", "kJ"), ("Pa", "MPa"), ("rad", "mrad")):
        assert scale_of(unit).shown == shown == scale_of(unit, "", 0.0).shown
    assert scale_of("J", "", math.inf).shown == "kJ"


def test_a_given_unit_is_kept():
    assert scale_of("rad", "deg", 1e-9).words(math.pi / 180) == "1 deg"
    assert (
        scale_of("1", "1").words(0.25) == "0.25" and Scale("1", "1").label("q") == "q"
    )
    assert scale_of("1", "count").words(3.0) == "3"
    assert scale_of("1", "count").number(2.5) == "2.5"
    assert scale_of("1", "count").number(math.nan) == "failed"
    assert scale_of("1", "count").number(math.inf) == "inf"
    assert scale_of("1", "ppm").number(1.0) == "1000000"
    assert scale_of("1", "ppm").words(1e-5) == "10 ppm"


def test_tables_use_the_units_of_the_study(tmp_path):
    study = {
        "model": "rich", "seed": 4,
        "trials": {"until": "frequency_2 mean +-50 mHz", "at_most": 1024},
        "deviations": {"A1": "+-50 um", "A2": {"tolerance": "IT7", "size": "40 mm"}},
        "limits": {"stress": "<= 0.3 GPa", "contact_ratio": ">= 1.2"},
    }  # fmt: skip
    run = tolstat.run(study, model=Rich(), output=tmp_path / "units.h5")
    shown = {name: scale.shown for name, scale in run.scales.items()}
    assert shown == {
        "A1": "um", "A2": "um", "stress": "GPa", "modes": "count", "contact_ratio": "1",
        "share": "%", "frequency_1": "Hz", "frequency_2": "mHz",
    }  # fmt: skip
    document = tolstat.summary(run).document()
    rows = rows_of(table_under(document, "Responses"))
    units = {as_text(row["response"].main): as_text(row["unit"].main) for row in rows}
    assert units["stress"] == "GPa" and units["contact_ratio"] == ""
    medians = {
        as_text(row["response"].main): plain(in_cell(row["50 %"].main[0])[0])
        for row in rows
    }
    assert float(medians["stress"]) == pytest.approx(0.2, rel=0.05)
    assert float(medians["contact_ratio"]) < 2
    rows = rows_of(table_under(document, "Limits"))
    limits = {as_text(row["response"].main): as_text(row["limit"].main) for row in rows}
    assert limits == {"stress": "<= 0.3 GPa", "contact_ratio": ">= 1.2"}
    assert "frequency_2 mean +-50 mHz: reached" in words_in(*document.blocks)
    page = tolstat.report(run).html()
    assert "stress, GPa" in page and "&lt;= 0.3 GPa" in page
    assert "Settings(" not in page


def test_the_interval_sets_the_digits():
    """Against decimal arithmetic: two figures of half the interval, three of its own,
    and ten at most; zero where it is practically zero beside the interval.
    """
    generator = np.random.default_rng(5)
    for _ in range(2000):
        value = float(generator.normal() * 10 ** generator.uniform(-3, 5))
        half = float(abs(value) * 10 ** generator.uniform(-10, 1))
        lower, upper = value - half, value + half * generator.uniform(0.5, 1.5)
        three = [Decimal(f"{x:.12g}") for x in (value, lower, upper)]
        wide = three[2] - three[1]
        last = (wide / 2).adjusted() - 1
        for x, words in zip(
            three, Scale("1", "1").interval(value, lower, upper), strict=True
        ):
            if abs(x) < wide * Decimal("1e-4"):
                continue  # may be zero
            place = max(min(last, x.adjusted() - 2), x.adjusted() - 9)
            unit = Decimal(1).scaleb(place)
            assert abs(Decimal(words) - x) <= unit / 2
            assert Decimal(words) % unit == 0 and "e+" not in words
            assert Decimal(words).as_tuple().exponent <= max(place, 0)


def test_an_interval_with_an_end_at_its_estimate_has_a_bound():
    """None of a million, and all: no machine lies beyond what is printed."""
    ppm = Scale("1", "ppm")
    assert ppm.interval(0.0, 0.0, 263.46e-6) == ("0", "0", "264")
    assert PER_CENT.interval(1.0, 1 - 263.46e-6, 1.0) == ("100", "99.9736", "100")
    assert ppm.interval(-1e-6, -5.021e-6, -1e-6) == ("-1", "-5.03", "-1")
    generator = np.random.default_rng(7)
    for share in 10 ** generator.uniform(-7, -0.5, 500):
        zero, _, upper = ppm.interval(0.0, 0.0, share)
        all_, lower, _ = PER_CENT.interval(1.0, 1 - share, 1.0)
        assert (zero, all_) == ("0", "100")
        assert (
            0 <= Decimal(upper) - Decimal(f"{1e6 * share:.12g}") <= Decimal(upper) / 99
        )
        assert Decimal(lower) <= Decimal(f"{100 * (1 - share):.12g}")
        assert 100 - Decimal(lower) <= Decimal(upper) / 10000 * Decimal("1.011")


def test_nonzero_numbers_are_not_printed_as_zero():
    ppm = Scale("1", "ppm")
    assert ppm.interval(6.03e-6, 2.69e-6, 14548e-6) == ("6.03", "2.69", "14500")
    assert ppm.interval(-6.03e-6, -14548e-6, -2.69e-6) == ("-6.03", "-14500", "-2.69")
    assert ppm.interval(6.03e-6, 0.0, 14548e-6)[0] == "6.03"  # zero is inside


def test_binary_rounding_errors_do_not_change_print():
    """One number is written alike wherever it stands: as 12 figures of it are."""
    plain = Scale("1", "1")
    for x in (1125.0, 0.001125e6, 1125 * (1 + 1e-14), 1125 * (1 - 1e-14)):
        assert plain.interval(x, 1000.0, 2000.0)[0] == "1120"
        assert plain.interval(1500.0, x, x + 1000)[1] == "1120"
    for x in (0.007045, 0.007045 * (1 + 1e-14), 0.007045 * (1 - 1e-14)):
        assert Scale("1", "ppm").interval(x, 0.0, 0.015)[0] == "7040"
        assert Scale("1", "ppm").interval(0.01, x, 0.017)[1] == "7040"


def test_an_interval_whose_estimate_failed_has_ends():
    plain = Scale("1", "1")
    assert plain.interval(math.nan, 0.0, 1.0) == ("failed", "0", "1.00")
    assert plain.interval(math.inf, 0.0, 1.0) == ("inf", "0", "1.00")
    assert plain.interval(math.nan, math.nan, 1.0)[0] == "failed"


def test_an_interval_has_one_style():
    """An exponent in all three, or in none that does not begin with four zeros."""
    plain = Scale("1", "1")
    assert plain.interval(1e6, 999990.0, 1.00001e6) == (
        "1.000000e6",
        "9.99990e5",
        "1.000010e6",
    )
    assert plain.interval(999990.0, 999980.0, 1e6) == ("999990", "999980", "1000000")
    assert plain.interval(2e-3, 9e-4, 4e-3) == ("0.00200", "0.000900", "0.00400")
    assert plain.interval(5e-4, 4e-4, 6e-4) == ("5.00e-4", "4.00e-4", "6.00e-4")


def test_an_interval_with_a_width_shows_it():
    """Of a chain of large dimensions too; without one it is a number like any other."""
    gap = Scale("m", "mm")
    ends = 2.41675, 2.416748, 2.416751
    assert gap.interval(*ends) == ("2416.7500", "2416.7480", "2416.7510")
    assert gap.interval(2.41675, 2.41675, 2.41675) == ("2417",) * 3
    noise = 0.1 + 0.2
    assert Scale("1", "1").interval(noise, 0.3, noise) == ("0.3",) * 3


def test_a_number_resolves_a_thousandth_of_its_spread():
    """Four figures at least, and one place more than what it is held against."""
    gap = Scale("m", "mm")
    assert gap.words(2.41667) == "2417 mm"
    assert gap.telling(0.5e-3).words(2.4166666) == "2416.667 mm"
    assert gap.telling(0.2e-3).words(2.41666666) == "2416.6667 mm"
    assert gap.telling(0.0, (2.4166,)).words(2.4166667) == "2416.67 mm"
    assert gap.telling(0.0, (2.41642, 2.41692, 0.0)).words(2.41666667) == "2416.667 mm"
    assert gap.telling(1.0).words(0.012344444) == "12.34 mm"
    assert gap.telling(1e-12).words(2.41666666666) == "2416.666667 mm"  # ten at most
    assert Scale("1", "1").telling(1e4).number(12345678.9) == "1.234568e7"
    for none in (0.0, math.inf, math.nan):
        assert gap.telling(none) == gap
    generator = np.random.default_rng(8)
    for _ in range(500):
        value, spread = generator.uniform(1, 1e5), 10 ** generator.uniform(-1, 3)
        words = Scale("1", "1").telling(spread).number(value)
        assert abs(Decimal(words) - Decimal(value)) <= Decimal(spread) / 1000


def test_a_bound_is_rounded_to_the_safe_side():
    """Against decimal arithmetic: three figures, and never beyond what it bounds."""
    generator = np.random.default_rng(6)
    plain = Scale("1", "1")
    for value in generator.normal(size=500) * 10 ** generator.uniform(-5, 8, 500):
        down, up = (Decimal(f(value)) for f in (plain.at_least, plain.at_most))
        assert down < Decimal(value) < up
        assert up - down <= Decimal(1).scaleb(Decimal(value).adjusted() - 2)
    assert plain.at_least(-0.4) == plain.at_most(-0.4) == "-0.4"
    assert plain.at_least(0.1 + 0.2) == "0.3" and plain.at_most(0.9274) == "0.928"
    loss = Scale("1", "%", 1e-5)
    assert (loss.at_least(1e-9), loss.at_most(1e-9)) == ("0", "1e-5")
    assert (loss.at_least(-1e-9), loss.at_most(-1e-9)) == ("-1e-5", "0")
    # an open interval has a bound, and what has no interval three figures
    assert plain.interval(math.inf, 1.0199, math.inf)[1] == "1.01"
    assert plain.interval(-math.inf, -math.inf, 1.011)[2] == "1.02"
    assert plain.interval(10.8531, math.nan, math.nan)[0] == "10.9"


def test_an_exact_number_keeps_its_figures():
    for value, words in (
        (5.0, "5"), (3 * 0.1, "0.3"), (1 / 3, "0.3333"), (0.99998, "1.000"),
        (123456.7, "123457"), (2e-7, "2e-7"), (1 / 3e7, "3.33e-8"), (2e9, "2e9"),
    ):  # fmt: skip
        assert figures(value) == words
    share = (0.99679, 0.99663, 0.99757)
    assert PER_CENT.interval(*share) == ("99.679", "99.663", "99.757")
    assert PART.interval(*share) == ("99.7", "99.7", "99.8")


def test_negligible_numbers_are_printed_as_below():
    loss = Scale("1", "%").beside(0.03)
    assert loss.least == 1e-5
    assert loss.words(1.06e-8) == "below 1e-5 %" and loss.number(-1e-9) == "above -1e-5"
    assert loss.number(0.0) == "0" and loss.number(1.2e-7) == "1.2e-5"
    # where figures end before, it is rounded away
    assert loss.interval(1e-9, 0.0, 0.002) == ("0", "0", "0.200")
    assert loss.interval(2e-8, 1e-8, 2e-7) == ("below 1e-5",) * 2 + ("2.00e-5",)
    assert Scale("m", "mm").beside(0.0).least == 0.0 == Scale("m", "mm").least


def test_slopes_have_both_units():
    slope = Ratio(Scale("N", "kN"), Scale("m", "mm"))
    assert slope.mark == "kN/mm" and slope.number(2e6) == "2"
    assert Ratio(Scale("1", "1"), Scale("m", "mm")).mark == "1/mm"
    assert Ratio(Scale("1", "%"), Scale("1", "1")).mark == "%"
    assert Ratio(Scale("N m", "kN m"), Scale("m/s", "m/s")).mark == "kN m/(m/s)"


def test_units_fit_the_size_of_small_energies(tmp_path):
    run = tolstat.run("runs/khpt75.toml", trials=3, output=tmp_path / "three.h5")
    size = np.abs(run.column("contact_energy")).max()
    assert 1e-3 <= run.scales["contact_energy"].factor * size < 1e6
    assert run.scales["crank_angle_1"].shown == "deg"


def test_a_negligible_end_of_an_interval_is_zero():
    ppm = Scale("1", "ppm")
    assert ppm.interval(9e-9, 1e-9, 3.6e-3) == ("0", "0", "3600")
    assert ppm.interval(240e-6, 3e-8, 1840e-6) == ("240", "0", "1840")
    assert ppm.interval(0.8e-6, 0.5e-6, 3.6e-3) == ("0.800", "0.500", "3600")
    assert ppm.interval(500e-6, 8e-8, 3800e-6) == ("500", "0", "3800")
    # what is estimated is sooner worth a figure
    assert ppm.interval(1.4e-6, 3e-8, 14.5e-3) == ("1.40", "0", "14500")


def test_an_estimate_has_three_figures_however_wide_its_interval():
    plain = Scale("1", "1")
    assert plain.interval(0.1594, 0.0312, 2.431) == ("0.159", "0.0312", "2.43")
    ppm = Scale("1", "ppm")
    # one number, whatever its interval
    for lower, upper in ((300e-6, 1300e-6), (30e-6, 4000e-6), (0.0, 14500e-6)):
        assert ppm.interval(732e-6, lower, upper)[0] == "732"
    # what is practically zero beside its interval is zero
    assert plain.interval(1e-9, -2.0, 2.0)[0] == "0"


def test_what_no_computation_resolves_is_zero():
    """A rounding error is not "above" nothing; a small share is "below" something."""
    gap = Scale("m", "mm").beside(0.15e-3)
    assert gap.number(-4.8e-18) == "0" and gap.number(-1e-14) == "above -1e-6"
    assert PART.number(6.63e-36) == "0" and PART.number(3e-9) == "below 0.0001"
    assert PART.number(0.3827) == "38.3"

"""Slips in a dimension chain: angles without unit, jumps, small values, two numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tolstat.answers.report.first_page import next_steps
from tolstat.answers.report.report_warnings import JUMPS as JUMPS_REASON
from tolstat.deviations.spread import reach_of
from tolstat.errors import ModelError
from tolstat.machines.dimension_chain.machine import DimensionChain
from tolstat.model.settings import make
from tolstat.render.screen import as_text
from tolstat.statistics.limits.yields import JUMP
from tolstat.study.study import load

LINKS = {
    "r": (0.1, "m"), "s": (0.02, "m"), "phi": (0.2, "rad"), "psi": (0.1, "rad"),
    "n": (45.0, "1"), "k": (0.3, "1"), "w": (3.0, "rad/s"), "t": (0.1, "s"),
}  # fmt: skip


def unit_of_gap(text):
    links = {name: {"nominal": nominal} for name, nominal in LINKS.items()}
    return make(DimensionChain(), {"links": links, "gap": text}).unit


@pytest.fixture
def ran(tmp_path):
    return lambda study: tolstat.run(study, output=tmp_path / "chain.h5", force=True)


def chain(gap, links, limit, **changes):
    """A chain of links, as a study gives it."""
    return {
        "model": "dimension_chain", "trials": 2000, "seed": 1, "links": links,
        "settings": {"gap": gap}, "limits": {"gap": limit}, **changes,
    }  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        "r*cos(30)", "r*cos(n)", "sin(-n)*k", "tan(abs(n) + k)", "k*sin(n/k)",
        "sin(s/r + 30)", "r*cos(min(s/r, 1))", "sin(phi/psi)", "r*sin(sqrt(n))",
        "r*sin(phi*180/pi)", "r*sin(180/pi*phi)", "r*sin(phi*pi/180)", "cos(exp(k))",
    ],
)  # fmt: skip
def test_a_bare_number_is_no_angle(text):
    with pytest.raises(ModelError, match=r'"30 deg" or "30 rad".*30\*pi/180'):
        unit_of_gap(text)


@pytest.mark.parametrize("text", ["r*sin(phi + 30)", "max(phi, 3)", "phi - n"])
def test_a_bare_number_is_not_added_to_an_angle(text):
    with pytest.raises(ModelError, match='such as "30 deg"'):
        unit_of_gap(text)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("r*cos(n*pi/180)", "m"), ("r*sin(phi + 30*pi/180)", "m"), ("r*sin(s/r)", "m"),
        ("cos(asin(k))", "1"), ("r*tan(atan2(s, r)/2)", "m"), ("r*sin(2*s/r)", "m"),
        ("r*cos(2*pi*k)", "m"), ("r*sin(pi*s/r)", "m"), ("sin(w*t)", "1"),
        ("r*cos(max(phi, 0) - pi/6)", "m"), ("sin(hypot(phi, psi))", "1"),
        ("r*(1 - phi**2/2)", "m"), ("phi/psi", "1"), ("phi*psi", "1"),
        ("180/pi*phi", "1"), ("exp(-s/r)", "1"), ("atan(k) + phi", "rad"),
    ],
)  # fmt: skip
def test_angles_and_ratios_of_lengths_are_taken(text, unit):
    assert unit_of_gap(text) == unit


def test_the_worst_case_of_eccentric_parts_is_the_one_of_the_model(ran):
    """A clearance is largest where all is centred: in no corner of the tolerances."""
    part = {"nominal": "0 mm", "tolerance": "+-0.1 mm"}
    ends = {"tolerance": "+-0.1 mm"}
    for gap, links, least, largest in (
        ("c - hypot(x, y)", {"c": "0.3 mm"}, 0.3 - 0.1 * math.sqrt(2), 0.3),
        ("c - abs(x) - abs(y)", {"c": "0.3 mm"}, 0.1, 0.3),
        ("max(x, y, 0*c)", {"c": "1 mm"}, 0.0, 0.1),
        ("c + x - y", {"c": {"nominal": "1 mm", **ends}}, 0.7, 1.3),
    ):
        study = chain(gap, {**links, "x": part, "y": part}, "0.25..0.26 mm")
        run = ran(study)
        cases = run.worst_cases("gap")
        numbers = {each.worst: each.value for each in run.numbers if each.worst}
        for side, known in (("least", least), ("largest", largest)):
            assert cases[side].value == pytest.approx(known * 1e-3, abs=1e-9)
            assert cases[side].value == pytest.approx(numbers[side], rel=1e-9)
        report = tolstat.report(run).responses["gap"].worst_cases
        assert report == cases


def test_parts_that_are_all_alike_have_no_worst_case_of_free_parts(ran):
    size = {"nominal": "1 mm", "tolerance": "+-0.1 mm"}
    study = chain("p_1 - p_2 + c", {"p_1": size, "p_2": size, "c": "1 mm"}, ">= 1 mm")
    study["links"] = {n: v["nominal"] for n, v in {"p_1": size, "p_2": size}.items()}
    study["links"]["c"] = "1 mm"
    study["deviations"] = {"p": {"tolerance": "+-0.1 mm", "common": True}}
    least = ran(study).worst_cases("gap")["least"]
    assert least.value == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("gap", "unit"), [("a / b", ""), ("a - b", ""), ("a * b", " mm"), ("b", " mm")]
)
def test_the_numbers_of_a_gap_are_linked_by_what_they_are(ran, gap, unit):
    """A share of the variance is no value of a gap that is a plain number."""
    links = {
        name: {"nominal": f"{size}{unit * (name == 'b')}",
               "tolerance": f"+-0.1{unit * (name == 'b')}"}
        for name, size in (("a", 5), ("b", 4))
    }  # fmt: skip
    run = ran(chain(gap, links, f">= 1{unit}"))
    linked = {each.name for each in run.numbers if each.of == "gap"}
    assert linked == {"worst_min", "worst_max", "rss_mean", "rss_sigma"}
    assert not any("share" in note for note in tolstat.summary(run).trials.notes)
    shares = [each.value for each in run.numbers if each.name.startswith("share_")]
    assert np.sum(shares) == pytest.approx(1.0)


def share_out(run):
    return np.mean(run.beyond("gap"))


# gap, links, limit, and the fraction out of limit: of a normal link the distribution
# function where the formula crosses the limit
SMALL = {
    "exp": ("exp(x)", {"x": ("60", "+-60")}, ">= 1", norm.cdf(-3)),
    "power": ("x**10", {"x": ("0.001", "+-0.002")}, ">= 1e-35",
              norm.cdf((1e-3 * 10**-0.5 - 1e-3) / (0.002 / 3))
              - norm.cdf((-1e-3 * 10**-0.5 - 1e-3) / (0.002 / 3))),
    "diode": ("exp(-V/0.026)", {"V": ("1", "+-1")}, ">= 1e-30",
              norm.sf((0.026 * 30 * math.log(10) - 1) / (1 / 3))),
    "pole": ("k/(a - b)**4",
             {"k": ("1e-30", ""), "a": ("1", "+-0.9"), "b": ("0.999", "")}, ">= 2e-30",
             norm.sf((0.5**0.25 - 0.001) / 0.3)
             + norm.sf((0.5**0.25 + 0.001) / 0.3)),
    "exp less a part": ("exp(x) - exp(y)", {"x": ("-60", "+-3"), "y": ("-60", "")},
                        ">= 1e-40", 0.5),
}  # fmt: skip


@pytest.mark.parametrize("case", SMALL)
def test_a_small_value_is_no_rounding_error(ran, case):
    gap, links, limit, known = SMALL[case]
    links = {
        name: {"nominal": nominal, **({"tolerance": zone} if zone else {})}
        for name, (nominal, zone) in links.items()
    }
    run = ran(chain(gap, links, limit, trials=20_000))
    error = 4 * math.sqrt(known * (1 - known) / run.trials)
    assert share_out(run) == pytest.approx(known, abs=error)
    assert not np.any(run.column("gap") == 0)


@pytest.mark.parametrize(
    ("gap", "sizes"),
    [
        ("a - b - c - d - e", (72.5, 16, 16, 38, 2.5)),
        ("(a - b - c - d - e)*b/c", (72.5, 16, 16, 38, 2.5)),
        ("sqrt(abs(a - b - c)*a)", (0.3, 0.1, 0.2)),
        ("a*sin(pi*b/b)", (5, 1)),
        ("0.3*a - 0.1*a - 0.2*a", (7,)),
    ],
)
def test_a_rounding_error_of_terms_is_nothing(ran, gap, sizes):
    links = {n: {"nominal": f"{x} mm"} for n, x in zip("abcde", sizes, strict=False)}
    links["z"] = {"nominal": "1 mm", "tolerance": "+-0.1 mm"}
    run = ran(chain(f"{gap} + 0*z", links, ">= 0 mm", trials=20))
    assert np.all(run.column("gap") == 0)


def warned(gap, links):
    """Return the warnings of a chain: links by nominal and tolerance."""
    links = {
        name: {"nominal": nominal, **({"tolerance": zone} if zone else {}), **more}
        for name, (nominal, zone, more) in links.items()
    }
    study = load(chain(gap, links, ">= 0 mm") | {"limits": {}})
    spreads = {n: reach_of(x) for n, x in study.deviating.distributions.items()}
    return study.model.warnings(study.settings, spreads)


def link(nominal, zone="", **more):
    return nominal, zone, more


Y, X = link("0 mm", "+-0.01 mm"), link("-10 mm", "+-0.1 mm")
NEAR = link("0.02 mm", "+-0.015 mm")  # beyond its zone a normal part reaches 0
# by formula: its links, and the words that say where it jumps
JUMPS = {
    "atan2(y, x)": ({"y": Y, "x": X}, ["x is below 0", "y (-20", "atan2(-y, -x)"]),
    "atan2(y, x) - pi": ({"y": NEAR, "x": X}, ["y (-10 um"]),
    "r*atan2(y - z, -x)": (
        {"y": link("5 mm", "+-0.1 mm"), "z": link("5.1 mm", "+-0.2 mm"),
         "x": link("10 mm", "+-0.1 mm"), "r": link("2 mm")},
        ["-x is below 0", "y - z (-0.7", "atan2(-(y - z), x)"],
    ),
    "k**2/x": ({"x": link("0.05 mm", "+-0.1 mm"), "k": link("1 mm")}, ["pole as x"]),
    "k**2/(a - b)": (
        {"a": link("1 mm", "+-0.1 mm"), "b": link("1.1 mm", "+-0.1 mm"),
         "k": link("1 mm")},
        ["pole as a - b"],
    ),
    "k**4*x**-3": ({"x": link("0.05 mm", "+-0.1 mm"), "k": link("1 mm")}, ["x **"]),
    "h*tan(g)": ({"g": link("89 deg", "+-1.5 deg"), "h": link("1 mm")}, ["90 deg"]),
    "h*tan(3*g)": ({"g": link("29 deg", "+-1.5 deg"), "h": link("1 mm")}, ["3 * g"]),
    # of many links the corner alone shows it
    "k**2/(" + " + ".join(f"x{i}" for i in range(14)) + " - 13.5*k)": (
        {**{f"x{i}": link("1 mm", "+-0.03 mm") for i in range(14)}, "k": link("1 mm")},
        ["pole as x0 + x1"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("gap", JUMPS, ids=lambda text: text[:30])
def test_a_jump_within_the_tolerances_is_said_with_its_place(gap):
    links, words = JUMPS[gap]
    (sentence,) = warned(gap, links)
    assert all(each in sentence for each in words), sentence


A, B = link("1 mm", "+-0.1 mm"), link("0.3 mm", "+-0.1 mm")
OFF = link("0 mm", "+-0.1 mm")
SMOOTH = {
    "a - b": {"a": A, "b": B},
    "a/b*b": {"a": A, "b": B},
    "hypot(a, b) + abs(a) - max(a, b) + min(a, b)": {"a": OFF, "b": OFF},
    "sqrt(a*b) + a*exp(-b/a)": {"a": A, "b": B},
    "atan2(a, b)": {"a": OFF, "b": A},
    "a*cos(atan2(b, -a))": {"a": A, "b": OFF},  # continuous across the cut
    "a*sin(b/a)/(b/a)": {"a": A, "b": link("0.02 mm", "+-0.1 mm")},  # and here
    "a**3/b**2": {"a": A, "b": link("0.02 mm", "+-0.1 mm")},  # a pole without a jump
    "atan2(b, -a)": {"a": A, "b": link("0.02 mm", "+-0.01 mm", distribution="uniform")},
    "a*tan(g)": {"a": A, "g": link("80 deg", "+-2 deg")},
    "a - b/sin(g)": {"a": A, "b": B, "g": link("45 deg", "+-1 deg")},
    "a - b*a/a": {"a": A, "b": B},
}


@pytest.mark.parametrize("gap", SMOOTH)
def test_a_smooth_formula_has_no_warning(gap):
    assert warned(gap, SMOOTH[gap]) == ()


def turned(offset, n=2000):
    """An angle beside 180 deg: the share of trials beyond is that of y below 0."""
    links = {
        "y": {"nominal": f"{offset} mm", "tolerance": "+-0.03 mm"},
        "x": {"nominal": "-10 mm", "tolerance": "+-0.1 mm"},
    }
    return chain("atan2(y, x)", links, ">= 179 deg", trials=n)


@pytest.mark.parametrize("offset", [0.0, 0.018, -0.02, 0.025])
def test_an_angle_beside_180_deg_is_no_verdict(ran, offset):
    run = ran(turned(offset))
    found = tolstat.report(run)
    *of_study, jump = found.warnings
    assert any("atan2(y, x) jumps" in each.sentence for each in of_study)
    assert (jump.kind, jump.response, jump.clusters.turn) == ("jump", "gap", True)
    over = np.mean(run.column("y") + offset * 1e-3 < 0)
    assert jump.clusters.below == pytest.approx(over * run.trials, abs=1)
    each = found.responses["gap"]
    assert each.limited.yields.verdict == "undecided"
    assert each.limited.yields.reason == JUMP and each.limited.yields.needed == 0
    assert each.causes.main is None and each.causes.reason == JUMPS_REASON
    assert each.off_centre is None
    (step,) = next_steps(found)
    assert as_text(step) == "Mend the formula of gap, as said above."
    # the angle from the opposite direction has a verdict
    study = turned(offset)
    study["settings"]["gap"] = "atan2(-y, -x)"
    study["limits"] = {"gap": "-1..1 deg"}
    again = tolstat.report(ran(study))
    assert not any("jumps" in each.sentence for each in again.warnings)
    assert again.verdicts == {"gap": "met"}

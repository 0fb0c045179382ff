"""Slips in a dimension chain: angles without unit, jumps, small values, two numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tolstat.answers.next_steps import StepKind
from tolstat.answers.report.finding_words import next_steps
from tolstat.answers.report.report_answer import NoCause
from tolstat.answers.run_entries import judged
from tolstat.cli.check import checked as check_runs
from tolstat.deviations.spread import reach_of
from tolstat.errors import ModelError
from tolstat.machines.dimension_chain.algebras import Dimensions, Roundings, Values
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.machines.dimension_chain.machine import DimensionChain
from tolstat.model.settings import make
from tolstat.render.screen import as_text
from tolstat.statistics.limits.yields import JUMP
from tolstat.study.study import load
from tolstat.units.conversion import dimension

LINKS = {
    "r": (0.1, "m"), "s": (0.02, "m"), "phi": (0.2, "rad"), "psi": (0.1, "rad"),
    "n": (45.0, "1"), "k": (0.3, "1"), "w": (3.0, "rad/s"), "t": (0.1, "s"),
}  # fmt: skip


def unit_of_gap(text):
    links = {name: {"nominal": nominal} for name, nominal in LINKS.items()}
    settings = make(DimensionChain(), {"links": links, "gap": text})
    return settings.unit_of(settings.formulas["gap"])


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
    with pytest.raises(ModelError, match=r'"30 deg" or "30 rad".*written 30 deg'):
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
    assert each.causes.main is None and each.causes.reason is NoCause.JUMPS
    assert found.findings.remedy is None
    assert [step.kind for step in found.findings.steps] == [StepKind.MEND_FORMULA]
    (step,) = next_steps(found)
    assert as_text(step) == "Mend the formula of gap, as said above."
    # the angle from the opposite direction has a verdict
    study = turned(offset)
    study["settings"]["gap"] = "atan2(-y, -x)"
    study["limits"] = {"gap": "-1..1 deg"}
    again = tolstat.report(ran(study))
    assert not any("jumps" in each.sentence for each in again.warnings)
    assert again.verdicts == {"gap": "met"}


def zoned(**links):
    """Return links by nominal and tolerance."""
    return {
        name: {"nominal": nominal, **({"tolerance": zone} if zone else {})}
        for name, (nominal, zone) in links.items()
    }


@pytest.mark.parametrize(
    ("gap", "links", "turns"),
    [
        ("L*cos(s*pi*180)", {"s": link("30")}, "2700 turns"),
        ("L*sin(s*pi)", {"s": link("30")}, "15 turns"),
        ("L*cos(2*pi*s)", {"s": link("30")}, "30 turns"),
        ("L*tan(s*pi)", {"s": link("45.2")}, "22.6 turns"),
        ("L*cos(g - pi*s)", {"s": link("30"), "g": link("3 deg")}, "14.99 turns"),
        ("L*sin(max(s, 1)*pi/2)", {"s": link("30")}, "7.5 turns"),
        ("L*cos(30*pi + g)", {"g": link("0 deg")}, "15 turns"),
    ],
)
def test_a_number_of_degrees_by_pi_is_asked_for(gap, links, turns):
    sentences = warned(gap, {"L": link("100 mm", "+-0.1 mm"), **links})
    (sentence,) = (each for each in sentences if "turns" in each)
    assert turns in sentence and '"30 deg"' in sentence


@pytest.mark.parametrize(
    ("gap", "links"),
    [
        ("L*cos(s*pi/180)", {"s": link("30")}),
        ("L*cos(2*pi*s)", {"s": link("0.3")}),
        ("L*cos(2*pi*s)", {"s": link("1")}),
        ("L*cos(g)", {"g": link("1080 deg")}),
        ("L*cos(g + pi/2)", {"g": link("1080 deg")}),
        ("L*sin(2*pi*f*t)", {"f": link("50 Hz"), "t": link("1 s")}),
        ("L*sin(2*pi*x/w)", {"x": link("95 mm"), "w": link("10 mm")}),
        ("L*sin(w*t + pi)", {"w": link("300 rad/s"), "t": link("1 s")}),
    ],
)
def test_an_angle_that_is_meant_has_no_warning(gap, links):
    assert warned(gap, {"L": link("100 mm", "+-0.1 mm"), **links}) == ()


# of L = 100 mm and a link that ends a right angle, the share out of limit by closed
# form: the gap is L tan(d), d of sigma 1 deg
OUT = 2 * norm.sf(math.degrees(math.atan(0.06)))
RIGHT = {
    "L/tan(a)": OUT,
    "L*cos(a)/sin(a)": OUT,
    "L/(tan(a) + 0*L/L)": OUT,
    "-L/tan(a)": OUT,
    "L - L - L/tan(a)": OUT,
    "L/(2*tan(a) - tan(a))": OUT,
    "L*tan(a - pi/2)": OUT,
}


@pytest.mark.parametrize("gap", RIGHT)
def test_a_huge_value_is_no_rounding_error(ran, gap):
    links = zoned(L=("100 mm", ""), a=("90 deg", "+-3 deg"))
    run = ran(chain(gap, links, "-6..6 mm", trials=20_000))
    known = RIGHT[gap]
    error = 4 * math.sqrt(known * (1 - known) / run.trials)
    assert share_out(run) == pytest.approx(known, abs=error) and not run.failed
    size = np.tan(run.column("a"))
    assert np.abs(run.column("gap")) == pytest.approx(np.abs(100e-3 * size), abs=1e-12)
    assert abs(run.nominal_values["gap"]) < 1e-15


@pytest.mark.parametrize(
    ("gap", "known"),
    [
        ("tan(a)", math.tan(math.pi / 2)), ("tan(a) + 1", math.tan(math.pi / 2)),
        ("1e20*tan(a) - 1e20", 1e20 * math.tan(math.pi / 2)),
        ("sin(k*1e16)", math.sin(1e16)),
    ],
)  # fmt: skip
def test_a_value_that_errs_by_its_size_is_kept(gap, known):
    links = {"a": np.array([math.pi / 2]), "k": np.array([1.0])}
    found = Formula(gap, ("a", "k")).worked_out(Roundings(links)).value
    assert found == pytest.approx(known)


def test_terms_far_larger_than_their_sum_leave_nothing():
    """0.3 - 0.1 - 0.2 times 1e20 is a rounding error, and so is a part beside it."""
    links = {"a": np.array([0.1]), "k": np.array([1e20])}
    for gap in ("3*a*k - a*k - 2*a*k", "(0.3*k - 0.1*k - 0.2*k) + a/1e20"):
        found = Formula(gap, ("a", "k")).worked_out(Roundings(links)).value
        assert found == 0


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "gap",
    ["asin(sin(a))", "acos(sin(a) - 0*a/a)", "sqrt(a - pi/2)*c", "abs(a)/a*c + c"],
)
def test_a_vertical_slope_is_no_message_of_numpy(ran, gap):
    shift = {"distribution": "uniform"} if "sqrt" in gap else {}
    zone = "0..2 deg" if shift else "+-1 deg"
    links = zoned(a=("90 deg", zone), c=("1 mm", ""))
    limit = ">= 0 mm" if "c" in gap.replace("acos", "") else ">= -1 deg"
    run = ran(chain(gap, links, limit, trials=50))
    assert run.complete


def test_the_numbers_of_a_jump_have_one_form():
    (sentence,) = warned("atan2(y, x)", {"y": link("0 mm", "+-0.03 mm"), "x": X})
    assert "y (-60 um to 60 um) passes 0" in sentence
    for size, ends in (
        ("0.05 mm", "(-0.15 mm to 0.25 mm)"),
        ("1 um", "(-0.199 mm to 0.201 mm)"),
    ):
        links = {"x": link(size, "+-0.1 mm"), "k": link("1 mm")}
        assert f"x {ends} passes 0" in warned("k**2/x", links)[0]


@pytest.mark.parametrize(
    ("gap", "limit", "sizes"),
    [
        ("atan2(y, x)", ">= 175 deg", ("0 mm", "-10 mm")),
        ("2*atan2(y, x) - atan2(y, x)", ">= 175 deg", ("0.01 mm", "-10 mm")),
        ("0.5*atan2(y, x)", ">= 85 deg", ("0 mm", "-10 mm")),
        ("atan(x/y)", "<= 89.5 deg", ("0.002 mm", "10 mm")),
    ],
)
def test_a_rare_run_of_an_angle_that_jumps_is_undecided(ran, gap, limit, sizes):
    links = zoned(y=(sizes[0], "+-0.03 mm"), x=(sizes[1], "+-0.1 mm"))
    limits = {"limit": limit, "ppm": 100}
    run = ran(chain(gap, links, limits, sampling="rare", trials=6000))
    found = tolstat.report(run)
    (jump,) = (each for each in found.warnings if each.kind == "jump")
    assert jump.clusters.turn == (0.5 if "0.5" in gap or "atan(" in gap else 1.0)
    assert (found.verdict, found.reason) == ("undecided", JUMP)
    assert math.isnan(found.plain_trials)
    checked = check_runs([run])
    assert [each[3:] for each in checked.limits] == [("undecided", JUMP)]
    assert any("jumps by" in each for each in checked.warnings)
    assert {n: x.words for n, x in judged(run).items()} == {"gap": found.words}


def test_a_rare_run_beside_the_cut_has_its_verdict(ran):
    """Out of limit is y above 0.1885 mm: 4.2 sigma."""
    links = zoned(y=("0.17455 mm", "+-0.01 mm"), x=("-10 mm", "+-0.01 mm"))
    limit = {"limit": ">= 178.92 deg", "ppm": 100}
    run = ran(chain("atan2(y, x)", links, limit, sampling="rare", trials=20_000))
    found = tolstat.report(run)
    assert found.verdict == "met" and not any(x.kind == "jump" for x in found.warnings)


@pytest.mark.parametrize("kind", ["grid", "table"])
@pytest.mark.parametrize(
    ("y", "warns"), [((-0.06, 0.07), True), ((0.01, 0.14), False), ((-0.2, 0.0), True)]
)
def test_given_trials_on_both_sides_of_a_cut_are_said(ran, tmp_path, kind, y, warns):
    study = chain("atan2(y, x)", zoned(y=("0 mm", ""), x=("-10 mm", "")), ">= 179 deg")
    del study["trials"], study["seed"]
    if kind == "grid":
        first, last = (f"{each} mm" for each in y)
        axis = {"from": first, "to": last, "points": 14}
        study |= {"sampling": "grid", "grid": {"y": axis}}
    else:
        path = tmp_path / "points.csv"
        values = np.linspace(*y, 14)
        path.write_text("\n".join(["y [mm]", *map(str, values)]) + "\n")
        study |= {"sampling": "table", "table": str(path)}
    found = tolstat.report(ran(study)).stored_run.warnings
    assert any("atan2(y, x) jumps" in each for each in found) == warns


def test_designs_that_jump_are_said_before_they_are_compared(tmp_path):
    def run(name, offset):
        study = turned(offset, 500)
        return tolstat.run(study, output=tmp_path / f"{name}.h5")

    jumping, smooth = run("a", 0.0), run("b", 0.1)
    for pair, labels in (((jumping, smooth), "A"), ((smooth, jumping), "B"),
                         ((jumping, jumping), "AB")):  # fmt: skip
        found = tolstat.compare(*pair)
        jumps = {
            each.label: [x.response for x in each.warnings if x.kind == "jump"]
            for each in found.designs
        }
        assert jumps == {x: ["gap"] * (x in labels) for x in "AB"}
        first = found.document().blocks[0].blocks[0]
        said = [as_text(parts) for parts in first.items]
        for label in labels:
            assert any(x.startswith(f"{label}: gap jumps by a whole") for x in said)
    alone = tolstat.compare(smooth, smooth).designs[0].warnings
    assert not any(each.kind == "jump" for each in alone)


ARC = {"r": link("50 mm", "+-0.2 mm"), "phi": link("30 deg", "+-1 deg")}
SPRING = {"k": link("100 N/mm", "+-5 N/mm"), "m": link("10 kg", "+-0.2 kg")}
LENGTHS = {"a": link("10 mm", "+-0.9 mm"), "b": link("1 mm", "+-0.03 mm")}


@pytest.mark.parametrize(
    ("gap", "links", "words"),
    [
        ("r*phi*pi/180", ARC, "not needed"),
        ("2*pi*r*phi/360", ARC, "not needed"),
        ("20*log(a/b)", LENGTHS, "natural logarithm"),
        ("sqrt(k/m)", SPRING, "is sqrt(k/m)/(2*pi)"),
    ],
)
def test_a_term_that_is_seldom_meant_so_is_said(gap, links, words):
    assert any(words in sentence for sentence in warned(gap, links))


@pytest.mark.parametrize(
    ("gap", "links"),
    [
        ("r*phi", ARC), ("2*pi*r*phi/(2*pi)", ARC), ("r*(1 - cos(phi))", ARC),
        ("20*log(a/b)/log(10)", LENGTHS), ("pi*a*b/180", LENGTHS),
        ("log(a/b)", LENGTHS),
        ("sqrt(k/m)/(2*pi)", SPRING), ("sqrt(k/m)/6.2832", SPRING),
    ],
)  # fmt: skip
def test_usual_terms_are_quiet(gap, links):
    assert warned(gap, links) == ()


def test_a_frequency_is_turns_a_second():
    """100 N/mm and 10 kg: 100 rad/s, 15.9 Hz."""
    per_second = {"k": "N/m", "m": "kg"}
    for text, value in (("sqrt(k/m)", 100.0), ("sqrt(k/m)/(2*pi)", 15.9155)):
        formula = Formula(text, ("k", "m"))
        assert formula.worked_out(Dimensions(per_second)).dimension == dimension("Hz")
        links = {"k": 1e5, "m": 10.0}
        assert formula.worked_out(Values(links)) == pytest.approx(value, rel=1e-5)


def test_half_a_power_is_no_root():
    with pytest.raises(ModelError, match="write sqrt"):
        Formula("(a/b)**1/2", ("a", "b"))

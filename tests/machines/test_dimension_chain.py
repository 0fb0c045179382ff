"""The dimension chain: known results, refusals, and formulas computed in three ways."""

from __future__ import annotations

import ast
import math
from itertools import product

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import approx_fprime

import tolstat
from tolstat.deviations.spread import Spread
from tolstat.errors import ModelError, StudyError
from tolstat.execution.diagnostics.influence import slopes
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.machines.dimension_chain.algebras import Dimensions, Slopes, Values
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.declarations import Settings
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.machines.dimension_chain.machine import DimensionChain
from tolstat.model.settings import make
from tolstat.study.study import load
from tolstat.units.grammar import quantity

WAVE = {
    "R_out": ("60 mm", 0.030), "R_in": ("47.935 mm", 0.020),
    "e": ("2 mm", 0.020), "d": ("10 mm", 0.010),
}  # fmt: skip


def wave_gear(**changes):
    """The clearance of a ball in its track, links uniform."""
    links = {
        name: {
            "nominal": nominal,
            "tolerance": f"+-{width / 2:g} mm",
            "distribution": "uniform",
        }
        for name, (nominal, width) in WAVE.items()
    }
    return {
        "model": "dimension_chain", "trials": 20_000, "seed": 3, "links": links,
        "settings": {"gap": "R_out - R_in - e - d"}, "limits": {"gap": ">= 0.035 mm"},
        **changes,
    }  # fmt: skip


def v_track(**changes):
    """A ball between opposed V-tracks, whose angle alone deviates."""
    angle = {"nominal": "45 deg", "tolerance": "+-1 deg", "distribution": "uniform"}
    return {
        "model": "dimension_chain", "trials": 20_000, "seed": 3,
        "links": {"H": "14.2 mm", "d": "10 mm", "gamma": angle},
        "settings": {"gap": "H - d/sin(gamma)"}, "limits": {"gap": ">= 0 mm"},
        **changes,
    }  # fmt: skip


@pytest.fixture
def ran(tmp_path):
    return lambda study: tolstat.run(study, output=tmp_path / "chain.h5", force=True)


def numbers_of(run):
    return {number.name: number.value for number in run.numbers}


SIGMAS = {"uniform": 0.01224744871, "normal": 0.00707106781}


@pytest.mark.parametrize("distribution", SIGMAS)
def test_the_clearance_of_the_wave_gear(ran, distribution):
    study = wave_gear()
    for link in study["links"].values():
        link["distribution"] = distribution
    found = numbers_of(ran(study))
    assert found["worst_min"] == pytest.approx(0.025e-3, rel=1e-9)
    assert found["worst_max"] == pytest.approx(0.105e-3, rel=1e-9)
    assert found["rss_mean"] == pytest.approx(0.065e-3, rel=1e-9)
    assert found["rss_sigma"] == pytest.approx(1e-3 * SIGMAS[distribution], rel=1e-9)
    # of the variance of a linear chain each has its own, exactly
    widths = np.array([width for _, width in WAVE.values()])
    shares = [found[f"share_{name}"] for name in WAVE]
    np.testing.assert_allclose(shares, widths**2 / np.sum(widths**2), rtol=1e-12)


def test_the_wave_gear_has_the_known_spread(ran):
    gap = 1e3 * ran(wave_gear()).column("gap")
    for below, share in {
        0.035: 1 / 288, 0.040: 5 / 288, 0.050: 0.117621527778, 0.065: 0.5,
        0.080: 0.882378472222, 0.090: 0.982638888889,
    }.items():  # fmt: skip
        error = math.sqrt(share * (1 - share) / len(gap))
        assert np.mean(gap < below) == pytest.approx(share, abs=4 * error)
    quantiles = {0.05: 0.044782693230, 0.95: 0.085217306770}
    for share, known in quantiles.items():
        assert np.quantile(gap, share) == pytest.approx(known, abs=4e-4)


def test_a_chain_that_is_not_linear(ran):
    run = ran(v_track())
    found, gap = numbers_of(run), 1e3 * run.column("gap")
    assert found["rss_mean"] == pytest.approx(0.057864376269e-3, rel=1e-9)
    assert found["rss_sigma"] == pytest.approx(0.142505536685e-3, rel=1e-9)
    assert found["worst_min"] == pytest.approx(-0.195565396e-3, rel=1e-8)
    assert found["worst_max"] == pytest.approx(0.298364090e-3, rel=1e-8)
    error = 0.142566334613 / math.sqrt(len(gap))
    assert gap.mean() == pytest.approx(0.055709782288, abs=4 * error)
    assert gap.std() == pytest.approx(0.142566334613, rel=0.02)
    assert np.mean(gap < 0) == pytest.approx(0.383497676046, abs=0.014)


def test_unequal_tolerances_move_the_middle_and_not_the_nominal(ran):
    study = wave_gear()
    study["links"]["e"]["tolerance"] = "-0.03..-0.01 mm"
    run = ran(study)
    assert numbers_of(run)["rss_mean"] == pytest.approx(0.085e-3, rel=1e-9)
    assert numbers_of(run)["worst_max"] == pytest.approx(0.125e-3, rel=1e-9)
    assert run.nominal_values["gap"] == pytest.approx(0.065e-3, rel=1e-9)


def test_a_source_that_enters_twice_enters_as_one(ran):
    """An eccentricity: its two components, and its size in the clearance."""
    component = {"nominal": "0 mm", "tolerance": "+-0.02 mm"}
    study = {
        "model": "dimension_chain", "trials": 20_000, "seed": 1,
        "links": {"c": "0.1 mm", "ex": component, "ey": component},
        "settings": {"gap": "c - hypot(ex, ey)"}, "limits": {"gap": ">= 0.07 mm"},
    }  # fmt: skip
    run = ran(study)
    eccentricity = 0.1e-3 - run.column("gap")
    rayleigh = 0.02e-3 / 3 * math.sqrt(math.pi / 2)
    assert eccentricity.mean() == pytest.approx(rayleigh, rel=0.02)
    found = numbers_of(run)
    assert found["worst_min"] == pytest.approx((0.1 - 0.02 * math.sqrt(2)) * 1e-3)
    assert found["worst_max"] == pytest.approx(0.1e-3)
    # neither rises nor falls alone: and linear analysis says so of itself
    caveats = {n.name: n.caveat for n in run.numbers}
    assert "ex, ey" in caveats["worst_max"]
    assert "no linear part" in caveats["rss_sigma"]
    twice = Formula("2*a - a", ("a",))
    known = answers(twice, {"a": 1.0}, {"a": Spread(-0.1, 0.1, 0.0, 0.05)})
    assert (known.worst_min, known.rss_sigma) == pytest.approx((0.9, 0.05))


FORMULAS = (
    "a + b - c*d", "a/b - c/d", "a**2 + b**-1.5 - sqrt(c)*d**3",
    "sin(a)*cos(b) + tan(c/4)", "asin(a/9) - acos(b/9) + atan(c*d)",
    "atan2(a - 2, b) + hypot(a, b, c)", "exp(-a) + log(b*c) - abs(d - 5)",
    "min(a, b, c) + 2*max(c, d)", "-(-a) + (+b) - pi*c", "3.5*(a - b)**2/(c + d)",
)  # fmt: skip


@pytest.mark.parametrize("text", FORMULAS)
def test_values_and_slopes_are_those_of_a_plain_formula(text):
    formula, rng = Formula(text, ("a", "b", "c", "d")), np.random.default_rng(1)
    known = {
        "sqrt": np.sqrt, "abs": np.abs, "exp": np.exp, "log": np.log, "sin": np.sin,
        "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos,
        "atan": np.arctan, "atan2": np.arctan2, "pi": np.pi, "min": min, "max": max,
        "hypot": math.hypot,
    }  # fmt: skip

    def plain(x):
        named = dict(zip("abcd", x, strict=True))
        return eval(text, {"__builtins__": {}}, {**known, **named})

    x = rng.uniform(0.5, 3.0, (20, 4))
    links = dict(zip("abcd", x.T, strict=True))
    values = formula.worked_out(Values(links))
    np.testing.assert_allclose(values, [plain(row) for row in x], rtol=1e-12)
    slopes = formula.worked_out(Slopes(links))
    np.testing.assert_array_equal(slopes.value, values)
    differences = [approx_fprime(row, plain, 1e-7) for row in x]
    np.testing.assert_allclose(slopes.by_link.T, differences, rtol=2e-5, atol=2e-5)


def test_the_worst_case_of_a_monotonic_formula_is_a_corner():
    rng = np.random.default_rng(4)
    for text in ("a - b/c", "a*b - sqrt(c)", "hypot(a, b) + c"):
        formula = Formula(text, ("a", "b", "c"))
        nominal = dict(zip("abc", rng.uniform(1, 2, 3), strict=True))
        ends = rng.uniform(0.1, 0.5, (3, 2)) * [-1, 1]
        spreads = {n: Spread(*ends[i], 0.0, 0.1) for i, n in enumerate("abc")}
        found = answers(formula, nominal, spreads)
        corners = np.array(list(nominal.values())) + list(product(*ends))
        values = formula.worked_out(Values(dict(zip("abc", corners.T, strict=True))))
        assert found.turning == ()
        assert found.worst_min == pytest.approx(values.min())
        assert found.worst_max == pytest.approx(values.max())


def test_the_worst_case_of_other_formulas_is_searched():
    formula = Formula("(a - 1)**2 - (b - 2)**2 + c", ("a", "b", "c"))
    nominal = {"a": 1.2, "b": 2.1, "c": 0.0}
    spread = Spread(-0.5, 0.5, 0.0, 0.2)
    found = answers(formula, nominal, dict.fromkeys("abc", spread))
    assert found.turning == ("a", "b")
    assert found.worst_min == pytest.approx(0 - 0.6**2 - 0.5, abs=1e-8)
    assert found.worst_max == pytest.approx(0.7**2 + 0.5, abs=1e-8)


REFUSED = {
    "R_out - R_inn": r"character 9, 'R_inn': \[links\] has no R_inn; did you mean",
    "R_out/(d - 5*e)": r"'d - 5\*e': division by zero",
    "__import__('os').system('id')": "is not a function here",
    "R_out.real": "links, numbers",
    "(lambda: 0)()": "is not a function here",
    "[e for e in (d,)]": "links, numbers",
    "R_out if e else d": "links, numbers",
    "e < d": "links, numbers",
    "(e := d)": "links, numbers",
    "f'{e}'": "links, numbers",
    "R_out - 2": "character 9, '2': a plain number cannot be taken from",
    "e + d**2": "a quantity in m\\^2 cannot be added to a quantity in m",
    "sin(e)*d": "sin takes an angle, or a ratio such as arc over radius, not a quant",
    "R_out^2": r"a power is written \*\*",
    "e**d": "an exponent is a plain number",
    "e**99": "an exponent is a plain number",
    "9**9**9*e": "an exponent is a plain number",
    "e*1e999": "too large",
    "abs(e, d)": "abs takes 1 value",
    "hypot(*e)": "hypot takes 2 to 3 values",
    "min(e, key=d)": "min takes 2 to 9 values",
    "hypot": "hypot is a function",
    "sqrt(e - d)": "the root of less than nothing",
    "R_out - ": "cannot be read at character 7",
    "": "is empty",
    "2 + 3": "names no link",
    "R_out # - e": "character 7: a formula has no comments",
    "'e'": "is not a number",
    "True*e": "is not a number",
    "e" + " + e" * 400: "1000",
    "-" * 900 + "e": "too deeply nested|nested operations",
    "(" * 300 + "e" + ")" * 300: "too|cannot be read",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: text[:30])
def test_wrong_formulas_are_refused_with_place_and_reason(text):
    with pytest.raises(ModelError, match=REFUSED[text]):
        Settings(gap=text)


def test_formulas_are_never_executed(monkeypatch):
    for name in ("eval", "exec", "compile"):
        # the parser of ast is not the compiler of code
        monkeypatch.setattr(f"builtins.{name}", _parsing_alone)
    formula = Formula("hypot(a, b)", ("a", "b"))
    assert formula.worked_out(Values({"a": 3.0, "b": 4.0})) == 5


def _parsing_alone(source, filename, mode, flags=0, *others, **more):
    assert flags & ast.PyCF_ONLY_AST
    return COMPILE(source, filename, mode, flags, *others, **more)


COMPILE = compile


E = {"nominal": "2 mm"}
WRONG = (
    ({"links": {"e": {"tolerance": "+-1 mm"}}}, r"\[links\] e.*nominal is missing"),
    ({"links": {"e": {**E, "tolerance": "+-1 N"}}}, r"\[links\] e.*another kind"),
    ({"links": {"e": {**E, "tolerances": "+-1 mm"}}}, r"\[links\] e.*no key toleranc"),
    ({"links": {"e": "2 ells"}}, "unknown unit 'ells'"),
    ({"links": {"e": True}}, "expected a link such as"),
    ({"links": {"e": E, "gap": "2 mm"}}, "gap is given twice"),
    (
        {"links": {"e": E}, "deviations": {"e": "+-1 mm"}},
        r"\[links\] e.*\[deviations\]",
    ),
    ({"links": {"e": E}, "settings": {"gap": "e", "links": {"e": E}}}, "links once"),
    ({"links": {"e": E, "in": "2 mm"}}, "a link cannot be called 'in'"),
    ({"links": {"e": E, "R-out": "2 mm"}}, "a link cannot be called 'R-out'"),
    ({"links": {"e": E, "\u00b5": "2 mm"}}, "a link cannot be called"),
    ({"links": {"e": E}, "model": "stand"}, "model 'stand' has no links"),
)


@pytest.mark.parametrize("change, words", WRONG)
def test_a_wrong_link_is_refused_by_name(change, words):
    with pytest.raises(StudyError, match=words):
        load(wave_gear(**{"settings": {"gap": "e"}, "limits": {}, **change}))


def test_a_trial_without_value_fails_with_a_message(ran):
    of = {"tolerance": "+-1 mm", "distribution": "uniform"}
    study = {
        "model": "dimension_chain", "trials": 400, "seed": 1,
        "links": {"a": {"nominal": "0.5 mm", **of}, "b": "1 mm"},
        "settings": {"gap": "sqrt(a*b)"}, "limits": {"gap": ">= 0 mm"},
    }  # fmt: skip
    run = ran(study)
    bad = run.column("a") < -0.5e-3
    assert 0 < bad.sum() == run.failures["the formula has no value"]
    worst = next(n for n in run.numbers if n.name == "worst_min")
    assert np.isnan(worst.value) and "has no value" in worst.caveat


def test_grades_refer_to_the_nominal_of_a_link(ran):
    study = wave_gear()
    study["links"]["d"] = {"nominal": "10 mm", "tolerance": "IT7"}
    lower, upper = ran(study).assumed["d"].tolerance
    assert upper - lower == pytest.approx(15e-6)


def test_a_stored_trial_is_replayed_bit_for_bit(ran):
    run = ran(v_track())
    assert tolstat.replay(run, 17).differences == ()


def test_units_of_arcs_and_angles():
    links = {"r": {"nominal": (0.1, "m")}, "phi": {"nominal": (0.2, "rad")}}
    for text, unit in (
        ("r*phi + r", "m"), ("2*phi - asin(0.1)", "rad"), ("r**2*phi", "m^2"),
        ("1 - phi**2/2", "1"), ("max(r - 2*r, 0) + 0", "m"), ("pi/2 - phi", "rad"),
        ("pi*r", "m"),
        ("r/(phi*r)", "1"), ("sqrt(r*r)", "m"),
    ):  # fmt: skip
        settings = make(DimensionChain(), {"links": links, "gap": text})
        assert settings.unit_of(settings.formulas["gap"]) == unit, text


def test_sigma_of_any_distribution_is_that_of_its_formula(ran):
    study = wave_gear()
    study["links"]["e"] |= {"distribution": "normal", "cp": 1.5}
    study["links"]["d"]["distribution"] = "triangular"
    known = (0.03**2 / 12 + 0.02**2 / 12 + (0.01 / 4.5) ** 2 + 0.005**2 / 6) ** 0.5
    assert numbers_of(ran(study))["rss_sigma"] == pytest.approx(1e-3 * known, rel=1e-9)


def test_the_middle_of_a_tolerance_is_not_the_mean(ran):
    """A mean shifted off the middle, and a link that is constant off its nominal."""
    study = wave_gear()
    study["links"]["e"] |= {"distribution": "normal", "shift": "0.004 mm"}
    study["links"]["d"] = {
        "nominal": "10 mm", "distribution": "constant", "value": "0.002 mm",
    }  # fmt: skip
    found = numbers_of(ran(study))
    assert found["rss_mean"] == pytest.approx((0.065 - 0.004 - 0.002) * 1e-3, rel=1e-9)
    assert found["worst_max"] == pytest.approx((0.105 - 0.005 - 0.002) * 1e-3, rel=1e-9)


def test_correlated_links_have_no_root_sum_square(ran):
    study = wave_gear(correlation={"R_out": {"R_in": 0.9}})
    run = ran(study)
    assert [n.name for n in run.numbers] == ["worst_min", "worst_max", "rss_mean"]
    assert "correlations are ignored" in run.numbers[0].caveat


def test_a_link_missing_from_the_formula_is_named(ran):
    study = wave_gear()
    study["links"]["washer"] = {"nominal": "1 mm", "tolerance": "+-0.1 mm"}
    assert all("washer not in the formula" in n.caveat for n in ran(study).numbers)


def test_the_worst_of_many_eccentricities_is_found():
    """Convex in each, and more links than corners are looked at."""
    pairs = [(f"x{i}", f"y{i}") for i in range(6)]
    names = ("c", *(name for pair in pairs for name in pair))
    formula = Formula("c" + "".join(f" - hypot({x}, {y})" for x, y in pairs), names)
    rng = np.random.default_rng(2)
    ends = {n: np.sort(rng.uniform(0.005, 0.03, 2) * [-1, 1]) for n in names[1:]}
    spreads = {n: Spread(*e, 0.0, 0.005) for n, e in ends.items()}
    nominal = {n: 1.0 * (n == "c") for n in names}
    far = {n: np.abs(e).max() for n, e in ends.items()}
    found = answers(formula, nominal, spreads)
    known = 1 - sum(math.hypot(far[x], far[y]) for x, y in pairs)
    assert found.worst_min == pytest.approx(known, abs=1e-9)
    assert found.worst_max == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "least", "largest"),
    [
        ("abs({s})", 0.0, 2.1), ("({s})*({s})", 0.0, 2.1**2),
        ("({s})*({c})", -0.3 * 2.1, 2.1**2), ("hypot({s}, {c})", 0.0, 2.1 * 2**0.5),
        ("1/(({s})*({s}))", math.nan, math.nan), ("2*({s}) + ({c})", -0.9, 6.3),
    ],
)  # fmt: skip
def test_a_sum_of_many_links_passes_zero_in_few_corners(text, least, largest):
    """No point tried does: 0.9 from 12 links of +-0.1, 24 in all."""
    names = [f"{kind}{i}" for kind in "sc" for i in range(12)]
    sums = {
        kind: "+".join(f"{kind}{i}" for i in range(6))
        + "".join(f"-{kind}{i}" for i in range(6, 12))
        for kind in "sc"
    }
    nominal = {name: 1.15 if int(name[1:]) < 6 else 1.0 for name in names}
    spreads = {name: Spread(-0.1, 0.1, 0.0, 0.03) for name in names}
    formula = Formula(text.format(**sums), tuple(names))
    found = answers(formula, nominal, spreads)
    worst = found.worst_min, found.worst_max
    assert worst == pytest.approx((least, largest), abs=1e-6, nan_ok=True)


def test_a_formula_with_a_kink_has_a_worst_case():
    spread = Spread(-0.1, 0.1, 0.0, 0.03)
    formula = Formula("c - sqrt(x**2 + y**2)", ("c", "x", "y"))
    found = answers(formula, {"c": 1.0, "x": 0.0, "y": 0.0}, {"x": spread, "y": spread})
    assert found.worst_min == pytest.approx(1 - math.hypot(0.1, 0.1))
    assert found.worst_max == pytest.approx(1.0, abs=1e-4)
    steep = Formula("sqrt(R**2 - x**2)", ("R", "x"))
    found = answers(steep, {"R": 1.0, "x": 0.9}, {"x": spread})
    assert found.worst_min == pytest.approx(0.0, abs=1e-6)
    assert found.worst_max == pytest.approx(math.sqrt(1 - 0.8**2))


def test_measured_links_are_deviations_from_the_nominal(ran, tmp_path):
    sizes = 10 + 0.001 * np.random.default_rng(1).normal(size=40)
    lines = "\n".join(f"{size:.6f}" for size in sizes)
    (tmp_path / "balls.csv").write_text(f"ball [mm]\n{lines}\n")
    (tmp_path / "chain.toml").write_text(
        'model = "dimension_chain"\ntrials = 2000\nseed = 1\nsettings.gap = "A - d"\n'
        'links.A = "10.05 mm"\n'
        'links.d = { nominal = "10 mm", data = "balls.csv", column = "ball" }\n'
    )
    run = tolstat.run(tmp_path / "chain.toml", output=tmp_path / "balls.h5")
    assert 1e3 * run.column("gap").mean() == pytest.approx(0.05, abs=5e-4)
    assert run.nominal_values["gap"] == pytest.approx(0.05e-3)


@pytest.mark.parametrize("text", ["h*tan(g)", "h/(g - 1.5)", "1/(g*g - 2.25)"])
def test_across_a_pole_there_is_no_worst_case(text):
    spreads = {"g": Spread(-0.2, 0.23, 0.0, 0.1)}
    for part in ({}, {"h": Spread(-0.1, 0.1, 0.0, 0.03)}):  # alone, and with another
        formula, nominal = Formula(text, ("h", "g")), {"h": 1.0, "g": 1.49}
        found = answers(formula, nominal, {**spreads, **part})
        assert math.isnan(found.worst_min) and math.isnan(found.worst_max)


def test_the_worst_case_does_not_depend_on_the_unit():
    """An eccentricity of some um, beside links that deviate as little."""
    formula = Formula("(D - d)/2 - hypot(ex, ey)", ("D", "d", "ex", "ey"))
    for unit in (1.0, 1e-3, 1e-6):
        part = Spread(-2e-3 * unit, 2e-3 * unit, 0.0, 1e-3 * unit)
        off = Spread(-3e-3 * unit, 3e-3 * unit, 0.0, 1e-3 * unit)
        nominal = {"D": 30.0 * unit, "d": 29.98 * unit, "ex": 0.0, "ey": 0.0}
        found = answers(formula, nominal, {"D": part, "d": part, "ex": off, "ey": off})
        assert found.worst_max == pytest.approx(0.012 * unit, rel=1e-4)
        worst = (0.008 - 0.003 * math.sqrt(2)) * unit
        assert found.worst_min == pytest.approx(worst, rel=1e-6)


def exact(**changes):
    """A chain whose gap is nothing where all links are nominal."""
    sizes = {"a": 72.5, "b": 16, "c": 16, "d": 38, "e": 2.5}
    return {
        "model": "dimension_chain", "trials": 200, "seed": 1,
        "settings": {"gap": "a - b - c - d - e"}, "limits": {"gap": ">= 0 mm"},
        "links": {n: {"nominal": f"{x} mm", "tolerance": "+-0.1 mm"}
                  for n, x in sizes.items()},
        **changes,
    }  # fmt: skip


def test_a_rounding_error_of_the_links_is_no_gap(ran):
    """72.5 - 16 - 16 - 38 - 2.5 is 0, and -4.8e-15 in binary numbers."""
    run = ran(exact())
    assert run.nominal["gap"] == 0.0
    numbers = {each.name: run.scale_of(each).words(each.value) for each in run.numbers}
    assert numbers["rss_mean"] == "0 mm"
    nominal = tolstat.replay(run, None).responses["gap"]
    assert nominal.value == 0.0 and not nominal.out_of_limit
    # what is more than a rounding error stays
    links = exact()["links"]
    links["a"]["nominal"] = "72.500000000001 mm"
    tiny = ran(exact(links=links)).nominal["gap"]
    assert tiny == pytest.approx(1e-15, rel=0.05)


def test_a_formula_without_a_slope_keeps_its_values(ran):
    """At its tip a root has no slope: nothing is known of its rounding."""
    study = exact(settings={"gap": "sqrt((a - a) * b) + a"})
    assert ran(study).nominal["gap"] == 0.0725


@pytest.mark.parametrize("bent", ["abs(S)", "S*S/1 mm", "hypot(S, S)"])
def test_a_slope_that_is_a_rounding_error_is_none(bent):
    """Of 44 equal links: by symmetry neither side of the nominal is preferred."""
    names = [f"p{i}" for i in range(44)]
    links = {n: {"nominal": "10 mm", "tolerance": "+-0.1 mm"} for n in ["a", *names]}
    gap = bent.replace("S", f"({'+'.join(names[::2])}-{'-'.join(names[1::2])})")
    study = {"model": "dimension_chain", "trials": 8, "seed": 1, "links": links}
    tables = []
    for text in (gap, f"a + {gap}"):
        read = load({**study, "settings": {"gap": text}})
        usual = np.full(45, 0.1e-3 / 3)
        with Workers() as crew:
            tables.append(slopes(read.model, read.settings, usual, crew)[:, 0])
        spreads = dict.fromkeys(links, Spread(-1e-4, 1e-4, 0.0, 0.1e-3 / 3))
        (formula,) = read.settings.formulas.values()
        found = answers(formula, read.settings.nominal, spreads)
        assert not any(found.effects.get(name) for name in names)
        if text == gap:
            assert found.no_linear_part and math.isnan(found.rss_sigma)
    assert found.rss_sigma == pytest.approx(0.1e-3 / 3)
    assert not tables[0].any() and not tables[1][1:].any()
    assert tables[1][0] == pytest.approx(1.0)


def test_a_share_that_is_a_rounding_error_is_none(ran):
    """A link that takes itself away has no share in the variance."""
    study = exact(settings={"gap": "a - b + 0.3*c - 0.1*c - 0.2*c"})
    run = ran(study)
    (share,) = (each for each in run.numbers if each.name == "share_c")
    assert share.value == 0


@pytest.mark.parametrize(
    ("formula", "links", "unit"),
    [
        ("r*w", {"r": "10 mm", "w": "60 rpm"}, "m/s"),
        ("r*w**2", {"r": "10 mm", "w": "60 rpm"}, "m/s^2"),
        ("r*phi", {"r": "10 mm", "phi": "3 deg"}, "m"),
        ("phi/t", {"phi": "3 deg", "t": "3 s"}, "rad/s"),
        ("w*t", {"w": "60 rpm", "t": "3 s"}, "rad"),
        ("F/x", {"F": "3 N", "x": "1 mm"}, "N/m"),
        ("c*phi/r", {"c": "3 N m/rad", "phi": "2 deg", "r": "1 m"}, "N"),
        ("U/I", {"U": "3 V", "I": "20 mA"}, "ohm"),
        ("L*a*dT", {"L": "3 mm", "a": "11.5e-6 1/K", "dT": "40 degC"}, "m"),
    ],
)
def test_units_of_products_are_those_that_people_use(formula, links, unit):
    """An angle beside what has none is a plain number; beside time it is a speed."""
    study = {"model": "dimension_chain", "trials": 8, "seed": 1, "links": links}
    (gap,) = load({**study, "settings": {"gap": formula}}).description.responses
    assert gap.unit == unit
    assert gap.shown == ("N/mm" if unit == "N/m" else "")


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("a - b - 0.5 mm", 5e-4),
        ("a - b - 500um", 5e-4),
        ("a - b*(1 + 1e-3) - 1e-3*b", 0.982e-3),
        ("sqrt((a - b)**2 + (4 mm)**2 - 4**2*(1 mm)**2)", 1e-3),
        ("max(a, 11 mm) - b - 0 mm", 2e-3),
        ("ceil((a - b)/0.3 mm)*0.3 mm", 12e-4),
        ("if(a - b > 0.1 in, a, 2*b)", 18e-3),
        ("m - 5*b - 5 mm", 5e-2),  # m is a link here
    ],
)
def test_numbers_with_units(formula, value):
    links = {"a": "10 mm", "b": "9 mm", "m": "100 mm"}
    text = Formula(formula, tuple(links))
    numbers = {name: quantity(size, "m") for name, size in links.items()}
    assert text.worked_out(Values(numbers)) == pytest.approx(value, rel=1e-12)
    kind = text.worked_out(Dimensions(dict.fromkeys(links, "m")))
    assert kind.unit == "m"


@pytest.mark.parametrize(
    ("formula", "reason"),
    [
        ("a - 0.5 foo", "unknown unit 'foo'"),
        ("a - 0.5 m", "cannot be read at character 9"),
        ("a - 5 deg", "in rad cannot be taken from a quantity in m"),
        ("a - 0,5*m", "one number or two; write 0.5 or, for two values, 0, 5"),
        ("min(a - m, 0,5 mm)", "one number or two"),
        ("sqrt(a**2 + 4 mm**2)", r"write \(4 mm\)\*\*"),
        ("a + m*(20 degC)/(1 K)", "write K, or make it a link"),
        ("a + 5 N/mm", "mm is a unit"),
        ("if(a > m; a; m)", "commas between the values of a function"),
    ],
)
def test_wrong_numbers_with_units(formula, reason):
    with pytest.raises(ModelError, match=reason):
        Formula(formula, ("a", "m")).worked_out(Dimensions({"a": "m", "m": "m"}))


def test_temperatures_of_two_scales_are_not_mixed():
    links = {"a": "293 K", "b": "20 degC"}
    study = {"model": "dimension_chain", "trials": 8, "seed": 1, "links": links}
    with pytest.raises(StudyError, match="a in K and b in degC: both are differences"):
        load({**study, "settings": {"gap": "a - b"}})


def values_of(formula, **links):
    """The gap and its slopes by each link, of plain numbers."""
    numbers = {name: np.float64(value) for name, value in links.items()}
    read = Formula(formula, tuple(links))
    assert read.worked_out(Dimensions(dict.fromkeys(links, "1"))).unit == "1"
    slope = read.worked_out(Slopes(numbers))
    value = read.worked_out(Values(numbers, strict=True))
    assert slope.value == pytest.approx(value)
    return value, slope.by_link.tolist()


@pytest.mark.parametrize(
    ("formula", "links", "value", "slopes"),
    [
        ("floor(x)", {"x": 2.7}, 2, [0]),
        ("ceil(x)", {"x": 2.2}, 3, [0]),
        ("round(x)", {"x": 2.7}, 3, [0]),
        ("sign(x)", {"x": -2.7}, -1, [0]),
        ("tanh(x)", {"x": 0.5}, math.tanh(0.5), [1 - math.tanh(0.5) ** 2]),
        ("mod(x, y)", {"x": 7.5, "y": 2.0}, 1.5, [1, -3]),
        ("if(x < y, x, 2*y)", {"x": 1.0, "y": 2.0}, 1, [1, 0]),
        ("if(x >= y, x, 2*y)", {"x": 1.0, "y": 2.0}, 4, [0, 2]),
        ("IF (x > 0, sqrt(x), 0)", {"x": -1.0}, 0, [0]),
        ("x**n", {"x": 3.0, "n": 2.0}, 9, [6, 9 * math.log(3)]),
        ("x**(n - 1)", {"x": 3.0, "n": 3.0}, 9, [6, 9 * math.log(3)]),
    ],
)
def test_functions_that_step_or_choose(formula, links, value, slopes):
    result, by_link = values_of(formula, **links)
    assert result == pytest.approx(value)
    assert by_link == pytest.approx(slopes)


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("if(x, x, y)", "a comparison is expected, with < <= > >="),
        ("if(x < y < 3, x, y)", "a comparison is expected"),
        ("if(x < y, x)", "IF takes 3 values"),
        ("x < y", "links, numbers, + - * / ** and functions are allowed"),
        ("if(x < L, x, y)", "does not go with"),
        ("if(x < y, x, L)", "does not go with"),
        ("floor(L)", "floor takes a plain number"),
        ("mod(x, L)", "does not go with"),
        ("L**x", "an exponent is a plain number, and so is the base"),
        ("x**L", "an exponent is a plain number, and so is the base"),
        ("x**1e9", "an exponent is a plain number from -10 to 10"),
    ],
)
def test_functions_that_are_misused(formula, words):
    links = {"x": "1", "y": "2", "L": "3 mm"}
    study = {"model": "dimension_chain", "trials": 8, "seed": 1, "links": links}
    with pytest.raises(StudyError) as refused:
        load({**study, "settings": {"gap": formula}})
    assert words in str(refused.value)


def test_shims_leave_a_uniform_play(tmp_path):
    """A space of 1.50 +-0.15 mm, shims of 0.05 mm that leave at least 0.05 mm."""
    space = {"nominal": "1.5 mm", "tolerance": "+-0.15 mm", "distribution": "uniform"}
    links = {"space": space, "step": "0.05 mm", "least": "0.05 mm"}
    study = {"model": "dimension_chain", "trials": 20_000, "seed": 1, "links": links}
    gap = "space - step*floor((space - least)/step)"
    study |= {"settings": {"gap": gap}, "limits": {"gap": "0.05..0.1 mm"}}
    run = tolstat.run(study, output=tmp_path / "shims.h5")
    play = 1e3 * run.column("gap")
    assert stats.kstest(play, stats.uniform(0.05, 0.05).cdf).pvalue > 1e-3
    assert float(run.nominal["gap"]) == pytest.approx(0.05e-3)  # 1.5/0.05 is 30
    (warning,) = tolstat.summary(run).warnings
    assert "floor((space - least) / step) jumps within" in warning.sentence
    assert "passes whole numbers" in warning.sentence


def test_a_link_without_effect_at_any_point_tried_is_searched():
    """It may have one between them: a narrow bump, of which slopes show nothing."""
    formula = Formula(
        "c - max(0, 0.001 - hypot(a - 0.613, b - 0.372))", ("a", "b", "c")
    )
    spread = Spread(-1.0, 1.0, 0.0, 0.3)
    found = answers(formula, dict.fromkeys("abc", 0.0), dict.fromkeys("abc", spread))
    assert found.turning == ("a", "b")

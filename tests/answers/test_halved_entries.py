"""Commands that halve the tolerance of a cause, each run as it is printed."""

from __future__ import annotations

import re
import shlex
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from click.testing import CliRunner

import tolstat
from tests.conftest import ROOT
from tolstat.answers.allocate import search
from tolstat.answers.halved_entries import halved_entries
from tolstat.answers.next_steps import to_allocate, to_halve
from tolstat.answers.report.chosen_steps import halving_of
from tolstat.answers.report.finding_words import next_steps
from tolstat.answers.report.first_page import remedy_cell
from tolstat.answers.report.report_answer import StepKind
from tolstat.cli.main import main
from tolstat.render.screen import as_text
from tolstat.study.study import load

# the entry of a link, half of it about its middle (a lognormal distribution begins at
# its lower end), and a limit that its parts often miss
ENTRIES = {
    "normal": ({"tolerance": "+-0.4 mm"}, "+-0.2 mm", "<= 0.2 mm"),
    "capability": (
        {"tolerance": "+-0.4 mm", "cp": 1.33, "shift": "0.05 mm"},
        {"tolerance": "+-0.2 mm", "cp": 1.33, "shift": "0.025 mm"}, "<= 0.2 mm"),
    "uniform": (
        {"tolerance": "-0.2..0.4 mm", "distribution": "uniform"},
        {"tolerance": "-0.05..0.25 mm", "distribution": "uniform"}, "<= 0.25 mm"),
    "triangular": (
        {"tolerance": "+-0.4 mm", "distribution": "triangular", "mode": "0.2 mm"},
        {"tolerance": "+-0.2 mm", "distribution": "triangular", "mode": "0.1 mm"},
        "<= 0.3 mm"),
    "trapezoidal": (
        {"tolerance": "0..0.4 mm", "distribution": "trapezoidal",
         "plateau": "0.1..0.2 mm"},
        {"tolerance": "0.1..0.3 mm", "distribution": "trapezoidal",
         "plateau": "0.15..0.2 mm"}, "<= 0.3 mm"),
    "lognormal": (
        {"tolerance": "0.1..0.4 mm", "distribution": "lognormal", "median": "0.2 mm"},
        {"tolerance": "0.1..0.25 mm", "distribution": "lognormal",
         "median": "0.15 mm"}, "<= 0.3 mm"),
    "shifted": (
        {"tolerance": "+-0.4 mm", "nominal_shift": "0.05 mm"},
        {"tolerance": "+-0.2 mm", "nominal_shift": "0.05 mm"}, "<= 0.3 mm"),
    "one side": ({"tolerance": "-0.4..0 mm"}, "-0.3..-0.1 mm", ">= -0.3 mm"),
    "grade": ({"tolerance": "h12"}, "-0.1875..-0.0625 mm", ">= -0.2 mm"),
    "clipped": (
        {"tolerance": "+-0.4 mm", "distribution": "truncated_normal", "cp": 0.5,
         "outside": "clipped"},
        {"tolerance": "+-0.2 mm", "distribution": "truncated_normal", "cp": 0.5,
         "outside": "clipped"}, "<= 0.35 mm"),
}  # fmt: skip


def chain(tmp_path, entry, limit, trials=4000):
    study = tmp_path / "chain.toml"
    links = {"a": {"nominal": "50 mm", **entry}, "b": {"nominal": "50 mm"}}
    links["b"]["tolerance"] = "+-0.02 mm"
    text = ['model = "dimension_chain"', f"trials = {trials}", "seed = 1"]
    text += ['settings.gap = "a - b"', f'limits.gap = "{limit}"', "[links]"]
    for name, link in links.items():
        keys = ", ".join(f'{k} = "{v}"' if isinstance(v, str) else f"{k} = {v}"
                         for k, v in link.items())  # fmt: skip
        text.append(f"{name} = {{ {keys} }}")
    study.write_text("\n".join(text))
    return tolstat.run(study)


def typed(command):
    done = CliRunner().invoke(main, shlex.split(command)[1:])
    assert done.exit_code in (0, 3), done.output
    return done.output


@pytest.mark.parametrize("kind", ENTRIES)
def test_the_printed_command_halves_as_the_number_promises(tmp_path, kind):
    entry, half, limit = ENTRIES[kind]
    run = chain(tmp_path, entry, limit)
    shown = CliRunner().invoke(main, ["show", str(run.path)]).output
    command, again = re.findall("^   (tolstat (?:what-if|run) .*)$", shown, re.M)[:2]
    assert typed(command).partition("run it: ")[2].strip() == again
    study = tomllib.loads((tmp_path / "chain-halved.toml").read_text())
    wanted = half if isinstance(half, dict) else {"tolerance": half}
    assert study["links"]["a"] == {"nominal": "50 mm", **wanted}
    typed(f"{again} --trials 100000")
    (fresh,) = tolstat.summary(tmp_path / "chain-halved.h5").limits.values()
    promised = tolstat.summary(run).responses["gap"].causes.main.halved
    found = fresh.yields.fraction_out_of_limit
    if promised.value == promised.value:
        assert found.upper >= promised.lower and found.lower <= promised.upper


def test_measured_parts_have_no_tolerance_to_halve(tmp_path):
    sizes = "\n".join(str(50 + i * 0.01) for i in range(-40, 41))
    (tmp_path / "parts.csv").write_text(f"size [mm]\n{sizes}\n")
    run = chain(tmp_path, {"data": "parts.csv", "column": "size"}, "<= 0.3 mm")
    assert not to_halve(run, ["a"])


# the middles meet the limits with half the widths, the zones as drawn do not: ppm by
# NumPy, 4 million trials. A zone that narrows to an end moves the mean out of limit
FITS = {
    "two-sided": (
        {"a": {"tolerance": "H7"},
         "b": {"tolerance": "-20..-7 um", "distribution": "uniform"}},
        {"limit": "12..33 um", "ppm": 500}, 44_035, 38),
    "one-sided": (
        {"a": {"tolerance": "H7"}, "b": {"tolerance": "-20..-7 um"}},
        {"limit": ">= 16 um", "ppm": 1000}, 25_970, 53),
    "with places": (
        {"a": {"tolerance": "0.1..0.3 mm", "distribution": "trapezoidal",
               "plateau": "0.15..0.25 mm"},
         "b": {"tolerance": "-0.2..0 mm", "distribution": "triangular",
               "mode": "-0.18 mm"}},
        {"limit": "0.22..0.45 mm"}, 71_540, 786),
}  # fmt: skip


def fit(kind):
    links, limit, *shares = FITS[kind]
    study = {
        "model": "dimension_chain", "trials": 40_000, "seed": 1,
        "settings": {"gap": "a - b"}, "limits": {"gap": limit},
        "links": {n: {"nominal": "25 mm", **keys} for n, keys in links.items()},
    }  # fmt: skip
    return study, *shares


@pytest.mark.parametrize("kind", FITS)
def test_half_the_widths_about_the_same_middles_meet_the_limit(tmp_path, kind):
    study, now, then = fit(kind)
    run = tolstat.run(study, output=tmp_path / "fit.h5")
    (limited,) = tolstat.summary(run).limits.values()
    found = limited.yields.fraction_out_of_limit
    assert found.lower <= now * 1e-6 <= found.upper
    if both := run.diagnostics.halved["gap"].get(("a", "b")):  # named as one cause
        assert both.beyond.lower <= then * 1e-6 <= both.beyond.upper
    entries = halved_entries(run, ["a", "b"])
    fresh = tolstat.fresh_study(run, entries)
    table = tomllib.loads(fresh) | {"trials": 40_000}
    again = tolstat.run(table, output=tmp_path / "half.h5")
    (limited,) = tolstat.summary(again).limits.values()
    found = limited.yields.fraction_out_of_limit
    assert limited.yields.verdict == "met"
    assert found.lower <= then * 1e-6 <= found.upper


@pytest.mark.parametrize("kind", FITS)
def test_a_search_finds_tolerances_about_the_same_middles(kind, monkeypatch):
    monkeypatch.setattr(search, "CURVE", np.array([]))  # less to be searched
    monkeypatch.setattr(search, "BISECTIONS", 1)
    study, *_ = fit(kind)
    drawn = {
        n: each.tolerance for n, each in load(study).deviating.distributions.items()
    }
    for name, zone in drawn.items():
        at = f"+-{zone.half * 1e3:.9g} mm"
        study["links"][name]["cost"] = {"law": "reciprocal", "at": at, "price": 1}
    found = tolstat.allocate(study, trials=4000 if kind == "with places" else None)
    assert found.met
    written = load(tomllib.loads(found.study_file())).deviating.distributions
    for name, zone in drawn.items():
        new = written[name].tolerance
        assert new.half < zone.half
        assert new.middle == pytest.approx(zone.middle, abs=0.01 * zone.half)


THREE = {
    "model": "dimension_chain", "trials": 1000, "seed": 1,
    "settings": {"gap": "H - a - b"}, "limits": {"gap": "0.4..0.6 mm"},
    "links": {
        "H": {"nominal": "50 mm", "tolerance": "+-0.3 mm"},
        "a": {"nominal": "30 mm", "tolerance": "-0.2..0.2 mm"},
        "b": {"nominal": "19.5 mm", "tolerance": "+-0.02 mm"},
    },
}  # fmt: skip


def lines(run):
    """The commands that the summary of a run suggests, in their order."""
    shown = CliRunner().invoke(main, ["show", str(run.path)]).output
    shown = re.sub(r" \\\n +", " ", shown)
    return re.findall("^   (tolstat .*)$", shown, re.MULTILINE)


def test_the_search_for_tolerances_is_written_with_prices(tmp_path):
    study, path = deepcopy(THREE), tmp_path / "three.toml"
    study["limits"]["gap"] = {"limit": "0.42..0.58 mm", "yield": "80 %"}
    path.write_text(tomli_w.dumps(study))
    write, search = lines(tolstat.run(path))
    typed(write)
    place = shlex.split(search)[2]
    priced = load(Path(place)).deviating.priced
    prices = {each.name: each.cost(each.specified_choice) for each in priced}
    assert prices == {"H": pytest.approx(1), "a": pytest.approx(1)}
    study["links"]["H"]["cost"] = {"law": "reciprocal", "at": "+-0.3 mm", "price": 3}
    path.write_text(tomli_w.dumps(study))
    *_, search = lines(tolstat.run(path, force=True))
    assert search.split()[1:3] == ["allocate", str(path)]


def test_a_step_says_that_halving_is_too_little(tmp_path):
    found = tolstat.summary(tolstat.run(THREE, output=tmp_path / "three.h5"))
    assert found.responses["gap"].causes.main.halved.lower > 0.0027
    halve, *_ = found.findings.steps
    assert halve.kind is StepKind.HALVE
    assert found.findings.limits["gap"].halving.still_missed
    (halve, *_) = [as_text(each) for each in next_steps(found)]
    assert ", still not met." in halve


def test_a_class_of_gears_halves_as_its_zone_and_a_full_turn_stays(tmp_path):
    path = tmp_path / "grades.h5"
    run = tolstat.run(ROOT / "runs/khpt75-grades.toml", trials=16, output=path)
    command, _ = to_halve(run, ["runout_7", "runout_phase_7", "tooth_position_1"])
    name, *entries = shlex.split(command)[1:5]
    zone = run.assumed["tooth_position_1"].tolerance[1] * 1e6
    assert name == "what-if" and "runout_phase" not in command
    assert f"tooth_position_1=+-{zone / 2:g} um" in entries
    (runout,) = (each for each in entries if each.startswith("runout_7"))
    typed(command)
    written = tomllib.loads((tmp_path / "grades-halved.toml").read_text())
    entry = {"tolerance": runout.partition("=")[2], "distribution": "weibull"}
    assert written["deviations"]["runout_7"] == {**entry, "shape": 2}
    both, _ = to_halve(run, ["tooth_position_1", "tooth_position_2"])
    assert "'tooth_position=+-" in both


def test_the_next_step_says_why_a_cause_cannot_be_halved(tmp_path):
    sizes = "\n".join(str(50 + i * 0.01) for i in range(-40, 41))
    (tmp_path / "parts.csv").write_text(f"size [mm]\n{sizes}\n")
    entry = {"data": "parts.csv", "column": "size"}
    found = tolstat.summary(chain(tmp_path, entry, "<= 0.3 mm"))
    assert StepKind.NOT_HALVED in [step.kind for step in found.findings.steps]
    said = [as_text(each) for each in next_steps(found)]
    assert "a cannot be halved: it has no tolerance." in said


KEYED = {
    "plateau": {"distribution": "trapezoidal", "plateau": "+-0.15 mm"},
    "mode": {"distribution": "triangular", "mode": "0.18 mm"},
    "median": {"distribution": "lognormal", "median": "0.1 mm"},
    "shift": {"shift": "-0.15 mm"},
    "moved": {"shift": "0.15 mm", "nominal_shift": "0.1 mm"},
}


@pytest.mark.parametrize("key", KEYED)
def test_a_price_that_is_proposed_fits_the_other_keys(tmp_path, key):
    run = chain(tmp_path, {"tolerance": "+-0.2 mm", **KEYED[key]}, "<= 0.1 mm")
    write, _ = to_allocate(run, ["a"])
    typed(write)
    (priced,) = load(tmp_path / "chain-priced.toml").deviating.priced
    assert priced.cost(priced.specified_choice) == pytest.approx(1)


def test_a_price_is_proposed_though_the_mean_lies_near_an_end(tmp_path):
    """The shift of the mean moves with the tolerance, as a plateau does."""
    entry = {"tolerance": "+-0.2 mm", "shift": "0.195 mm"}
    run = chain(tmp_path, entry, "<= 0.1 mm")
    write, _ = to_allocate(run, ["a"])
    typed(write)
    (priced,) = load(tmp_path / "chain-priced.toml").deviating.priced
    tightest, _ = priced.ends
    (narrow,) = priced.distributions(tightest).values()
    assert narrow.shift == pytest.approx(0.195e-3 / 4)


@pytest.mark.parametrize(
    ("key", "limit"),
    [
        ("plateau", "<= 0.1 mm"), ("mode", "-0.06..0.18 mm"),
        ("shift", "-0.25..-0.05 mm"),
    ],
)  # fmt: skip
def test_the_table_names_no_tolerance_that_is_refused_alone(tmp_path, key, limit):
    run = chain(tmp_path, {"tolerance": "+-0.2 mm", **KEYED[key]}, limit)
    found = tolstat.summary(run).responses["gap"]
    halving = halving_of(run, found, found.limited)
    assert halving.tolerance == ""
    said = as_text(remedy_cell(halving).main)
    assert said in ("halve a", "halve a and b")  # not "to +-0.1 mm"


def test_links_whose_deviation_stands_elsewhere(tmp_path):
    """`bearing_1 = "20 mm"` is a nominal value; [deviations] has its tolerance."""
    study = {
        "model": "dimension_chain", "trials": 500, "seed": 1,
        "settings": {"gap": "a - b_1 - b_2"},
        "links": {"a": "40.3 mm", "b_1": "20 mm", "b_2": "20 mm"},
        "deviations": {"b": {"tolerance": "-0.12..0 mm", "distribution": "uniform"}},
        "limits": {"gap": "0.32..0.5 mm"},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "b.h5")
    assert tolstat.summary(run).verdicts == {"gap": "not met"}
    entries = halved_entries(run, ["b_1", "b_2"])
    assert entries == {"b": "-0.09..-0.03 mm"}
    written = tomllib.loads(tolstat.fresh_study(run, entries))["deviations"]["b"]
    assert written == {"tolerance": "-0.09..-0.03 mm", "distribution": "uniform"}

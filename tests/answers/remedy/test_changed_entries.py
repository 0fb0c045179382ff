"""Entries after a change: half a tolerance, of every kind of entry, as it is typed."""

from __future__ import annotations

import shlex
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import tolstat
from tests.answers.remedy.following import follow, halved, typed
from tests.conftest import ROOT
from tolstat.answers.allocate import search
from tolstat.answers.next_steps import StepKind, to_change
from tolstat.answers.remedy.changed_entries import fixed_contributors
from tolstat.study.editor import StudyChange
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


@pytest.mark.parametrize("kind", ENTRIES)
def test_the_commands_halve_as_the_number_promises(tmp_path, kind):
    entry, half, limit = ENTRIES[kind]
    run = chain(tmp_path, entry, limit)
    write, again = map(str, to_change(run, StudyChange(halved(run, "a"))))
    typed(write)
    study = tomllib.loads((tmp_path / "chain.remedy.toml").read_text())
    wanted = half if isinstance(half, dict) else {"tolerance": half}
    assert study["links"]["a"] == {"nominal": "50 mm", **wanted}
    typed(f"{again} --trials 20000")
    (fresh,) = tolstat.summary(tmp_path / "chain.remedy.h5").limits.values()
    promised = tolstat.summary(run).responses["gap"].causes.contributors["a"].halved
    found = fresh.yields.fraction_out_of_limit
    if promised.value == promised.value:
        assert found.upper >= promised.lower and found.lower <= promised.upper


def test_measured_parts_have_no_tolerance_to_halve(tmp_path):
    sizes = "\n".join(str(50 + i * 0.01) for i in range(-40, 41))
    (tmp_path / "parts.csv").write_text(f"size [mm]\n{sizes}\n")
    run = chain(tmp_path, {"data": "parts.csv", "column": "size"}, "<= 0.3 mm")
    assert "a" in fixed_contributors(run) and not halved(run, "a")


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
    entries = halved(run, "a", "b")
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
    monkeypatch.setattr(search, "MOST_PROVED", 1)  # any proof will do
    monkeypatch.setattr(search, "MOST_STRETCHED", 0)
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


def test_a_search_for_tolerances_is_offered_where_costs_are(tmp_path):
    study, path = deepcopy(THREE), tmp_path / "three.toml"
    path.write_text(tomli_w.dumps(study))
    steps = tolstat.summary(tolstat.run(path)).findings.steps
    assert StepKind.ALLOCATE not in [step.kind for step in steps]
    study["links"]["H"]["cost"] = {"law": "reciprocal", "at": "+-0.3 mm", "price": 3}
    path.write_text(tomli_w.dumps(study))
    *_, step = tolstat.summary(tolstat.run(path, force=True)).findings.steps
    assert step.kind is StepKind.ALLOCATE
    assert step.commands[0].words[:2] == ("allocate", path)


def test_a_class_of_gears_halves_as_its_zone_and_a_full_turn_stays(tmp_path):
    path = tmp_path / "grades.h5"
    run = tolstat.run(ROOT / "runs/khpt75-grades.toml", trials=16, output=path)
    entries = halved(run, "runout_7", "runout_phase_7", "tooth_position_1")
    zone = run.assumed["tooth_position_1"].tolerance[1] * 1e6
    assert not any("runout_phase" in name for name in entries)
    assert entries["tooth_position"] == f"+-{zone / 2:g} um"
    write, _ = map(str, to_change(run, StudyChange(entries)))
    typed(write)
    name = shlex.split(write)[-1]
    written = tomllib.loads(Path(name).read_text())["deviations"]
    Path(name).unlink()
    assert written["tooth_position"] == entries["tooth_position"]
    runout = {"tolerance": entries["runout_7"], "distribution": "weibull", "shape": 2}
    assert written["runout_7"] == runout  # another size has another zone


KEYED = {
    "plateau": {"distribution": "trapezoidal", "plateau": "+-0.15 mm"},
    "mode": {"distribution": "triangular", "mode": "0.18 mm"},
    "median": {"distribution": "lognormal", "median": "0.1 mm"},
    "shift": {"shift": "-0.15 mm"},
    "moved": {"shift": "0.15 mm", "nominal_shift": "0.1 mm"},
}


LAW = {"law": "reciprocal", "at": "+-0.2 mm", "price": 1}


@pytest.mark.parametrize("key", KEYED)
def test_a_price_fits_the_other_keys(key):
    study = deepcopy(THREE)
    study["links"]["a"] |= {"tolerance": "+-0.2 mm", "cost": LAW, **KEYED[key]}
    (priced,) = load(study).deviating.priced
    assert priced.cost(priced.specified_choice) == pytest.approx(1)


def test_a_price_fits_though_the_mean_lies_near_an_end():
    """The shift of the mean moves with the tolerance, as a plateau does."""
    study = deepcopy(THREE)
    study["links"]["a"] |= {"shift": "0.195 mm", "cost": LAW}
    (priced,) = load(study).deviating.priced
    tightest, _ = priced.ends
    (narrow,) = priced.distributions(tightest).values()
    assert narrow.shift == pytest.approx(0.195e-3 / 4)


@pytest.mark.parametrize("key", KEYED)
def test_other_keys_move_with_the_tolerance(tmp_path, key):
    # far from met: few trials show it again
    run = chain(tmp_path, {"tolerance": "+-0.2 mm", **KEYED[key]}, "<= 0.05 mm")
    write, again = to_change(run, StudyChange(halved(run, "a")))
    before, after = run.assumed["a"], follow((write, again)).assumed["a"]
    assert after.sigma == pytest.approx(before.sigma / 2, rel=1e-6)
    assert after.centre == pytest.approx(before.centre)


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
    entries = halved(run, "b_1", "b_2")
    assert entries == {"b": "-0.09..-0.03 mm"}
    written = tomllib.loads(tolstat.fresh_study(run, entries))["deviations"]["b"]
    assert written == {"tolerance": "-0.09..-0.03 mm", "distribution": "uniform"}

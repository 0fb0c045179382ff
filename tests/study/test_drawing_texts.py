"""Sizes and tolerances as drawings write them: in studies, what-if and allocations."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tests.study.chains import CHAIN, problems_of, zone
from tolstat.answers.allocate.fresh_runs import FreshRuns
from tolstat.deviations.spread import spread_of
from tolstat.errors import TolstatError
from tolstat.study.study import load


def gap(links, formula="a - b", **more):
    return {
        **CHAIN,
        "trials": 4000,
        "settings": {"gap": formula},
        "links": links,
        **more,
    }


@pytest.mark.parametrize(
    ("fit", "mean", "least", "share"),
    [("50 H7/g6 mm", 29.5, 20, 0.027405), ("50 H7/k6 mm", 2.5, 0, 0.3067)],
)
def test_a_fit_is_a_hole_and_a_shaft(fit, mean, least, share):
    """Both normal at Cp = 1: 25 and 16 um are six sigma each."""
    study = load(gap({"pair": fit}, "pair_hole - pair_shaft"))
    hole, shaft = map(spread_of, study.deviating.distributions.values())
    clearance, sigma = hole.mean - shaft.mean, np.hypot(hole.sigma, shaft.sigma)
    assert 1e6 * clearance == pytest.approx(mean)
    assert 1e6 * sigma == pytest.approx(4.947, abs=5e-4)
    assert norm.cdf((least * 1e-6 - clearance) / sigma) == pytest.approx(
        share, abs=5e-5
    )


TEXTS = {
    "+0.1/-0.05 mm": (-50, 100), "0/-0.02 mm": (-20, 0), "-20…50 um": (-20, 50),
    "±0,1 mm": (-100, 100), "g6": (-25, -9), "H7 (+0.025/0)": (0, 25),
    "ISO 2768-m": (-300, 300), "ISO 2768-fH": (-150, 150),
}  # fmt: skip


@pytest.mark.parametrize("text", TEXTS)
def test_a_text_survives_the_editor_and_an_allocation(text):
    ends = np.array(TEXTS[text]) * 1e-6
    study = load(
        gap({"a": {"nominal": "50 mm", "tolerance": text}, "b": "49 +-0.1 mm"})
    )
    np.testing.assert_allclose(study.deviating.distributions["a"].tolerance, ends)
    assert study.deviating.words["a"] == f"normal, {text}, cp 1"
    editor = study.editor()
    editor.change("b", text)  # what-if, and advice that is written
    editor.change("a", "js7")
    assert load(editor.table).deviating.words["b"] == f"normal, {text}, cp 1"
    width = 1e3 * (ends[1] - ends[0])
    cost = {"law": "reciprocal", "at": f"+-{width / 2:.6g} mm", "price": 4}
    link = {"nominal": "50 mm", "tolerance": text, "cost": cost}
    priced = load(gap({"a": link, "b": "49 mm"}))
    (entry,) = priced.deviating.priced
    runs = FreshRuns(priced, None, 8, lambda progress: None)
    halved = tomllib.loads(runs.study_text((entry.specified_choice - np.log(2),)))
    half = load(halved).deviating.distributions["a"].tolerance
    assert np.ptp(half) == pytest.approx(np.ptp(ends) / 2, rel=0.01)
    same = tomllib.loads(runs.study_text((entry.specified_choice,)))
    assert same["links"]["a"]["tolerance"] == text


def test_what_if_changes_one_part_of_a_fit(tmp_path):
    links = {"pair": "50 H7/g6 mm", "c": "1 +-0.1 mm"}
    study = gap(links, "pair_hole - pair_shaft", limits={"gap": ">= 20 um"})
    run = tolstat.run(study, output=tmp_path / "fit.h5")
    scenario = tolstat.what_if(run, {"pair_shaft": "-12/-22 um"}).changes["pair_shaft"]
    assert scenario.baseline == "normal, g6, cp 1"
    fresh = tomllib.loads(tolstat.fresh_study(run, {"pair_shaft": "f6"}))
    assert fresh["links"] == {
        "pair_hole": {"nominal": "50 mm", "tolerance": "H7"},
        "pair_shaft": {"nominal": "50 mm", "tolerance": "f6"},
        "c": "1 +-0.1 mm",
    }
    assert tolstat.report(run)


# class, nominal (mm), half the zone (mm)
@pytest.mark.parametrize(
    ("text", "nominal", "half"),
    [
        ("ISO 2768-f", 3, 0.05), ("ISO 2768-f", 2000, 0.5), ("ISO 2768-m", 6, 0.1),
        ("ISO 2768-m", 30, 0.2), ("ISO 2768-1-m", 31, 0.3), ("ISO 2768-c", 400, 1.2),
        ("ISO 2768-c", 4000, 4), ("ISO2768-v", 5, 0.5), ("ISO 2768-vL", 1000, 4),
        ("ISO 2768-m radius", 3, 0.2), ("ISO 2768-c radius", 6, 1),
        ("ISO 2768-m radius", 7, 1),
    ],
)  # fmt: skip
def test_general_tolerances_of_lengths(text, nominal, half):
    part, _ = zone(f"{nominal} mm", text)
    np.testing.assert_allclose(np.array(part.tolerance) * 1e3, (-half, half))


@pytest.mark.parametrize(
    ("text", "side", "minutes"),
    [("ISO 2768-m", 10, 60), ("ISO 2768-m", 50, 30), ("ISO 2768-c", 200, 15),
     ("ISO 2768-v", 500, 20)],
)  # fmt: skip
def test_general_tolerances_of_angles(text, side, minutes):
    part, _ = zone("30 deg", text, size=f"{side} mm")
    half = np.deg2rad(minutes / 60)
    np.testing.assert_allclose(part.tolerance, (-half, half))


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ({"nominal": "2 mm", "tolerance": "ISO 2768-v"}, "ISO 2768-1 has none"),
        ({"nominal": "0.3 mm", "tolerance": "ISO 2768-m"}, "ISO 2768-1 has none"),
        ({"nominal": "3 kg", "tolerance": "ISO 2768-m"}, "of lengths and angles"),
        ({"nominal": "3 kg", "tolerance": "g6"}, "g6 is of lengths"),
        ({"nominal": "3 deg", "tolerance": "ISO 2768-m"}, "length of its shorter side"),
        ({"nominal": "50 mm", "tolerance": "H7 (+0.021/0)"}, "has +0.025/0 mm"),
    ],
)
def test_what_a_standard_lacks_is_refused(link, words):
    assert words in problems_of(gap({"a": link, "b": "1 mm"}, "b"))


@pytest.mark.parametrize(
    ("keys", "mean", "sigma"),
    [
        ({"sigma": "4 um"}, 0.0, 4.0),  # alone: centred
        ({"mean": "10 um", "sigma": "4 um"}, 10.0, 4.0),
        ({"mean": "50.01 mm", "sigma": "4 um"}, 10.0, 4.0),
        ({"tolerance": "0/-0.02 mm", "sigma": "4 um"}, -10.0, 4.0),
        ({"tolerance": "+-30 um", "mean": "-5 um", "sigma": "4 um"}, -5.0, 4.0),
        ({"tolerance": "+-30 um", "mean": "-5 um", "cp": 2}, -5.0, 5.0),
        ({"tolerance": "+-30 um", "mean": "-6 um", "cpk": 2}, -6.0, 4.0),
    ],
)
def test_mean_and_sigma_as_statistical_control_gives_them(keys, mean, sigma):
    study = load(gap({"a": {"nominal": "50 mm", **keys}, "b": "49 mm"}))
    distribution = study.deviating.distributions["a"]
    np.testing.assert_allclose(distribution.mean_and_sigma, (mean * 1e-6, sigma * 1e-6))
    assert study.reading_warnings == ()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"sigma": "4 um", "cp": 1.33}, "cp refers to a tolerance; add one"),
        (
            {"tolerance": "h7", "sigma": "4 um", "cp": 1},
            "sigma, cp and cpk say the same",
        ),
        (
            {"tolerance": "+-9 um", "mean": "1 um", "shift": "1 um"},
            "shift and mean say",
        ),
        ({"tolerance": "+-9 um", "mean": "10 um"}, "mean outside the tolerance"),
        ({"mean": "10 um"}, "the key tolerance is missing"),
        ({"sigma": "-4 um"}, "sigma = -4e-06: it must be above zero"),
        ({"sigma": 4}, "unit is missing"),
        ({"sigma": "4 um", "cost": {"+-12 um": 3}}, "cost needs a tolerance"),
    ],
)
def test_what_mean_and_sigma_contradict_is_refused(keys, words):
    assert words in problems_of(gap({"a": {"nominal": "50 mm", **keys}, "b": "1 mm"}))


def test_another_tolerance_moves_mean_and_sigma():
    """Cp stays, as everywhere."""
    keys = {"nominal": "50 mm", "tolerance": "+-30 um", "mean": "6 um", "sigma": "4 um"}
    editor = load(gap({"a": keys, "b": "49 mm"})).editor()
    editor.change("a", "+-15 um")
    link = editor.table["links"]["a"]
    assert (link["mean"], link["sigma"]) == ("3 um", "2 um")
    editor = load(
        gap({"a": "50 mm", "b": {"nominal": "9 mm", "sigma": "4 um"}})
    ).editor()
    editor.change("b", "+-6 um")
    assert editor.table["links"]["b"] == {
        "nominal": "9 mm", "sigma": "2 um", "tolerance": "+-6 um",
    }  # fmt: skip


def test_a_report_of_a_sigma_alone(tmp_path):
    links = {"a": {"nominal": "50 mm", "sigma": "40 um"}, "b": "49.9 +-0.05 mm"}
    run = tolstat.run(gap(links, limits={"gap": ">= 0 mm"}), output=tmp_path / "s.h5")
    assert tolstat.report(run)
    fresh = tomllib.loads(tolstat.fresh_study(run, {"a": "+-60 um"}))
    assert fresh["links"]["a"]["sigma"] == "20 um"


TWO = [
    {"share": "70 %", "mean": "10 mm", "sigma": "20 um"},
    {"share": "30 %", "mean": "10.05 mm", "sigma": "20 um"},
]
MIXED = {"nominal": "10 mm", "distribution": "mixture"}


def test_two_suppliers_by_their_means_and_sigmas(tmp_path):
    links = {"a": {**MIXED, "parts": TWO}, "b": "9 +-0.01 mm"}
    study = gap(links, "a", limits={"gap": "9.95..10.08 mm"})
    mixture = load(study).deviating.distributions["a"]
    np.testing.assert_allclose(mixture.parts, [(0.7, 0, 2e-5), (0.3, 5e-5, 2e-5)], 1e-9)
    run = tolstat.run(study, output=tmp_path / "mixture.h5")
    share = np.mean(run.column("gap") < 9.95e-3) + np.mean(run.column("gap") > 10.08e-3)
    assert share == pytest.approx(0.024411, abs=4 * np.sqrt(0.0244 / 4000))
    assert tolstat.report(run)
    with pytest.raises(TolstatError, match="a mixture has no tolerance to change"):
        tolstat.fresh_study(run, {"a": "+-0.1 mm"})


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ("two", "parts: a list of tables is expected"),
        ([{"mean": "10 mm", "sigma": "1 um"}], "each needs its share"),
        ([TWO[0]], "100 % together, not 70 %"),
        ([TWO[0], {**TWO[1], "distribution": "uniform"}], "has no key mean"),
        ([TWO[0], {"share": "30 %", "tolerance": "+-9 um", "distribution": "uniform"}],
         "parts: each is normal"),
        ([TWO[0], {"share": "30 kg", "sigma": "1 um"}], "another kind"),
    ],
)  # fmt: skip
def test_a_wrong_mixture_is_refused(parts, words):
    assert words in problems_of(gap({"a": {**MIXED, "parts": parts}}, "a"))

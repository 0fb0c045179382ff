"""What a limit demands, as a study may write it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scipy.stats import norm

import tolstat
from tolstat.errors import StudyError, UnitError
from tolstat.model.description import Description
from tolstat.statistics.limits.limit import DEMANDED
from tolstat.study.limits_section import read_limit
from tolstat.study.study import load


@pytest.mark.parametrize(
    ("given", "demanded"),
    [
        ("<= 3 %", DEMANDED),
        ({"limit": "<= 3 %", "yield": "99 %"}, 0.99),
        ({"limit": "<= 3 %", "ppm": 100}, 0.9999),
        ({"limit": "<= 3 %", "ppk": 1.33}, norm.cdf(3 * 1.33)),
        ({"limit": "1..3 %", "ppk": 1.0}, norm.cdf(3) - norm.cdf(-3)),
        ({"limit": ">= 1 %", "ppk": 1}, norm.cdf(3)),
    ],
)
def test_demanded_yields_as_written(given, demanded):
    assert read_limit(given, "1").demanded == pytest.approx(demanded, abs=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"limit": "<= 3 %", "ppk": 1, "ppm": 5}, "ppk and ppm set the same demand"),
        (
            {"limit": "<= 3 %", "ppk": "1.33"},
            "expected a number, for example ppk = 1.33",
        ),
        ({"limit": "<= 3 %", "ppk": -1}, "ppk = -1: a value between 0 and 2.7"),
        ({"limit": "<= 3 %", "ppk": 9}, "ppk = 9"),
        ({"limit": "<= 3 %", "ppm": 2_000_000}, "between 0 and 1 000 000"),
        ({"limit": "<= 3 %", "ppm": True}, "expected a number"),
        ({"limit": "<= 3 %", "ppm": float("nan")}, "ppm = nan"),
        ({"limit": "<= 3 %", "yield": 99}, 'such as "99 %"'),
        ({"limit": "<= 3 %", "yield": "101 %"}, "between 0 and 100 %"),
        ({"limit": "<= 3 %", "yield": "99.73"}, 'write yield = "99.73 %"'),
        ({"limit": "<= 3 %", "cpk": 1}, "did you mean 'ppk'"),
        ({"ppk": 1}, 'limit is missing; expected a text such as "<= 3 %"'),
    ],
)
def test_wrong_demands_are_refused(given, words):
    with pytest.raises((UnitError, StudyError), match=words.replace(".", r"\.")):
        read_limit(given, "1")


@pytest.mark.parametrize(
    ("given", "shown", "readings"),
    [
        ("<= 4", "", ('"<= 4 %"', '"<= 400 %"')),
        ("<= 0.04", "%", ('"<= 0.04 %"', '"<= 4 %"')),
        ("0..3", "", ('"0..3 %"', '"0..300 %"')),
        (">= -2.5", "%", ('">= -2.5 %"', '">= -250 %"')),
        ("<= 50", "ppm", ('"<= 50 ppm"', '"<= 5e7 ppm"')),
        ({"limit": "<= 4", "ppk": 1}, "", ('"<= 4 %"', '"<= 400 %"')),
    ],
)
def test_a_share_without_unit_is_refused_with_both_readings(given, shown, readings):
    with pytest.raises(UnitError) as raised:
        read_limit(given, "1", shown)
    assert all(reading in str(raised.value) for reading in readings)


@pytest.mark.parametrize(
    ("given", "unit", "shown", "upper"),
    [
        ("<= 4 %", "1", "", 0.04), ("<= 4", "1", "1", 4), ("<= 4", "1", "count", 4),
        ("<= 4 %", "1", "1", 0.04), ("<= 50 ppm", "1", "%", 50e-6),
        ("<= 4 mm", "m", "", 0.004),
    ],
)  # fmt: skip
def test_a_limit_with_its_unit_is_taken(given, unit, shown, upper):
    assert read_limit(given, unit, shown).upper == pytest.approx(upper)


STAND = {"model": "stand", "trials": 100, "seed": 1}
BOTH = {
    "limits": ({"limits": {"extra_loss": "<= 3"}}, '"<= 3 %" or "<= 300 %"'),
    "range": ({"limits": {"jam_share": "0..1.5"}}, '"0..1.5 %" or "0..150 %"'),
    "rule": (
        {"trials": {"until": "extra_loss mean +-0.1", "at_most": 200}},
        r'"\+-0.1 pp" for percentage points, or "\+-0.1 % of itself"',
    ),
    "rule of a share": (
        {"trials": {"until": "extra_loss beyond +-0.1", "at_most": 200},
         "limits": {"extra_loss": "<= 3 %"}},
        r'"\+-0.1 pp" for percentage points',
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BOTH)
def test_shares_of_the_stand_have_a_unit(case):
    changes, words = BOTH[case]
    with pytest.raises(StudyError, match=words):
        load({**STAND, **changes})


def test_a_requested_limit_of_a_share_has_a_unit(toy, tmp_path):
    class Share(type(toy)):
        name = "share"

        def describe(self, settings):
            parts, (*others, ratio) = super().describe(settings)
            return Description(parts, (*others, replace(ratio, shown="")))

    study = {
        "model": "share",
        "trials": 50,
        "seed": 1,
        "deviations": {"part": "+-1 mm"},
    }
    run = tolstat.run(study, model=Share(), output=tmp_path / "share.h5")
    with pytest.raises(StudyError, match='"<= 4 %" or "<= 400 %"'):
        tolstat.limited(run, {"ratio": "<= 4"})
    with pytest.raises(StudyError, match='"<= 4 %" or "<= 400 %"'):
        tolstat.what_if(
            run, {"part": "+-0.9 mm"}, limits={"ratio": "<= 4"}, model=Share()
        )
    assert tolstat.limited(run, {"ratio": "<= 4 %"}).limits["ratio"].upper == 0.04

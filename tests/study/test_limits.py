"""What a limit demands, as a study may write it."""

from __future__ import annotations

import pytest
from scipy.stats import norm

from tolstat.errors import StudyError, UnitError
from tolstat.statistics.limits.limit import DEMANDED
from tolstat.study.limits_section import read_limit


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
            "expected a number such as ppk = 1.33",
        ),
        ({"limit": "<= 3 %", "ppk": -1}, "ppk = -1: a value between 0 and 2.7"),
        ({"limit": "<= 3 %", "ppk": 9}, "ppk = 9"),
        ({"limit": "<= 3 %", "ppm": 2_000_000}, "between 0 and 1 000 000"),
        ({"limit": "<= 3 %", "ppm": True}, "expected a number"),
        ({"limit": "<= 3 %", "ppm": float("nan")}, "ppm = nan"),
        ({"limit": "<= 3 %", "yield": 99}, 'such as "99 %"'),
        ({"limit": "<= 3 %", "yield": "101 %"}, "between 0 and 100 %"),
        ({"limit": "<= 3 %", "cpk": 1}, "did you mean 'ppk'"),
        ({"ppk": 1}, 'limit is missing; expected a text such as "<= 3 %"'),
    ],
)
def test_wrong_demands_are_refused(given, words):
    with pytest.raises((UnitError, StudyError), match=words.replace(".", r"\.")):
        read_limit(given, "1")

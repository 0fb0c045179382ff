"""Contributions with known answers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.sensitivity.regression import ascending
from tolstat.statistics.sensitivity.sobol_indices import nearest


def stack(n, seed=0):
    """A linear stack: variances 9, 4, 1 of 14, and a part that does nothing."""
    X = np.random.default_rng(seed).normal(size=(n, 4))
    parts = {name: X[:, i] for i, name in enumerate(("rod_1", "rod_2", "gear", "idle"))}
    return parts, 3 * X[:, 0] - 2 * X[:, 1] + X[:, 2]


def test_a_linear_stack():
    parts, y = stack(10_000)
    groups = {"rod": ["rod_1", "rod_2"], "gear": ["gear"]}
    found = contributions(parts, {"gap": y}, groups)["gap"]
    for name, share in (
        ("rod_1", 9 / 14),
        ("rod_2", 4 / 14),
        ("gear", 1 / 14),
        ("idle", 0),
    ):
        first = found.first_order[name]
        assert first.lower <= share <= first.upper
        assert first.upper - first.lower < 0.1
    assert found.groups["rod"].value == pytest.approx(13 / 14, abs=0.03)
    assert found.groups["rod"].value == pytest.approx(
        found.first_order["rod_1"].value + found.first_order["rod_2"].value
    )
    assert found.unexplained.lower <= 0 <= found.unexplained.upper
    assert found.explained.value > 0.94
    signs = {name: np.sign(e.value) for name, e in found.rank_regression.items()}
    assert (signs["rod_1"], signs["rod_2"], signs["gear"]) == (1, -1, 1)


def test_rank_regression_matches_a_manual_one():
    parts, y = stack(500)
    found = contributions(parts, {"gap": y})["gap"].rank_regression
    ranks = np.column_stack([stats.rankdata(x) for x in parts.values()])
    design = (ranks - ranks.mean(0)) / ranks.std(0)
    of_y = stats.rankdata(y)
    known, *_ = np.linalg.lstsq(design, (of_y - of_y.mean()) / of_y.std(), rcond=None)
    assert [e.value for e in found.values()] == pytest.approx(known)


def test_ishigami():
    X = np.random.default_rng(1).uniform(-np.pi, np.pi, (20_000, 3))
    y = (
        np.sin(X[:, 0])
        + 7 * np.sin(X[:, 1]) ** 2
        + 0.1 * X[:, 2] ** 4 * np.sin(X[:, 0])
    )
    found = contributions({f"x{i}": X[:, i] for i in range(3)}, {"y": y})["y"]
    known = (0.3139, 0.4424, 0.0)
    for estimate, share in zip(found.first_order.values(), known, strict=True):
        assert estimate.lower <= share <= estimate.upper
        assert estimate.value == pytest.approx(share, abs=0.03)
    # the interaction of 1 and 3 remains, and the regression saw almost nothing of 2
    assert found.unexplained.value == pytest.approx(0.2437, abs=0.05)
    assert abs(found.rank_regression["x1"].value) < 0.05


def test_intervals_of_contributions_cover():
    hits = np.zeros(4)
    for seed in range(200):
        parts, y = stack(400, seed + 100)
        found = contributions(parts, {"y": y})["y"].first_order
        known = np.array([9, 4, 1, 0]) / 14
        hits += [
            e.lower <= s <= e.upper for e, s in zip(found.values(), known, strict=True)
        ]
    assert (hits / 200 > 0.93 - 3 * np.sqrt(0.07 * 0.93 / 200)).all()


def test_contributions_that_are_not_estimable_have_none():
    parts, y = stack(150)
    found = contributions(parts, {"y": y})["y"]
    assert "150 trials" in found.first_order["rod_1"].reason
    parts, y = stack(500)
    flat = contributions(parts, {"y": np.zeros(500)}, {"rod": ["rod_1"]})["y"]
    assert "does not spread" in flat.groups["rod"].reason


def test_two_rods_together_explain_more_than_either_alone():
    rng = np.random.default_rng(3)
    parts = {name: rng.normal(size=4000) for name in ("rod_1", "rod_2", "gear")}
    y = np.abs(parts["rod_1"] - parts["rod_2"])
    groups = {"rod": ["rod_1", "rod_2"]}
    found = contributions(parts, {"gap": y}, groups)["gap"]
    assert found.groups["rod"].upper < 0.6
    together = found.together["rod"]
    assert together.value > 0.95 and together.lower > 0.9 and together.upper == 1.0
    assert found.unexplained.lower > 0.4


def test_few_jammed_trials_allow_no_interval():
    rng = np.random.default_rng(4)
    parts = {name: rng.normal(size=4000) for name in ("rod_1", "rod_2")}
    y = np.maximum(np.abs(parts["rod_1"] - parts["rod_2"]) - 3.2, 0)
    found = contributions(parts, {"loss": y}, {"rod": list(parts)})["loss"]
    assert found.dominated_by_few
    for each in (found.first_order["rod_1"], found.groups["rod"], found.unexplained):
        assert not each.sure and "few trials dominate" in each.reason
        assert np.isfinite(each.value)
    assert found.rank_regression["rod_1"].sure
    # understated by neighbours all the same: its lower end holds
    together = found.together["rod"]
    assert 0.4 < together.lower < together.value and together.upper == 1.0


def test_shares_of_a_heavy_tailed_response_are_of_its_central_99_per_cent():
    rng = np.random.default_rng(9)
    a, b, c = parts = rng.normal(size=(3, 4000))
    y = a * b + np.exp(1.5 * c)
    found = contributions(dict(zip("abc", parts, strict=True)), {"y": y})["y"]
    assert found.clipped and not found.dominated_by_few

    def index(x, y):
        y = y.clip(*np.quantile(y, [0.005, 0.995], method="median_unbiased"))
        return 1 - np.mean(np.diff(y[np.argsort(x)]) ** 2) / (2 * np.var(y, ddof=1))

    each = found.first_order["c"]
    assert each.value == pytest.approx(index(c, y))
    part = np.arange(4000) % 20
    left_out = np.array([index(c[part != p], y[part != p]) for p in range(20)])
    half = stats.t.ppf(0.975, 19) * np.sqrt(19) * left_out.std()
    # the ends of the central range are followed along a straight line
    assert each.value - each.lower == pytest.approx(half, rel=0.3)
    light = contributions({"a": a}, {"y": a + 0.5 * b})["y"]
    assert not light.clipped


def test_where_neighbours_differ_much_the_upper_end_is_higher():
    """A sine of 30 periods: neighbours of 200 trials are a sixth of a period apart."""
    x, other = np.random.default_rng(10).random((2, 200))
    found = contributions({"x": x, "other": other}, {"y": np.sin(60 * np.pi * x)})["y"]
    each = found.first_order["x"]
    assert each.value < 0.7 and each.upper > 1
    assert found.unexplained.lower < 0


SPACER = {"housing": 0.05, "part_1": 0.03, "part_2": 0.03, "spacer": 0.0085}


def spaced(n, seed=7):
    """A gap between a housing and three parts; the spacer has 1.65 %."""
    rng = np.random.default_rng(seed)
    parts = {name: rng.normal(0, t / 3, n) for name, t in SPACER.items()}
    variances = {name: t**2 for name, t in SPACER.items()}
    whole = sum(variances.values())
    y = parts["housing"] - sum(parts[name] for name in list(SPACER)[1:])
    return parts, y, {name: v / whole for name, v in variances.items()}


def test_shares_of_a_linear_response_come_from_its_regression():
    parts, y, known = spaced(4000)
    groups = {"part": ["part_1", "part_2"], "many": list(parts)}
    found = contributions(parts, {"gap": y}, groups)["gap"]
    assert found.linear and known["spacer"] == pytest.approx(0.0165, abs=5e-5)
    for name, share in known.items():
        each = found.first_order[name]
        assert each.value == pytest.approx(share, rel=0.05)
        assert each.lower <= share <= each.upper
    neighbours = contributions(parts, {"gap": y}, groups, independent=False)["gap"]
    assert not neighbours.linear
    spacer = neighbours.first_order["spacer"]
    sharp = found.first_order["spacer"]
    assert spacer.upper - spacer.lower > 10 * (sharp.upper - sharp.lower)
    # nothing but sums: no interaction, and no group too large to be told
    assert found.together["part"] == found.groups["part"]
    assert found.together["many"].value == pytest.approx(1)
    assert found.unexplained[:3] == (0, 0, 0)


def test_regression_shares_match_coefficients_and_sigmas():
    parts, y, _ = spaced(1000)
    y = y + np.random.default_rng(8).normal(0, 0.05 * y.std(), len(y))
    found = contributions(parts, {"gap": y})["gap"]
    X = np.column_stack([*parts.values(), np.ones(len(y))])
    slopes = np.linalg.lstsq(X, y, rcond=None)[0]
    explained = (X @ slopes).var() / y.var()
    alone = slopes[:-1] ** 2 * X[:, :-1].var(axis=0)
    values = [each.value for each in found.first_order.values()]
    assert values == pytest.approx(explained * alone / alone.sum())
    assert found.unexplained.value == pytest.approx(1 - explained)
    # what it leaves may be anybody's: upper ends reach higher by it
    for each in found.first_order.values():
        assert each.upper - each.value > each.value - each.lower + 0.8 * (1 - explained)


def test_a_nearly_linear_response_is_not_treated_as_linear():
    parts, y, _ = spaced(4000)
    bent = y / y.std() + 0.12 * (parts["housing"] / 0.0167) ** 2
    assert not contributions(parts, {"gap": bent})["gap"].linear


def test_ties_have_equal_ranks():
    rng = np.random.default_rng(5)
    rods = rng.integers(0, 5, 500).astype(float)
    parts = {"rod": rods, "gear": rng.normal(size=500)}
    y = np.round(rods + parts["gear"])
    found = contributions(parts, {"y": y})["y"].rank_regression
    ranks = stats.rankdata(np.column_stack(list(parts.values())), axis=0)
    design = (ranks - ranks.mean(0)) / ranks.std(0)
    of_y = stats.rankdata(y)
    known, *_ = np.linalg.lstsq(design, (of_y - of_y.mean()) / of_y.std(), rcond=None)
    assert [e.value for e in found.values()] == pytest.approx(known)


@pytest.mark.parametrize("digits", [16, 0])
def test_intervals_match_a_jackknife_of_twenty_parts(digits):
    parts, y = stack(437)
    # without digits many are alike
    parts, y = {name: x.round(digits) for name, x in parts.items()}, y.round(digits)
    rods = {"rod": ["rod_1", "rod_2"]}
    found = contributions(parts, {"y": y}, rods, independent=False)["y"]

    def index(x, y):
        y = y[np.argsort(x, kind="stable")]
        return 1 - np.mean(np.diff(y) ** 2) / (2 * np.var(y, ddof=1))

    def interval(statistic):
        part = np.arange(len(y)) % 20
        left_out = np.array([statistic(part != p) for p in range(20)])
        scatter = np.mean((left_out - left_out.mean()) ** 2)
        return stats.t.ppf(0.975, 19) * np.sqrt(19 * scatter)

    every = np.ones(len(y), dtype=bool)
    for name, x in parts.items():

        def one(kept, x=x):
            return index(x[kept], y[kept])

        each = found.first_order[name]
        assert each.value == pytest.approx(one(every))
        assert each.value - each.lower == pytest.approx(interval(one))
        assert each.upper - each.value >= 0.9999 * (each.value - each.lower)

    def regressed(kept):
        ranks = stats.rankdata(np.column_stack(list(parts.values()))[kept], axis=0)
        design = (ranks - ranks.mean(0)) / ranks.std(0)
        of_y = stats.rankdata(y[kept])
        of_y = (of_y - of_y.mean()) / of_y.std()
        return np.linalg.lstsq(design, of_y, rcond=None)[0][0]

    each = found.rank_regression["rod_1"]
    assert each.value - each.lower == pytest.approx(interval(regressed))


def test_equal_values_stay_in_order():
    assert ascending(np.array([1.0, 0.0, 1.0, 0.0])).tolist() == [1, 3, 0, 2]


def test_nearest_returns_the_nearest_trial():
    X = np.random.default_rng(6).normal(size=(200, 3))
    ranks = X.argsort(axis=0).argsort(axis=0)
    apart = ((ranks[:, None] - ranks[None]) ** 2).sum(axis=2)
    apart[np.diag_indices(200)] = 3 * 200**2
    found = nearest(X)
    assert (apart[np.arange(200), found] == apart.min(axis=1)).all()

"""Few measured parts are a uncertainty of a fraction out of limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri

from tests.studies.coverage.measured_parts import drawn, limit_of, population
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import JOINT, MET, UNDECIDED, Caveat, yield_of
from tolstat.statistics.measured.populations import MeasuredSample
from tolstat.statistics.measured.sample_uncertainty import (
    MeasuredTrials,
    uncertainties_of,
)
from tolstat.statistics.sample import Sample
from tolstat.status import Status

TRIALS = 4096
RNG = np.random.default_rng(7)
PARTS = np.sort(RNG.standard_normal(10))
UNITS, OTHER = RNG.random(TRIALS), 0.75 * RNG.standard_normal(TRIALS)


def measured_x(response, limit, parts=PARTS, fit="normal", p_value=0.5, names=("x",)):
    """Return the uncertainty of a response of measured x and another part."""
    fitted = parts.mean() + parts.std(ddof=1) * ndtri(UNITS)
    x = fitted if fit else parts[(UNITS * len(parts)).astype(int)]
    sample = MeasuredSample("x", names, parts, fit, p_value)
    deviations = {**dict.fromkeys(names, x), "other": OTHER}
    trials = MeasuredTrials(
        (sample,), deviations, {"y": response(x, OTHER)}, {"y": limit}
    )
    return uncertainties_of(trials, (0.5,))


def test_of_a_fit_the_interval_is_that_of_its_mean_and_sigma():
    end = PARTS.mean() + 3.0
    share = measured_x(lambda x, w: x + w, Limit(-np.inf, end))["y"].share
    rng, n, draws = np.random.default_rng(0), len(PARTS), 20_000
    sigma = PARTS.std(ddof=1) * np.sqrt((n - 1) / rng.chisquare(n - 1, draws))
    mean = PARTS.mean() + sigma / np.sqrt(n) * rng.standard_normal(draws)
    out = ndtr((mean - end) / np.hypot(sigma, OTHER.std()))
    # 400 draws know the ends of an interval over two decades to a few tenths of one
    known = np.quantile(out, [0.025, 0.975])
    assert np.log10(share.if_fitted[1:3]) == pytest.approx(np.log10(known), abs=0.3)
    assert share.assumed == "normal" and share.entries == {"x": 10}
    assert share.for_any.upper > share.if_fitted.upper


def test_a_bent_response_moves_as_if_evaluated_again():
    def bent(x, w):
        return x + 0.1 * x**2 + w + 0.2 * x * w

    limit = Limit(-2.5, 3.0)
    share = measured_x(bent, limit)["y"].share
    sample, rng = MeasuredSample("x", ("x",), PARTS, "normal", 0.5), None
    rng = np.random.default_rng(1)
    out = [
        np.mean((y < limit.lower) | (y > limit.upper))
        for population in sample.populations(400, rng, fitted=True)
        for y in [bent(population(UNITS), OTHER)]
    ]
    known = np.quantile(out, [0.025, 0.975], method="weibull")
    assert share.of_parts == pytest.approx(known, abs=1e-12)


def test_two_parts_give_no_interval_and_no_verdict():
    parts = np.array([-0.01, 0.01])
    found = measured_x(lambda x, w: x + 0.1 * w, Limit(-1.0, 1.0), parts, "")
    share, sample = found["y"].share, Sample(np.full(TRIALS, Status.DONE))
    judged = yield_of(0.1 * OTHER, sample, (-1.0, 1.0), measured=share)
    assert (judged.verdict, judged.reason) == (UNDECIDED, Caveat.FEW_PARTS)
    assert judged.words == "undecided (only 2 parts measured)"
    assert not judged.fraction_out_of_limit.sure and judged.needed == 0
    assert judged.fraction_out_of_limit.value == 0
    assert not found[JOINT].share.widened(judged.fraction_out_of_limit).sure


def test_where_trials_alone_decide_more_of_them_do_not():
    """None of the trials is out of limit; the parts leave 0 to 2600 ppm."""
    end, demanded = 4.1, 0.998
    limit = Limit(-np.inf, end, demanded=demanded)
    share = measured_x(lambda x, w: x + w, limit)["y"].share
    assert share.of_parts[1] < 1 - demanded < share.interval.upper
    x = PARTS.mean() + PARTS.std(ddof=1) * ndtri(UNITS)
    sample, ends = Sample(np.full(TRIALS, Status.DONE)), (-np.inf, end)
    judged = yield_of(x + OTHER, sample, ends, demanded, measured=share)
    assert yield_of(x + OTHER, sample, ends, demanded).verdict == MET
    assert (judged.verdict, judged.reason) == (UNDECIDED, Caveat.FEW_PARTS)
    assert judged.needed == 0 < share.needed


@pytest.mark.parametrize("n", range(5, 11))
def test_parts_between_the_tails_remain(n):
    share = measured_x(lambda x, w: x + w, Limit(-9.0, 9.0), PARTS[:n], "")["y"].share
    assert share.for_any.sure and 0 <= share.of_parts[0] < share.of_parts[1] < 1
    body = MeasuredSample("x", ("x",), PARTS[:n]).populations(
        50, np.random.default_rng(0), fitted=False
    )
    middle = [population(np.full(1, 0.5)) for population in body]
    assert PARTS[0] < np.median(middle) < PARTS[n - 1]


def test_no_number_of_parts_proves_a_tail():
    """None of a hundred even parts is out of limit: perhaps none at all is."""
    parts = (np.arange(100) + 0.5) / 100
    x, limits = parts[(UNITS * 100).astype(int)], {"y": Limit(-np.inf, 1.0)}
    sample = MeasuredSample("x", ("x",), parts)
    trials = MeasuredTrials((sample,), {"x": x}, {"y": x}, limits)
    lower, upper = uncertainties_of(trials, (), ())["y"].share.of_parts
    assert lower == 0 < 0.001 < upper < 0.05


def test_a_doubtful_fit_decides_nothing():
    uncertainty = measured_x(lambda x, w: x + w, Limit(-np.inf, 3.0), p_value=0.04)
    assert not uncertainty["y"].share.assumed


def test_a_verdict_by_a_fit_has_its_condition_until_the_parts_agree():
    sample = Sample(np.full(TRIALS, Status.DONE))
    many = np.sort(np.random.default_rng(3).standard_normal(1000))
    for parts, end, reason in (
        (PARTS, 9.0, Caveat.NORMAL_PARTS),
        (many, 9.0, Caveat.NONE),
    ):
        share = measured_x(lambda x, w: x + w, Limit(-np.inf, end), parts)["y"].share
        found = yield_of(OTHER, sample, (-np.inf, end), measured=share)
        assert (found.verdict, found.reason) == (MET, reason)


def test_parts_that_decide_are_said_and_do_decide():
    limit = Limit(-np.inf, PARTS.mean() + 5.5 * PARTS.std(ddof=1))
    needed = measured_x(lambda x, w: x + w, limit, fit="")["y"].share.needed
    assert needed in (20, 30, 50, 100, 200, 300, 500, 1000)
    more = MeasuredSample("x", ("x",), PARTS).enlarged(needed).values
    assert len(more) == needed
    assert more.mean() == pytest.approx(PARTS.mean())
    assert more.std(ddof=1) == pytest.approx(PARTS.std(ddof=1))
    share = measured_x(lambda x, w: x + w, limit, more, "")["y"].share
    assert share.of_parts[1] <= 0.0027 and share.needed == 0


def test_contributors_of_one_entry_come_from_one_population():
    """Two parts from one file err together: as one part that counts twice."""
    limit = Limit(-np.inf, 6.0)
    rng = np.random.default_rng(4)
    x = [PARTS[(rng.random(TRIALS) * 10).astype(int)] for _ in "ab"]
    widths = []
    for samples in (
        (MeasuredSample("x", ("a", "b"), PARTS),),
        tuple(MeasuredSample(n, (n,), PARTS) for n in "ab"),
    ):
        trials = MeasuredTrials(
            samples, dict(zip("ab", x, strict=True)), {"y": sum(x)}, {"y": limit}
        )
        gains = uncertainties_of(trials, (0.5,))["y"].numbers.mean
        widths.append(gains.std())
    assert widths[0] == pytest.approx(np.sqrt(2) * widths[1], rel=0.15)


def yield_of_few(rng, kind, limit):
    """Return the yield by ten parts, and these; the truth is 2700 ppm."""
    parts, u = np.sort(population(kind, rng.random(10))), rng.random(TRIALS)
    x = {"x": parts[(u * 10).astype(int)], "w": 0.75 * rng.standard_normal(TRIALS)}
    y, samples = x["x"] + x["w"], (MeasuredSample("x", ("x",), parts),)
    limits = {"y": Limit(-np.inf, limit)}
    share = uncertainties_of(MeasuredTrials(samples, x, {"y": y}, limits), (), ())["y"]
    sample = Sample(np.full(TRIALS, Status.DONE))
    permitted = limits["y"].permitted
    return yield_of(y, sample, permitted, 1 - 0.0027, measured=share.share), samples


@pytest.mark.parametrize("kind", ["normal", "skewed"])
def test_intervals_of_few_parts_hold(kind):
    """More in tests/studies/coverage/measured_parts.csv."""
    rng, limit = np.random.default_rng(5), limit_of(kind, 1, 0.0027)
    studies = [yield_of_few(rng, kind, limit)[0] for _ in range(12)]
    shares = [x.fraction_out_of_limit for x in studies]
    assert sum(x.lower <= 0.0027 <= x.upper for x in shares) >= 10
    # wrongly in at most 2.5 % of studies: two of twelve would be a chance of 3.5 %
    assert sum(x.verdict == MET for x in studies) <= 1


def test_measured_coverage_is_that_of_these_intervals():
    """The study of the coverage has closed forms instead of trials."""
    rng, limit = np.random.default_rng(6), limit_of("normal", 1, 0.0027)
    fraction, samples = yield_of_few(rng, "normal", limit)
    shares = [drawn(samples, rng, [limit], fitted=False) for _ in range(40)]
    lower, upper = np.quantile(shares, (0.025, 0.975))
    trials = fraction.fraction_out_of_limit
    assert trials.lower == pytest.approx(lower, rel=0.3, abs=3e-4)
    assert trials.upper == pytest.approx(upper, rel=0.3)


def test_few_lots_tell_little_of_their_mean():
    """The mean of five lots is as uncertain as Student's t of their means has it."""
    rng, lots = np.random.default_rng(3), 5
    lot = np.repeat(np.arange(lots), 200)
    parts = 6.0 * np.arange(lots)[lot] + 0.5 * rng.standard_normal(len(lot))
    order = np.argsort(np.argsort(parts, kind="stable"))
    sample = MeasuredSample(
        "x", ("x",), np.sort(parts), order=order, lot=lot, lot_names=tuple("ABCDE")
    )
    between = sample.lot_effect.between
    assert between == pytest.approx(6.0 * np.std(range(5), ddof=1), rel=0.01)
    assert sample.few_lots == 5
    u = (np.arange(1000) + 0.5) / 1000
    for tails in (True, False):
        drawn = sample.populations(2000, rng, fitted=False, tails=tails)
        means = np.array([population(u).mean() for population in drawn])
        ends = stats.t(lots - 1, 12.0, between / np.sqrt(lots)).interval(0.9)
        np.testing.assert_allclose(np.quantile(means, [0.05, 0.95]), ends, atol=1.5)


def test_few_lots_are_what_is_few():
    """A thousand parts of four lots: more of the same lots decide nothing."""
    rng, lots = np.random.default_rng(3), 4
    lot = np.repeat(np.arange(lots), 250)
    parts = 0.6 * np.array([-1, 1, 0.3, -0.3])[lot] + rng.standard_normal(len(lot))
    order = np.argsort(np.argsort(parts, kind="stable"))
    sample = MeasuredSample(
        "x", ("x",), np.sort(parts), order=order, lot=lot, lot_names=tuple("ABCD")
    )
    x, limit = rng.choice(parts, TRIALS), Limit(-np.inf, 4.0)
    trials = MeasuredTrials((sample,), {"x": x}, {"gap": x}, {"gap": limit})
    share = uncertainties_of(trials, (0.5,))["gap"].share
    assert share.lots == {"x": 4} and share.counts == {"x": (4, "lot")}
    assert share.interval.upper > 0.0027 and 4 < share.needed <= 100
    sample = Sample(np.full(TRIALS, Status.DONE))
    judged = yield_of(x, sample, limit.permitted, measured=share)
    assert judged.words == "undecided (only 4 lots measured)"
    alone = MeasuredSample("x", ("x",), np.sort(parts))
    share = uncertainties_of(trials._replace(samples=(alone,)), (0.5,))["gap"].share
    assert share.lots == {} and share.interval.upper < 0.0022

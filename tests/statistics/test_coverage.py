"""Intervals cover what they claim: what the measured table says, and new studies."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from tests.coverage.index_problems import INDEX_PROBLEMS
from tests.coverage.measure import TABLE, intervals, measure, stopped
from tests.coverage.problems import PROBLEMS, SIZES
from tolstat.statistics.precision import FIRST
from tolstat.statistics.quantiles import quantile

SURE = 3.5  # standard errors
EXACT, APPROXIMATE = 0.95, 0.93  # what they claim to cover


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(TABLE)


def test_the_table_is_whole(table):
    assert set(table["problem"]) == {*PROBLEMS, *INDEX_PROBLEMS}
    assert set(table["trials"]) == {*SIZES, FIRST}
    assert (table["studies"] == 4000).all()


def least_covered(claim, studies):
    """The least coverage that so many studies may show of an interval that keeps it."""
    return claim - SURE * np.sqrt(claim * (1 - claim) / studies)


def test_in_the_table_exact_intervals_do_not_miss_too_often(table):
    exact = table[table["exact"] & (table["offered"] > 0)]
    assert (exact["offered"] == 1).all()
    assert (exact["covered"] >= least_covered(EXACT, 4000)).all()


def coverage_of_quantile(share, n):
    """How often the order-statistic interval covers, for a continuous response."""
    found = quantile(np.arange(1.0, n + 1), share)  # its ranks
    low, high = int(found.lower), int(found.upper)
    return binom.cdf(high - 1, n, share) - binom.cdf(low - 1, n, share)


def test_in_the_table_quantiles_cover_what_the_binomial_says_of_their_ranks(table):
    rows = table[table["statistic"].str.startswith("quantile") & table["exact"]]
    rows = rows[rows["offered"] > 0]
    rows = rows[rows["problem"] != "mixture with an atom"]  # covers more at its atom
    assert len(rows) == 3 * (3 + 4 + 6)
    for row in rows.itertuples():
        share = float(row.statistic.split()[1])
        known = coverage_of_quantile(share, row.trials)
        error = np.sqrt(known * (1 - known) / row.studies)
        assert abs(row.covered - known) < SURE * error + 1e-4, row


def test_in_the_table_approximate_intervals_are_offered_only_where_they_cover(table):
    # of less than one study in 200 too few are left to measure their coverage
    assert (table["missed"][table["offered"] < 0.005] < 0.005).all()
    offered = table[~table["exact"] & (table["offered"] >= 0.005)]
    assert (offered["covered"] >= APPROXIMATE).all(), offered.nsmallest(3, "covered")
    # and not offered where they are known not to: 200 trials of a lognormal
    refused = table[
        (table["statistic"] == "sigma")
        & ((table["trials"] == 200) | (table["problem"] == "lognormal"))
    ]
    assert (refused["offered"] < 0.001).all()


# the cheapest cells in which every kind of interval that needs few trials is offered
NEW = {
    ("normal", 200): (intervals, 1000),
    ("normal", 1000): (intervals, 300),
    ("mixture with an atom", 200): (intervals, 500),
    ("linear stack", 200): (intervals, 300),
    ("lognormal", FIRST): (stopped, 500),
}
NARROWER, LEFT = ", a third narrower", 2 / 3


def also_narrower(of):
    """Every interval of a study, and beside it one that is too narrow."""

    def both(name, rng, size):
        for problem, each, found, truth, exact in of(name, rng, size):
            yield problem, each, found, truth, exact
            narrower = found._replace(
                lower=found.value + LEFT * (found.lower - found.value),
                upper=found.value + LEFT * (found.upper - found.value),
            )
            yield problem, each + NARROWER, narrower, truth, exact

    return both


@pytest.fixture(scope="module", params=NEW, ids=str)
def again(request, table):
    """New studies of a cell of the table, and beside them what it says of them."""
    of, studies = NEW[request.param]
    found = pd.DataFrame(measure(*request.param, studies, seed=1, of=also_narrower(of)))
    found["narrower"] = found["statistic"].str.endswith(NARROWER)
    found["statistic"] = found["statistic"].str.removesuffix(NARROWER)
    both = found.merge(
        table, on=["problem", "trials", "statistic"], suffixes=("", "_known")
    )
    assert len(both) == len(found)
    return both


def disagrees(both):
    """Where new intervals are offered, or miss, not as often as the table says."""
    n, known_n = both["studies"], both["studies_known"]
    found = np.zeros(len(both), dtype=bool)
    for of in ("offered", "missed"):
        new, known = both[of], both[f"{of}_known"]
        share = (n * new + known_n * known) / (n + known_n)
        error = np.sqrt(share * (1 - share) * (1 / n + 1 / known_n))
        found |= (new - known).abs() > SURE * error + 1 / n
    return found


def test_new_studies_cover_what_is_claimed_and_what_the_table_says(again):
    new = again[~again["narrower"]]
    assert not disagrees(new).any(), new[disagrees(new)]
    offered = new[new["offered"] > 0]
    claimed = np.where(offered["exact"], EXACT, APPROXIMATE)
    studies = offered["offered"] * offered["studies"]
    assert (offered["covered"] >= least_covered(claimed, studies)).all(), offered


def test_new_studies_notice_an_interval_that_is_too_narrow(again):
    broken = again[again["narrower"] & (again["offered"] > 0)]
    broken = broken[broken["covered_known"] < 1]
    assert len(broken) and disagrees(broken).all(), broken[~disagrees(broken)]

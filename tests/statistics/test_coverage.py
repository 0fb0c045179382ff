"""Intervals cover what they claim: the measured table, and a small part of it again."""

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


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(TABLE)


def test_the_table_is_whole(table):
    assert set(table["problem"]) == {*PROBLEMS, *INDEX_PROBLEMS}
    assert set(table["trials"]) == {*SIZES, FIRST}
    assert (table["studies"] == 4000).all()


def test_exact_intervals_do_not_miss_too_often(table):
    exact = table[table["exact"] & (table["offered"] > 0)]
    allowed = 0.95 - 3.5 * np.sqrt(0.95 * 0.05 / 4000)
    assert (exact["offered"] == 1).all()
    assert (exact["covered"] >= allowed).all(), exact.nsmallest(3, "covered")


def coverage_of_quantile(share, n):
    """How often the order-statistic interval covers, for a continuous response."""
    found = quantile(np.arange(1.0, n + 1), share)  # its ranks
    low, high = int(found.lower), int(found.upper)
    return binom.cdf(high - 1, n, share) - binom.cdf(low - 1, n, share)


def test_exact_intervals_cover_what_the_binomial_says(table):
    rows = table[table["statistic"].str.startswith("quantile") & table["exact"]]
    rows = rows[rows["offered"] > 0]
    rows = rows[rows["problem"] != "mixture with an atom"]  # covers more at its atom
    assert len(rows) == 3 * (3 + 4 + 6)
    for row in rows.itertuples():
        share = float(row.statistic.split()[1])
        known = coverage_of_quantile(share, row.trials)
        error = np.sqrt(known * (1 - known) / row.studies)
        assert abs(row.covered - known) < 3.5 * error + 1e-4, row


def test_approximate_intervals_are_offered_only_where_they_cover(table):
    # of less than one study in 200 too few are left to measure their coverage
    assert (table["missed"][table["offered"] < 0.005] < 0.005).all()
    offered = table[~table["exact"] & (table["offered"] >= 0.005)]
    assert (offered["covered"] >= 0.93).all(), offered.nsmallest(3, "covered")
    # and not offered where they are known not to: 200 trials of a lognormal
    refused = table[
        (table["statistic"] == "sigma")
        & ((table["trials"] == 200) | (table["problem"] == "lognormal"))
    ]
    assert (refused["offered"] < 0.001).all()


@pytest.mark.parametrize(
    ("name", "size", "of"),
    [
        ("normal", 1000, intervals),
        ("mixture with an atom", 1000, intervals),
        ("linear stack", 200, intervals),
        ("lognormal", FIRST, stopped),
    ],
)
def test_the_table_can_be_measured_again(table, name, size, of):
    """200 new studies agree with it."""
    again = pd.DataFrame(measure(name, size, 200, seed=1, of=of))
    known = table[(table["problem"] == name) & (table["trials"] == size)]
    known = known[known["statistic"].isin(again["statistic"])]
    both = again.merge(known, on="statistic", suffixes=("", "_known"))
    assert len(both) == len(again)
    error = np.sqrt(0.05 * 0.95 / 200)
    assert (both["missed"] < both["missed_known"] + 4 * error).all()
    assert (both["offered"] - both["offered_known"]).abs().max() < 0.15

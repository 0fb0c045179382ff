"""Coverage of intervals: in the measured table, and in new studies."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from tests.studies.coverage.appendix import LEAST, PAGE, page
from tests.studies.coverage.comparing_problems import intervals as of_designs
from tests.studies.coverage.halving_problems import intervals as of_halving
from tests.studies.coverage.index_problems import intervals as of_indices
from tests.studies.coverage.measure import FAMILIES, TABLE, digest, measure
from tests.studies.coverage.one_response import failing, intervals, until_quantile
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.statistics.sample_size import FIRST_STAGE

SURE = 3.5  # standard errors
EXACT, APPROXIMATE = 0.95, 0.93  # what they claim to cover
ENOUGH = 500  # intervals in a cell, from which the share that holds is told


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(TABLE)


def test_the_table_is_of_this_code_and_whole(table):
    """Else: python -m tests.studies.coverage.measure."""
    codes = {digest(family): family for family in FAMILIES}
    assert set(table["code"]) == set(codes)
    for code, family in codes.items():
        rows = table[table["code"] == code]
        asked = {(name, size) for name, size, *_ in family.JOBS}
        asked = {(n, s) for n, s in asked if n != "replicates"}
        assert asked <= set(zip(rows["problem"], rows["trials"], strict=True))


def test_the_page_matches_the_table():
    """Else: python -m tests.studies.coverage.appendix."""
    assert PAGE.read_text() == page()


def least_covered(claim, studies):
    """The least coverage that so many studies may show of an interval that keeps it."""
    return claim - SURE * np.sqrt(claim * (1 - claim) / studies)


def test_in_the_table_exact_intervals_do_not_miss_too_often(table):
    exact = table[table["exact"] & (table["offered"] >= LEAST)]
    least = least_covered(EXACT, exact["offered"] * exact["studies"])
    assert (exact["covered"] >= least).all(), exact[exact["covered"] < least]


SMOOTH = (
    "normal", "lognormal", "strongly skewed", "Student t4", "2 in 1000 of another kind",
)  # fmt: skip


def coverage_of_quantile(share, n):
    """How often the order-statistic interval covers, for a continuous response."""
    found = quantiles(np.arange(1.0, n + 1), [share])[share]  # its ranks
    low, high = int(found.lower), int(found.upper)
    return binom.cdf(high - 1, n, share) - binom.cdf(low - 1, n, share)


def test_in_the_table_quantiles_have_their_binomial_coverage(table):
    rows = table[table["statistic"].str.fullmatch(r"quantile [0-9.]+")]
    rows = rows[rows["problem"].isin(SMOOTH) & (rows["offered"] > 0)]
    assert len(rows) == len(SMOOTH) * (1 + 3 + 4 + 6)
    for row in rows.itertuples():
        share = float(row.statistic.split()[1])
        known = coverage_of_quantile(share, row.trials)
        error = np.sqrt(known * (1 - known) / row.studies)
        # the farthest of seventy
        assert abs(row.covered - known) < 4 * error + 1e-4, row


def test_in_the_table_approximate_intervals_are_offered_only_where_they_cover(table):
    assert (table["missed"][table["offered"] < LEAST] < LEAST).all()
    offered = table[~table["exact"] & (table["offered"] >= LEAST)]
    given = offered["offered"] * offered["studies"]
    # fewer intervals than that cannot tell
    least = np.where(given < ENOUGH, least_covered(APPROXIMATE, given), APPROXIMATE)
    assert (offered["covered"] >= least).all(), offered.nsmallest(3, "covered")


# the cheapest cells in which every kind of interval that needs few trials is offered
NEW = {
    ("normal", 200): (intervals, 1000),
    ("Student t4", 1000): (intervals, 500),
    ("1 in 50 jams", 200): (intervals, 1000),
    ("1 in 100 jams, as a share", 200): (intervals, 500),
    ("lognormal", 1000): (failing, 500),
    ("linear stack", 200): (of_indices, 300),
    ("too alike, 5 % beyond", 1000): (of_halving, 400),
    ("lognormal", FIRST_STAGE): (until_quantile, 500),
    ("the other way: in part", 200): (of_designs, 500),
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


def test_new_studies_have_the_claimed_and_the_measured_coverage(again):
    new = again[~again["narrower"]]
    assert not disagrees(new).any(), new[disagrees(new)]
    offered = new[new["offered"] > 0]
    claimed = np.where(offered["exact"], EXACT, APPROXIMATE)
    studies = offered["offered"] * offered["studies"]
    assert (offered["covered"] >= least_covered(claimed, studies)).all(), offered


def test_new_studies_detect_an_interval_that_is_too_narrow(again):
    broken = again[again["narrower"] & (again["offered"] > 0)]
    # those that are wide to be sure of all shapes stay sure
    broken = broken[(broken["covered_known"] < 0.985) & (broken["offered_known"] == 1)]
    if broken.empty:
        assert (again["covered_known"][again["offered_known"] == 1] >= 0.985).all()
        return
    assert disagrees(broken).all(), broken[~disagrees(broken)]

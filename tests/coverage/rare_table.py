"""What rare runs say of known shares: a table for tolstat/statistics/README.md.

    python -m tests.coverage.rare_table

Prints it; what it says was measured for tests/coverage/table.csv.
"""

from __future__ import annotations

import pandas as pd
from scipy.stats import binomtest

from tests.coverage.measure import TABLE
from tests.coverage.rare_problems import RARE_PROBLEMS


def row(measured):
    """Return a line of the table."""
    share = RARE_PROBLEMS[measured.problem]().share
    held = binomtest(round(measured.studies * measured.covered), measured.studies)
    low, high = held.proportion_ci()
    return (
        f"| {measured.problem} | {share:.3g} | {measured.trials} | {measured.studies} "
        f"| {100 * measured.covered:.1f} ({100 * low:.1f} to {100 * high:.1f}) |"
    )


def main():
    """Print the table."""
    print("| problem | share | trials | studies | covered, % |")
    print("|---|---|---|---|---|")
    table = pd.read_csv(TABLE)
    table = table[table["problem"].isin(RARE_PROBLEMS) & (table["offered"] == 1)]
    for measured in table.itertuples():
        print(row(measured))


if __name__ == "__main__":
    main()

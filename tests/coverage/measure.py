"""How often intervals cover what they claim: written to tests/coverage/table.csv.

    python -m tests.coverage.measure          # 4000 studies each; a quarter of an hour

Exact intervals may miss too seldom, but not too often; approximate ones are offered
only where they cover at least 93 % on every problem. "offered" is the share of studies
that got an interval, "covered" the share of these that hold the truth, "missed" the
share of all studies that print an interval without it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from tests.coverage.problems import PROBLEMS, SIZES
from tolstat.statistics.capability import by_moments, by_percentiles
from tolstat.statistics.moments import deviation_of, mean_of
from tolstat.statistics.proportions import proportion
from tolstat.statistics.quantiles import quantile

TABLE = Path(__file__).with_name("table.csv")
STUDIES = 4000
LIMIT = 0.995  # the limit stands where this share of the machines is within


def statistics(problem):
    """Name each interval, how to compute it, and its true value."""
    end = problem.quantile(LIMIT)
    middle, far = problem.quantile(0.5), problem.quantile(0.99865)
    found = {
        f"quantile {share:g}": (
            lambda x, share=share: quantile(x, share), problem.quantile(share), True,
        )
        for share in (0.00135, 0.05, 0.5, 0.95, 0.99, 0.99865)
    }  # fmt: skip
    found["share beyond"] = (
        lambda x: proportion(int((x > end).sum()), len(x)),
        float(1 - problem.cdf(end)), True,
    )  # fmt: skip
    found["mean"] = (mean_of, problem.mean, False)
    found["standard deviation"] = (deviation_of, problem.deviation, False)
    found["Ppk by percentiles"] = (
        lambda x: by_percentiles(x, (-np.inf, end)).ppk,
        float((end - middle) / (far - middle)), True,
    )  # fmt: skip
    found["Ppk by moments"] = (
        lambda x: by_moments(x, (-np.inf, end)).ppk,
        float((end - problem.mean) / (3 * problem.deviation)), False,
    )  # fmt: skip
    return found


def measure(name, size, studies, seed=75):
    """Return one row for each interval on one problem at one size."""
    problem = PROBLEMS[name]
    asked = statistics(problem)
    rng = np.random.default_rng([seed, size, sorted(PROBLEMS).index(name)])
    counts = {each: [0, 0] for each in asked}
    for _ in range(studies):
        x = problem.draw(rng, size)
        for each, (interval, truth, _) in asked.items():
            found = interval(x)
            if np.isnan(found.lower) or np.isnan(found.upper):
                continue
            counts[each][0] += 1
            counts[each][1] += found.lower <= truth <= found.upper
    return [
        {
            "problem": name,
            "trials": size,
            "statistic": each,
            "exact": asked[each][2],
            "studies": studies,
            "offered": round(offered / studies, 4),
            "covered": round(covered / offered, 4) if offered else np.nan,
            "missed": round((offered - covered) / studies, 4),
        }
        for each, (offered, covered) in counts.items()
    ]


def main():
    """Measure everything and write the table."""
    rows = []
    for name in PROBLEMS:
        for size in SIZES:
            rows += measure(name, size, STUDIES)
            print(f"{name}, {size} trials", file=sys.stderr, flush=True)
    pd.DataFrame(rows).to_csv(TABLE, index=False)


if __name__ == "__main__":
    main()

"""What rare runs say of known shares: a table for tolstat/statistics/README.md.

    python -m tests.coverage.rare_table      # prints it; half an hour

The studies are those of tests/coverage/table.csv.
"""

from __future__ import annotations

import sys
import zlib
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from scipy.stats import binomtest

from tests.coverage.measure import PARTS
from tests.coverage.rare_problems import JOBS, RARE_PROBLEMS, intervals


def told(name, size, studies, part, seed=75):
    """Return what the studies of a part say, in the order of `measure.counted`."""
    rng = np.random.default_rng([seed, size, zlib.crc32(name.encode()), part])
    return [next(intervals(name, rng, size))[2] for _ in range(studies // PARTS)]


def row(name, size, estimates):
    """Return a line of the table."""
    share = RARE_PROBLEMS[name]().share
    sure = [each for each in estimates if each.sure]
    held = sum(each.lower <= share <= each.upper for each in sure)
    low, high = binomtest(held, len(sure)).proportion_ci()
    some = [each for each in sure if each.value > 0]
    widths = [(each.upper - each.lower) / each.value for each in some]
    width = f"{np.median(widths):.3f}" if some else "none"
    if some:
        ends = np.array([each.value for each in some]) / share
        ratios = f"{ends.min():.2f} to {ends.max():.2f}"
    else:
        ratios = f"0, below {max(each.upper for each in sure):.2g}"
    none = len(estimates) - len(some)
    return (
        f"| {name} | {share:.3g} | {size} | {len(estimates)} "
        f"| {100 * held / len(sure):.1f} "
        f"({100 * low:.1f} to {100 * high:.1f}) | {width} | {ratios} | {none} |"
    )


def main():
    """Measure all, and print the table."""
    heads = "problem | share | trials | studies | covered, % | width | told over true"
    print(f"| {heads} | 0 told |")
    print("|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor() as workers:
        jobs = {
            (name, size): [
                workers.submit(told, name, size, studies, part) for part in range(PARTS)
            ]
            for name, size, _, studies in JOBS
        }
        for (name, size), parts in jobs.items():
            estimates = [each for part in parts for each in part.result()]
            print(row(name, size, estimates))
            sys.stdout.flush()


if __name__ == "__main__":
    main()

"""Cost of allocated tolerances above a known optimum.

python -m tests.studies.benchmarks.allocating         # two minutes; prints a table

Sums of parts with reciprocal costs: of normal parts the optimum is Lagrange's, of
uniform ones that cost alike all tolerances are the same. By default, ten seeds each.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response

SEEDS = range(3, 13)
AT, LIMIT = 0.1e-3, 0.2e-3  # m: of the prices, to either side of the sum


class Sum(Model):
    """A weighted sum of parts."""

    name = "sum"
    title = "sum of parts"

    def __init__(self, slopes: tuple[float, ...]) -> None:
        self.slopes = np.array(slopes)

    def describe(self, settings):
        links = (
            Contributor(f"link_{i + 1}", "m", f"l{i + 1}", "a link")
            for i in range(len(self.slopes))
        )
        return Description(tuple(links), (Response("gap", "m", "g", "the gap"),))

    def evaluate(self, deviations, settings):
        return Outcome((deviations * self.slopes).sum(axis=1)[:, None])


class Problem(NamedTuple):
    """Parts, each with a slope and a price at +-0.1 mm, and the share permitted."""

    words: str
    distribution: str
    slopes: tuple[float, ...]
    prices: tuple[float, ...]
    share: float = 0.02

    @property
    def study(self) -> dict:
        cost = {"law": "reciprocal", "at": "+-0.1 mm"}
        ends = {"tightest": "+-0.01 mm", "loosest": "+-0.6 mm"}
        lines = {
            f"link_{i + 1}": {
                "tolerance": "+-0.1 mm",
                "distribution": self.distribution,
                "cost": {**cost, **ends, "price": price},
            }
            for i, price in enumerate(self.prices)
        }
        limit = {"limit": "-0.2..0.2 mm", "yield": f"{100 * (1 - self.share):.6g} %"}
        return {"model": "sum", "deviations": lines, "limits": {"gap": limit}}

    @property
    def least(self) -> float:
        """The cost of the cheapest tolerances."""
        a, c = np.abs(self.slopes), AT * np.array(self.prices)
        if self.distribution == "normal":
            T = (c / a**2) ** (1 / 3)
            T *= LIMIT / -ndtri(self.share / 2) / math.sqrt(np.sum((a * T / 3) ** 2))
            return float(np.sum(c / T))
        n = len(c)
        reach = brentq(lambda x: 2 * _beyond(n, x) - self.share, 0.0, n)
        return float(n * c[0] * reach / LIMIT)


def _beyond(n: int, x: float) -> float:
    """Return the share of sums of n numbers, even from -1 to 1, that exceed x."""
    y = (x + n) / 2  # Irwin and Hall
    terms = (
        (-1) ** k * math.comb(n, k) * (y - k) ** n for k in range(math.floor(y) + 1)
    )
    return 1 - math.fsum(terms) / math.factorial(n)


THREE = (1.0, -2.0, 0.5), (5.0, 20.0, 2.0)
FIVE = (1.0, -1.0, 2.0, 0.5, 1.0), (5.0, 1.0, 9.0, 2.0, 3.0)
PROBLEMS = (
    Problem("three normal parts", "normal", *THREE),
    Problem("the same, 0.27 % beyond", "normal", *THREE, share=0.0027),
    Problem("five normal parts", "normal", *FIVE),
    Problem("two uniform parts alike", "uniform", (1.0, -1.0), (2.0, 2.0)),
    Problem("five uniform parts alike", "uniform", (1.0,) * 5, (2.0,) * 5),
)


def main() -> None:
    """Print the table."""
    print(f"{'':28} {'seed':>4} {'above optimum':>13} {'machines':>10} {'seconds':>8}")
    for each in PROBLEMS:
        for seed in SEEDS:
            began = time.perf_counter()
            given = {**each.study, "seed": seed, "trials": 1000}
            found = tolstat.allocate(given, model=Sum(each.slopes))
            assert found.met
            took = time.perf_counter() - began
            above = found.cost / each.least - 1
            machines = found.wide_trials + sum(found.fresh_trials)
            print(
                f"{each.words:28} {seed:4d} {above:13.2%} {machines:10d} {took:8.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()

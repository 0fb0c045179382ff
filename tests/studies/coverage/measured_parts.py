"""How often intervals hold that rest on few measured parts: measured_parts.csv.

    python -m tests.studies.coverage.measured_parts          # 400 studies a cell
    python -m tests.studies.coverage.measured_parts 40       # a first look
    python -m tests.studies.coverage.measured_parts 400 fresh    # an hour

"fresh" are other numbers of parts, other shapes, two to four contributors. No constant
of the package was chosen by them. That the lower end never rests on the form of a tail
was, by two cells of heavy tails. Their table is measured_parts_fresh.csv.

A response is the sum of one to five measured contributors and of a normal one. Its
limit permits 2700 ppm, and so many are out of it, or a quarter more. The populations
are those that the package draws from the parts. Their shares are averages over fixed
unit samples, in closed form over the normal contributor: no error of trials hides that
of parts. The limit has its share by the same average over the true population.

"covered" is the share of studies whose interval holds the truth. "met, wrongly" is the
share that says so where a quarter more are out of limit. "normal" is the interval
that assumes a normal population, "any" the one that decides without a fit.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.special import gammaincinv, ndtr, ndtri, stdtrit
from scipy.stats import qmc

from tolstat.statistics.measured.populations import MeasuredSample
from tolstat.statistics.summary import ENDS

TABLE = Path(__file__).with_name("measured_parts.csv")
STUDIES, PERMITTED, OTHERS, MORE = 400, 0.0027, 0.75, 1.25
DRAWS = 39  # the least and the largest are the ends of 95 %
PARTS = (5, 10, 30, 100, 1000)
CELLS = [
    (kind, fit, parts, contributors)
    for contributors in (1, 5)
    for kind in ("normal", "skewed")
    for fit in ("", "normal")
    for parts in PARTS
    if not fit or (kind == "normal" and parts >= 8)
]


FRESH = [
    *((kind, "", parts, contributors)
      for kind, parts, contributors in (
          ("normal", 7, 2), ("normal", 20, 3), ("normal", 60, 4), ("normal", 400, 2),
          ("skewed", 7, 3), ("skewed", 20, 2), ("skewed", 60, 1), ("skewed", 200, 4),
          ("skewed", 1000, 1), ("skewed", 1000, 3),
          ("very skewed", 15, 1), ("very skewed", 50, 2), ("very skewed", 200, 1),
          ("very skewed", 1000, 1),
          ("heavy", 15, 2), ("heavy", 50, 1), ("heavy", 200, 3), ("heavy", 1000, 1),
          ("heavy", 200, 1), ("heavy", 1000, 3),
          ("uniform", 15, 3), ("uniform", 50, 1), ("uniform", 200, 2),
          ("two kinds", 20, 1), ("two kinds", 60, 3), ("two kinds", 400, 1),
      )),
    *(("normal", "normal", parts, contributors)
      for parts, contributors in ((8, 3), (20, 2), (60, 4), (400, 1))),
]  # fmt: skip


def population(kind, unit):
    """Return parts of mean 0 and sigma 1: of skewness 1 or 2, of kurtosis 9, ..."""
    match kind:
        case "normal":
            return ndtri(unit)
        case "skewed":
            return (gammaincinv(4.0, unit) - 4.0) / 2.0
        case "very skewed":
            return -np.log1p(-unit) - 1.0
        case "heavy":
            return stdtrit(5.0, unit) * np.sqrt(3 / 5)
        case "uniform":
            return np.sqrt(12) * (unit - 0.5)
        case "two kinds":  # two bells, 3 sigma apart
            values = np.linspace(-6, 6, 4001)
            share = (ndtr(values - 1.5) + ndtr(values + 1.5)) / 2
            return np.interp(unit, share, values) / np.sqrt(1 + 1.5**2)
    raise ValueError(kind)


@cache
def unit_samples(contributors):
    """Return unit samples, float64[contributor, point], and their weights."""
    if contributors == 1:  # evenly in normal scores, so that tails are resolved
        score = np.linspace(-6, 6, 121)
        density = np.exp(-(score**2) / 2)
        return ndtr(score)[None], density / density.sum()
    unit = qmc.Sobol(contributors, rng=1).random_base2(7).T
    return unit, np.full(unit.shape[1], 1 / unit.shape[1])


def share_out(values, limit):
    """Return the share out of limit, of float64[..., contributor, point]."""
    sums = values.sum(axis=-2) / np.sqrt(values.shape[-2])
    _, weights = unit_samples(values.shape[-2])
    return ndtr((sums - limit) / OTHERS) @ weights


@cache
def limit_of(kind, contributors, share):
    """Return the end that such a share is beyond."""
    values = population(kind, unit_samples(contributors)[0])
    return brentq(lambda end: share_out(values, end) - share, 0, 20)


def drawn(samples, rng, limits, **how):
    """Return the shares out of limits in populations of these parts: [limit, draw]."""
    unit, _ = unit_samples(len(samples))
    values = [
        [deviations(u) for deviations in sample.populations(DRAWS, rng, **how)]
        for sample, u in zip(samples, unit, strict=True)
    ]
    values = np.moveaxis(np.array(values), 0, 1)
    return np.array([share_out(values, end) for end in limits])


def study(rng, kind, fit, parts, contributors):
    """Return the intervals of the share for fresh parts: float64[limit, end]."""
    limits = [limit_of(kind, contributors, r * PERMITTED) for r in (1.0, MORE)]
    samples = [
        MeasuredSample(f"part_{i}", (f"part_{i}",), np.sort(values), fit, 0.5)
        for i, values in enumerate(
            population(kind, rng.random((contributors, parts)))
        )
    ]  # fmt: skip
    shares = drawn(samples, rng, limits, fitted=bool(fit))
    lower, upper = np.quantile(shares, ENDS, axis=1, method="weibull")
    if not fit:  # as `uncertainties_of` has it
        inside = drawn(samples, rng, limits, fitted=False, tails=False)
        least = np.quantile(inside, ENDS[0], axis=1, method="weibull")
        lower = np.minimum(lower, least)
    return np.stack([lower, upper], axis=1)


def measured(studies, cells=CELLS, table=TABLE):
    """Return a row for each cell."""
    rows = []
    for cell in cells:
        kind, fit, parts, contributors = cell
        rng = np.random.default_rng([75, parts, contributors, len(kind), len(fit)])
        found = np.array([study(rng, *cell) for _ in range(studies)])
        lower, upper = found[:, 0].T
        rows.append({
            "parts are": kind, "interval": fit or "any", "parts": parts,
            "contributors": contributors, "studies": studies,
            "covered": np.mean((lower <= PERMITTED) & (upper >= PERMITTED)),
            "missed below": np.mean(upper < PERMITTED),
            "met, wrongly": np.mean(found[:, 1, 1] <= PERMITTED),
            "median lower, ppm": round(1e6 * np.median(lower)),
            "median upper, ppm": round(1e6 * np.median(upper)),
        })  # fmt: skip
        print(rows[-1], file=sys.stderr, flush=True)
        pd.DataFrame(rows).to_csv(table, index=False)
    return rows


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else STUDIES
    if sys.argv[2:] == ["fresh"]:
        measured(number, FRESH, TABLE.with_stem("measured_parts_fresh"))
    else:
        measured(number)

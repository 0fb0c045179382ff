"""How often intervals hold that rest on few measured parts: measured_parts.csv.

    python -m tests.studies.coverage.measured_parts          # 400 studies a cell
    python -m tests.studies.coverage.measured_parts 40       # a first look

A response is the sum of one to five measured contributors and of a normal one. Its
limit permits 2700 ppm, and so many are out of it, or a quarter more. "covered" is the
share of studies whose interval holds the truth; "met" the share that says so, all of
them wrong where a quarter more are out of limit; "conditional" the share that adds "if
the parts are normal".
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import ndtri
from scipy.stats import anderson

from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET, Caveat, yield_of
from tolstat.statistics.measured.doubt import MeasuredTrials, doubts_of
from tolstat.statistics.measured.populations import MeasuredSample
from tolstat.statistics.sample import Sample
from tolstat.status import Status

TABLE = Path(__file__).with_name("measured_parts.csv")
TRIALS, STUDIES, PERMITTED, OTHERS = 4096, 400, 0.0027, 0.75
PARTS = (5, 10, 30, 100, 1000)
CELLS = [
    (kind, fit, parts, contributors, ratio)
    for kind in ("normal", "skewed")
    for fit in ("", "normal")
    for contributors in (1, 5)
    for parts in PARTS
    for ratio in (1.0, 1.25)
    if not fit or parts >= 8
]


def population(kind, shape, rng):
    """Return parts of mean 0 and sigma 1, of skewness 0 or 1."""
    if kind == "normal":
        return rng.standard_normal(shape)
    return (rng.gamma(4.0, 1.0, shape) - 4.0) / 2.0


@cache
def limit(kind, contributors, ratio):
    """Return the end that so many times 2700 ppm are beyond."""
    rng = np.random.default_rng(1)
    y = np.sum([population(kind, 4_000_000, rng) for _ in range(contributors)], axis=0)
    y = y / np.sqrt(contributors) + OTHERS * rng.standard_normal(len(y))
    return float(np.quantile(y, 1 - ratio * PERMITTED))


@cache
def _null(parts):
    """Return the statistic of Anderson and Darling for normal samples, ascending."""
    rng = np.random.default_rng(2)
    return np.sort([_statistic(rng.standard_normal(parts)) for _ in range(999)])


def _statistic(x):
    return anderson(x, method="interpolate").statistic


def study(rng, kind, fit, parts, contributors, ratio):
    """Return the yield of a study of fresh parts and fresh trials."""
    samples, x = [], {"other": OTHERS * rng.standard_normal(TRIALS)}
    for number in range(contributors):
        values, u = np.sort(population(kind, parts, rng)), rng.random(TRIALS)
        p_value, name = np.nan, f"part_{number}"
        x[name] = values[(u * parts).astype(int)]
        if fit:
            rank = np.searchsorted(_null(parts), _statistic(values))
            p_value = (len(_null(parts)) - rank + 1) / (len(_null(parts)) + 1)
            x[name] = values.mean() + values.std(ddof=1) * ndtri(u)
        samples.append(MeasuredSample(name, (name,), values, fit, p_value))
    scale = {n: 1.0 if n == "other" else contributors**-0.5 for n in x}
    y = np.sum([scale[name] * values for name, values in x.items()], axis=0)
    limits = {"y": Limit(-np.inf, limit(kind, contributors, ratio), 1 - PERMITTED)}
    doubts = doubts_of(MeasuredTrials(tuple(samples), x, {"y": y}, limits), ())
    sample = Sample(np.full(TRIALS, Status.DONE))
    return yield_of(
        y, sample, limits["y"].permitted, 1 - PERMITTED, measured=doubts["y"].share
    )


def measured(studies, cells=CELLS):
    """Return a row for each cell."""
    rows = []
    for number, cell in enumerate(cells):
        rng, truth = np.random.default_rng([75, number]), cell[-1] * PERMITTED
        yields = [study(rng, *cell) for _ in range(studies)]
        shares = [x.fraction_out_of_limit for x in yields]
        met = [x for x in yields if x.verdict == MET]
        rows.append({
            **dict(zip(["parts are", "fit", "parts", "contributors", "p/p0"], cell,
                       strict=True)),
            "studies": studies,
            "covered": np.mean([x.lower <= truth <= x.upper for x in shares]),
            "met": sum(x.reason == Caveat.NONE for x in met) / studies,
            "conditional": sum(x.reason != Caveat.NONE for x in met) / studies,
            "median lower, ppm": round(1e6 * np.median([x.lower for x in shares])),
            "median upper, ppm": round(1e6 * np.median([x.upper for x in shares])),
        })  # fmt: skip
        print(rows[-1], file=sys.stderr, flush=True)
        pd.DataFrame(rows).to_csv(TABLE, index=False)
    return rows


if __name__ == "__main__":
    measured(int(sys.argv[1]) if len(sys.argv) > 1 else STUDIES)

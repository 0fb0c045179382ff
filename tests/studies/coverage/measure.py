"""How often intervals cover what they claim: written to tests/studies/coverage/table.csv.

    python -m tests.studies.coverage.measure          # what changed since; --all: everything

Exact intervals may miss too seldom, but not too often; approximate ones are offered
only where they cover at least 93 % on every problem. "offered" is the share of studies
that got an interval, "covered" the share of these that hold the truth, "missed" the
share of all studies that print an interval without it. "code" is the digest of what
made the row: the suite refuses rows of other code.
"""

from __future__ import annotations

import sys
import zlib
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import numpy as np
import pandas as pd

from tests.studies.coverage import (
    comparing_problems,
    halving_problems,
    index_problems,
    one_response,
    rare_problems,
    weighting_problems,
)
from tolstat.lanes import digest as code

FAMILIES = (
    one_response,
    index_problems,
    halving_problems,
    comparing_problems,
    rare_problems,
    weighting_problems,
)
TABLE = Path(__file__).with_name("table.csv")
PARTS = 4  # that the studies of a cell are measured in, side by side
CELL = ["problem", "trials", "statistic", "exact"]


def counted(name, size, studies, seed=75, of=one_response.intervals, part=0):
    """Count offered intervals and those that hold the truth, on one problem or all."""
    rng = np.random.default_rng([seed, size, zlib.crc32(name.encode()), part])
    counts = {}
    for _ in range(studies):
        for problem, each, found, truth, exact in of(name, rng, size):
            count = counts.setdefault((problem, size, each, exact), [0, 0])
            if np.isnan(found.lower) or np.isnan(found.upper):
                continue
            count[0] += 1
            # a share by counting: what is one rounding away is the same
            near = 1e-12 * abs(truth)
            count[1] += found.lower - near <= truth <= found.upper + near
    rows = [(*cell, studies, *count) for cell, count in counts.items()]
    return pd.DataFrame(rows, columns=[*CELL, "studies", "given", "held"])


def rates(counts):
    """Return one row for each interval on one problem at one size."""
    found = counts.groupby(CELL, as_index=False, sort=True).sum()
    given, held, studies = found.pop("given"), found.pop("held"), found["studies"]
    found["offered"] = (given / studies).round(4)
    found["covered"] = (held / given).round(4)
    found["missed"] = ((given - held) / studies).round(4)
    return found


def measure(name, size, studies, seed=75, of=one_response.intervals):
    """Count in one go, and return the rates."""
    return rates(counted(name, size, studies, seed, of))


def digest(family):
    """Digest the code that measures a family of problems."""
    return code.digest(Path(family.__file__))[:12]


def main():
    """Measure what the table does not say, or says of other code, and write it."""
    codes = {family: digest(family) for family in FAMILIES}
    old = pd.read_csv(TABLE) if TABLE.exists() else pd.DataFrame({"code": []})
    kept = old[old["code"].isin(codes.values())]
    if "--all" in sys.argv:
        kept = kept[:0]
    stale = [f for f in FAMILIES if codes[f] not in set(kept["code"])]
    rows = [kept]
    for family in stale:
        if hasattr(family, "simulated"):
            family.simulated()  # once, and not in each of the workers
        # the longest first
        jobs = sorted(family.JOBS, key=lambda job: -job[1] * job[3])
        with ProcessPoolExecutor() as workers:
            parts = {
                workers.submit(counted, name, size, studies // PARTS, 75, of, part): (
                    f"{name}, {size} trials, {of.__name__}"
                )
                for name, size, of, studies in jobs
                for part in range(PARTS)
            }
            counts = []
            for count, done in enumerate(as_completed(parts), 1):
                counts.append(done.result())
                words = f"{count} of {len(parts)}: {parts[done]}"
                print(words, file=sys.stderr, flush=True)
        rows.append(rates(pd.concat(counts)).assign(code=codes[family]))
    table = pd.concat(rows).sort_values(["problem", "trials", "statistic"])
    table.to_csv(TABLE, index=False)


if __name__ == "__main__":
    main()

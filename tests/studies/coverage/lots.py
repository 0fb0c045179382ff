"""How often intervals hold of parts whose lots differ: lots.csv.

    python -m tests.studies.coverage.lots          # 1000 files a cell, ten minutes
    python -m tests.studies.coverage.lots 100      # a first look

Normal parts of variance 1 in equal lots; "between" is the share of it between lots. The
columns are the shares of files whose interval of mean, sigma, Ppk and share outside
holds the truth. Below five lots only the share outside has an interval.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import norm

from tolstat.statistics.capability import Tolerance, capability_of

TABLE = Path(__file__).with_name("lots.csv")
FILES, END = 1000, 2.0
CELLS = [*product((3, 5, 8, 20), (4, 20), (0.0, 0.1, 0.3, 0.6, 0.9))]
TRUTHS = {"mean": 0.0, "sigma": 1.0, "ppk": END / 3, "outside": norm.sf(END)}


def covered(files, lots, parts, between):
    """Return the shares of files whose intervals hold, and of those with intervals."""
    rng = np.random.default_rng([75, lots, parts, int(100 * between)])
    names = [str(lot) for lot in np.repeat(np.arange(lots), parts)]
    holds = {name: [] for name in TRUTHS}
    for _ in range(files):
        means = np.sqrt(between) * rng.standard_normal(lots)
        values = np.repeat(means, parts)
        values += np.sqrt(1 - between) * rng.standard_normal(len(names))
        capability = capability_of(values, Tolerance(upper=END), names)
        for name, truth in TRUTHS.items():
            estimate = getattr(capability, name)
            if estimate.sure:
                holds[name].append(estimate.lower <= truth <= estimate.upper)
    return {"with intervals": len(holds["ppk"]) / files} | {
        name: round(float(np.mean(hits)), 3) if hits else np.nan
        for name, hits in holds.items()
    }


def main(files):
    """Measure all cells."""
    rows = []
    for lots, parts, between in CELLS:
        rows.append(
            {"lots": lots, "parts a lot": parts, "between": between, "files": files}
            | covered(files, lots, parts, between)
        )
        print(rows[-1], file=sys.stderr, flush=True)
        pd.DataFrame(rows).to_csv(TABLE, index=False)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else FILES)

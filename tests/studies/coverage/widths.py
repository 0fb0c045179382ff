"""How wide intervals as sampled are, beside their goals: tests/studies/coverage/widths.csv.

python -m tests.studies.coverage.widths           # half a minute
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import ndtri
from scipy.stats import chi2, t

from tolstat.deviations.samplers import REPLICATES, Latin, Sobol
from tolstat.statistics.sample import Sample, as_sampled
from tolstat.status import Status

TABLE = Path(__file__).with_name("widths.csv")
NORMAL, DEPENDENT = 2000, 200  # studies
SIZE = 4096  # of Latin hypercube and Sobol' trials
SMOOTH = {
    "a sum": lambda z: z @ [3.0, 2.0, 1.0],
    "a product and a square": lambda z: z[:, 0] * z[:, 1] + z[:, 2] ** 2,
    "an exponential": lambda z: np.exp(0.3 * z @ [1.0, 1.0, 1.0]),
}
TRUTH = {
    "a sum": 0.0, "a product and a square": 1.0, "an exponential": np.exp(0.135),
}  # fmt: skip


def of_normal_responses(rng):
    """Yield the mean width of normal responses over the classical one."""
    for n in (300, 1000):
        sample = Sample(np.full(n, Status.DONE))
        found = [as_sampled(rng.normal(size=n), sample) for _ in range(NORMAL)]
        ends = np.sqrt((n - 1) / chi2.ppf([0.025, 0.975], n - 1))
        classical = {
            "mean": (0.0, 2 * t.ppf(0.975, n - 1) / np.sqrt(n)),
            "sigma": (1.0, ends[0] - ends[1]),
        }
        for name, (truth, width) in classical.items():
            every = [getattr(each, name) for each in found]
            wide = np.mean([each.upper - each.lower for each in every]) / width
            held = np.mean([each.lower <= truth <= each.upper for each in every])
            yield (
                f"{name} of a normal response, width over the classical",
                n,
                wide,
                held,
            )


def of_dependent_trials(rng):
    """Yield the mean half width over the scatter of the mean between studies."""
    sample = Sample(np.full(SIZE, Status.DONE), REPLICATES)
    streams = {"a": 0, "b": 1, "c": 2}
    for sampler in (Latin(), Sobol()):
        found = {name: [] for name in SMOOTH}
        for _ in range(DEPENDENT):
            seed = int(rng.integers(2**62))
            z = ndtri(sampler.unit_samples(seed, streams, SIZE))
            for name, response in SMOOTH.items():
                found[name].append(as_sampled(response(z), sample).mean)
        words = type(sampler).__name__
        for name, every in found.items():
            half = np.mean([each.upper - each.lower for each in every]) / 2
            wide = half / np.std([each.value for each in every])
            held = np.mean([x.lower <= TRUTH[name] <= x.upper for x in every])
            yield f"mean of {name}, {words}, half width over scatter", SIZE, wide, held


def lines(table):
    """Yield the lines of the table, with the goals."""
    yield "| number | trials | found | goal | covers, % |"
    yield "|---|---|---|---|---|"
    for each in table.itertuples():
        goal = "0.9 to 1.1" if "normal" in each.number else "at most 3"
        yield (
            f"| {each.number} | {each.trials} | {each.found:.2f} | {goal} "
            f"| {100 * each.covered:.1f} |"
        )


def main():
    """Measure, and write the table."""
    rng = np.random.default_rng(75)
    rows = [*of_normal_responses(rng), *of_dependent_trials(rng)]
    head = ["number", "trials", "found", "covered"]
    pd.DataFrame(rows, columns=head).round(4).to_csv(TABLE, index=False)


if __name__ == "__main__":
    main()

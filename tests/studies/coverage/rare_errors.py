"""Errors of the estimates of rare runs, from the studies of the coverage table.

    python -m tests.studies.coverage.rare_errors

It writes tests/studies/coverage/rare.md: for each problem the root-mean-square error over the
true fraction, how often the 95 % interval contains this fraction, and half the width of
the interval over the standard deviation of the estimates.
"""

from __future__ import annotations

import zlib
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from tests.studies.coverage.measure import PARTS
from tests.studies.coverage.rare_problems import JOBS, RARE_PROBLEMS, intervals

PAGE = Path(__file__).with_name("rare.md")
HEAD = """# Rare failures: errors of the estimates

Of {studies} studies of each problem:

- root-mean-square error, in per cent of the true fraction (aim: at most 10 up to ten
  parts, 20 up to a hundred);
- 95 % intervals that contain the true fraction (aim: at least 93 %);
- median half width of the interval over the standard deviation of the estimates (aim:
  at most 5).

A missed aim is in bold type. The coverage is uncertain by 4 percentage points.

*`python -m tests.studies.coverage.rare_errors`, 2026-11-26.*

| problem | parts | trials | rms error, % | coverage, % | half width / sigma |
|---|---|---|---|---|---|
"""


def studies(name, size, number, part):
    """Return float64[study, 4]: value, lower, upper end and true fraction."""
    rng = np.random.default_rng([75, size, zlib.crc32(name.encode()), part])
    found = [next(iter(intervals(name, rng, size))) for _ in range(number)]
    return np.array([(e.value, e.lower, e.upper, t) for *_, e, t, _ in found])


def row(name, size, each):
    """Return the row of a problem."""
    value, lower, upper, share = each.T
    parts = len(RARE_PROBLEMS[name]().distributions)
    scatter = np.std(value)
    if not share.any():
        return f"| {name} | {parts} | {size} | none exists | | |"
    error = 100 * np.sqrt(np.mean((value / share - 1) ** 2))
    held = 100 * np.mean((lower <= share) & (share <= upper))
    width = np.median(upper - lower) / 2 / scatter
    aims = error <= (10 if parts <= 10 else 20), held >= 93, width <= 5
    said = [
        text if met else f"**{text}**"
        for text, met in zip(
            (f"{error:.3g}", f"{held:.3g}", f"{width:.2g}"), aims, strict=True
        )
    ]
    return f"| {name} | {parts} | {size} | {' | '.join(said)} |"


def main():
    """Write the page."""
    with ProcessPoolExecutor() as workers:
        going = {
            (name, size): [
                workers.submit(studies, name, size, number // PARTS, part)
                for part in range(PARTS)
            ]
            for name, size, _, number in JOBS
        }
        rows = [
            row(*job, np.concatenate([part.result() for part in parts]))
            for job, parts in going.items()
        ]
    head = HEAD.format(studies=JOBS[0][3])
    PAGE.write_text(head + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()

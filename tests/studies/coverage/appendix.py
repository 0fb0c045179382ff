"""The measured coverage as a page: tests/studies/coverage/README.md, made of table.csv.

python -m tests.studies.coverage.appendix         # writes it; a test holds the page to it
"""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from tests.studies.coverage import causes, widths
from tests.studies.coverage.measure import TABLE
from tests.studies.coverage.rare_problems import RARE_PROBLEMS

ENOUGH = 100  # intervals, from which the least coverage is told
LEAST = 0.005  # of the studies: with fewer intervals their coverage is not known
PAGE = TABLE.with_name("README.md")
TEXT = """# How often the intervals hold

Problems with known answers were studied again and again, 1000 studies of each problem
and size. There are exceptions:

- 4000 studies of halved tolerances;
- 500 studies of 10 000 replicated trials;
- 400 studies of 400 weighted trials, 100 of 4096;
- 200 studies of rare runs ([errors](rare.md));
- 600 studies of two designs, 300 with 10 000 trials;
- 100 to 1000 studies of what was measured last, 40 to 120 with 10 000 trials:
  contributions, Ppk by moments, numbers "as printed", stopping rules, paired quantiles.

*Measured by `python -m tests.studies.coverage.measure`, 2026-11-22 to 26, three hours
of processor time, into [`table.csv`](table.csv). This page by `python -m
tests.studies.coverage.appendix`.* Tests hold the table to the code, the page to the
table, and new studies to both.

## Widths

*`python -m tests.studies.coverage.widths`, 2026-11-24.*

{widths}

## All statistics

- "On": the [problems](#problems) on which at least one study of 200 was offered an
  interval.
- "Of": the number of problems tried.
- "Offered": the least share of studies with an interval.
- "Covers": the least coverage in any problem and size with 100 intervals or more,
  rounded down. Of 400 studies of an interval that covers 95 %, some show 93 %.
- "As printed": as sampled, and for any distribution where few trials dominate. Problems
  with a kind of trial that a study expects fewer than five times are left out: these
  intervals assume none.

{claims}

Where fewer than 500 studies show less than 93 %, the difference is not significant.

These are printed with an interval, but were not measured:

- Pp;
- Pp and Ppk by percentiles of weighted trials;
- Ppk of limits with two ends, and their differences;
- "as printed", by moments and with stopping rules: trials of the stand;
- stopping rules other than the two in the table;
- Saltelli's design with 10 000 groups.

## Rare failures

"Covered" stands with its exact binomial interval at 95 %.

{rare}

Shares of the branches, bent limits, the Weibull part and the bounded zones are by
quadrature, all others in closed form. "Past the end" has share 0.

## Main causes

Each cell is 200 studies of 2048 trials with 20 contributors, unless said otherwise.

- "Wrong", of a limit: an innocent part is named, or a pair that is none. Or a part is
  named without its twin.
- "Right": the first named cause is a planted one.
- With a second limit, "wrong" is the mean over both limits. "Right" holds for both.

*`python -m tests.studies.coverage.causes`, 2026-11-25, 10 minutes of processor time.*

{causes}

- In `|a - 3 b|` part a has a tenth of the variance. b alone is a right answer. 40 of
  2048 are 19 500 ppm; half the tolerance of b leaves 42 ppm. "The pair" counts only
  both together.
- Told b, the 3 and the limit, a likelihood-ratio test finds a in 95, 100 and 100 %.
  That is at 10, 20 and 40. Told b alone, the signs of b find it in 52, 86 and 100 %.
  So the pair could be named oftener (`found_if_told` in `causes.py`).
- A weaker part need not be named with a pair: a and b are right of `|2 a + 2 b - c|`.
- **Incomplete pairs are the exception.** The error rate of 5 % holds for innocent
  parts. Of the uneven sum `|a + 2 b - c|` two parts are often named as a pair, without
  the third. So 14, 9.5 and 6.5 % are wrong at 10, 20 and 40. An innocent part is named
  in 2, 2.5 and 5 % (`innocent` in `causes.py`).
- Two other cells have 6 %. Of `|a + b + c|` at 10, an innocent part is named in 2 %. Of
  four equal parts with two limits at 20, in 4 %.

## Problems

- Problems of khpt75 and of rods are trials of the stand. Studies sample from 65 536
  trials of `runs/khpt75.toml`, and of the same with rods of +-0.9 mm alone. At most
  0.5 % are out of limit.
- A problem "of one part" depends on one contributor.
- "Weighted": sums of normal parts and their exponentials ("skew"), whose parts come
  from other distributions.
- "Some fail": 0.4 % of the trials, those of the largest response.
- "Followed until decided": a share exactly at the demanded one. The printed number of
  trials is added until the verdict falls.

{problems}
"""


def named(table):
    """Return the problems in the order of their numbers."""
    return sorted(table["problem"].unique())


def kind(statistic):
    """Return what several statistics of a table are one of."""
    words = re.sub(r"\bx\d( and x\d)?\b", "a part", statistic)
    words = re.sub(r"quantile (0\.00135|0\.99865)", "quantiles 0.135, 99.865 %", words)
    words = re.sub(
        r"quantile 0\.(05|5|95|99)\b(?! until)", "quantiles 5 to 99 %", words
    )
    return words.replace("sobol", "Sobol'").replace("latin", "Latin")


def runs_of(numbers):
    """Write ascending whole numbers: 1-3, 5."""
    found = []
    for number in numbers:
        if found and found[-1][1] == number - 1:
            found[-1][1] = number
        else:
            found.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in found)


def claims(table):
    """Yield the lines of the table of all statistics."""
    number = {name: i for i, name in enumerate(named(table), 1)}
    table = table.assign(kind=table["statistic"].map(kind))
    yield "| statistic | on | of | trials | offered, % | covers at least, % |"
    yield "|---|---|---|---|---|---|"
    for words, rows in table.groupby("kind", sort=True):
        given = rows[rows["offered"] >= LEAST]
        if given.empty:
            continue
        on = runs_of(sorted({number[name] for name in given["problem"]}))
        sizes = sorted(set(given["trials"]))
        trials = f"{sizes[0]} to {sizes[-1]}" if len(sizes) > 1 else f"{sizes[0]}"
        offered = f"{100 * given['offered'].min():.3g} to 100"
        if given["offered"].min() == 1:
            offered = "100"
        enough = given[given["offered"] * given["studies"] >= ENOUGH]
        if enough.empty:
            continue
        worst = np.floor(1000 * enough["covered"].min()) / 10
        worst = f"{worst:.1f}{', exact' if given['exact'].all() else ''}"
        count = rows["problem"].nunique()
        yield f"| {words} | {on} | {count} | {trials} | {offered} | {worst} |"


def rare(table):
    """Yield the lines of the table of rare failures."""
    yield "| problem | share | trials | studies | covered, % |"
    yield "|---|---|---|---|---|"
    rows = table[table["problem"].isin(RARE_PROBLEMS) & (table["offered"] == 1)]
    for each in rows.itertuples():
        share = RARE_PROBLEMS[each.problem]().share
        held = binomtest(round(each.studies * each.covered), each.studies)
        low, high = held.proportion_ci()
        yield (
            f"| {each.problem} | {share:.3g} | {each.trials} | {each.studies} "
            f"| {100 * each.covered:.1f} ({100 * low:.1f} to {100 * high:.1f}) |"
        )


def numbers(table):
    """Yield the lines of the table of problems."""
    yield "| number | problem |"
    yield "|---|---|"
    yield from (f"| {i} | {name} |" for i, name in enumerate(named(table), 1))


def page():
    """Return the text of the page."""
    table = pd.read_csv(TABLE)
    parts = {"claims": claims, "rare": rare, "problems": numbers}
    made = {k: "\n".join(of(table)) for k, of in parts.items()}
    made["widths"] = "\n".join(widths.lines(pd.read_csv(widths.TABLE)))
    made["causes"] = "\n".join(causes.lines(pd.read_csv(causes.TABLE)))
    return TEXT.format(**made)


if __name__ == "__main__":
    PAGE.write_text(page())

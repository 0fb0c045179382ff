"""The table of claims in tolstat/statistics/README.md, made of what was measured.

python -m tests.coverage.claims           # prints it; a test holds the README to it
"""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from tests.coverage.measure import TABLE

LEAST = 0.005  # of the studies: with fewer intervals their coverage is not known


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
    """Yield the lines of the table."""
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
        worst = np.floor(1000 * given["covered"].min()) / 10
        worst = f"{worst:.1f}{', exact' if given['exact'].all() else ''}"
        count = rows["problem"].nunique()
        yield f"| {words} | {on} | {count} | {trials} | {offered} | {worst} |"


def main():
    """Print the numbers of the problems, and the table."""
    table = pd.read_csv(TABLE)
    print("; ".join(f"{i} {name}" for i, name in enumerate(named(table), 1)))
    print("\n".join(claims(table)))


if __name__ == "__main__":
    main()

"""How often causes of out-of-limit trials are named rightly, on planted problems.

    python -m tests.studies.coverage.causes       # causes.csv, and its table in README.md

Of each problem and number out of limit, 200 studies of 2048 trials. "wrong", of a
limit: a named part is not in the formula, two parts are named as a pair that is none,
or a part without its twin. "right": the first named cause is a planted one. Of studies
with a second limit, "wrong" is the mean over both, and "right" is so for both.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm

from tolstat.statistics.sensitivity.named_causes import Effect, named_causes

TABLE = Path(__file__).with_name("causes.csv")
STUDIES, TRIALS, CONTRIBUTORS = 200, 2048, 20
OUT = (10, 20, 40, 100)
STEP = 0.1  # of a slope


class Planted(NamedTuple):
    """A problem with known causes."""

    of: Callable  # the response of x[contributor, trial] and noise[trial]
    first: tuple  # sets of parts (numbers): those that may be named first
    pair: bool = False  # whether the first cause is a pair
    twins: tuple = ()  # parts that may only be named together
    guilty: tuple = ()  # further parts in the formula
    sides: int = 1  # ends of the limit
    parts: Callable = lambda rng, k: rng.normal(size=(k, TRIALS))
    contributors: int = CONTRIBUTORS
    sigma: tuple = ()  # of the parts, 1 unless given
    kinds: tuple = ()  # numbers of parts of one kind
    failing: float = 0.0  # share of the out-of-limit trials that just failed


def _batch(share):
    """The first four parts have some of their deviation in common."""

    def parts(rng, k):
        x = rng.normal(size=(k, TRIALS))
        x[:4] = np.sqrt(1 - share) * x[:4] + np.sqrt(share) * rng.normal(size=TRIALS)
        return x

    return parts


def _threshold(x, noise):
    return 3 * x[0] + 40 * (x[1] > 2.7)


def _nothing(x, noise):
    return noise


def _uniform(rng, k):
    return rng.uniform(-1.0, 1.0, size=(k, TRIALS))


def _measured(rng, k):
    """Twelve measured values of each part, to a tenth of a sigma."""
    return rng.choice(norm.ppf((np.arange(12) + 0.5) / 12).round(1), size=(k, TRIALS))


CHAIN = (15.0, 10.0, 10.0, 5.0)
AB = ((0, 1),)
PROBLEMS = {
    "a": Planted(lambda x, e: x[0], ((0,),)),
    "a, with noise": Planted(lambda x, e: x[0] + 0.7 * e, ((0,),)),
    "|a|": Planted(lambda x, e: x[0], ((0,),), sides=2),
    "two equal bearings, a housing": Planted(
        lambda x, e: x[0] + x[1] + 1.5 * x[2], ((2,), (0, 1)), twins=((0, 1),),
        guilty=(0, 1, 2), kinds=(0, 1)),
    "a + b": Planted(lambda x, e: x[0] + x[1], ((0,), (1,), (0, 1)), guilty=(0, 1),
                     sigma=(1.0, 1.1)),
    "|a + b|": Planted(lambda x, e: np.abs(x[0] + x[1]), AB, True),
    "|a - b|": Planted(lambda x, e: np.abs(x[0] - x[1]), AB, True),
    "|a - b|, with noise": Planted(
        lambda x, e: np.abs(x[0] - x[1]) + 0.5 * e, AB, True),
    "|a - 2 b|": Planted(lambda x, e: np.abs(x[0] - 2 * x[1]), AB, True),
    "|a - 3 b|": Planted(lambda x, e: np.abs(x[0] - 3 * x[1]), ((0, 1), (1,)), True),
    "|a - 3 b|, the pair": Planted(
        lambda x, e: np.abs(x[0] - 3 * x[1]), AB, True),
    "|a b|": Planted(lambda x, e: np.abs(x[0] * x[1]), AB, True),
    "a and b both outer": Planted(
        lambda x, e: np.minimum(np.abs(x[0]), np.abs(x[1])), AB, True),
    "a or b": Planted(lambda x, e: np.abs(x[:2]).max(axis=0), ((0,), (1,), (0, 1)),
                      guilty=(0, 1)),
    "|a - b| or c": Planted(
        lambda x, e: np.maximum(np.abs(x[0] - x[1]), np.sqrt(2) * np.abs(x[2])),
        ((0, 1), (2,)), True),
    "|a + b - c|": Planted(lambda x, e: np.abs(x[0] + x[1] - x[2]), ((0, 1, 2),)),
    "|a + b + c|": Planted(lambda x, e: np.abs(x[0] + x[1] + x[2]), ((0, 1, 2),)),
    "|a + 2 b - c|": Planted(
        lambda x, e: np.abs(x[0] + 2 * x[1] - x[2]), ((0, 1, 2), (1,))),
    "|2 a + 2 b - c|": Planted(
        lambda x, e: np.abs(2 * x[0] + 2 * x[1] - x[2]), ((0, 1), (0, 1, 2)), True),
    "|a + b - c - d|": Planted(
        lambda x, e: np.abs(x[0] + x[1] - x[2] - x[3]), ((0, 1, 2, 3),)),
    **{f"{n} equal parts": Planted(
        lambda x, e, n=n: x[:n].sum(axis=0), (tuple(range(n)),),
        twins=(tuple(range(n)),), kinds=tuple(range(n))) for n in (4, 8, 12)},
    **{f"{n} equal parts, two limits": Planted(
        lambda x, e, n=n: x[:n].sum(axis=0), (tuple(range(n)),),
        twins=(tuple(range(n)),), kinds=tuple(range(n)), sides=2) for n in (4, 8)},
    "one bad of eight": Planted(lambda x, e: 3 * x[0], ((0,),), kinds=tuple(range(8))),
    "3 a + 40 (b > 2.7), of eight": Planted(
        _threshold, ((0,), (1,), (0, 1)), guilty=(0, 1), kinds=tuple(range(8))),
    "spread by a, failure by b": Planted(
        lambda x, e: 5 * x[0] + 1000 * (x[1] > 1.5) * x[1], ((1,),), guilty=(0,)),
    "nothing": Planted(_nothing, ()),
    "nothing, of three": Planted(_nothing, (), contributors=3),
    "4 of 20 one-sided uniform": Planted(
        lambda x, e: x[:4].sum(axis=0), ((0, 1, 2, 3),), twins=((0, 1, 2, 3),),
        parts=lambda rng, k: rng.uniform(0.0, 1.0, size=(k, TRIALS))),
    "one of four correlated": Planted(
        lambda x, e: x[0], ((0,), (0, 1, 2, 3)), parts=_batch(0.6)),
    "one of four of a batch": Planted(
        lambda x, e: x[0], ((0, 1, 2, 3),), guilty=(0, 1, 2, 3), parts=_batch(1.0)),
    "|a - b| of correlated a and c": Planted(
        lambda x, e: np.abs(x[0] - x[4]), ((0, 4),), True, parts=_batch(0.3)),
    "|a - b|, twelve measured values": Planted(
        lambda x, e: np.abs(x[0] - x[1]) + 0.2 * e, AB, True, parts=_measured),
    "|a - b|, and c of a second limit": Planted(
        lambda x, e: [np.abs(x[0] - x[1]), x[2]], ((0, 1), (2,)), True),
    "a + 0.8 b, of 30": Planted(lambda x, e: x[0] + 0.8 * x[1], ((0,), (1,), (0, 1)),
                                guilty=(0, 1), contributors=30),
    "exp(a + b / 2)": Planted(lambda x, e: np.exp(x[0] + x[1] / 2), ((0,), (1,)),
                              guilty=(0, 1)),
    "|a - b|, 3 of 10 just failed": Planted(
        lambda x, e: np.abs(x[0] - x[1]), AB, True, failing=0.3),
    "chain of four, uniform": Planted(
        lambda x, e: x[0] - x[1] - x[2] - x[3], ((0,), (1, 2)), twins=((1, 2),),
        guilty=(0, 1, 2, 3), parts=_uniform, sigma=CHAIN, contributors=4),
    "chain of four, two limits": Planted(
        lambda x, e: x[0] - x[1] - x[2] - x[3], ((0,), (1, 2), (0, 1, 2), (0, 1, 2, 3)),
        twins=((1, 2),), guilty=(0, 1, 2, 3), sides=2, parts=_uniform, sigma=CHAIN,
        contributors=4),
}  # fmt: skip


def _responses(planted, x, noise):
    found = planted.of(x, noise)
    return found if isinstance(found, list) else [found]


def study(name, out, number):
    """Return for each limit whether a wrong, the right, any, an innocent is named."""
    planted = PROBLEMS[name]
    rng = np.random.default_rng([number, out, zlib.crc32(name.encode())])
    k = planted.contributors
    size = np.ones(k)
    size[: len(planted.sigma)] = planted.sigma
    x = size[:, None] * planted.parts(rng, k)
    step = STEP * size
    ends = [
        _responses(planted, end * np.diag(step), np.zeros(k)) for end in (1.0, -1.0)
    ]
    units, effects = {}, {}
    for i, y in enumerate(_responses(planted, x, rng.normal(size=TRIALS))):
        slopes = (ends[0][i] - ends[1][i]) / (2 * STEP)
        y = np.abs(y - np.median(y)) if planted.sides == 2 else y
        failed = round(planted.failing * out)
        units[f"y{i}"] = y >= np.sort(y)[failed - out]
        units[f"y{i}"][rng.choice(TRIALS, failed, replace=False)] = True
        effects[f"y{i}"] = {
            f"x{j}": Effect(size[j], slopes[j], "kind" if j in planted.kinds else "")
            for j in range(k)
        }
    named = named_causes({f"x{j}": each for j, each in enumerate(x)}, units, effects)
    return [
        _judged(planted, each, i, len(named)) for i, each in enumerate(named.values())
    ]


def _numbers(found):
    return {int(each[1:]) for each in found.members}


def _judged(planted, found, limit, limits):
    guilty = {*planted.guilty, *(j for each in planted.first for j in each)}
    parts = [_numbers(each) for each in found.parts if not each.correlated]
    pairs = [_numbers(each) for each in found.pairs]
    innocent = any(not each <= guilty for each in parts + pairs)
    innocent |= any(
        each.correlated and not _numbers(each) & guilty for each in found.parts
    )
    planted_pairs = [{*e} for e in planted.first if planted.pair and len(e) == 2]
    wrong = innocent
    wrong |= any(len(each) == 2 and each not in planted_pairs for each in pairs)
    for twins in map(set, planted.twins):
        wrong |= any(each & twins and not each >= twins for each in parts)
    strong = [e for e in found.pairs if e.far.value > e.single]
    first = [_numbers(e) for e in (*strong, *found.parts)][:1]
    may = [
        {*each} for each in (planted.first if limits == 1 else [planted.first[limit]])
    ]
    right = not first if not may else any(each in may for each in first)
    if planted.pair and limits == 1:
        right = any(each in pairs for each in planted_pairs) or first == may[1:]
    return wrong, right, bool(parts or pairs), innocent


def rates(name, out, studies=STUDIES):
    """Return shares: of limits with a wrong name, of studies with the right and any."""
    found = [study(name, out, number) for number in range(studies)]
    wrong = np.mean([each[0] for of in found for each in of])
    right, some = np.mean(
        [[all(each[i] for each in of) for i in (1, 2)] for of in found], axis=0
    )
    return {"problem": name, "out": out, "studies": studies, "wrong": wrong,
            "right": right, "named": some}  # fmt: skip


def innocent(name, out, studies=STUDIES):
    """Return the share of limits with an innocent part named: a part of "wrong"."""
    found = [study(name, out, number) for number in range(studies)]
    return np.mean([each[3] for of in found for each in of])


def found_if_told(out, studies=500):
    """Return how often two tests that are told b find a of |a - 3 b|, among 19 others.

    Both use the out-of-limit trials alone, at 5 % for 19 contributors and two signs.
    The likelihood-ratio test is told the 3 and the limit c, too. If a is innocent, a
    trial with this b meets |a - 3 b| > c by chance, in all trials with the product of
    these. The other takes the mean of a, times the sign of b: normal.
    """
    rng, found = np.random.default_rng(out), []
    for _ in range(studies):
        a, b = rng.normal(size=(2, TRIALS))
        y = np.abs(a - 3 * b)
        c = np.sort(y)[-out]
        a, b = a[y >= c], b[y >= c]
        chance = norm.sf(c - 3 * np.abs(b)) + norm.sf(c + 3 * np.abs(b))
        by_sign = norm.sf(-np.sum(a * np.sign(b)) / np.sqrt(out))
        found.append([np.prod(chance), by_sign])
    return np.mean(np.array(found) < 0.05 / 19 / 2, axis=0)


def lines(table):
    """Yield the lines of the table: wrong, then right, in per cent."""
    yield "| named wrongly / rightly, % | " + " | ".join(map(str, OUT)) + " |"
    yield "|---" * (1 + len(OUT)) + "|"
    for name in PROBLEMS:
        row = table[table["problem"] == name].set_index("out")
        cells = (f"{100 * row.wrong[m]:.3g} / {100 * row.right[m]:.3g}" for m in OUT)
        yield f"| {name.replace('|', chr(92) + '|')} | {' | '.join(cells)} |"


def main():
    """Measure, and write the table."""
    cells = [(name, out) for name in PROBLEMS for out in OUT]
    with ProcessPoolExecutor() as workers:
        found = []
        for each in workers.map(rates, *zip(*cells, strict=True)):
            print(each, file=sys.stderr, flush=True)
            found.append(each)
    table = pd.DataFrame(found)
    table.to_csv(TABLE, index=False)
    print("\n".join(lines(table)))


if __name__ == "__main__":
    main()

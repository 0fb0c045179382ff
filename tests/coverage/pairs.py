"""How often a pair is named where there is none, and where one is planted.

python -m tests.coverage.pairs            # two minutes; its table is in the README
"""

from __future__ import annotations

import numpy as np

from tolstat.statistics.sensitivity.pairs import pairs

STUDIES, TRIALS, CONTRIBUTORS = 60, 4096, 20
BEYOND = (5, 15, 40, 400)
NOBODY = {
    "nothing": lambda x, noise: noise,
    "one": lambda x, noise: x[0],
    "one, to either side": lambda x, noise: np.abs(x[0]),
    "one, and noise": lambda x, noise: x[0] + noise,
    "one or another": lambda x, noise: np.abs(x[:2]).max(axis=0),
    "one or another of four": lambda x, noise: np.abs(x[:4]).max(axis=0),
}
PLANTED = {
    "difference": lambda x, noise: np.abs(x[0] - x[1]),
    "difference, and noise": lambda x, noise: np.abs(x[0] - x[1]) + 0.5 * noise,
    "difference, 3 to 2": lambda x, noise: np.abs(3 * x[0] - 2 * x[1]),
    "sum, to one side": lambda x, noise: x[0] + x[1],
    "product": lambda x, noise: np.abs(x[0] * x[1]),
    "difference or a third": lambda x, noise: np.maximum(
        np.abs(x[0] - x[1]), np.sqrt(2) * np.abs(x[2])
    ),
}


def shares(of, beyond):
    """Return in how many studies some pair is named, and the first two are."""
    some = right = 0
    for study in range(STUDIES):
        rng = np.random.default_rng([study, beyond])
        x = rng.normal(size=(CONTRIBUTORS, TRIALS))
        y = of(x, rng.normal(size=TRIALS))
        found = pairs(dict(enumerate(x)), {"y": y >= np.sort(y)[-beyond]})["y"]
        some += bool(found)
        right += any(each.members == (0, 1) for each in found)
    return some / STUDIES, right / STUDIES


def main():
    """Print the table."""
    print(f"| beyond is | {' | '.join(map(str, BEYOND))} |")
    print("|---" * (1 + len(BEYOND)) + "|")
    for name, of in (NOBODY | PLANTED).items():
        known = [shares(of, beyond)[name in PLANTED] for beyond in BEYOND]
        print(f"| {name} | {' | '.join(f'{100 * s:.0f}' for s in known)} |", flush=True)


if __name__ == "__main__":
    main()

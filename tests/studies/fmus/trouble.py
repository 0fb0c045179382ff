"""10 000 trials of an FMU that crashes in 1 %, hangs in 0.1 % and leaks, twice.

python -m tests.studies.fmus.trouble [TRIALS]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.stats import norm

import tolstat
from tests.fmu.building import build
from tolstat import catalogue

CRASHES, HANGS = 0.01, 0.001


def main(trials):
    above = norm.isf(CRASHES + HANGS)
    hangs = norm.isf(HANGS)
    with tempfile.TemporaryDirectory() as folder:
        catalogue.load(str(build("Trouble", 2, folder)))
        study = {
            "model": "Trouble", "trials": trials, "seed": 1, "longest_trial": "1 s",
            "settings": {"how": "mixed", "above": above, "hang": hangs},
            "deviations": {"x": "+-3"},
        }  # fmt: skip
        frames = []
        for name in ("first", "second"):
            began = time.perf_counter()
            run = tolstat.run(study, output=Path(folder, f"{name}.h5"))
            frames.append(frame := run.frame())
            counts = dict(frame["status"].value_counts())
            print(name, run.complete, {k: n for k, n in counts.items() if n},
                  f"{time.perf_counter() - began:.0f} s")  # fmt: skip
    x = frames[0]["x"].to_numpy()
    expected = np.where(
        x > hangs, "took too long", np.where(x > above, "crashed", "done")
    )
    wrong = frames[0]["status"].to_numpy() != expected
    print("wrongly named:", int(wrong.sum()), "same bits:", frames[0].equals(frames[1]))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)

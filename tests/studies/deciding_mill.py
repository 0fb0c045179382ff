"""Trials and seconds until the five limits of the mill are decided, plain and thinned.

python -m tests.studies.deciding_mill [SEEDS]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import tolstat
from tolstat.toml import toml_table

STUDY = Path(__file__).parents[2] / "runs" / "khpt75.toml"
WAYS = {"plain": False, "thinned": True}  # whether it is slow


def main(seeds=3):
    """Print a row for each seed and way."""
    print("| seed | trials | evaluated | drawn | s | verdicts |")
    print("|---|---|---|---|---|---|")
    study = toml_table(STUDY.read_text())
    for seed in range(75, 75 + seeds):
        for way, slow in WAYS.items():
            study["trials"] = {"until": "decide", "slow": slow}
            began = time.monotonic()
            run = tolstat.run({**study, "seed": seed})
            seconds = time.monotonic() - began
            drawn = run.thinned.drawn[-1] if run.thinned else run.trials
            verdicts = tolstat.report(run).verdicts
            words = ", ".join(f"{name} {verdict}" for name, verdict in verdicts.items())
            print(
                f"| {seed} | {way} | {run.trials} | {drawn:.0f} | {seconds:.0f} | "
                f"{words} |",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

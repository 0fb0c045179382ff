"""Errors of the responses of shipped studies, in units of their sigma.

    python -m tests.studies.benchmarks.sigmas [TRIALS] [NAME ...]

The same trials again, at a hundred thousandth of rtol and a quarter of the longest
step. The cells of a grid have the sigma of the grid.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.studies.benchmarks.accuracy import machines
from tolstat.study.study import Study, load

RUNS = Path(__file__).parents[3] / "runs"
PERMITTED = 1e-3
TIGHTER, LEAST = 1e5, 1e-10
CHECKS = ("energy_residual",)  # zero but for the error
# speeds half and twice as large, and far off; longer steps
CASES: tuple[tuple[str, Mapping[str, float]], ...] = (
    ("ring.toml", {}),
    ("ring.toml", {"speed": 0.25}),
    ("ring.toml", {"speed": 1.0}),
    ("ring.toml", {"speed": 20.0}),
    ("ring-table.toml", {}),
    ("ring-table.toml", {"speed": 0.25}),
    ("ring-table.toml", {"speed": 1.0}),
    ("ring-spectrum.toml", {}),
    ("ring-spectrum.toml", {"speed": 0.25}),
    ("ring-spectrum.toml", {"speed": 1.0}),
    ("khpt75.toml", {}),
    ("khpt75.toml", {"crank_speed": 3.75}),
    ("khpt75.toml", {"crank_speed": 15.0}),
    ("khpt75.toml", {"crank_speed": 20.0}),
    ("khpt75.toml", {"max_step": 5e-3}),
)


class Errors(NamedTuple):
    """What a study's responses err by."""

    by_name: dict[str, float]  # largest of the trials, of sigma
    steps: float  # mean of the trials
    seconds: float  # of the processor, at the settings of the study


def errors(study: Study, changes: Mapping[str, float], trials: int) -> Errors:
    """Return the errors of the responses of trials drawn as the study does."""
    cells = [replace(case.settings, **changes) for case in study.cases]
    deviations = np.zeros((1, len(study.description.contributors)))
    if len(cells) == 1:
        deviations = machines(study, trials)

    def responses(cells: list[Any]) -> tuple[NDArray[np.float64], float]:
        outcomes = [study.model.evaluate(deviations, settings) for settings in cells]
        steps = float(np.mean([x.steps for x in outcomes if x.steps is not None]))
        return np.concatenate([x.responses for x in outcomes]), steps

    began = time.process_time()
    values, steps = responses(cells)
    seconds = time.process_time() - began
    exact, _ = responses(
        [
            replace(x, rtol=max(x.rtol / TIGHTER, LEAST), max_step=x.max_step / 4.0)
            for x in cells
        ]
    )
    names = [x.name for x in study.model.describe(cells[0]).responses]
    largest = np.abs(values - exact).max(axis=0)
    sigma = exact.std(axis=0, ddof=1)
    by_name = {
        name: float(error / s)
        for name, error, s in zip(names, largest, sigma, strict=True)
        if s > 0.0 and name not in CHECKS
    }
    return Errors(by_name, steps, seconds)


def main() -> None:
    """Print one line for each case, the worst responses last."""
    trials, *names = sys.argv[1:] or ["256"]
    for name, changes in CASES:
        if names and name not in names:
            continue
        by_name, steps, seconds = errors(load(RUNS / name), changes, int(trials))
        worst = sorted(by_name, key=lambda x: -by_name[x])[:4]
        many = sum(error > PERMITTED for error in by_name.values())
        words = ", ".join(f"{x} {by_name[x]:.1e}" for x in worst)
        change = " ".join(f"{x} {value:g}" for x, value in changes.items())
        print(
            f"{name} {change}: {steps:.0f} steps, {seconds:.2f} s, "
            f"{many} of {len(by_name)} above {PERMITTED:g}: {words}",
            flush=True,
        )


if __name__ == "__main__":
    main()

"""Errors of the responses of shipped studies, in units of their sigma.

    python -m tests.studies.benchmarks.sigmas [TRIALS] [NAME ...]

The same trials again, at a hundred thousandth of rtol and a quarter of the longest
step. The cells of a grid have the sigma of the grid.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
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
SPEEDS = {"khpt75*.toml": "crank_speed", "ring*.toml": "speed"}  # setting, by files
TIMES = 1.0, 0.5, 2.0  # of the study's speed
# far off; longer steps
MORE: Mapping[str, tuple[Mapping[str, float], ...]] = {
    "khpt75": ({"crank_speed": 20.0}, {"max_step": 5e-3}),
    "ring": ({"speed": 20.0},),
}


class Errors(NamedTuple):
    """What a study's responses err by."""

    by_name: dict[str, float]  # largest of the trials, of sigma
    failed: int  # trials left out: they fail at one of the settings
    steps: float  # mean of the trials
    seconds: float  # of the processor, at the settings of the study


def errors(study: Study, changes: Mapping[str, float], trials: int) -> Errors:
    """Return the errors of the responses of trials drawn as the study does."""
    cells = [replace(case.settings, **changes) for case in study.cases]
    deviations = np.zeros((1, len(study.description.contributors)))
    if len(cells) == 1:
        drawn = study.sampler is not None
        deviations = machines(study, trials) if drawn else study.deviations()

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
    described = study.model.describe(cells[0]).responses
    done = np.isfinite(values - exact).all(axis=1)
    values, exact = values[done], exact[done]
    largest = np.abs(values - exact).max(axis=0)
    sigma = exact.std(axis=0, ddof=1)
    by_name = {
        response.name: float(error / s)
        for response, error, s in zip(described, largest, sigma, strict=True)
        if s > 0.0 and not response.residual
    }
    return Errors(by_name, int(np.sum(~done)), steps, seconds)


def cases() -> Iterator[tuple[str, Study, Mapping[str, float]]]:
    """Yield name, study and changed settings of each case."""
    for files, speed in SPEEDS.items():
        for path in sorted(RUNS.glob(files)):
            study = load(path)
            usual = float(getattr(study.settings, speed))
            for times in TIMES:
                yield path.stem, study, {} if times == 1 else {speed: times * usual}
            for changes in MORE.get(path.stem, ()):
                yield path.stem, study, changes


def main() -> None:
    """Print a row of the table for each case, the worst responses last."""
    trials, *names = sys.argv[1:] or ["256"]
    for name, study, changes in cases():
        if names and name not in names:
            continue
        by_name, failed, steps, seconds = errors(study, changes, int(trials))
        worst = sorted(by_name, key=lambda x: -by_name[x])[:3]
        many = sum(error > PERMITTED for error in by_name.values())
        words = ", ".join(f"{x} {by_name[x]:.1e}" for x in worst)
        words += f"; {failed} trials fail" if failed else ""
        change = " ".join(f"{x} {value:g}" for x, value in changes.items())
        row = f"{steps:.0f}", f"{seconds:.2f}", f"{many} of {len(by_name)}", words
        print("|", " | ".join([name, change, *row]), "|", flush=True)


if __name__ == "__main__":
    main()

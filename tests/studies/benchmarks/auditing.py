"""Results of an audit against all trials of a study integrated again.

python -m tests.studies.benchmarks.auditing

Prints, for limited responses, how far the claimed moves of mean and sigma are off (root
of the mean square over choices of the random trials), with these alone and with those
chosen on purpose, and which share of the largest error is seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.conftest import ROOT
from tolstat.execution.diagnostics.audit_selection import select
from tolstat.execution.stages import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.checked import tightened
from tolstat.statistics.integration_error import integration_error
from tolstat.study.study import load

CHOICES = 300


def moves(values: NDArray[np.float64], better: NDArray[np.float64]) -> list[float]:
    """Return how far mean and sigma move."""
    return [values.mean() - better.mean(), values.std(ddof=1) - better.std(ddof=1)]


def main() -> None:
    """Integrate all trials of the main study twice, and audit them again and again."""
    study = load(ROOT / "runs" / "khpt75.toml")
    trials = Trials.planned(study.description, study.deviations())
    with Workers() as crew:
        for settings in (study.settings, tightened(study.model, study.settings)):
            answers = crew.simulate(study.model, trials.deviations, settings)
            if settings is study.settings:
                trials.take([(0, answers)])
    precise = dict(
        zip([r.name for r in study.description.responses], answers.responses.T,
            strict=True)
    )  # fmt: skip
    choices = [select(trials, study.limits, seed) for seed in range(CHOICES)]
    print(f"{len(choices[0].trials)} of {trials.ended} trials are chosen")
    for name in study.limits:
        values, truth = trials.response(name), precise[name]
        true = np.array(moves(values, truth))
        for words in ("at random", "all"):
            off, seen = [], []
            for choice in choices:
                some = choice.at_random | (words == "all")
                chosen = choice.trials[some]
                alike = choice.at_random | (choice.chosen_by[name] > 0)
                error = integration_error(values, chosen, truth[chosen], alike[some])
                off.append(np.array(moves(values, error.removed(values))) - true)
                seen.append(error.largest / np.abs(values - truth).max())
            rms = np.sqrt(np.mean(np.square(off), axis=0))
            print(
                f"{name:15} {words:10} mean moves by {true[0]:8.1e}, off by "
                f"{rms[0]:.1e}; sigma by {true[1]:8.1e}, off by {rms[1]:.1e}; "
                f"largest seen {np.median(seen):.0%}"
            )


if __name__ == "__main__":
    main()

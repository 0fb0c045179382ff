"""The classical answers beside the simulated ones: root sum square, worst trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tolstat.answers.report.report_answer import WorstTrial
from tolstat.answers.sampled_trials import Drawn
from tolstat.statistics.sensitivity.linear import Scatter, scatter_of

NAMED = 3  # contributors told of a worst trial


def scatter_of_run(drawn: Drawn) -> Scatter | None:
    """Return how the deviations scatter; None without slopes.

    By the distributions where each deviation is independent, else by the trials.
    """
    run = drawn.run
    slopes = run.diagnostics.slopes
    if not slopes or len(drawn.trials) < 2:
        return None
    varying = tuple(next(iter(slopes.values())))
    assumed = [run.assumed[name] for name in varying]
    sigmas = np.array([each.sigma for each in assumed])
    if np.isfinite(sigmas).all() and run.independent:
        means = np.array([each.mean for each in assumed])
        return Scatter(varying, means, np.diag(sigmas**2))
    return scatter_of({name: drawn.values(name) for name in varying})


def worst_trials(
    drawn: Drawn, name: str, leading: Sequence[str]
) -> tuple[WorstTrial, ...]:
    """List the worst trials with what matters most of their deviations."""
    run = drawn.run
    return tuple(
        WorstTrial(
            each.trial,
            float(run.column(name)[each.trial]),
            each.precise,
            {n: float(run.column(n)[each.trial]) for n in leading[:NAMED]},
        )
        for each in run.diagnostics.worst.get(name, ())
    )

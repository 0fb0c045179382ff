"""The classical answers beside the simulated ones: slopes, worst case, worst trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tolstat.answers.report.findings import Culprits, WorstTrialFindings, leading_of
from tolstat.answers.report.variance import hanging_together
from tolstat.answers.sampled_trials import Drawn
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.sensitivity.linear import (
    Departure,
    Linear,
    Scatter,
    departures,
    root_sum_square,
    scatter_of,
)
from tolstat.statistics.summary import Summary

NAMED = 3  # contributors told of a worst trial


class Classical(NamedTuple):
    """The classical answers about one response; empty where it has no limit."""

    linear: Linear | None
    departures: tuple[Departure, ...]
    worst_trials: tuple[WorstTrialFindings, ...]


def classical_of(
    drawn: Drawn,
    summaries: Mapping[str, Summary],
    contributions: Mapping[str, Contributions],
    culprits: Mapping[str, Culprits],
) -> dict[str, Classical]:
    """Put stored evidence into findings.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    summaries : mapping of str to Summary
        By response.
    contributions : mapping of str to Contributions
        Of what is looked at closely.
    culprits : mapping of str to Culprits
        Of what is limited.

    Returns
    -------
    dict of str to Classical
        By response.
    """
    slopes = drawn.run.evidence.slopes
    scatter = None
    if slopes and len(drawn.trials) > 1:
        varying = tuple(next(iter(slopes.values())))
        scatter = scatter_of({name: drawn.values(name) for name in varying})
        assumed = [drawn.run.assumed[name] for name in varying]
        sigmas = np.array([each.sigma for each in assumed])
        if np.isfinite(sigmas).all() and not hanging_together(drawn.run.study.table):
            means = np.array([each.mean for each in assumed])
            scatter = Scatter(varying, means, np.diag(sigmas**2))
    found = {}
    for name, summary in summaries.items():
        worst = _worst_trials(
            drawn, name, leading_of(contributions.get(name), culprits.get(name))
        )
        if not scatter:
            found[name] = Classical(None, (), worst)
            continue
        nominal = drawn.run.nominal_values[name]
        linear = root_sum_square(nominal, slopes[name], scatter)
        off = departures(linear, summary.quantiles)
        found[name] = Classical(linear, tuple(off), worst)
    return found


def _worst_trials(
    drawn: Drawn, name: str, leading: Sequence[str]
) -> tuple[WorstTrialFindings, ...]:
    """List the worst trials with what matters most of their deviations."""
    run = drawn.run
    return tuple(
        WorstTrialFindings(
            each.trial,
            float(run.column(name)[each.trial]),
            each.precise,
            {n: float(run.column(n)[each.trial]) for n in leading[:NAMED]},
        )
        for each in run.evidence.worst.get(name, ())
    )

"""What steps of a model jump over: kinks of its rates, and residuals inside steps."""

from typing import Any

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.errors import ModelError
from tolstat.integrator.branches import kink_words
from tolstat.integrator.integrate import Integration, observed
from tolstat.integrator.problem import Residual
from tolstat.integrator.residual import largest_residual
from tolstat.integrator.stiffness import stiffness_of
from tolstat.model.checked import described, simulate
from tolstat.model.contract import Model
from tolstat.status import Status
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study

FEWEST, MOST = 16, 256  # trials that are surveyed


def kinks_of(model: Model, settings: Any) -> tuple[str, ...]:
    """Return a sentence for each kink of the nominal trial that its steps may miss."""
    try:
        kinks: tuple[str, ...] = model.called(_kinks_here, settings)
    except ModelError:  # the nominal trial will say it
        return ()
    return kinks


def _kinks_here(model: Model, settings: Any) -> tuple[str, ...]:
    nominal = np.zeros((1, len(described(model, settings).contributors)))
    return kink_words(surveyed(model, nominal, settings))


def surveyed(model: Model, deviations: Array, settings: Any) -> list[Integration]:
    """Return the integrations of trials, with a survey of their steps."""
    with observed(surveyed=True) as integrations:
        simulate(model, deviations, settings)
    return integrations


def why_failed(model: Model, deviations: Array, settings: Any) -> str:
    """Return where a trial that fails ends, by which state, and whether it is stiff."""
    words: str = model.called(_failure_here, deviations, settings)
    return words


def _failure_here(model: Model, deviations: Array, settings: Any) -> str:
    for integration in surveyed(model, deviations, settings):
        if not integration.failure:
            continue
        sentences = [f"A trial {integration.failure}."]
        status = integration.solution.status
        if (status == Status.TOO_MANY_STEPS).any():
            stiffness = stiffness_of(integration)
            sentences += [stiffness.words] * stiffness.limits
        return " ".join([*sentences, *kink_words([integration])])
    return "A result is not finite."


def residual_of(study: Study, deviations: Array, chosen: Integers) -> Residual | None:
    """Return the largest residual in steps of chosen trials, and of others evenly.

    None where nothing is integrated.
    """
    trials = len(deviations)
    more = np.linspace(0, trials - 1, min(FEWEST, trials)).astype(np.int64)
    trials_of_survey = np.union1d(chosen[:MOST], more)
    parts = [
        (deviations[trials_of_survey[case.first : case.stop]], case.settings)
        for case in cases_among(study.cases, trials_of_survey)
    ]
    residual: Residual | None = study.model.called(_residual_here, parts)
    return residual


def _residual_here(model: Model, parts: list[tuple[Array, Any]]) -> Residual | None:
    integrations = [
        integration
        for deviations, settings in parts
        for integration in surveyed(model, deviations, settings)
    ]
    return largest_residual(integrations)

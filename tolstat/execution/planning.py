"""All that is known of a run before anything has run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat import catalogue
from tolstat.deviations.dependence import Dependence
from tolstat.deviations.spread import Spread, spread_of
from tolstat.errors import StudyError
from tolstat.execution.trial_table import Trials
from tolstat.model.checked import impossible, numbers_of
from tolstat.model.description import StudyNumber
from tolstat.model.settings import settings_of
from tolstat.status import words_of
from tolstat.store.plan import (
    SCORES,
    Assumed,
    Chosen,
    Plan,
    Reference,
    Sampled,
    Swept,
)
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import setting_name
from tolstat.study.study import Study


def plan_of(study: Study, trials: Trials) -> Plan:
    """Say all that is known of a run before anything has run."""
    model, points = study.model, study.points
    assumed = assumed_of(study.deviating)
    if study.rare:  # how unlikely each part of a machine is that was sought
        assumed = {n: _with_scores(a, study.deviating, n) for n, a in assumed.items()}
    return Plan(
        study_text=study.text,
        title=study.title,
        model=model.name,
        machine=catalogue.place_of(model),
        sampling=study.sampling,
        description=study.description,
        deviations=trials.deviations,
        words=words_of(model.failures),
        integrates=model.integrates,
        source_digest=model.source_digest,
        sampled=_sampled(study),
        settings={
            name: Chosen(
                study.typed.get(name, each.kind.words(getattr(study.settings, name))),
                each.sentence,
                name in study.typed,
            )
            for name, each in settings_of(model).items()
        },
        limits=study.limits,
        assumed=assumed,
        shown=study.shown,
        grid=tuple(axis.name for axis in points.swept) if points else (),
        swept=_swept(study),
        reference=Reference(*study.reference) if study.reference else None,
        notes=study.notes,
        assumptions=tuple(model.assumptions),
        numbers=_numbers(study, assumed),
        rules=study.until.rules if study.until else (),
        study_file=study.path.resolve() if study.path else None,
        drawn=trials.drawn,
        rare=study.rare,
    )


def cannot_be_built(study: Study, deviations: NDArray[np.float64]) -> str:
    """Say which share of deviations[trial, contributor], SI, cannot be built.

    Empty where all can; refused where none can.
    """
    if study.rare:  # its machines are sought, and those that cannot be among them
        return ""
    model = study.model
    status = np.concatenate(
        [
            impossible(model, deviations[case.first : case.stop], case.settings)
            for case in study.cases
        ]
    )
    words, trials = words_of(model.failures), len(deviations)
    codes, counts = np.unique(status[status > 0], return_counts=True)
    why = "; ".join(
        f"{words[code]} ({model.failures[words[code]]}): {count}"
        for code, count in zip(codes.tolist(), counts.tolist(), strict=True)
    )
    failing = int(counts.sum())
    if failing == trials:
        raise StudyError(
            f"{study.path or 'the study'}: none of the {trials} machines can be built: "
            f"{why}; their trials would have no answer"
        )
    share = f"{failing} of {trials} machines, {100 * failing / trials:.3g} %,"
    return f"{share} cannot be built, and have no answer: {why}" if failing else ""


def _sampled(study: Study) -> Sampled | None:
    """Say how the machines are drawn; None where they are chosen."""
    if study.sampler is None:
        return None
    assert study.seed is not None  # checked when the study was loaded
    group = study.sampler.group(len(study.factors))
    promise, replicates = study.sampler.promise, study.sampler.replicates
    return Sampled(study.seed, promise, replicates, group, study.factors)


def _swept(study: Study) -> dict[str, Swept]:
    """Return the settings that a grid changes."""
    points = study.points
    if points is None:
        return {}
    declared = settings_of(study.model)
    axes = {axis.name: axis for axis in points.swept}
    return {
        name: Swept(
            values,
            axes[name].unit,
            axes[name].shown,
            declared[setting_name(name)].sentence,
        )
        for name, values in (points.settings or {}).items()
    }


def _numbers(study: Study, assumed: Mapping[str, Assumed]) -> tuple[StudyNumber, ...]:
    """Ask the machine for the numbers of the study; a grid has none of its own."""
    if study.points:
        return ()
    spreads = {n: Spread(*a.tolerance, a.mean, a.sigma) for n, a in assumed.items()}
    alone = study.deviating.dependence == Dependence()
    return numbers_of(study.model, study.settings, spreads, independent=alone)


def _with_scores(assumed: Assumed, deviating: Deviations, name: str) -> Assumed:
    """Say how far out a deviation lies."""
    at = deviating.distributions[name].deviations(np.asarray(ndtr(SCORES), np.float64))
    return assumed._replace(at_scores=tuple(at.tolist()))


def assumed_of(deviating: Deviations) -> dict[str, Assumed]:
    """Say what is assumed of each deviation."""
    found = {}
    for name, distribution in deviating.distributions.items():
        spread = spread_of(distribution)
        batch = deviating.dependence.batches.get(name)
        alike = batch.name if batch and batch.share == 1 else ""
        found[name] = Assumed(
            (spread.lower, spread.upper),
            deviating.words[name],
            alike,
            spread.mean,
            spread.sigma,
        )
    return found

"""All that is known of a run before anything has run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import THREE_SIGMA
from tolstat.machines.settings import fields_of
from tolstat.store.assumed import Assumed
from tolstat.store.run_writer import Audit, Plan, SweptSetting
from tolstat.study.audit import audited_trials, tightened
from tolstat.study.deviations import Deviations
from tolstat.study.study import Study


def audit_of(study: Study, trials: int) -> Audit | None:
    """Choose the trials that are integrated again.

    Parameters
    ----------
    study : Study
        Checked.
    trials : int
        Of the run.

    Returns
    -------
    Audit or None
        None if the model integrates nothing.
    """
    tight = tightened(study.settings)
    if tight is None:
        return None
    return Audit(audited_trials(study.seed or 0, trials), tight.rtol)


def plan_of(study: Study, deviations: NDArray[np.float64], audit: Audit | None) -> Plan:
    """Say all that is known of a run before anything has run.

    Parameters
    ----------
    study : Study
        Checked.
    deviations : float64[trial, contributor]
        Drawn, SI.
    audit : Audit or None
        Trials that are integrated again.
    """
    facts: dict[str, str | int] = {
        "title": study.title,
        "model": study.model.name,
        "sampling": study.sampling,
        "settings": repr(study.settings),
    }
    if study.seed is not None:
        facts["seed"] = study.seed
    if study.sampler:
        facts["replicates"] = study.sampler.replicates
        facts["promise"] = study.sampler.promise
        facts["factors"] = " ".join(study.factors)
        facts["group"] = study.sampler.group(len(study.factors))
    if study.until:
        facts["at_most"] = study.trials
    if assumptions := getattr(study.model, "assumptions", ()):
        facts["assumptions"] = "\n".join(assumptions)
    if study.notes:
        facts["notes"] = "\n".join(study.notes)
    swept = {}
    if study.points and study.points.swept:
        facts["grid"] = " ".join(axis.name for axis in study.points.swept)
        units = {axis.name: axis.unit for axis in study.points.swept}
        fields = fields_of(study.model)
        for name, values in (study.points.settings or {}).items():
            sentence = fields[name].metadata["sentence"]
            swept[name] = SweptSetting(values, units[name], sentence)
    return Plan(
        study.text,
        facts,
        study.description,
        deviations,
        {name: limit.permitted for name, limit in study.limits.items()},
        {name: limit.demanded for name, limit in study.limits.items()},
        _assumed(study.deviating),
        swept,
        audit,
        study.reference,
    )


def _assumed(deviating: Deviations) -> dict[str, Assumed]:
    """Say what is assumed of each deviation."""
    found = {}
    for name, distribution in deviating.distributions.items():
        zone = getattr(distribution, "tolerance", None)
        if zone is None:  # measured parts: where three sigma of a normal one would lie
            ends = np.array([1 - THREE_SIGMA, THREE_SIGMA])
            zone = distribution.deviations(ends).tolist()
        batch = deviating.dependence.batches.get(name)
        alike = batch.name if batch and batch.share == 1 else ""
        found[name] = Assumed(tuple(zone), deviating.words[name], alike)
    return found

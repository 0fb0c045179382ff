"""The plan of a study: what its run is asked to do, before any trial has run."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TypeVar, cast

import numpy as np
from scipy.special import ndtr

from tolstat import catalogue
from tolstat.arrays import Array
from tolstat.deviations.dependence import Dependence
from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.measured import Fitted, Measured
from tolstat.deviations.samplers import Sampler
from tolstat.deviations.spread import (
    Spread,
    fixed_point,
    has_places,
    reach_of,
    spread_of,
    zone_of,
)
from tolstat.errors import StudyError
from tolstat.execution.stages import Trials
from tolstat.model.checked import impossible, model_warnings, numbers_of
from tolstat.model.description import Contributor, Response
from tolstat.model.setting_kinds import as_typed
from tolstat.model.settings import settings_of
from tolstat.model.view import typed_unit
from tolstat.statistics.intervals.weights import COLUMNS
from tolstat.statistics.measured.populations import MeasuredSample
from tolstat.status import words_of
from tolstat.store import run_records as records
from tolstat.store.assumed import SCORES, Assumed
from tolstat.store.provenance import now, provenance
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import setting_name
from tolstat.study.study import Study
from tolstat.study.study_schema import CASES

NO_STEPS = (
    "The audit cannot shorten the steps of this model: it has no setting max_step. An "
    "event shorter than a step may be missed by every evaluation."
)
Column = TypeVar("Column", Contributor, Response)


def planned(study: Study, trials: Trials) -> records.Plan:
    """Return the plan of a study and of its trials."""
    model, points, sampler = study.model, study.points, study.sampler
    part = model.isolation
    declared, axes = settings_of(model), points.swept if points else ()
    sampled = None
    if sampler:  # else the trials are no sample
        sampled = records.Sampled(
            study.seed or 0, sampler.promise, sampler.replicates,
            sampler.group(len(study.factors)), study.factors, sampler.sample, study.aim,
        )  # fmt: skip
    assumed = assumed_of(study.deviating)
    independent = study.deviating.dependence == Dependence()
    spreads = {n: Spread(*a.tolerance, a.mean, a.sigma) for n, a in assumed.items()}
    return records.Plan(
        study=records.StudyText(study.text),
        study_file=study.path.resolve() if study.path else None,
        title=study.title,
        model=model.name,
        sampling=study.sampling,
        machine=catalogue.place_of(model),
        source_digest=model.source_digest,
        document={
            k: v.strip() for k, v in study.document.document.items() if v.strip()
        },
        sampled=sampled,
        rules=study.until.rules if study.until else (),
        contributors=_in_units(study.description.contributors, study.shown),
        responses=_in_units(study.description.responses, study.shown),
        swept=tuple(
            records.Swept(
                x.name, x.unit, declared[setting_name(x.name)].sentence, x.shown
            )
            for x in axes
            if not x.members
        ),
        details=details_of(trials, sampler),
        settings={
            name: records.Chosen(
                study.typed.get(name, s.kind.words(getattr(study.settings, name))),
                s.sentence,
                name in study.typed,
            )
            for name, s in declared.items()
        }
        | _cases(study),
        limits=study.limits,
        assumed=assumed,
        measured=tuple(measured_samples(study.deviating)),
        correlation=_ranks(study),
        independent=independent,
        words=words_of(model.failures),
        grid=tuple(x.name for x in axes),
        reference=records.Reference(*study.reference) if study.reference else None,
        # those of a grid would change with its settings
        numbers=()
        if points
        else numbers_of(model, study.settings, spreads, independent=independent),
        notes=study.notes,
        assumptions=tuple(model.assumptions),
        isolation=records.Isolation(part.longest) if part else None,
        made={**provenance(), "started_at": now()},
        warnings=(
            *study.reading_warnings,
            *([NO_STEPS] if model.integrates and not model.audits_steps else []),
            *model_warnings(model, study.settings, _reaches(study)),
            *_kinks(study),
        ),
    )


def details_of(
    trials: Trials, sampler: Sampler | None = None
) -> tuple[records.DrawDetail, ...]:
    """Return the columns of the sampler about each trial, and of thinned stages."""
    sentences = {**(sampler.columns if sampler else {}), **COLUMNS}
    return tuple(records.DrawDetail(n, "1", sentences[n]) for n in trials.drawn)


def _cases(study: Study) -> dict[str, records.Chosen]:
    """Return the cases of a study beside its settings."""
    if not (cases := study.document.cases):
        return {}
    words = "what each case changes; trials are evaluated in all cases"
    return {CASES: records.Chosen(as_typed(cases), words, True)}


def _kinks(study: Study) -> tuple[str, ...]:
    if not study.model.integrates:
        return ()
    from tolstat.execution.diagnostics.kinks import kinks_of  # loads the integrator

    return kinks_of(study.model, study.settings)


def _reaches(study: Study) -> dict[str, Spread]:
    """Return the spread of each deviation from end to end of what trials reach."""
    if study.points is None:
        return {n: reach_of(d) for n, d in study.deviating.distributions.items()}
    names = [contributor.name for contributor in study.description.contributors]
    return {
        name: Spread(*map(float, (x.min(), x.max(), x.mean(), x.std())))
        for name, x in zip(names, study.deviations().T, strict=True)
        if np.any(x)
    }


def _in_units(
    columns: tuple[Column, ...], units: Mapping[str, str]
) -> tuple[Column, ...]:
    """Return columns shown in the units that the study uses."""
    return tuple(replace(c, shown=typed_unit(c, units)) for c in columns)


def cannot_be_built(study: Study, deviations: Array) -> str:
    """Return a warning about trials that cannot be built; empty if all can.

    Deviations are [trial, contributor], SI. A StudyError if none can be built.
    """
    if study.aim:  # a search for rare trials may pass ones that cannot be built
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
            f"{study.path or 'the study'}: none of the {trials} trials can be built: "
            f"{why}; change tolerances or settings"
        )
    share = f"{failing} of {trials} trials ({100 * failing / trials:.3g} %)"
    return f"{share} cannot be built and have no answer: {why}" if failing else ""


def _ranks(study: Study) -> dict[str, dict[str, float]]:
    """Return rank correlations, of names as the study writes them where it can."""
    typed = study.document.correlation
    if all(isinstance(x, float) for others in typed.values() for x in others.values()):
        return cast(dict[str, dict[str, float]], typed)
    ranks = dict[str, dict[str, float]]()
    for (first, second), rank in study.deviating.dependence.correlations.items():
        ranks.setdefault(first, {})[second] = rank
    return ranks


def measured_samples(deviating: Deviations) -> Iterator[MeasuredSample]:
    """Yield the measured parts, once for all contributors that are sampled from them.

    They have the name of the first entry that they stand in.
    """
    members = dict[tuple[str, bytes], list[str]]()
    measured = {
        name: distribution
        for name, distribution in deviating.distributions.items()
        if isinstance(distribution, Fitted | Measured)
    }
    for name, distribution in measured.items():
        key = getattr(distribution, "kind", ""), distribution.values.tobytes()
        members.setdefault(key, []).append(name)
    names = set[str]()
    for names_of in members.values():
        first = measured[names_of[0]]
        entry = deviating.entries[names_of[0]]
        name = names_of[0] if entry in names else entry
        names.add(name)
        fit = ("", math.nan)
        if isinstance(first, Fitted):
            fit = first.kind, first.p_value
        parts = deviating.measured[names_of[0]]
        lots = tuple(dict.fromkeys(parts.lots))
        yield MeasuredSample(
            name, tuple(names_of), first.values, *fit,
            order=parts.order,
            lot=np.array([lots.index(lot) for lot in parts.lots]) if lots else None,
            lot_names=lots,
            lower=parts.tolerance.lower,
            upper=parts.tolerance.upper,
            source=parts.source,
        )  # fmt: skip


def assumed_of(deviating: Deviations) -> dict[str, Assumed]:
    """Return the assumptions on each deviation."""
    assumed = {}
    for name, distribution in deviating.distributions.items():
        *zone, mean, sigma = spread_of(distribution)
        tolerance, batch = Tolerance(*zone), deviating.dependence.batches.get(name)
        quantiles = distribution.deviations(ndtr(SCORES))
        measured = isinstance(distribution, Fitted | Measured) and distribution
        assumed[name] = Assumed(
            words=deviating.words[name],
            entry=deviating.entries[name],
            common=batch.share if batch else 0.0,
            tolerance=tolerance,
            centre=fixed_point(distribution, sized=name in deviating.sized)
            if zone_of(distribution)
            else tolerance.middle,
            nominal_shift=getattr(distribution, "by", 0.0),
            has_places=has_places(distribution),
            mean=mean,
            sigma=sigma,
            parts=measured.parts if measured else 0,
            # rounding may make them descend
            quantiles=tuple(np.maximum.accumulate(quantiles).tolist()),
        )
    return assumed

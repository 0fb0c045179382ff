"""Findings gathered from a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.classical import classical_of
from tolstat.answers.report.findings import (
    Assumptions,
    DeviationFindings,
    DistributionFindings,
    DocumentFindings,
    Findings,
    JointFindings,
    NumberFindings,
    ResponseFindings,
    TrialsFindings,
)
from tolstat.answers.report.integration import integration_of
from tolstat.answers.report.main_causes import culprits_of
from tolstat.answers.report.summary_table import joint_of, notes_of, summaries_of
from tolstat.answers.report.variance import contributions_of, indices_of
from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.errors import PictureError, allowed_names
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.statistics.intervals.moments import unseen
from tolstat.statistics.intervals.replicates import never_met
from tolstat.statistics.limits.yields import CONFIDENCE
from tolstat.statistics.sample import Sample
from tolstat.statistics.shapes import NAMES, Shape, atom_of, best_shape
from tolstat.store.plan import Sampled
from tolstat.store.stored_run import Run

Array = NDArray[np.float64]

MOST_DRAWN = 8  # responses, where no limit says which ones matter


def responses_of_interest(run: Run, chosen: Sequence[str] = ()) -> list[str]:
    """Choose what is looked at closely.

    Parameters
    ----------
    run : Run
        The run.
    chosen : sequence of str
        Names given by the user; else what has a limit, else the first eight responses.

    Raises
    ------
    PictureError
        If a name is not one of the run's responses.
    """
    known = [response.name for response in run.responses]
    chosen = [chosen] if isinstance(chosen, str) else chosen
    for name in chosen:
        if name not in known:
            raise PictureError(f"response {name}: {allowed_names(name, known)}")
    return list(dict.fromkeys(chosen)) or list(run.limits) or known[:MOST_DRAWN]


def reportable(run: Run, chosen: Sequence[str] = ()) -> tuple[Drawn, list[str]]:
    """Return what a report rests on, and which responses it looks at closely.

    Raises
    ------
    PictureError
        If the machines were not drawn, no trial is done, or a response is unknown.
    """
    drawn = drawn_trials(run)
    if drawn is None:
        raise PictureError(no_sample(run))
    if not np.any(drawn.sample.ran):
        raise PictureError(f"{run.path}: no trial has run; there is nothing to report")
    return drawn, responses_of_interest(run, chosen)


def findings_of(run: Run, chosen: Sequence[str] = ()) -> Findings:
    """Gather what a report says of a run; of its file alone, nothing is simulated.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    chosen : sequence of str
        Responses to be looked at closely; see `responses_of_interest`.

    Raises
    ------
    PictureError
        If the machines were not drawn, no trial is done, or a response is unknown.
    """
    drawn, interest = reportable(run, chosen)
    with ThreadPoolExecutor(1) as other:
        # they take longest: beside all the rest, for NumPy keeps no other waiting
        shares = other.submit(contributions_of, drawn, interest)
        summaries = summaries_of(drawn)
        errors = {
            name: integration_of(drawn, name, summaries[name]) for name in summaries
        }
        shapes = {name: _distribution(name, drawn) for name in interest}
        contributions, members = shares.result()
    culprits = culprits_of(drawn)
    classical = classical_of(drawn, summaries, contributions, culprits)
    responses = {}
    for response in run.responses:
        name = response.name
        found = ResponseFindings(
            **vars(summaries[name]),
            nominal=run.nominal_values[name],
            symbol=response.symbol,
            sentence=response.sentence,
            source=response.source,
            scale=run.scales[name],
            integration_error=errors[name],
            slopes=run.evidence.slopes.get(name, {}),
            linear=classical[name].linear,
            departures=classical[name].departures,
            worst_cases=run.evidence.worst_cases.get(name, {}),
            worst_trials=classical[name].worst_trials,
            culprits=culprits.get(name),
        )
        if name in interest:
            found = replace(
                found,
                distribution=shapes[name],
                contributions=contributions.get(name),
                members=members,
                indices=indices_of(drawn, name) if drawn.grouped else None,
            )
        responses[name] = found
    return Findings(
        document_of(run),
        run.title,
        run.path.name,
        run.model,
        run.machine,
        _trials(drawn),
        joint_findings(drawn),
        tuple(interest),
        responses,
        {
            each.name: NumberFindings(
                each.value, run.scale_of(each), each.sentence, each.caveat
            )
            for each in run.numbers
        },
        assumptions_of(run),
        provenance_of(run, drawn.sampled),
    )


def _trials(drawn: Drawn) -> TrialsFindings:
    run = drawn.run
    return TrialsFindings(
        run.trials,
        run.ended,
        int(np.count_nonzero(drawn.sample.done)),
        drawn.sample.failed,
        len(drawn.trials),
        run.counts,
        drawn.sample.failures,
        _unseen(drawn.sample),
        run.sampling,
        drawn.sampled.promise,
        tuple(notes_of(run, drawn.sample)),
    )


def _unseen(sample: Sample) -> float:
    """Return the share of the machines that may lie beyond all trials."""
    done = int(np.count_nonzero(sample.done))
    if sample.replicates:
        # at either end, which the trials choose themselves
        return min(2 * never_met(done, sample.replicates), 1.0)
    return unseen(done)


def joint_findings(drawn: Drawn) -> JointFindings | None:
    """Say how many machines are within all limits at once."""
    within, limits = joint_of(drawn), len(drawn.run.limits)
    if within is None:
        return None
    return JointFindings(limits, within, min(limits * (1 - CONFIDENCE) / 2, 1.0))


def document_of(run: Run) -> DocumentFindings:
    """Return what the study says of its sheet."""
    given = run.study.table.get("document", {})
    names = DocumentFindings._fields
    return DocumentFindings(*(str(given.get(name, "")).strip() for name in names))


def _distribution(name: str, drawn: Drawn) -> DistributionFindings:
    """Say what a response looks like: an atom, and the shape of the rest."""
    sample, done = drawn.sample, drawn.done(name)
    replicate = sample.replicate[sample.done] if sample.replicates else None
    atom = atom_of(done, replicate)
    rest = atom.without(done) if atom else done
    shape = Shape(NAMES[0], {}, refused=RANDOM_ONLY)
    if not sample.replicates:
        shape = best_shape(rest)
    beyond, limit = math.nan, drawn.run.limits.get(name)
    if limit and not shape.rejected:
        lower, upper = limit.permitted
        least, most = shape.below(np.array([lower, upper]))
        beyond = float(least + 1 - most) * len(rest) / len(done)
        if atom and not lower <= atom.value <= upper:
            beyond += atom.share.value
    return DistributionFindings(atom, len(rest), shape, beyond)


def provenance_of(run: Run, sampled: Sampled) -> dict[str, object]:
    """Say how a run came to be: versions, times, seed, the study as it was written."""
    return {
        **run.provenance,
        "source_digest": run.source_digest,
        "seed": sampled.seed,
        "study": run.study.text,
    }


def assumptions_of(run: Run) -> Assumptions:
    """Say what the numbers hang on."""
    correlation: Mapping[str, Mapping[str, float]] = run.study.table.get(
        "correlation", {}
    )
    return Assumptions(
        {
            each.name: DeviationFindings(
                run.assumed[each.name].words,
                *run.assumed[each.name].tolerance,
                run.scales[each.name],
                each.sentence,
            )
            for each in run.contributors
            if each.name in run.assumed
        },
        correlation,
        run.settings,
        run.assumptions,
        run.evidence.missing,
    )

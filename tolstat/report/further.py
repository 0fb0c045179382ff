"""What further simulations add to the findings of a run."""

from __future__ import annotations

from tolstat.report.contributions_found import leading_contributors
from tolstat.report.drawn import drawn_trials
from tolstat.report.plain import Found, estimate_from, number, share_words
from tolstat.statistics.evidence import Evidence
from tolstat.statistics.linear import Scatter, departures, root_sum_square, scatter_of
from tolstat.store.run import Run


def with_evidence(found: Found, run: Run, evidence: Evidence) -> Found:
    """Add slopes, worst cases and worst trials to findings.

    Parameters
    ----------
    found : dict
        Of `findings_of`; not changed.
    run : Run
        The same.
    evidence : Evidence
        What further simulations say.

    Returns
    -------
    dict
        Findings.
    """
    drawn = drawn_trials(run)
    assert drawn is not None  # there are no findings otherwise
    slopes = next(iter(evidence.slopes.values()), {})
    scatter = None
    if slopes and len(drawn.trials) > 1:
        scatter = scatter_of({n: drawn.values(n) for n in slopes})
    responses = {
        name: {
            **each,
            "linear": _linear(run, name, each, evidence, scatter),
            "worst_cases": _worst_cases(name, evidence),
            "worst_trials": _worst_trials(run, name, each, evidence),
        }
        for name, each in found["responses"].items()
    }
    assumptions = {
        **found["assumptions"],
        "missing": evidence.missing,
        "precise_rtol": evidence.precise_rtol,
    }
    return {**found, "responses": responses, "assumptions": assumptions}


def _linear(
    run: Run, name: str, found: Found, evidence: Evidence, scatter: Scatter | None
) -> Found | None:
    """Put the linear answer beside the simulated one."""
    if scatter is None:
        return None
    slopes = evidence.slopes[name]
    linear = root_sum_square(run.nominal_values[name], slopes, scatter)
    quantiles = {
        float(words.removesuffix(" %")) / 100: estimate_from(each)
        for words, each in found["quantiles"].items()
    }
    return {
        "mean": number(linear.mean),
        "sigma": number(linear.sigma),
        "shares": {n: number(share) for n, share in linear.shares.items()},
        "departures": [
            {
                "quantile": share_words(each.share),
                "linear": number(each.linear),
                "relative": number(each.relative),
                "fails": each.fails,
            }
            for each in departures(linear, quantiles)
        ],
    }


def _worst_cases(name: str, evidence: Evidence) -> list[Found]:
    return [
        {
            "side": each.side,
            "value": number(each.value),
            "tried": each.tried,
            "failed": each.failed,
            "deviations": {n: v for n, v in each.deviations.items() if v},
        }
        for each in evidence.worst_cases.get(name, ())
    ]


def _worst_trials(run: Run, name: str, found: Found, evidence: Evidence) -> list[Found]:
    """List the worst trials with what matters most of their deviations."""
    leading = leading_contributors(found)
    return [
        {
            "trial": each.trial,
            "value": number(each.value),
            "precise": number(each.precise),
            "deviations": {n: float(run.column(n)[each.trial]) for n in leading},
        }
        for each in evidence.worst.get(name, ())
    ]

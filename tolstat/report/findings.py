"""Everything a report says, as plain data: the page, JSON and CSV all print this."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import PictureError, allowed_names
from tolstat.report.contributions_found import contributions_found, indices_found
from tolstat.report.drawn import Drawn, drawn_trials
from tolstat.report.plain import Found, estimate, number, share_words
from tolstat.report.summary_table import notes_of, summaries_of
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.integration_error import integration_error
from tolstat.statistics.shapes import NAMES, Shape, atom_of, best_shape
from tolstat.statistics.statistic import quantiles_at, yields
from tolstat.statistics.summary import Limited, Summary
from tolstat.statistics.tails import Tail, upper_tail
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

Array = NDArray[np.float64]

RETURNS = (1e-3, 1e-4, 1e-5, 1e-6)  # shares of the machines that a level is exceeded by
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
        raise PictureError(
            f"{run.path}: machines of a grid or a table were chosen and not drawn, and "
            "have no statistics; `tolstat show --plot` draws them"
        )
    if not np.any(drawn.sample.done):
        raise PictureError(f"{run.path}: no trial is done; there is nothing to report")
    return drawn, responses_of_interest(run, chosen)


def findings_of(run: Run, chosen: Sequence[str] = ()) -> Found:
    """Gather what a report says of a run alone; see also `with_evidence`.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    chosen : sequence of str
        Responses to be looked at closely; see `responses_of_interest`.

    Returns
    -------
    dict
        Plain numbers, texts, lists and dicts, SI. An estimate is a dict of value,
        lower, upper (its 95 % interval; None where there is none) and reason.

    Raises
    ------
    PictureError
        If the machines were not drawn, no trial is done, or a response is unknown.
    """
    drawn, interest = reportable(run, chosen)
    responses = {}
    with ThreadPoolExecutor(1) as other:
        # they take longest: beside all the rest, for NumPy keeps no other waiting
        shares = other.submit(contributions_found, drawn, interest)
        summaries = summaries_of(drawn)
        for response in run.responses:
            name, summary = response.name, summaries[response.name]
            found = summary_found(summary)
            found["nominal"] = number(run.nominal_values[name])
            found["symbol"], found["sentence"] = response.symbol, response.sentence
            found["source"], found["unit"] = response.source, response.unit
            found["shown_unit"] = engineering_unit(response.unit)
            found["integration_error"] = _integration_error(drawn, name, summary)
            if name in interest:
                done = drawn.values(name)[drawn.sample.done]
                found["distribution"] = _distribution(done, drawn)
                found["tails"] = _tails(done, drawn, summary)
            responses[name] = found
    for name in interest:
        responses[name]["contributions"] = shares.result()[name]
        if drawn.grouped:
            responses[name]["indices"] = indices_found(drawn, name)
    return {
        "title": run.facts["title"],
        "run": run.path.name,
        "model": run.facts["model"],
        "trials": _trials(drawn),
        "interest": interest,
        "responses": responses,
        "assumptions": _assumptions(run),
        "provenance": _provenance(run),
    }


def _trials(drawn: Drawn) -> Found:
    run = drawn.run
    counts = {word.replace(" ", "_"): count for word, count in run.counts.items()}
    ran = run.trials - run.counts[Status.NOT_RUN.word]
    found: Found = {
        "asked": run.trials,
        "ran": ran,
        "done": run.counts[Status.DONE.word],
        "failed": ran - run.counts[Status.DONE.word],
        "counted": len(drawn.trials),
        "by_status": counts,
        "failures": estimate(drawn.sample.failures),
        "sampling": run.facts["sampling"],
        "promise": run.facts["promise"],
        "notes": notes_of(run, drawn.sample),
    }
    return found


def summary_found(summary: Summary) -> Found:
    """Return a summary as plain data."""
    return {
        "mean": estimate(summary.mean),
        "sigma": estimate(summary.sigma),
        "least": number(summary.least),
        "largest": number(summary.largest),
        "quantiles": {
            share_words(share): estimate(found)
            for share, found in summary.quantiles.items()
        },
        "limit": _limit(summary.limited) if summary.limited else None,
    }


def _limit(limited: Limited) -> Found:
    lower, upper = limited.limit
    return {
        "lower": None if math.isinf(lower) else lower,
        "upper": None if math.isinf(upper) else upper,
        "demanded": limited.demanded,
        "verdict": limited.yields.verdict,
        "needed": limited.yields.needed,
        "beyond": estimate(limited.yields.beyond),
        "yield_if_failed_are_bad": estimate(limited.yields.least),
        "yield_if_failed_are_good": estimate(limited.yields.most),
        "pp_by_percentiles": estimate(limited.percentiles.pp),
        "ppk_by_percentiles": estimate(limited.percentiles.ppk),
        "pp_by_moments": estimate(limited.moments.pp),
        "ppk_by_moments": estimate(limited.moments.ppk),
    }


def _distribution(done: Array, drawn: Drawn) -> Found:
    """Say what the response looks like: an atom, and the shape of the rest."""
    atom = atom_of(done)
    rest = atom.without(done) if atom else done
    best = Shape(NAMES[0], {}, refused=RANDOM_ONLY)
    if not drawn.sample.replicates:
        best = best_shape(rest)
    return {
        "atom": {
            "value": atom.value,
            "least": atom.least,
            "largest": atom.largest,
            "share": estimate(atom.share),
        }
        if atom
        else None,
        "rest": len(rest),
        "name": best.name,
        "parameters": best.parameters,
        "anderson_darling": number(best.statistic),
        "level": number(best.level),
        "rejected": best.rejected,
        "refused": best.refused,
    }


def tails_of(
    done: Array, drawn: Drawn, limit: tuple[float, float] | None
) -> dict[str, Tail]:
    """Fit the tails that matter: beyond each end of a limit, else the upper one."""
    lower, upper = limit or (-math.inf, math.inf)
    found = {}
    if drawn.sample.replicates:
        refused = Tail(math.nan, 0, len(done), refused=RANDOM_ONLY)
        return {"upper": refused}
    if math.isfinite(upper) or not math.isfinite(lower):
        found["upper"] = upper_tail(done)
    if math.isfinite(lower):
        found["lower"] = upper_tail(-done)
    return found


def _tails(done: Array, drawn: Drawn, summary: Summary) -> Found:
    limit = summary.limited.limit if summary.limited else None
    found: Found = {}
    for side, tail in tails_of(done, drawn, limit).items():
        sign = 1 if side == "upper" else -1
        levels = {}
        for share in RETURNS:
            # only beyond the trials themselves, and not too far
            if not tail.refused and share < tail.exceedances / tail.trials:
                level = tail.exceeded_by(share)
                levels[f"{share:g}"] = estimate(_mirrored(level, sign))
        beyond = None
        if limit is not None and not tail.refused:
            end = limit[1] if side == "upper" else -limit[0]
            beyond = estimate(tail.share_beyond(end))
        found[side] = {
            "refused": tail.refused,
            "threshold": number(sign * tail.threshold),
            "exceedances": tail.exceedances,
            "shape": number(tail.shape),
            "scale": number(tail.scale),
            "level": number(tail.level),
            "exceeded_by": levels,
            "beyond_limit": beyond,
        }
    return found


def _mirrored(found: Estimate, sign: int) -> Estimate:
    if sign > 0:
        return found
    return Estimate(-found.value, -found.upper, -found.lower, found.reason)


def _integration_error(drawn: Drawn, name: str, summary: Summary) -> Found | None:
    """Say how far integration errors move the numbers of a response."""
    run = drawn.run
    if run.audited is None:
        return None
    audited = run.audited
    ran = (audited.status == Status.DONE) & (run.status[audited.trials] == Status.DONE)
    values = run.column(name)
    precise = np.where(ran, audited.responses[name], np.nan)
    error = integration_error(values, audited.trials, precise)
    found: Found = {
        "trials": len(error.trials),
        "failed": error.failed,
        "rtol": audited.rtol,
        "largest": number(error.largest),
        "moves": {},
    }
    if not len(error.trials):
        return found
    better = error.removed(values)[drawn.trials]
    sample = drawn.sample
    done = better[sample.done]
    moves = {
        "mean": summary.mean.value - float(done.mean()),
        "sigma": summary.sigma.value - float(done.std(ddof=1))
        if len(done) > 1
        else math.nan,
    }
    again = quantiles_at(better, sample, summary.quantiles)
    for share, known in summary.quantiles.items():
        moves[share_words(share)] = known.value - again[share].value
    if summary.limited:
        beyond = yields(better, sample, summary.limited.limit).beyond
        moves["beyond"] = summary.limited.yields.beyond.value - beyond.value
    found["moves"] = {key: number(move) for key, move in moves.items()}
    return found


def _assumptions(run: Run) -> Found:
    """Say what the numbers hang on."""
    return {
        "deviations": {
            each.name: {
                "words": run.assumed[each.name].words,
                "lower": run.assumed[each.name].tolerance[0],
                "upper": run.assumed[each.name].tolerance[1],
                "unit": each.unit,
                "shown_unit": engineering_unit(each.unit),
                "sentence": each.sentence,
            }
            for each in run.contributors
            if each.name in run.assumed
        },
        "correlation": run.study.table.get("correlation", {}),
        "settings": run.facts["settings"],
        "of_the_model": str(run.facts.get("assumptions", "")).splitlines(),
    }


def _provenance(run: Run) -> Found:
    hidden = ("promise", "notes", "assumptions", "contributors", "responses", "factors")
    found = {
        name: value
        for name, value in run.facts.items()
        if name not in hidden and not name.startswith("trials_")
    }
    return {**found, "study": run.study.text}

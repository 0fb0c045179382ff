"""Examination of a model: a few trials, their steps, errors, and dependence."""

from pathlib import Path

import numpy as np

from tolstat import catalogue
from tolstat.document import blocks
from tolstat.document.inline import Number, text
from tolstat.execution.verification import other_answers
from tolstat.integrator.examination import MOST_STEPS, Examination, examine
from tolstat.integrator.integrate import observed
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, simulate
from tolstat.model.contract import Answers
from tolstat.status import words_of
from tolstat.study.study import load

TRIALS = 3
SMALL = 1e-6  # SI: deviations, where no study gives tolerances
PERMITTED = 300.0  # of rtol, for a healthy error
DEPENDENT = (
    "An answer depends on the other trials of its block: compute each row of "
    "deviations by itself."
)
OTHER = 100.0  # times its largest value, or a part of it: a scale to think about


def examined(what: str) -> tuple[blocks.Document, bool]:
    """Return the examination of a few trials of a model, and whether it is healthy.

    Parameters
    ----------
    what : str
        A study file, a name of `tolstat.models()`, or FILE.py:NAME.

    Raises
    ------
    StudyError, ModelError
        If there is no such study or model, or it cannot be evaluated.
    """
    if what.endswith(".toml"):
        study = load(Path(what))
        model, settings = study.model, study.settings
        rows = study.deviations()[:TRIALS]
    else:
        model = catalogue.load(what) if ":" in what else catalogue.find(what)
        settings = model_settings.make(model, None)
        names = described(model, settings).contributors
        rows = SMALL * np.arange(TRIALS)[:, None] * np.ones((1, len(names)))
    with observed() as seen:
        together = simulate(model, rows, settings)
    apart = Answers.joined([simulate(model, row[None, :], settings) for row in rows])
    dependent = bool(other_answers(together, apart).any())
    words = words_of(model.failures)
    ended = zip(*np.unique(together.status, return_counts=True), strict=True)
    facts = {
        "trials": ", ".join(f"{count} {words[code]}" for code, count in ended),
        "alone and in a block": "different" if dependent else "the same",
    }
    advice, states, healthy = [DEPENDENT] * dependent, None, not dependent
    if seen:
        longest = max(seen, key=lambda each: int(each.solution.steps.sum()))
        found, rtol = examine(longest), longest.block.accuracy.rtol
        failure = next((f"A trial {each.failure}" for each in seen if each.failure), "")
        facts |= _facts(found)
        advice += _advice(found, rtol, failure)
        healthy &= not found.failed.any() and max(found.errors.values()) <= PERMITTED
        states = _states(found)
    else:
        facts["equations"] = "none are integrated"
    shown = blocks.shown(
        blocks.Paragraph(text(model.title), "lead"),
        blocks.Facts(tuple((name, text(each)) for name, each in facts.items())),
        blocks.Bullets(tuple(map(text, advice))),
        states,
    )
    return blocks.Document("", shown), healthy


def _facts(found: Examination) -> dict[str, str]:
    errors = ", ".join(f"{name} {each:.2g}" for name, each in found.errors.items())
    rows = {
        "steps a trial": f"{found.steps.min()} to {found.steps.max()}",
        "largest error, in units of rtol": errors,
        "steps left at 100 times rtol": f"{found.looser:.0%}",
        "with the longest step times 4": f"{found.longer:.0%}",
    }
    if found.undamped is not None:
        rows["without damped states"] = f"{found.undamped:.0%}"
    return rows


def _advice(found: Examination, rtol: float, failure: str) -> list[str]:
    said = list[str]()
    first = f"State {found.demanding + 1} demands most steps."
    if found.failed.any():
        said.append(
            f"{failure}. Look at the rates of this state there: a branch without a "
            "crossing, a division by zero, or a stiff part."
            if failure
            else f"{first} A trial needs more than {MOST_STEPS} steps."
        )
    elif found.stiff:
        said.append(
            f"{first} The steps hardly depend on rtol: the equations are stiff. If one "
            "state relaxes much faster than all others, name it in damped."
        )
    elif found.by_longest:
        said.append("The longest step decides: a longer one saves steps.")
    else:
        said.append(f"{first} Accuracy decides: a larger rtol saves steps.")
    if found.undamped is not None:
        times = f"{found.undamped:.2g} times the steps"
        pays = "pays" if found.undamped > 1.0 else "does not pay"
        said.append(f"Damping {pays}: without it the trials need {times}.")
    if max(found.errors.values()) > PERMITTED:
        said.append(
            f"Errors exceed {PERMITTED:.0f} times rtol = {rtol:g}. A branch of the "
            "rates without a crossing, or a lambda that is too large, does this."
        )
    ratio = found.scale / found.proposed
    unusual = (ratio >= OTHER) | (ratio <= 1.0 / OTHER)
    if numbers := [str(i + 1) for i in np.flatnonzero(unusual)]:
        said.append(
            f"The scale of state {', '.join(numbers)} differs {OTHER:.0f} times or "
            "more from its largest value. Keep it where small parts of it count."
        )
    return said


def _states(found: Examination) -> blocks.Table:
    rows: list[dict[str, blocks.Given]] = [
        {
            "state": str(i + 1),
            "scale": Number(scale),
            "largest value": Number(largest),
            "steps if only it counts, %": Number(round(100.0 * share)),
        }
        for i, (scale, largest, share) in enumerate(
            zip(found.scale, found.proposed, found.alone, strict=True)
        )
    ]
    return blocks.table_of(rows, "States")

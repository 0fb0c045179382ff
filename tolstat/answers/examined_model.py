"""Examination of a model: a few trials, their steps, errors, and dependence."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.arrays import Integers, Truths
from tolstat.document.blocks import (
    Block,
    Bullets,
    Document,
    Facts,
    Given,
    Paragraph,
    table_of,
)
from tolstat.document.inline import Number, Parts, Said, text
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
OTHER = 100.0  # times its largest value, or a part of it: a scale to think about


class Examined(NamedTuple):
    """A model, examined."""

    document: Document
    healthy: bool


def examined(what: str) -> Examined:
    """Return the examination of a few trials of a model.

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
    facts: list[tuple[str, Parts]] = [
        ("trials", text(_ended(together.status, words_of(model.failures)))),
        ("alone and in a block", text("different" if dependent else "the same")),
    ]
    advice: list[Said] = []
    if dependent:
        advice.append(
            "An answer depends on the other trials of its block: compute each row of "
            "deviations by itself."
        )
    if not seen:
        facts.append(("equations", text("none are integrated")))
        return Examined(_document(model.title, facts, advice), not dependent)
    longest = max(seen, key=lambda each: int(each.solution.steps.sum()))
    found, rtol = examine(longest), longest.block.accuracy.rtol
    failure = next((f"A trial {each.failure}" for each in seen if each.failure), "")
    facts += _facts(found)
    advice += _advice(found, rtol, failure)
    healthy = not (dependent or found.failed.any() or _worst(found) > PERMITTED)
    return Examined(_document(model.title, facts, advice, _states(found)), healthy)


def _ended(status: Integers, words: dict[int, str]) -> str:
    codes, counts = np.unique(status, return_counts=True)
    return ", ".join(f"{n} {words[c]}" for c, n in zip(codes, counts, strict=True))


def _worst(found: Examination) -> float:
    return max(found.errors.values())


def _facts(found: Examination) -> list[tuple[str, Parts]]:
    errors = ", ".join(f"{name} {each:.2g}" for name, each in found.errors.items())
    steps = found.steps
    rows: list[tuple[str, Parts]] = [
        ("steps a trial", text(f"{steps.min()} to {steps.max()}")),
        ("largest error, in units of rtol", text(errors)),
        ("steps left at 100 times rtol", text(f"{found.looser:.0%}")),
        ("with the longest step times 4", text(f"{found.longer:.0%}")),
    ]
    if found.undamped is not None:
        rows.append(("without damped states", text(f"{found.undamped:.0%}")))
    return rows


def _advice(found: Examination, rtol: float, failure: str) -> list[Said]:
    said: list[Said] = []
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
    if _worst(found) > PERMITTED:
        said.append(
            f"Errors exceed {PERMITTED:.0f} times rtol = {rtol:g}. A branch of the "
            "rates without a crossing, or a lambda that is too large, does this."
        )
    numbers = [str(i + 1) for i in np.flatnonzero(_unusual(found))]
    if numbers:
        said.append(
            f"The scale of state {', '.join(numbers)} differs {OTHER:.0f} times or "
            "more from its largest value. Keep it where small parts of it count."
        )
    return said


def _unusual(found: Examination) -> Truths:
    ratio = found.scale / found.proposed
    return np.asarray((ratio >= OTHER) | (ratio <= 1.0 / OTHER))


def _states(found: Examination) -> Block:
    rows: list[dict[str, Given]] = [
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
    return table_of(rows, "States")


def _document(
    title: str, facts: list[tuple[str, Parts]], advice: list[Said], *more: Block
) -> Document:
    said = Bullets(tuple(text(each) for each in advice)) if advice else None
    sheet = (Paragraph(text(title), "lead"), Facts(tuple(facts)), said, *more)
    return Document("", tuple(each for each in sheet if each is not None))

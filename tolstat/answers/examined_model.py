"""A model examined by a few of its trials: their steps, their errors, their audit."""

import math
from collections.abc import Iterator, Mapping
from enum import Enum, auto
from pathlib import Path
from typing import Any

import numpy as np

from tolstat import catalogue
from tolstat.answers.report.finding_words import movement_words
from tolstat.arrays import Array
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts
from tolstat.document.sentences import say, text
from tolstat.execution.diagnostics.audit import finer, phased
from tolstat.execution.run_loop import other_results
from tolstat.integrator.branches import kink_words
from tolstat.integrator.examination import MOST_STEPS, PERMITTED, Examination, examine
from tolstat.integrator.integrate import observed
from tolstat.integrator.problem import Residual
from tolstat.integrator.residual import largest_residual
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, simulate
from tolstat.model.contract import Model, TrialResults
from tolstat.statistics.integration_error import AuditedResponse
from tolstat.statistics.limits.limit import Limit
from tolstat.status import Status, words_of
from tolstat.study.given_points import Case
from tolstat.study.study import load
from tolstat.units.scale import scale_of

TRIALS = 3
EVENT = "event "  # a state that `held` or another event of a motion needs
AUDITED = 24  # trials evaluated again as by an audit
FROM_ZERO = Limit(0.0, math.inf)  # without limits errors count beside the size
MISSED = (
    "Integration errors would leave {} undecided: {}. An event shorter than max_step, "
    "or a jump of the rates, is missed. Give it marks or a crossing, or let max_step "
    "be shorter than it."
)
MISSED_BY_OTHERS = (
    "Errors of this model would leave {} undecided: {}. Let max_step be shorter, rtol "
    "smaller, or choose model exchange where it is offered."
)
NOTABLE = 0.01  # of its size: an error in a model that tolstat does not integrate
SMALL = 1e-6  # SI: deviations, where no study gives tolerances
DEPENDENT = (
    "An answer depends on the other trials of its block: compute each row of "
    "deviations by itself."
)
OTHER = 100.0  # times its largest value, or a part of it: a scale to think about


class Health(Enum):
    """What an examination finds."""

    GOOD = auto()
    NO_AUDIT = auto()  # the audit of a run would leave its limits undecided
    UNHEALTHY = auto()


def examined(source: str) -> tuple[blocks.Document, Health]:
    """Return the examination of a few trials of a model, and its health.

    Parameters
    ----------
    source : str
        A study file, a name of `tolstat.models()`, or FILE.py:NAME.

    Raises
    ------
    StudyError, ModelError
        If there is no such study or model, or it cannot be evaluated.
    """
    limits: Mapping[str, Limit] = {}
    if source.endswith(".toml"):
        study = load(Path(source))
        model, settings, limits = study.model, study.settings, study.limits
        deviations = study.deviations()[:AUDITED]
    else:
        custom = catalogue.load(source) if catalogue.is_source(source) else source
        model = catalogue.find(custom)
        settings = model_settings.make(model, None)
        names = described(model, settings).contributors
        deviations = SMALL * np.arange(AUDITED)[:, None] * np.ones((1, len(names)))
    rows = deviations[:TRIALS]
    with observed(surveyed=True) as seen:
        together = simulate(model, rows, settings)
    alone = [simulate(model, row[None, :], settings) for row in rows]
    dependent = bool(other_results(together, TrialResults.joined(alone)).any())
    words = words_of(model.failures)
    ended = zip(*np.unique(together.status, return_counts=True), strict=True)
    facts = {
        "trials": ", ".join(f"{count} {words[code]}" for code, count in ended),
        "alone and in a block": "different" if dependent else "the same",
    }
    done = bool((together.status == Status.DONE).all())
    advice, states, healthy = [DEPENDENT] * dependent, None, done and not dependent
    advice += [f"A trial fails: {output}" for output in [*together.output.values()][:1]]
    if seen:
        longest = max(seen, key=lambda i: int(i.solution.steps.sum()))
        examination, rtol = examine(longest), longest.block.accuracy.rtol
        failures = (f"A trial {i.failure}" for i in seen if i.failure)
        state_names = _state_names(model, len(examination.scale))
        facts |= _facts(examination)
        advice += _advice(examination, state_names, rtol, next(failures, ""))
        advice += kink_words(seen)
        settled = examination.accurate or examination.sensitive
        healthy &= not examination.failed.any() and settled
        states = _states(examination, state_names)
    else:
        others = "solved in other processes, which tolstat does not see"
        facts["equations"] = others if model.isolation else "none are integrated"
    warnings = _audit(model, settings, deviations, limits, largest_residual(seen))
    parts = blocks.shown(
        blocks.Paragraph(text(model.title), "lead"),
        blocks.Facts(tuple((name, text(fact)) for name, fact in facts.items())),
        blocks.Bullets((*warnings, *map(text, advice))),
        states,
    )
    usual = Health.GOOD if healthy else Health.UNHEALTHY
    return blocks.Document("", parts), Health.NO_AUDIT if warnings else usual


def _audit(
    model: Model,
    settings: Any,
    rows: Array,
    limits: Mapping[str, Limit],
    residual: Residual | None,
) -> list[Parts]:
    """Return why an audit of these trials would fail; empty if it would not.

    The trials are evaluated again, and a third time, as an audit does it. `residual` is
    that of their steps.
    """
    tight, tightest = (finer(model, settings, times) for times in (1, 2))
    if tight is None:
        return []
    rows = rows if model.integrates else rows[:TRIALS]  # others may be slow
    levels = [simulate(model, rows, settings).responses]
    for times, level in enumerate((tight, tightest or tight), 1):
        cases = phased(Case(0, len(rows), level), times)
        parts = [simulate(model, rows[c.first : c.stop], c.settings) for c in cases]
        levels.append(TrialResults.joined(parts).responses)
    trials, none = np.arange(len(rows)), np.zeros(len(rows), np.bool_)
    warnings, responses = list[Parts](), described(model, settings).responses
    sizes = np.abs(np.nan_to_num(levels[0])).max(axis=0)
    for column, response in enumerate(responses):
        limit = limits.get(response.name, FROM_ZERO)
        if response.residual or (limits and limit is FROM_ZERO):
            continue
        usual, precise, most = (answers[:, column] for answers in levels)
        audited = AuditedResponse(
            usual, limit.permitted, trials, precise, ~none, none, trials, most,
            residual.of_rtol if residual else 0.0,
        )  # fmt: skip
        fails = audited.irregular.any()
        if limits:  # a verdict depends on more
            fails |= audited.unsettled.any() or audited.dominant or audited.jumped_over
        else:  # a difference has no size of its own
            alike = sizes[[other.unit == response.unit for other in responses]]
            errors = np.nan_to_num(audited.errors)
            if model.integrates:
                fails &= errors.max() > PERMITTED * settings.rtol * alike.max()
            else:  # what errors it may have is not known
                fails |= errors.max() > NOTABLE * alike.max()
        if fails:
            scale = scale_of(response.unit, response.shown, float(sizes[column]))
            movement = movement_words(audited.movement, scale)
            words = MISSED if model.integrates else MISSED_BY_OTHERS
            warnings.append(say(words, Name(response.name), movement))
    return warnings


def _facts(examination: Examination) -> dict[str, str]:
    errors = [f"{name} {error:.2g}" for name, error in examination.errors.items()]
    rows = {
        "steps a trial": f"{examination.steps.min()} to {examination.steps.max()}",
        "largest error, in units of rtol": ", ".join(errors),
        "steps at 100 times rtol": f"{examination.looser:.0%}",
        "with the longest step times 4": f"{examination.longer:.0%}",
    }
    if examination.undamped is not None:
        rows["without damped states"] = f"{examination.undamped:.0%}"
    return rows


def _state_names(model: Model, number: int) -> list[str]:
    """Return the names of states; their numbers where the model does not name them."""
    equations = getattr(model.unwrapped, "equations", None)
    names = [*getattr(equations, "states", ())]
    return names if len(names) == number else [str(i + 1) for i in range(number)]


def _advice(
    examination: Examination, names: list[str], rtol: float, failure: str
) -> Iterator[str]:
    first = f"State {names[examination.demanding]} demands most steps."
    if examination.failed.any() and examination.stiff:
        yield f"{failure}. {examination.stiffness.words}".lstrip(". ")
    elif examination.failed.any():
        yield (
            f"{failure}. Look at the rates of this state there: a branch without a "
            "crossing, a division by zero, or a stiff part."
            if failure
            else f"{first} A trial needs more than {MOST_STEPS} steps."
        )
    elif examination.stiff:
        yield f"{first} The steps hardly depend on rtol. {examination.stiffness.words}"
    elif examination.by_longest:
        yield "The longest step decides: a longer one saves steps."
    elif examination.by_rtol:
        yield f"{first} Accuracy decides: a larger rtol saves steps."
    else:
        yield (
            "A larger rtol or a longer step saves few steps: they end at samples, "
            "marks and crossings, or stability limits them."
        )
    if examination.undamped is not None:
        times = f"{examination.undamped:.2g} times the steps"
        pays = "pays" if examination.undamped > 1.0 else "does not pay"
        yield f"Damping {pays}: without it the trials need {times}."
    if examination.sensitive:
        yield (
            f"The motion is sensitive: a small change of its start is "
            f"{examination.growth:.2g} times as large at the end, and so are errors. A "
            "smaller rtol or a shorter motion makes them smaller."
        )
    elif not examination.accurate:
        yield (
            f"Errors exceed {PERMITTED:.0f} times rtol = {rtol:g}. A branch of the "
            "rates without a crossing, or a lambda that is too large, does this."
        )
    ratio = examination.scale / examination.proposed
    unusual = (ratio >= OTHER) | (ratio <= 1.0 / OTHER)
    odd = [name for name, is_odd in zip(names, unusual, strict=True) if is_odd]
    if declared := [name for name in odd if not name.startswith(EVENT)]:
        yield (
            f"The scale of state {', '.join(declared)} differs {OTHER:.0f} times or "
            "more from its largest value. Keep it where small parts of it count."
        )


def _states(examination: Examination, names: list[str]) -> blocks.Table:
    states = zip(
        names, examination.scale, examination.proposed, examination.alone, strict=True
    )
    rows: list[dict[str, blocks.Given]] = [
        {
            "state": name,
            "scale": Number(scale),
            "largest value": Number(largest),
            "steps if only it counts, %": Number(round(100.0 * share)),
        }
        for name, scale, largest, share in states
    ]
    return blocks.table_of(rows, "States")

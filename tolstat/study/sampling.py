"""Sampling of a study: how its trials are chosen, and how many; keys for each."""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.deviations.distributions import Constant
from tolstat.deviations.draw import SAMPLERS, factors
from tolstat.deviations.names import expand
from tolstat.errors import ModelError, StudyError, UnitError, allowed_names
from tolstat.model.description import Description, Response
from tolstat.statistics.sample_size import DECIDE, MOST_ROWS, Precision, Statistic
from tolstat.statistics.sensitivity.sobol_indices import LEAST_GROUPS
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import Points
from tolstat.study.problems import Problems
from tolstat.study.study_schema import (
    MISSING,
    RESULTS,
    DecideEntry,
    Document,
    RareEntry,
    UntilEntry,
    read_entry,
)
from tolstat.units.grammar import bare_number, quantity, unit_of
from tolstat.units.scale import PER_CENT, scale_of

GIVEN = ("grid", "table")  # samplings whose trials are given
KINDS = ("mean", "sigma", "median", "beyond")  # of a stopping rule
EXAMPLE = 'such as extra_loss = "<= 3 %"'  # a limit
Rule = str | Mapping[str, Any]  # a stopping rule: the key `trials` of a study
AT_MOST = ", at most "  # before the budget of a rule
SLOW = {True: ", slow", False: ", not slow", None: ""}  # after it
FIRST_ROWS = 8192  # trials of such a run: first


def read_sampling(document: Document, problems: Problems) -> tuple[str, str]:
    """Return a sampling, and the response whose limit it aims at; empty for none."""
    value, samplings = document.sampling, [*SAMPLERS, *GIVEN]
    if document.model == RESULTS:
        if "sampling" in document.model_fields_set and value != "table":
            said = (
                'the trials are rows of a file; say how in [table]: sampled = "random"'
            )
            problems.add("sampling", value, said)
        return "table", ""
    if isinstance(value, str) and value in samplings:
        return value, ""
    with problems.noting("sampling", value):
        if isinstance(value, str):
            raise StudyError(f"no such sampling; {allowed_names(value, samplings)}")
        return "rare", read_entry(RareEntry, value, "there is").rare
    return "random", ""


def aim_of(sampling: str, name: str, limited: Collection[str], names: list[str]) -> str:
    """Return the response that a sampling aims at: named, or the only limited one.

    Empty where it aims at none.
    """
    if sampling not in SAMPLERS or not SAMPLERS[sampling].aims:
        return ""
    aims = expand(name, names) if name else list(limited)
    if name and (without := [aim for aim in aims if aim not in limited]):
        raise ModelError(
            f"{', '.join(without)}: no limit; add one to [limits], {EXAMPLE}"
        )
    if not aims:
        raise StudyError(
            f"it needs a limit; add one to [limits], {EXAMPLE}; responses: "
            f"{', '.join(names)}"
        )
    if len(aims) > 1:
        raise StudyError(
            f"it needs one limit, and there are {len(aims)}: {', '.join(aims)}; "
            f'name one, such as sampling = {{ {sampling} = "{aims[0]}" }}'
        )
    return aims[0]


def note_faults(
    document: Document,
    sampling: str,
    deviating: Deviations,
    points: Points | None,
    problems: Problems,
) -> None:
    """Note keys that are missing for a sampling, or have no meaning for it.

    A wrong sampling is taken for random.
    """
    if problems.noted("sampling") and (document.grid or document.table):
        return
    for key, needed in (("grid", "grid"), ("table", "table"), ("[reference]", "grid")):
        if getattr(document, key.strip("[]")) and sampling != needed:
            problems.add(key, None, f'it needs sampling = "{needed}"')
    typed = f'sampling = "{sampling}"'
    if sampling in GIVEN:
        _note_faults_of_given(document, sampling, deviating, points, problems)
        return
    sampler = SAMPLERS[sampling]
    varying = len(factors(deviating.distributions, deviating.dependence))
    usual = sampler.usual_trials(varying)
    if document.trials is None:
        missing = f"missing; such as trials = {usual}" if usual else MISSING["trials"]
        problems.add("trials", None, missing)
    if document.seed is None:
        problems.add("seed", None, MISSING["seed"])
    if decides(document.trials) and sampling != "random":
        problems.add(
            "trials",
            document.trials,
            f'{typed} has no verdict that holds after any number of trials; "decide" '
            'needs sampling = "random"',
        )
    elif isinstance(document.trials, dict) and not sampler.extensible:
        number = f"give one, such as trials = {usual}," if usual else "give one"
        problems.add(
            "trials",
            document.trials,
            f"{typed} needs a fixed number of trials; {number} or "
            'sampling = "random" or "sobol" for a stopping rule',
        )
    if sampler.group(varying) > 1 and document.correlation:
        wrong = f"{typed} needs deviations that are independent"
        problems.add("[correlation]", None, wrong)


def _note_faults_of_given(
    document: Document,
    sampling: str,
    deviating: Deviations,
    points: Points | None,
    problems: Problems,
) -> None:
    """Note keys that trials of a grid or a table lack, or cannot have."""
    if sampling == "grid" and not document.grid:
        missing = "missing; give contributors or settings, and their values"
        problems.add("[grid]", None, missing)
    if sampling == "table" and not document.table:
        problems.add("table", None, 'missing; such as table = "machines.csv"')
    none = f'sampling = "{sampling}" samples nothing'
    for key in ("trials", "seed"):
        if (value := getattr(document, key)) is not None:
            problems.add(key, value, f"{none}; leave it out")
    # a sample, or results, may state what it came from
    stated = document.model == RESULTS or (points and points.sampler)
    if document.correlation and not stated:
        problems.add("[correlation]", None, none)
    taken = {m for axis in points.swept for m in axis.members} if points else set()
    for name, distribution in deviating.distributions.items():
        if stated and sampling == "table":
            continue
        if not isinstance(distribution, Constant):
            only = f'{none}; only distribution = "constant" is allowed'
            problems.add(f"[deviations] {name}", None, only)
        elif name in taken:
            wrong = "is also in [grid]; give it once"
            problems.add(f"[deviations] {name}", None, wrong)


def warnings_of(sampling: str, trials: int, varying: int) -> tuple[str, ...]:
    """Return the warnings about a study before it is run."""
    if varying == 0 and trials > 1:
        return (
            f"nothing deviates: all {trials} trials are equal, and their intervals "
            "have no meaning; give [deviations]",
        )
    sampler = SAMPLERS[sampling]
    group = sampler.group(varying)
    if group > 1 and trials < (least := LEAST_GROUPS * group):
        return (
            f"there will be no Sobol' indices: they need {LEAST_GROUPS} groups of "
            f"{group} trials; give trials = {least} or more ({trials} are "
            f"{trials // group} groups)",
        )
    return sampler.warnings(trials, varying)


class Budget(NamedTuple):
    """What a run may take: it ends once it has taken both."""

    trials: int
    seconds: float

    @property
    def most(self) -> int:
        """Most trials that it may have."""
        return MOST_ROWS if self.seconds else self.trials


BUDGET = Budget(200_000, 60.0)  # without another


class Until(NamedTuple):
    """A stopping rule: the precision at which a run ends, or the verdicts."""

    precisions: tuple[Precision, ...]  # all of them must be reached
    at_most: int  # trials after which it ends in any case
    rules: tuple[str, ...]  # as they are written
    units: dict[str, str]  # of a rule's precision, by response
    # of a run that ends when every limit is decided; it has no precisions, and its
    # first trials are `at_most`
    budget: Budget | None = None
    slow: bool | None = None  # whether it evaluates few trials; None: see `is_thinned`


def decides(trials: object) -> bool:
    """Return whether the key `trials` asks for a verdict of every limit."""
    return (trials.get("until") if isinstance(trials, dict) else trials) == DECIDE


def deciding(at_most: int | str | None = None, slow: bool | None = None) -> Rule:
    """Return the key `trials` that asks for every verdict within a budget."""
    keys = {"at_most": at_most, "slow": slow}
    keys = {name: value for name, value in keys.items() if value is not None}
    return {"until": DECIDE, **keys} if keys else DECIDE


def with_slow(rule: object, written: object) -> object:
    """Return the key `trials` in place of one as written, whose `slow` it keeps."""
    if not (decides(rule) and decides(written) and isinstance(written, dict)):
        return rule
    keys = {"slow": written["slow"]} if "slow" in written else {}
    return keys | rule if isinstance(rule, dict) else {"until": DECIDE, **keys}


def rule_stored(rules: Sequence[str]) -> Rule | None:
    """Return the key `trials` of a run by its rules; None if it has others."""
    if not rules or not (rule := rules[0]).startswith(DECIDE):
        return None
    words = rule.removeprefix(DECIDE)
    slow = next(key for key, word in SLOW.items() if words.endswith(word))
    at_most = words.removesuffix(SLOW[slow]).removeprefix(AT_MOST)
    trials = at_most.removesuffix(" trials")
    return deciding(int(trials) if trials != at_most else at_most or None, slow)


def _read_deciding(keys: Rule, limited: Collection[str]) -> Until:
    """Return the rule that ends a run when every limit is decided."""
    at_most = slow = None
    if isinstance(keys, Mapping):
        entry = read_entry(DecideEntry, keys, "there is")
        at_most, slow = entry.at_most, entry.slow
    if not limited:
        raise StudyError(f"no limit to decide; add one to [limits], {EXAMPLE}")
    budget, words = BUDGET, ""
    if isinstance(at_most, str):
        budget, words = Budget(0, quantity(at_most, "s")), f"{AT_MOST}{at_most}"
        if not budget.seconds > 0:
            raise UnitError(f'at_most = "{at_most}": a time above zero is expected')
    elif at_most is not None:
        if at_most < 1:
            raise StudyError(f"at_most = {at_most}: a whole number from 1 is expected")
        budget, words = Budget(at_most, 0.0), f"{AT_MOST}{at_most} trials"
    words = f"{DECIDE}{words}{SLOW[slow]}"
    return Until((), min(FIRST_ROWS, budget.most), (words,), {}, budget, slow)


def read_until(
    keys: Rule, description: Description, limited: Mapping[str, Any]
) -> Until:
    """Return a stopping rule: `until`, one or a list of them, and `at_most`.

    `limited` are the responses with a limit.
    """
    if isinstance(keys, str) or decides(keys):
        return _read_deciding(keys, limited)
    entry = read_entry(UntilEntry, keys, "there is")
    rules = [entry.until] if isinstance(entry.until, str) else entry.until
    responses = {response.name: response for response in description.responses}
    read = [_precision(rule, responses, limited) for rule in rules]
    units = {precision.statistic.response: unit for precision, unit in read if unit}
    precisions = tuple(precision for precision, _ in read)
    return Until(precisions, entry.at_most, tuple(rules), units)


def _precision(
    rule: str, responses: Mapping[str, Response], limited: Mapping[str, Any]
) -> tuple[Precision, str]:
    """Return one rule, and the unit of its precision."""
    words = rule.replace("±", "+-").split(maxsplit=2)
    if len(words) != 3 or not words[2].startswith("+-"):
        raise StudyError(
            f'"{rule}": a response, a statistic and a precision are expected, such as '
            '"extra_loss p95 +-2 %"'
        )
    name, kind, precision = words
    if name not in responses:
        raise StudyError(f"response {name}: {allowed_names(name, responses)}")
    statistic = _statistic(name, kind)
    if kind == "beyond" and name not in limited:
        raise StudyError(f"{name} beyond: the response has no limit")
    within = precision.removeprefix("+-").strip()
    value, relative = _within(within, kind, responses[name])
    if not value > 0:
        raise UnitError(f'"{precision}": a precision above zero is expected')
    of_the_response = not relative and kind != "beyond" and not within.endswith("pp")
    return Precision(statistic, value, relative), (
        unit_of(within) if of_the_response else ""
    )


def _within(words: str, kind: str, response: Response) -> tuple[float, bool]:
    """Return a precision; a per cent is relative to the number, in any unit."""
    share, unit = kind == "beyond", response.unit
    if words.endswith("pp") and (share or unit == "1"):
        return bare_number(words.removesuffix("pp").strip()) / 100, False
    if share and words.endswith("%"):
        raise UnitError(
            f'"+-{words}" of a share is ambiguous; write "+-0.1 pp" for '
            'percentage points or "+-20 % of itself"'
        )
    words = words.removesuffix("of itself").strip()
    if words.endswith("%"):
        return bare_number(words.removesuffix("%").strip()) / 100, True
    scale = PER_CENT if share else scale_of(unit, response.shown)
    value = quantity(words, scale.unit)
    if scale.unit == "1" and scale.factor != 1 and unit_of(words) == "1":
        raise UnitError(
            f'"+-{words}" of a number shown in {scale.mark} has no unit; write '
            f'"+-{words} pp" for percentage points, or "+-{words} % of itself"'
        )
    return value, False


def _statistic(name: str, kind: str) -> Statistic:
    if percentile := re.fullmatch(r"p(\d+(?:\.\d+)?)", kind):
        share = float(percentile[1]) / 100
        if 0 < share < 1:
            return Statistic(name, "quantile", share)
    elif kind == "median":
        return Statistic(name, "quantile", 0.5)
    elif kind in KINDS:
        return Statistic(name, kind)
    raise StudyError(
        f"statistic {kind}: {', '.join(KINDS)}, or a percentile such as p95 or p99.865"
    )

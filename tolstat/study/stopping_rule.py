"""The key `trials` as a stopping rule."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from tolstat.errors import StudyError, UnitError, allowed_names
from tolstat.model.description import Description, Response
from tolstat.statistics.precision import Precision, Statistic
from tolstat.study.study_schema import UntilEntry, read_entry
from tolstat.units.grammar import bare_number, quantity, unit_of
from tolstat.units.scale import PER_CENT, scale_of

KINDS = ("mean", "sigma", "median", "beyond")


class Until(NamedTuple):
    """A stopping rule: the precision at which a run ends."""

    precisions: tuple[Precision, ...]  # all of them must be reached
    at_most: int  # trials after which it ends in any case
    rules: tuple[str, ...]  # as they are written
    shown: dict[str, str]  # the unit of a rule's precision, by response


def read_until(
    given: Mapping[str, Any], description: Description, limited: Mapping[str, Any]
) -> Until:
    """Return a stopping rule: `until`, one or a list of them, and `at_most`.

    `limited` are the responses with a limit.
    """
    entry = read_entry(UntilEntry, given, "there is")
    rules = [entry.until] if isinstance(entry.until, str) else entry.until
    known = {each.name: each for each in description.responses}
    read = [_precision(rule, known, limited) for rule in rules]
    shown = {each.statistic.response: unit for each, unit in read if unit}
    precisions = tuple(each for each, _ in read)
    return Until(precisions, entry.at_most, tuple(rules), shown)


def _precision(
    rule: str, known: Mapping[str, Response], limited: Mapping[str, Any]
) -> tuple[Precision, str]:
    """Return one rule, and the unit of its precision."""
    words = rule.replace("±", "+-").split(maxsplit=2)
    if len(words) != 3 or not words[2].startswith("+-"):
        raise StudyError(
            f'"{rule}": a response, a statistic and a precision are expected, such as '
            '"extra_loss p95 +-2 %"'
        )
    name, kind, precision = words
    if name not in known:
        raise StudyError(f"response {name}: {allowed_names(name, known)}")
    statistic = _statistic(name, kind)
    if kind == "beyond" and name not in limited:
        raise StudyError(f"{name} beyond: the response has no limit")
    within = precision.removeprefix("+-").strip()
    value, relative = _within(within, kind, known[name])
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
    if found := re.fullmatch(r"p(\d+(?:\.\d+)?)", kind):
        share = float(found[1]) / 100
        if 0 < share < 1:
            return Statistic(name, "quantile", share)
    elif kind == "median":
        return Statistic(name, "quantile", 0.5)
    elif kind in KINDS:
        return Statistic(name, kind)
    raise StudyError(
        f"statistic {kind}: {', '.join(KINDS)}, or a percentile such as p95 or p99.865"
    )

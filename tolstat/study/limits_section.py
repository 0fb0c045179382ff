"""The section [limits] of a study, read."""

from collections.abc import Iterable, Mapping
from typing import Any

from tolstat.deviations.names import expand
from tolstat.errors import ModelError, UnitError
from tolstat.model.description import Response
from tolstat.statistics.limits.limit import DEMANDED, Limit, yield_of_ppk
from tolstat.study.problems import Problems
from tolstat.study.study_schema import LimitEntry, read_entry
from tolstat.units.grammar import limit, quantity
from tolstat.units.scale import KNOWN, figures

LEAST_YIELD = 0.5  # a smaller one is the share out of limit


def read_limits(
    given: Mapping[str, str | dict[str, Any]],
    responses: Iterable[Response],
    problems: Problems,
) -> dict[str, Limit]:
    """Return the limits of responses, SI; a name without number means each of them."""
    known = {each.name: each for each in responses}
    found: dict[str, Limit] = {}
    for name, value in given.items():
        with problems.noting(f"[limits] {name}", value):
            for each in expand(name, list(known)):
                if each in found:
                    raise ModelError(f"{each} is given twice")
                response = known[each]
                found[each] = read_limit(value, response.unit, response.shown)
    return found


def read_limit(given: str | dict[str, Any], unit: str, shown: str = "") -> Limit:
    """Return the limit of a response in an SI unit, shown in another one.

    "<= 3 %", or with a demand, { limit = "<= 3 %", yield = "99 %" }. The demand is a
    yield (99.73 % by default), the largest fraction nonconforming (`ppm = 100`), or the
    equivalent Ppk (`ppk = 1.33`).
    """
    keys = {"limit": given} if isinstance(given, str) else given
    entry = read_entry(LimitEntry, keys, "a limit has")
    lower, upper = limit(entry.limit, unit, shown)
    found = Limit(lower, upper, words=entry.limit.strip())
    ppk, ppm = entry.ppk, entry.ppm
    typed = f"Ppk {figures(ppk, KNOWN)}" if ppk is not None else ""
    typed = f"{figures(ppm, KNOWN)} ppm" if ppm is not None else typed
    return found._replace(demanded=_demanded(entry, found.ends), demand=typed)


def _demanded(entry: LimitEntry, ends: int) -> float:
    """Return the demanded yield."""
    said = {"yield": entry.demanded, "ppk": entry.ppk, "ppm": entry.ppm}
    given = [key for key, value in said.items() if value is not None]
    if len(given) > 1:
        raise UnitError(f"{' and '.join(given)} set the same demand; give one of them")
    demanded, expected = DEMANDED, ""
    if entry.demanded is not None:
        demanded, expected = quantity(entry.demanded, "1"), "0 and 100 %"
    if entry.ppk is not None:
        demanded = yield_of_ppk(entry.ppk, ends) if entry.ppk > 0 else 0
        expected = "0 and 2.7"
    if entry.ppm is not None:
        demanded, expected = 1 - entry.ppm / 1e6, "0 and 1 000 000"
    if not (0 < demanded < 1 and 1 - demanded < 1):
        value = said[given[0]]
        shown = value if isinstance(value, str) else f"{value:g}"
        raise UnitError(f"{given[0]} = {shown}: a value between {expected} is expected")
    if demanded < LEAST_YIELD:
        out = figures(100 * (1 - demanded), KNOWN)
        raise UnitError(
            f"{given[0]} permits {out} % out of limit; a yield is the share within, "
            'such as yield = "99 %"; write the share out of limit in ppm, such as '
            f"ppm = {figures(1e6 * demanded, KNOWN)}"
        )
    return demanded

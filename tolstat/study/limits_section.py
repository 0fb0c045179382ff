"""The section [limits] of a study, read."""

from collections.abc import Iterable, Mapping
from typing import Any

from tolstat.deviations.names import expand
from tolstat.errors import ModelError, UnitError
from tolstat.model.description import Response
from tolstat.statistics.limits.limit import DEMANDED, Limit, yield_of_ppk
from tolstat.study.problems import Problems
from tolstat.study.study_schema import LimitEntry, read_entry
from tolstat.units.grammar import limit as limit_of
from tolstat.units.grammar import quantity
from tolstat.units.scale import KNOWN, figures

LEAST_YIELD = 0.5  # a smaller one is the share out of limit


def read_limits(
    entries: Mapping[str, str | dict[str, Any]],
    responses: Iterable[Response],
    problems: Problems,
) -> dict[str, Limit]:
    """Return the limits of responses, SI; a name without number means each of them."""
    by_name = {response.name: response for response in responses}
    limits: dict[str, Limit] = {}
    for name, entry in entries.items():
        with problems.noting(f"[limits] {name}", entry):
            for member in expand(name, [*by_name]):
                if member in limits:
                    raise ModelError(f"{member} is given twice")
                response = by_name[member]
                limits[member] = read_limit(entry, response.unit, response.shown)
    return limits


def read_limit(entry: str | dict[str, Any], unit: str, shown_in: str = "") -> Limit:
    """Return the limit of a response in an SI unit, shown in another one.

    "<= 3 %", or with a demand, { limit = "<= 3 %", yield = "99 %" }. The demand is a
    yield (99.73 % by default), the largest fraction nonconforming (`ppm = 100`), or the
    equivalent Ppk (`ppk = 1.33`).
    """
    keys = {"limit": entry} if isinstance(entry, str) else entry
    read = read_entry(LimitEntry, keys, "a limit has")
    limit = Limit(*limit_of(read.limit, unit, shown_in), words=read.limit.strip())
    typed = f"Ppk {figures(read.ppk, KNOWN)}" if read.ppk is not None else ""
    typed = f"{figures(read.ppm, KNOWN)} ppm" if read.ppm is not None else typed
    return limit._replace(
        demanded=_demanded(read, limit.ends),
        demand=typed,
        typed_ppk=None if read.ppk is None else float(read.ppk),
    )


def _demanded(entry: LimitEntry, ends: int) -> float:
    """Return the demanded yield."""
    demands = {"yield": entry.demanded, "ppk": entry.ppk, "ppm": entry.ppm}
    typed = {key: value for key, value in demands.items() if value is not None}
    if len(typed) > 1:
        raise UnitError(f"{' and '.join(typed)} set the same demand; give one of them")
    if not typed:
        return DEMANDED
    ((key, value),) = typed.items()
    if entry.demanded is not None:
        demanded, expected = quantity(entry.demanded, "1"), "0 and 100 %"
    elif entry.ppk is not None:
        demanded = yield_of_ppk(entry.ppk, ends) if entry.ppk > 0 else 0
        expected = "0 and 2.7"
    else:
        assert entry.ppm is not None
        demanded, expected = 1 - entry.ppm / 1e6, "0 and 1 000 000"
    if not (0 < demanded < 1 and 1 - demanded < 1):
        words = value if isinstance(value, str) else f"{value:g}"
        plain = key == "yield" and "%" not in words and "ppm" not in words
        mend = f'; write yield = "{words} %"' if plain and 1 < demanded < 100 else ""
        raise UnitError(
            f"{key} = {words}: a value between {expected} is expected{mend}"
        )
    if demanded < LEAST_YIELD:
        out = figures(100 * (1 - demanded), KNOWN)
        raise UnitError(
            f"{key} permits {out} % out of limit; a yield is the share within, "
            'such as yield = "99 %"; write the share out of limit in ppm, such as '
            f"ppm = {figures(1e6 * demanded, KNOWN)}"
        )
    return demanded

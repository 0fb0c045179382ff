"""The section [limits] of a study, read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from tolstat.deviations.names import expand
from tolstat.errors import ModelError, UnitError, allowed_names
from tolstat.model.description import Response
from tolstat.statistics.limits.limit import DEMANDED, Limit, yield_of_ppk
from tolstat.study.problems import Problems
from tolstat.units.grammar import limit, quantity

DEMANDS = ("yield", "ppk", "ppm")
EXAMPLES = {"ppk": "1.33", "ppm": "100"}
RANGES = {"ppk": ("0", "2.7"), "ppm": ("0", "1 000 000")}


def read_limits(
    given: Mapping[str, str | dict[str, Any]],
    responses: Iterable[Response],
    problems: Problems,
) -> dict[str, Limit]:
    """Read the limits of responses, SI; a name without number is each of them."""
    units = {each.name: each.unit for each in responses}
    found: dict[str, Limit] = {}
    for name, value in given.items():
        with problems.noting(f"[limits] {name}", value):
            for each in expand(name, list(units)):
                if each in found:
                    raise ModelError(f"{each} stands there already; give it once")
                found[each] = read_limit(value, units[each])
    return found


def read_limit(given: str | dict[str, Any], unit: str) -> Limit:
    """Read the limit of a response.

    "<= 3 %", or with what is demanded, { limit = "<= 3 %", yield = "99 %" }: a yield,
    the greatest share beyond per million (`ppm = 100`), or the Ppk of a normal response
    with as many beyond each end (`ppk = 1.33`); a yield of 99.73 % where none is given.
    SI.
    """
    keys = {"limit": given} if isinstance(given, str) else given
    for key in keys:
        if key not in ("limit", *DEMANDS):
            allowed = allowed_names(key, ("limit", *DEMANDS))
            raise UnitError(f"a limit has no key {key}; {allowed}")
    if not isinstance(keys.get("limit"), str):
        raise UnitError('limit: a text is expected, such as "<= 3 %"')
    lower, upper = limit(keys["limit"], unit)
    found = Limit(lower, upper, words=keys["limit"].strip())
    demanded = _demanded(keys, found.ends)
    typed = float(keys["ppk"]) if "ppk" in keys else None
    return found._replace(demanded=demanded, typed_ppk=typed)


def _demanded(keys: dict[str, Any], ends: int) -> float:
    """Read which share of the machines is to be within."""
    given = [key for key in DEMANDS if key in keys]
    if not given:
        return DEMANDED
    if len(given) > 1:
        raise UnitError(f"{' and '.join(given)} say the same twice; give one of them")
    (key,) = given
    value = keys[key]
    if key == "yield":
        if not isinstance(value, str):
            raise UnitError('yield: a text is expected, such as "99 %"')
        demanded = quantity(value, "1")
        if not (0 < demanded < 1 and 1 - demanded < 1):
            raise UnitError(f"yield = {value}: between 0 and 100 % is expected")
        return demanded
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UnitError(f"{key}: a number is expected, such as {key} = {EXAMPLES[key]}")
    demanded = 1 - value / 1e6 if key == "ppm" else yield_of_ppk(value, ends)
    if not (value > 0 and 0 < demanded < 1):
        least, most = RANGES[key]
        raise UnitError(f"{key} = {value:g}: between {least} and {most} is expected")
    return demanded

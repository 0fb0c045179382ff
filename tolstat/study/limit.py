"""One line of [limits], read."""

from __future__ import annotations

from typing import Any

from tolstat.errors import UnitError, allowed_names
from tolstat.statistics.limit import DEMANDED, Limit
from tolstat.units.grammar import limit, quantity


def read_limit(given: str | dict[str, Any], unit: str) -> Limit:
    """Read the limit of a response.

    Parameters
    ----------
    given : str or dict
        "<= 3 %", or { limit = "<= 3 %", yield = "99 %" }.
    unit : str
        SI unit of the response.

    Returns
    -------
    Limit
        SI; a yield of 99.73 % is demanded where none is given.

    Raises
    ------
    UnitError
        If a key or a quantity is wrong.
    """
    keys = {"limit": given} if isinstance(given, str) else given
    for key, value in keys.items():
        if key not in ("limit", "yield"):
            allowed = allowed_names(key, ("limit", "yield"))
            raise UnitError(f"a limit has no key {key}; {allowed}")
        if not isinstance(value, str):
            raise UnitError(f'{key}: a text is expected, such as "<= 3 %" or "99 %"')
    if "limit" not in keys:
        raise UnitError("the key limit is missing")
    demanded = quantity(keys["yield"], "1") if "yield" in keys else DEMANDED
    if not 0 < demanded < 1:
        raise UnitError(
            f"yield = {100 * demanded:g} %: between 0 and 100 % is expected"
        )
    lower, upper = limit(keys["limit"], unit)
    return Limit(lower, upper, demanded, keys["limit"].strip())

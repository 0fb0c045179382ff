"""One line of [deviations], read: its tolerance and its distribution."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from tolstat.deviations import distributions
from tolstat.deviations.draw import Spread
from tolstat.deviations.parts import find_in, names_in
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError, allowed_names
from tolstat.units.grammar import quantity, tolerance

DEFAULT = "normal"


def read_spread(given: str | dict[str, Any], unit: str) -> Spread:
    """Read the distribution of one contributor's deviation.

    Parameters
    ----------
    given : str or dict
        "+-1.2 mm", or a table with the key `tolerance`, the key `distribution` and the
        keys of that distribution.
    unit : str
        SI unit of the contributor.

    Returns
    -------
    Spread
        SI.

    Raises
    ------
    UnitError, DistributionError
        If a quantity or a key is wrong or they do not fit each other.
    """
    keys = {"tolerance": given} if isinstance(given, str) else dict(given)
    if "tolerance" not in keys:
        raise DistributionError('the key tolerance is missing; such as "+-1.2 mm"')
    text = keys.pop("tolerance")
    if not isinstance(text, str):
        raise DistributionError('tolerance: a text such as "+-1.2 mm" is expected')
    zone = Tolerance(*tolerance(text, unit))
    name = keys.pop("distribution", DEFAULT)
    known = names_in(distributions)
    if name not in known:
        raise DistributionError(
            f"no distribution is called '{name}'; {allowed_names(str(name), known)}"
        )
    kind = find_in(distributions, name)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    values = {}
    for key, value in keys.items():
        if key not in fields:
            allowed = allowed_names(key, ["tolerance", "distribution", *fields])
            raise DistributionError(
                f"the {name} distribution has no key {key}; {allowed}"
            )
        if fields[key].metadata.get("in_unit_of_contributor"):
            values[key] = quantity(str(value), unit)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise DistributionError(f"{key}: a number is expected")
        else:
            values[key] = float(value)
    distribution = kind(**values)
    distribution.deviations(np.array([0.5]), zone)  # refuses what does not fit
    return Spread(distribution, zone)

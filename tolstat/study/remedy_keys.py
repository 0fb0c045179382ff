"""What an entry says about remedies: `fixed`, and the `step` of its shifts."""

from collections.abc import Mapping
from typing import Any

from tolstat.errors import DistributionError
from tolstat.model.description import Contributor
from tolstat.study.distribution_entry import FIXED, STEP, WITHOUT
from tolstat.units.grammar import quantity
from tolstat.units.scale import scale_of

CHANGEABLE = ("m", "rad", "kg")  # units that a drawing has: others are conditions


def is_fixed(keys: Mapping[str, Any], part: Contributor) -> bool:
    """Return whether no remedy may change an entry.

    What has no tolerance is fixed. If an entry does not say it itself, so is what is no
    length, angle or mass and has no cost.
    """
    if any(key in keys for key in WITHOUT):
        return True
    changeable = part.unit in CHANGEABLE or "cost" in keys
    return bool(keys.get(FIXED, not changeable))


def step_of(keys: Mapping[str, Any], part: Contributor) -> float | None:
    """Return the step to which changes are rounded, SI; None if none is given."""
    return quantity(keys[STEP], part.unit) if STEP in keys else None


def check_remedy_keys(
    keys: Mapping[str, Any], parts: Mapping[str, Contributor]
) -> None:
    """Refuse values of `fixed` and `step` that say nothing.

    Raises
    ------
    DistributionError, UnitError
        If they cannot be read, or contradict other keys of the entry.
    """
    fixed, step = keys.get(FIXED, True), keys.get(STEP)
    if not isinstance(fixed, bool):
        raise DistributionError("fixed: true or false is expected")
    kept = [key for key in WITHOUT if key in keys]
    if kept and (not fixed or STEP in keys):
        wrong = STEP if STEP in keys else FIXED
        raise DistributionError(
            f"{wrong}: an entry with {kept[0]} has no tolerance, so no remedy changes "
            f"it; leave {wrong} out"
        )
    if keys.get(FIXED) and "cost" in keys:
        raise DistributionError(
            "fixed = true and cost contradict each other; leave one of them out"
        )
    if step is None:
        return
    if not isinstance(step, str):
        raise DistributionError('step: a text such as "0.01 mm" is expected')
    for part in parts.values():
        if not quantity(step, part.unit) > 0:
            mark = scale_of(part.unit, part.shown).mark
            example = f"0.01 {mark}".strip()
            raise DistributionError(
                f'step: a value above 0 is expected, such as "{example}"'
            )

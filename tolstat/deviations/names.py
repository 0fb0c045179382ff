"""Names without their number: `rod_length` means rod_length_1 and rod_length_2."""

import re
from collections.abc import Iterable, Sequence

from tolstat.errors import ModelError, allowed_names


def expand(name: str, allowed: Sequence[str]) -> list[str]:
    """Return the known names that a name stands for, at least one.

    A known name, or one without its number: NAME means exactly NAME_<number> (runout is
    not runout_phase_7).

    Raises `ModelError` if it stands for none; the message names the nearest known name.
    """
    if name in allowed:
        return [name]
    numbered = re.compile(re.escape(name) + r"_[0-9]+")
    members = [other for other in allowed if numbered.fullmatch(other)]
    if not members:
        raise ModelError(f"unknown; {allowed_names(name, known_or_general(allowed))}")
    return members


def known_or_general(numbered: Iterable[str]) -> list[str]:
    """Return names, each numbered family also without its number."""
    names: dict[str, None] = {}
    for name in numbered:
        names |= {general(name): None, name: None}
    return list(names)


def general(name: str) -> str:
    """Return a name without its number."""
    return re.sub(r"_[0-9]+$", "", name)

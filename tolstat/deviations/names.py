"""Names without their number: `rod_length` means rod_length_1 and rod_length_2."""

import re
from collections.abc import Iterable, Sequence

from tolstat.errors import ModelError, allowed_names


def expand(name: str, known: Sequence[str]) -> list[str]:
    """Return the known names that a name stands for, at least one.

    A known name, or one without its number: NAME means exactly NAME_<number> (runout is
    not runout_phase_7).

    Raises `ModelError` if it stands for none; the message names the nearest known name.
    """
    if name in known:
        return [name]
    numbered = re.compile(re.escape(name) + r"_[0-9]+")
    found = [each for each in known if numbered.fullmatch(each)]
    if not found:
        raise ModelError(f"unknown; {allowed_names(name, known_or_general(known))}")
    return found


def known_or_general(known: Iterable[str]) -> list[str]:
    """Return names, each numbered family also without its number."""
    names: dict[str, None] = {}
    for each in known:
        names |= {general(each): None, each: None}
    return list(names)


def general(name: str) -> str:
    """Return a name without its number."""
    return re.sub(r"_[0-9]+$", "", name)

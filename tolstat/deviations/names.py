"""Names without their number: `rod_length` means rod_length_1 and rod_length_2.

So do names of responses without their case: `play` means play_at_cold and play_at_hot.
"""

import re
from collections.abc import Iterable, Sequence

from tolstat.errors import ModelError, allowed_names

IN_CASE = "_at_"  # between a response and its case


def expand(name: str, allowed: Sequence[str]) -> list[str]:
    """Return the known names that a name stands for, at least one.

    A known name, or one without its number: NAME means exactly NAME_<number> (runout is
    not runout_phase_7). A response is also known without its case.

    Raises `ModelError` if it stands for none; the message names the nearest known name.
    """
    if name in allowed:
        return [name]
    stem, in_case, case = name.rpartition(IN_CASE)
    last = re.escape(in_case + case) if in_case else f"(?:{IN_CASE}.+)?"
    member = re.compile(re.escape(stem if in_case else name) + r"(?:_[0-9]+)?" + last)
    members = [other for other in allowed if member.fullmatch(other)]
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

"""Names without their number: `rod_length` means rod_length_1 and rod_length_2.

So do names of responses without their case: `play` means play_at_cold and play_at_hot.
"""

import re
from collections.abc import Iterable, Sequence

from tolstat.errors import ModelError, allowed_names

IN_CASE = "_at_"  # between a response and its case
LOT = "_lot"  # behind the name of parts: the mean of their lot


def expand(name: str, allowed: Sequence[str]) -> list[str]:
    """Return the known names that a name stands for, at least one.

    A known name, or one without its number: NAME means exactly NAME_<number> (runout is
    not runout_phase_7). A response is also known without its case.

    Raises `ModelError` if it stands for none; the message names the nearest known name.
    """
    if name in allowed:
        return [name]
    stem, in_case, case = map(re.escape, name.partition(IN_CASE))
    number = "(?:_[0-9]+)?"
    member = re.compile(
        rf"(?:{stem}{number}{in_case}{case}|{re.escape(name)}{number})(?:{IN_CASE}.+)?"
    )
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


def means_of_lots(names: Sequence[str]) -> list[str]:
    """Return the names that are NAME_lot beside parts of that name."""
    lots = [name for name in names if name.endswith(LOT)]
    parts = known_or_general(names) if lots else ()  # slow of thousands
    return [name for name in lots if name.removesuffix(LOT) in parts]

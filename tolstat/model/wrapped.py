"""A model around another one: what it has in common with it."""

from operator import attrgetter
from typing import Any

from tolstat.lanes.digest import digest
from tolstat.model.contract import Model

COMMON = (
    "name", "title", "settings", "assumptions", "failures", "row_by_row",
    "needs_nominal", "tightened", "notes",
)  # fmt: skip


def _of_base(name: str) -> Any:
    """Return a property of a wrapped model: that of the other one."""
    return property(attrgetter(f"base.{name}"))


class Wrapped(Model):
    """A model that evaluates another one, with its settings."""

    unwrapped = _of_base("unwrapped")
    isolation = _of_base("isolation")
    audits_steps = _of_base("audits_steps")
    integrates = _of_base("integrates")
    moves = _of_base("moves")
    animates = _of_base("animates")

    def __init__(self, base: Model) -> None:
        self.base = base
        vars(self).update({name: getattr(base, name) for name in COMMON})

    @property
    def source_digest(self) -> str:
        """The digest of the code that decides the bits of its trials."""
        return digest(super().source_digest, self.base.source_digest)

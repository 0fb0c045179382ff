"""A model around another one: what it has in common with it."""

from typing import Any

from tolstat.lanes.digest import digest
from tolstat.model.contract import Model, OtherProcesses

COMMON = (
    "name", "title", "settings", "assumptions", "failures", "row_by_row",
    "needs_nominal",
)  # fmt: skip


class Wrapped(Model):
    """A model that evaluates another one, with its settings."""

    def __init__(self, base: Model) -> None:
        self.base = base
        vars(self).update({name: getattr(base, name) for name in COMMON})

    def tightened(self, settings: Any) -> Any | None:
        """Return settings that integrate more precisely."""
        return self.base.tightened(settings)

    def notes(self) -> tuple[str, ...]:
        """Return what its trials have shown of it."""
        return self.base.notes()

    @property
    def source_digest(self) -> str:
        """The digest of the code that decides the bits of its trials."""
        return digest(super().source_digest, self.base.source_digest)

    @property
    def unwrapped(self) -> Model:
        """The model itself, without the cases and lots of a study."""
        return self.base.unwrapped

    @property
    def isolation(self) -> OtherProcesses | None:
        """The part of it that is evaluated in other processes, if there is one."""
        return self.base.isolation

    @property
    def audits_steps(self) -> bool:
        """Whether an audit shortens its longest step, or takes another method."""
        return self.base.audits_steps

    @property
    def integrates(self) -> bool:
        """Whether tolstat's integrator solves it, with the setting `rtol`."""
        return self.base.integrates

    @property
    def moves(self) -> bool:
        """Whether it has histories."""
        return self.base.moves

    @property
    def animates(self) -> bool:
        """Whether it has a mechanism to animate."""
        return self.base.animates

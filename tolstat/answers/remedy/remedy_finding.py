"""What meets all limits of a run together, as types. SI."""

from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

from tolstat.document.inline import Typed
from tolstat.statistics.estimate import Estimate
from tolstat.study.editor import StudyChange


class Evidence(StrEnum):
    """How well the effect of a change is known."""

    PREDICTED = "predicted"  # by the stored trials
    PROVED = "proved"  # by fresh trials


class EntryChange(NamedTuple):
    """A change of an entry."""

    entry: str
    members: tuple[str, ...]  # contributors
    shift: float  # of the centre; 0 if it stays
    tolerance: str  # the tighter one, of the first member; empty if it stays


class RemedyStep(NamedTuple):
    """Changes that belong together."""

    changes: tuple[EntryChange, ...]
    before: Estimate  # yield of all limits, after the earlier steps
    after: Estimate


class Unavoidable(NamedTuple):
    """What stays out of limit if the free entries do not deviate at all."""

    share: Estimate  # out of any limit
    causes: Mapping[str, float]  # share of the variance, by fixed entry
    # wider ones that all entries as they are meet, proved by fresh trials
    limits: Mapping[str, tuple[float, float]]
    # changes of fixed entries, each of which would meet all limits, were it free
    freed: tuple[EntryChange, ...]
    # how far medians lie above their limits; negative: below them
    medians: Mapping[str, float]


class RemedyFinding(NamedTuple):
    """What meets all limits together; without steps, why nothing does."""

    steps: tuple[RemedyStep, ...] = ()
    evidence: Evidence = Evidence.PREDICTED
    trials: int = 0  # fresh ones that prove it, or wider limits
    met: bool = False  # all limits
    missed: tuple[str, ...] = ()  # limits surely not met
    # fraction out of each limit: before, after
    limits: Mapping[str, tuple[Estimate, Estimate]] = {}
    change: StudyChange = StudyChange()  # of all steps
    entries: Mapping[str, str] = {}  # of [deviations], as what-if takes them
    unavoidable: Unavoidable | None = None
    reason: str = ""  # why no step is known
    note: str = ""  # why a change is not proved
    commands: tuple[Typed, ...] = ()  # that write and run the changed study
    proving: Typed | None = None  # proves a change, where that is quick

    @property
    def changes(self) -> tuple[EntryChange, ...]:
        """The changes of all steps."""
        return tuple(change for step in self.steps for change in step.changes)

    @property
    def in_one(self) -> RemedyStep:
        """All steps as one."""
        return RemedyStep(self.changes, self.steps[0].before, self.steps[-1].after)

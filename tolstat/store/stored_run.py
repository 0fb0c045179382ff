"""A stored run, to be looked at."""

from __future__ import annotations

import html
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.limits.limit import Limit, within
from tolstat.status import Status, status_words
from tolstat.store.audited import Audited
from tolstat.store.damage import Damage
from tolstat.store.layout import DRAWN, STATUS, STEPS
from tolstat.store.plan import Known, Stopped
from tolstat.store.provenance import DECISIVE, provenance
from tolstat.store.stored_diagnostics import Evidence
from tolstat.units.scale import Scale, scale_of

if TYPE_CHECKING:
    import pandas as pd

ROUNDING = 1e-9  # of a value: by less, no machine is another one


@dataclass(frozen=True)
class StudyText:
    """The study that a run was made from.

    Attributes
    ----------
    text : str
        As it was written.
    table : dict
        The same, read as TOML.
    """

    text: str
    table: dict[str, Any]


@dataclass(frozen=True, kw_only=True, repr=False)
class Run(Known):
    """A stored run; what it says of itself besides, see `Known`.

    Attributes
    ----------
    path : Path
        Its file.
    study : StudyText
        What was asked.
    contributors, responses : tuple
        The columns, in order, with units and sentences.
    nominal_values : dict
        Responses (SI), status (a word) and steps of the machine without deviations.
    swept : dict of str to str
        SI unit of each setting that a grid changes.
    stopped : Stopped or None
        What the stopping rule made of it; None without one, or where it was cut short.
    audited : Audited or None
        Trials evaluated again; None where that cannot be, or did not come to it.
    rerun : Audited or None
        Failed trials evaluated again with tighter settings; they still count as failed.
    evidence : Evidence
        Slopes, worst cases and worst trials, or why there are none.
    complete : bool
        Whether it came to its end.
    damage : Damage
        What is not as it was written; false if nothing is.
    """

    path: Path
    study: StudyText
    contributors: tuple[Contributor, ...]
    responses: tuple[Response, ...]
    nominal_values: dict[str, Any]
    swept: dict[str, str]
    stopped: Stopped | None
    audited: Audited | None
    rerun: Audited | None
    evidence: Evidence
    complete: bool
    damage: Damage
    _facts: dict[str, Any]
    _shown: dict[str, str]
    _columns: dict[str, NDArray[Any]]

    @property
    def trials(self) -> int:
        """Number of trials asked for."""
        return len(self.status)

    @property
    def status(self) -> NDArray[np.uint8]:
        """Status of each trial: a key of `words`."""
        return self._columns[STATUS]

    @property
    def provenance(self) -> dict[str, Any]:
        """How it came to be: versions, processor, times, trials of each status."""
        counts = {f"trials_{w.replace(' ', '_')}": n for w, n in self.counts.items()}
        return {**self._facts, **counts}

    @cached_property
    def counts(self) -> dict[str, int]:
        """Number of trials of each status, by its word."""
        counted = np.bincount(self.status, minlength=256)
        return {word: int(counted[code]) for code, word in self.words.items()}

    def ended_as(self, trial: int) -> str:
        """Return the word of how a trial ended."""
        return self.words.get(int(self.status[trial]), "unknown")

    @property
    def ended(self) -> int:
        """Number of trials that have run."""
        return self.trials - self.counts[Status.NOT_RUN.word]

    @property
    def failed(self) -> int:
        """Number of those that failed."""
        return self.ended - self.counts[Status.DONE.word]

    @property
    def failures(self) -> dict[str, int]:
        """Number of failed trials by the word of their failure, where there are any."""
        return {
            word: self.counts[word]
            for code, word in self.words.items()
            if code > Status.DONE and self.counts[word]
        }

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column; "1" where there is none."""
        described: list[Contributor | Response] = [*self.contributors, *self.responses]
        return {**self.swept, **{each.name: each.unit for each in described}}

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """How each column is shown: as typed, as declared, or fitting its size."""
        return {name: self._scale(name, unit) for name, unit in self.units.items()}

    def _scale(self, name: str, unit: str) -> Scale:
        values, shown = self._columns[name], self._shown.get(name, "")
        if values.dtype.kind != "f":
            return scale_of(unit, shown)
        known = np.abs(np.append(values, self.nominal_values.get(name, np.nan)))
        size = float(np.nanmax(known)) if not np.isnan(known).all() else 0.0
        found = scale_of(unit, shown, size)
        # what is nothing beside its numbers, and beside what is asked of them
        asked = self.limits[name].asked if name in self.limits else ()
        found = found.beside(min([size, *map(abs, asked)]))
        return found.telling(self._spread(name), asked)

    def _spread(self, name: str) -> float:
        """Return how far a column reaches, SI: its tolerance zone, or its numbers."""
        if name in self.assumed:
            lower, upper = self.assumed[name].tolerance
            return upper - lower
        values = self._columns[name]
        values = values[np.isfinite(values)]
        if not len(values):
            return 0.0
        spread = float(np.ptp(values))
        return spread if spread > ROUNDING * float(np.abs(values).max()) else 0.0

    def scale_of(self, number: StudyNumber) -> Scale:
        """Return how a number of the study is shown: as what it is an answer about."""
        if number.of in self.scales:
            return self.scales[number.of]
        return scale_of(number.unit, number.shown, abs(number.value))

    def column(self, name: str) -> NDArray[Any]:
        """Return a swept setting, contributor or response of all trials, SI.

        Of a rare run also how they were drawn: "rare-stage", "rare-weight".
        """
        return self._columns[name]

    def beyond(self, response: str) -> NDArray[np.bool_]:
        """Return which trials ended beyond a limit, failed ones among them."""
        ended: NDArray[np.bool_] = self.status != Status.NOT_RUN
        return ended & ~within(self.column(response), self.limits[response].permitted)

    def limited(
        self, limits: dict[str, Limit], shown: dict[str, str], note: str
    ) -> Run:
        """Return the run with these limits, units shown and one more note."""
        written = {**shown, **self._shown}
        return replace(self, limits=limits, notes=(*self.notes, note), _shown=written)

    def made_otherwise(self, source_digest: str) -> list[str]:
        """Say what may change the bits of a trial that is evaluated again here.

        Source (of the machine as it is now), processor, versions; empty where a trial
        comes out bit for bit.
        """
        said, facts, here = [], self._facts, provenance()
        if self.source_digest != source_digest:
            said.append(
                f"the run was made by tolstat {facts['version_tolstat']} of another "
                f"source ({self.source_digest}, not {source_digest})"
            )
        if facts["processor"] != here["processor"]:
            said.append(f"the run was made on another processor ({facts['processor']})")
        for name in DECISIVE:
            was, now = facts[f"version_{name}"], here[f"version_{name}"]
            if was != now:
                said.append(f"the run was made with {name} {was}, and this is {now}")
        return said

    @property
    def steps(self) -> NDArray[np.int64] | None:
        """Integration steps of each trial; None where nothing is integrated."""
        return self._columns.get(STEPS)

    @property
    def nominal(self) -> pd.Series[Any]:
        """The machine without deviations: its responses (SI), status and steps."""
        import pandas as pd

        series = pd.Series(self.nominal_values, name="nominal")
        series.attrs["units"] = self.units
        return series

    def frame(self) -> pd.DataFrame:
        """Return swept settings, contributors, responses, status and steps.

        Returns
        -------
        DataFrame
            Indexed by trial, SI; `attrs["units"]` holds the units, status is a word;
            steps only where something is integrated.
        """
        import pandas as pd

        named = [*self.units, *(name for name in DRAWN if name in self._columns)]
        columns: dict[str, Any] = {name: self._columns[name] for name in named}
        columns[STATUS] = status_words(self.status, self.words)
        if self.steps is not None:
            columns[STEPS] = self.steps
        frame = pd.DataFrame(columns)
        frame.index.name = "trial"
        frame.attrs["units"] = self.units
        return frame

    def __repr__(self) -> str:
        """Say in a line what it is."""
        became = "sought in stages" if self.rare else f"{self.failed} failed"
        return (
            f"<tolstat run {str(self.path)!r}: {self.title!r}, {self.ended} of "
            f"{self.trials} trials of {self.model}, {became}>"
        )

    def _repr_html_(self) -> str:
        """Show the first trials under a line of words, in a notebook."""
        table: str = self.frame().head().to_html()
        return f"<p>{html.escape(repr(self))}</p>\n{table}"

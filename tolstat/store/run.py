"""A stored run, to be looked at."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.limit import Limit, within
from tolstat.status import Status, status_words
from tolstat.store.audited import Audited
from tolstat.store.damage import Damage
from tolstat.store.evidence import Evidence
from tolstat.store.layout import DRAWN, STATUS, STEPS
from tolstat.store.plan import Assumed, Chosen, Reference, Sampled, Stopped
from tolstat.store.provenance import DECISIVE, provenance
from tolstat.units.scale import Scale, scale_of

if TYPE_CHECKING:
    import pandas as pd


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


@dataclass(frozen=True, repr=False)
class Run:
    """A stored run.

    Attributes
    ----------
    path : Path
        Its file.
    study : StudyText
        What was asked.
    title, model, sampling : str
        Of the study.
    machine : str
        FILE.py:NAME of a machine of one's own; empty for an installed one.
    contributors, responses : tuple
        The columns, in order, with units and sentences.
    nominal_values : dict
        Responses (SI), status (a word) and steps of the machine without deviations.
    sampled : Sampled or None
        How the machines were drawn; None where they were chosen.
    settings : dict of str to Chosen
        Of the machine, as they are written.
    swept : dict of str to str
        SI unit of each setting that a grid changes.
    grid : tuple of str
        What a grid sweeps, the slowest first; empty for any other run.
    limits : dict of str to Limit
        By response, SI.
    assumed : dict of str to Assumed
        By contributor that deviates.
    stopped : Stopped or None
        What the stopping rule made of it; None without one, or where it was cut short.
    audited : Audited or None
        Trials evaluated again; None where that cannot be, or did not come to it.
    evidence : Evidence
        Slopes, worst cases and worst trials, or why there are none.
    reference : Reference or None
        Known points to be shown beside a grid.
    notes, assumptions : tuple of str
        What has to be known of the deviations, and of the machine's answers.
    numbers : tuple of StudyNumber
        Numbers of the study, shown beside those of its machines.
    words : dict of int to str
        The word of each status that a trial can have.
    source_digest : str
        Of the source that decided the numbers.
    rerun : Audited or None
        Failed trials evaluated again with tighter settings; they still count as failed.
    rules : tuple of str
        The stopping rule that it follows; empty without one.
    complete : bool
        Whether it came to its end.
    damage : Damage
        What is not as it was written; false if nothing is.
    study_file : Path or None
        Where the study lay that it was made from.
    rare : str
        The response whose limit a rare run is about; empty for any other run.
    """

    path: Path
    study: StudyText
    title: str
    model: str
    machine: str
    sampling: str
    contributors: tuple[Contributor, ...]
    responses: tuple[Response, ...]
    nominal_values: dict[str, Any]
    sampled: Sampled | None
    settings: dict[str, Chosen]
    swept: dict[str, str]
    grid: tuple[str, ...]
    limits: dict[str, Limit]
    assumed: dict[str, Assumed]
    stopped: Stopped | None
    audited: Audited | None
    evidence: Evidence
    reference: Reference | None
    notes: tuple[str, ...]
    assumptions: tuple[str, ...]
    words: dict[int, str]
    source_digest: str
    _facts: dict[str, Any]
    _shown: dict[str, str]
    _columns: dict[str, NDArray[Any]] = field(repr=False)
    numbers: tuple[StudyNumber, ...] = ()
    rerun: Audited | None = None
    rules: tuple[str, ...] = ()
    complete: bool = False
    damage: Damage = field(default_factory=Damage)
    study_file: Path | None = None
    rare: str = ""

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
        ends = self.limits[name].permitted if name in self.limits else ()
        asked = [abs(end) for end in ends if end and math.isfinite(end)]
        return found.beside(min([size, *asked]))

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
        return (
            f"<tolstat run {str(self.path)!r}: {self.title!r}, {self.ended} of "
            f"{self.trials} trials of {self.model}, {self.failed} failed>"
        )

    def _repr_html_(self) -> str:
        """Show the first trials under a line of words, in a notebook."""
        table: str = self.frame().head().to_html()
        return f"<p>{html.escape(repr(self))}</p>\n{table}"

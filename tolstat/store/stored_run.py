"""A stored run."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Truths
from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.model.view import typed_unit
from tolstat.statistics.limits.limit import (
    WORST,
    Limit,
    margins,
    within,
    worst_trials,
)
from tolstat.status import Status, status_words
from tolstat.store import run_records as records
from tolstat.store.checksums import Damage
from tolstat.store.codec import ELSEWHERE, Stored
from tolstat.store.layout import STATUS, STEPS
from tolstat.store.provenance import decisive
from tolstat.units.scale import Scale, scale_of

if TYPE_CHECKING:
    import pandas as pd

NOT_ENDED = records.Diagnostics(missing="the run did not come to its end")
ROUNDING = 1e-9  # of a value: a smaller difference is rounding


@dataclass(frozen=True, kw_only=True, repr=False)
class Run:
    """A stored run.

    Attributes
    ----------
    path : Path
        Its file.
    study : StudyText
        The text of the study.
    study_file : Path or None
        Path of the study; None if it is not a file.
    title, model, sampling : str
        Of the study.
    machine : str
        FILE.py:NAME of a custom model; empty for an installed one.
    source_digest : str
        Digest of the source that decides the numbers.
    document : dict of str to str
        The title block of the study: "project", "drawing", and so on.
    sampled : Sampled or None
        How the trials are sampled; None where the study lists them.
    rules : tuple of str
        The stopping rule, as it is written; empty without one.
    contributors, responses : tuple
        The columns, in order, with units and sentences.
    swept : tuple of Swept
        Settings that a grid changes.
    details : tuple of DrawDetail
        Columns of the sampler about each trial.
    settings : dict of str to Chosen
        All settings of the model, as they are written.
    limits : dict of str to Limit
        By response, SI.
    assumed : dict of str to Assumed
        By contributor that deviates.
    correlation : dict of str to dict of str to float
        Rank correlations, as the study writes them.
    independent : bool
        Whether all deviations are independent: no correlation, nothing in common.
    words : dict of int to str
        The word of each status that a trial can have.
    grid : tuple of str
        What a grid sweeps, the slowest first; empty for any other run.
    reference : Reference or None
        Known points to be shown beside a grid.
    numbers : tuple of StudyNumber
        Numbers of the study, shown beside those of its trials.
    notes, assumptions : tuple of str
        Notes on the run and its deviations; assumptions of the model.
    warnings : tuple of str
        What readers have to know before its verdicts, from its study.
    made : dict of str to str
        Versions, processor, platform, command, and when it was started.
    replaces : str
        What identifies the run that it replaced; empty if there was none.
    stopped : Stopped or None
        How the stopping rule ended it; None without one, or if interrupted.
    audited : Audited or None
        Trials evaluated again; None if not possible, or not reached.
    rerun : Audited or None
        Failed trials evaluated again with tighter settings; they still count as failed.
    diagnostics : Diagnostics
        Slopes, worst cases and halved tolerances, or why there are none.
    complete : bool
        Whether all its trials and diagnostics are there.
    nominal_values : dict
        Responses (SI), status (a word) and steps of the nominal trial.
    times : dict
        "ended_at", "seconds".
    damage : Damage
        Damaged parts of the file; false if there are none.
    columns : dict of str to array
        Of all trials: see `column`.
    """

    path: Annotated[Path, ELSEWHERE]
    study: records.StudyText
    study_file: Annotated[Path | None, ELSEWHERE]
    title: str
    model: str
    sampling: str
    machine: str
    source_digest: str
    document: Annotated[dict[str, str], Stored("title-block")]
    sampled: records.Sampled | None
    rules: tuple[str, ...]
    contributors: Annotated[tuple[Contributor, ...], Stored(columns="")]
    responses: Annotated[tuple[Response, ...], Stored(columns="")]
    swept: Annotated[tuple[records.Swept, ...], Stored(columns="")]
    details: Annotated[tuple[records.DrawDetail, ...], Stored(columns="")]
    settings: dict[str, records.Chosen]
    limits: Annotated[dict[str, Limit], Stored(columns="limit_")]
    assumed: Annotated[dict[str, records.Assumed], Stored(columns="assumed_")]
    correlation: Annotated[dict[str, dict[str, float]], Stored("rank-correlation")]
    independent: bool
    words: Annotated[dict[int, str], Stored("status-words")]
    grid: tuple[str, ...]
    reference: records.Reference | None
    numbers: tuple[StudyNumber, ...]
    notes: tuple[str, ...]
    assumptions: tuple[str, ...]
    made: Annotated[dict[str, str], Stored("provenance")]
    warnings: tuple[str, ...] = ()
    replaces: str = ""
    stopped: records.Stopped | None = None
    audited: Annotated[records.Audited | None, Stored("audit")] = None
    rerun: records.Audited | None = None
    diagnostics: records.Diagnostics = NOT_ENDED
    complete: bool = False
    nominal_values: Annotated[dict[str, Any], ELSEWHERE] = field(default_factory=dict)
    times: Annotated[dict[str, Any], ELSEWHERE] = field(default_factory=dict)
    damage: Annotated[Damage, ELSEWHERE] = field(default_factory=Damage)
    columns: Annotated[Mapping[str, NDArray[Any]], ELSEWHERE]

    @property
    def aim(self) -> str:
        """The response whose limit is searched; empty without a search."""
        return self.sampled.aim if self.sampled else ""

    @property
    def trials(self) -> int:
        """Number of trials requested."""
        return len(self.status)

    @property
    def status(self) -> NDArray[np.uint8]:
        """Status of each trial: a key of `words`."""
        return self.columns[STATUS]

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance: versions, processor, times, trials of each status."""
        counts = {f"trials_{w.replace(' ', '_')}": n for w, n in self.counts.items()}
        return {**self.made, **self.times, **counts}

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
        return {each.name: each.unit for each in self.described}

    @property
    def described(self) -> list[records.Swept | Contributor | Response]:
        """Swept settings, contributors and responses."""
        return [*self.swept, *self.contributors, *self.responses]

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """How each column is shown: as typed, as declared, or fitting its size."""
        return {e.name: self._scale(e.name, e.unit, e.shown) for e in self.described}

    def _scale(self, name: str, unit: str, shown: str) -> Scale:
        values = self.columns[name]
        if values.dtype.kind != "f":
            return scale_of(unit, shown)
        known = np.abs(np.append(values, self.nominal_values.get(name, np.nan)))
        size = float(np.nanmax(known)) if not np.isnan(known).all() else 0.0
        found = scale_of(unit, shown, size)
        # what is zero beside its numbers, and beside the ends of its limit
        asked = self.limits[name].asked if name in self.limits else ()
        found = found.beside(min([size, *map(abs, asked)]))
        return found.telling(self._spread(name), asked)

    def _spread(self, name: str) -> float:
        """Return the width of a column, SI: of its tolerance, or of its numbers."""
        if name in self.assumed:
            lower, upper = self.assumed[name].tolerance
            return upper - lower
        values = self.columns[name]
        values = values[np.isfinite(values)]
        if not len(values):
            return 0.0
        spread = float(np.ptp(values))
        return spread if spread > ROUNDING * float(np.abs(values).max()) else 0.0

    def scale_of(self, number: StudyNumber) -> Scale:
        """Return how a number of the study is shown: as the response it describes."""
        if number.of in self.scales:
            return self.scales[number.of]
        found = scale_of(number.unit, number.shown, abs(number.value))
        return found.beside(1.0) if found.shown == "%" else found

    def column(self, name: str) -> NDArray[Any]:
        """Return a swept setting, contributor or response of all trials, SI.

        Also the columns of the sampler: `details`.
        """
        return self.columns[name]

    @property
    def known(self) -> list[str]:
        """The columns that are known before a trial runs."""
        described: list[records.Swept | Contributor | records.DrawDetail]
        described = [*self.swept, *self.contributors, *self.details]
        return [each.name for each in described]

    def beyond(self, response: str) -> Truths:
        """Return which trials are out of a response's limit, failed ones among them."""
        ended: Truths = self.status != Status.NOT_RUN
        return ended & ~within(self.column(response), self.limits[response].permitted)

    def worst_trials(self, response: str, count: int = WORST) -> dict[int, float]:
        """Return the worst trials of a limited response, the worst first.

        Parameters
        ----------
        response : str
            Its name.
        count : int
            How many.

        Returns
        -------
        dict of int to float
            By trial the response, SI: as it was evaluated more precisely, where it was.
        """
        values, limit = self.columns[response], self.limits[response]
        precise = np.full(len(values), np.nan)
        if self.audited:
            precise[self.audited.trials] = self.audited.responses[response]
        worst = worst_trials(values, self.status, limit, count)
        known = np.where(np.isnan(precise), values, precise)[worst]
        order = np.argsort(margins(known, limit.permitted), kind="stable")
        return dict(zip(worst[order].tolist(), known[order].tolist(), strict=True))

    def worst_cases(self, response: str) -> dict[str, records.WorstCase]:
        """Return the worst cases of a limited response, by side.

        A search among corners cannot see a worst case inside the tolerances: where the
        model knows a worse one (`StudyNumber.worst`), it counts. A model takes all
        parts for free: not where some are alike.
        """
        cases = dict(self.diagnostics.worst_cases.get(response, {}))
        alike = any(each.batch for each in self.assumed.values())
        for number in self.numbers if not alike else ():
            case = cases.get(number.worst)
            if number.of != response or case is None or math.isnan(case.value):
                continue
            sign = 1 if number.worst == "largest" else -1
            size = max(abs(number.value), abs(case.value))
            if sign * (number.value - case.value) > ROUNDING * size:
                cases[number.worst] = records.WorstCase(
                    number.value, {}, 0, case.failed
                )
        return cases

    def first(self, trials: int) -> Run:
        """Return the run of its first trials alone."""
        columns = {name: values[:trials] for name, values in self.columns.items()}
        return replace(self, columns=columns)

    def limited(
        self, limits: dict[str, Limit], shown: dict[str, str], note: str
    ) -> Run:
        """Return the run with these limits, units shown and one more note."""
        responses = tuple(
            replace(each, shown=typed_unit(each, shown)) for each in self.responses
        )
        notes = (*self.notes, note)
        return replace(self, limits=limits, responses=responses, notes=notes)

    def made_otherwise(self, source_digest: str) -> list[str]:
        """Return reasons why a trial evaluated here may differ in its bits.

        They are source (of the model as it is now), processor, compiler and versions;
        empty if there are none. An older run does not know its machine code.
        """
        said, facts = [], self.made
        if self.source_digest != source_digest:
            said.append(
                f"the run was made by tolstat {facts['version_tolstat']} of another "
                f"source ({self.source_digest}, not {source_digest})"
            )
        for what, now in decisive().items():
            was = facts.get(f"version_{what}", facts.get(what.replace(" ", "_"), now))
            if was != now:
                said.append(f"the run was made with {what} {was}, and this is {now}")
        return said

    @property
    def steps(self) -> NDArray[np.int64] | None:
        """Integration steps of each trial; None where nothing is integrated."""
        return self.columns.get(STEPS)

    @property
    def nominal(self) -> pd.Series[Any]:
        """The nominal trial: its responses (SI), status and steps."""
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

        named = [*self.units, *(each.name for each in self.details)]
        columns: dict[str, Any] = {name: self.columns[name] for name in named}
        columns[STATUS] = status_words(self.status, self.words)
        if self.steps is not None:
            columns[STEPS] = self.steps
        frame = pd.DataFrame(columns)
        frame.index.name = "trial"
        frame.attrs["units"] = self.units
        return frame

    def __repr__(self) -> str:
        """Return a summary in one line."""
        became = "sought in stages" if self.aim else f"{self.failed} failed"
        return (
            f"<tolstat run {str(self.path)!r}: {self.title!r}, {self.ended} of "
            f"{self.trials} trials of {self.model}, {became}>"
        )

    def _repr_html_(self) -> str:
        """Show the first trials under a line of words, in a notebook."""
        table: str = self.frame().head().to_html()
        return f"<p>{html.escape(repr(self))}</p>\n{table}"

"""A stored run."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Integers, Truths
from tolstat.errors import RunFileError, UnitError, allowed_names
from tolstat.model.contract import TrialResults
from tolstat.model.description import StudyNumber
from tolstat.model.view import typed_unit
from tolstat.regular_files import content, decoded
from tolstat.statistics.intervals.weights import COLUMNS, Thinned
from tolstat.statistics.limits.limit import WORST, Limit, margins, within, worst_trials
from tolstat.statistics.sample_size import DECIDE
from tolstat.status import Status, status_words
from tolstat.store import run_records as records
from tolstat.store.integrity import Damage
from tolstat.store.run_records import STATUS, STEPS, Plan
from tolstat.store.stored_fields import ELSEWHERE, Stored
from tolstat.units.conversion import to_si
from tolstat.units.scale import Scale, scale_of

if TYPE_CHECKING:
    import pandas as pd

MEGABYTES = 1  # of a study
SI, SHOWN = "SI", "shown"  # units of a table
IN_MEMORY = Path("run in memory")  # stands where a run has no file
NO_FILE = 'a run in memory has no file; write one: tolstat.save(run, "run.h5")'
NOT_ENDED = records.Diagnostics(missing="the run did not come to its end")
ROUNDING = 1e-9  # of a value: a smaller difference is rounding


@dataclass(frozen=True, kw_only=True, repr=False)
class Run(Plan):
    """A run: its plan, the rows of its trials, and what followed them.

    Attributes
    ----------
    path : Path
        Its file; of a run in memory `IN_MEMORY`, which is no file.
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
    nominal_results : TrialResults
        What the nominal trial answered, as a model does: see `nominal_values`.
    times : dict
        "ended_at", "seconds".
    damage : Damage
        Damaged parts of the file; false if there are none.
    columns : dict of str to array
        Of all trials: see `column`.
    """

    path: Annotated[Path, ELSEWHERE]
    replaces: str = ""
    stopped: records.Stopped | None = None
    audited: Annotated[records.Audited | None, Stored("audit")] = None
    rerun: records.Audited | None = None
    diagnostics: records.Diagnostics = NOT_ENDED
    complete: bool = False
    nominal_results: Annotated[TrialResults, ELSEWHERE]
    times: Annotated[dict[str, Any], ELSEWHERE] = field(default_factory=dict)
    damage: Annotated[Damage, ELSEWHERE] = field(default_factory=Damage)
    columns: Annotated[Mapping[str, NDArray[Any]], ELSEWHERE]

    @classmethod
    def begun(cls, plan: Plan, path: Path, columns: Mapping[str, NDArray[Any]]) -> Run:
        """Return the run of a plan before any of its trials has run."""
        nominal = TrialResults(
            np.full((1, len(plan.responses)), np.nan),
            np.full(1, int(Status.NOT_RUN)),
            np.zeros(1, np.int64) if STEPS in columns else None,
        )
        asked = {field.name: getattr(plan, field.name) for field in fields(Plan)}
        return cls(path=path, columns=columns, nominal_results=nominal, **asked)

    @property
    def plan(self) -> Plan:
        """What the run was asked to do; its attributes are also those of the run."""
        return Plan(**{field.name: getattr(self, field.name) for field in fields(Plan)})

    def __fspath__(self) -> str:
        """Return its path, so that a run stands where a path is expected."""
        if self.path == IN_MEMORY:
            raise RunFileError(NO_FILE)
        return str(self.path)

    @cached_property
    def data_folder(self) -> Path | None:
        """Where the data files of its study are; None for a study without a file.

        A run file may name any study, so that is no permission: a folder that is not
        the run's counts only if a study with the stored text lies there.
        """
        study = self.study_file
        if self.path == IN_MEMORY:
            return study.parent if study else None
        folder = self.path.resolve().parent
        with suppress(OSError, ValueError):  # ValueError: no UTF-8
            text = study and decoded(content(study, MEGABYTES), "utf-8-sig")
            if study and text == self.study.text:
                folder = study.parent
        return folder

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

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """How each column is shown: as typed, as declared, or fitting its size."""
        return {c.name: self._scale(c.name, c.unit, c.shown) for c in self.described}

    def _scale(self, name: str, unit: str, shown_unit: str) -> Scale:
        values = self.columns[name]
        if values.dtype.kind != "f":
            return scale_of(unit, shown_unit)
        sizes = np.abs(np.append(values, self.nominal_values.get(name, np.nan)))
        size = float(np.nanmax(sizes)) if not np.isnan(sizes).all() else 0.0
        # what is zero beside its numbers, and beside the ends of its limit
        ends = self.limits[name].asked if name in self.limits else ()
        scale = scale_of(unit, shown_unit, size).beside(min([size, *map(abs, ends)]))
        return scale.telling(self._spread(name), ends)

    def _spread(self, name: str) -> float:
        """Return the width of a column, SI: of its tolerance, or of its numbers."""
        if name in self.assumed:
            lower, upper = self.assumed[name].tolerance
            return upper - lower
        values = self.columns[name]
        values = values[np.isfinite(values)]
        spread = float(np.ptp(values)) if len(values) else 0.0
        rounding = ROUNDING * float(np.abs(values).max(initial=0.0))
        return spread if spread > rounding else 0.0

    def scale_of(self, number: StudyNumber) -> Scale:
        """Return how a number of the study is shown: as the response it describes."""
        if number.of in self.scales:
            return self.scales[number.of]
        scale = scale_of(number.unit, number.shown, abs(number.value))
        return scale.beside(1.0) if scale.shown == "%" else scale

    def column(self, name: str) -> NDArray[Any]:
        """Return a swept setting, contributor or response of all trials, SI.

        Also the columns of the sampler: `details`.
        """
        return self.columns[name]

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
        if audited := self.audit_of(response):
            precise[audited.trials] = audited.responses[response]
        trials = worst_trials(values, self.status, limit, count)
        values = np.where(np.isnan(precise), values, precise)[trials]
        order = np.argsort(margins(values, limit.permitted), kind="stable")
        return dict(zip(trials[order].tolist(), values[order].tolist(), strict=True))

    def worst_cases(self, response: str) -> dict[str, records.WorstCase]:
        """Return the worst cases of a limited response, by side.

        A search among corners cannot see a worst case inside the tolerances: where the
        model knows a worse one (`StudyNumber.worst`), it counts. A model takes all
        parts for free: not where some are alike.
        """
        cases = dict(self.diagnostics.worst_cases.get(response, {}))
        alike = any(assumed.common == 1 for assumed in self.assumed.values())
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

    def audit_of(self, response: str) -> records.Audited | None:
        """Return the audit of a response; None without one, and of a residual.

        A residual is itself the error of an integration, so it has none.
        """
        (described,) = (x for x in self.responses if x.name == response)
        return None if described.residual else self.audited

    @property
    def deciding(self) -> bool:
        """Whether it is to go on until every limit is decided."""
        return not self.complete and any(rule.startswith(DECIDE) for rule in self.rules)

    @property
    def progress(self) -> str:
        """How many trials have run, and of how many if that is known."""
        return f"{self.ended}" if self.deciding else f"{self.ended} of {self.trials}"

    def first(self, trials: int) -> Run:
        """Return the run of its first trials alone."""
        columns = {name: values[:trials] for name, values in self.columns.items()}
        return replace(self, columns=columns)

    def limited(
        self, limits: dict[str, Limit], shown_units: dict[str, str], note: str
    ) -> Run:
        """Return the run with these limits, units shown and one more note.

        Trials that `decide` left out, as far from its limits, may be near others: then
        the stages that left out none remain.
        """
        new = any(
            name not in self.limits or limit.permitted != self.limits[name].permitted
            for name, limit in limits.items()
        )
        if new and self.thinned and self.thinned.skips:
            covering = self.first(self.thinned.covering)
            return covering.limited(limits, shown_units, note)
        responses = tuple(
            replace(response, shown=typed_unit(response, shown_units))
            for response in self.responses
        )
        notes = (*self.notes, note)
        return replace(self, limits=limits, responses=responses, notes=notes)

    @property
    def thinned(self) -> Thinned | None:
        """How its trials were thinned; None if they were not, or none has run."""
        if not ({detail.name for detail in self.details} >= COLUMNS.keys()):
            return None
        return Thinned(*(self.columns[name] for name in COLUMNS))

    @property
    def random_trials(self) -> int:
        """Number of its first trials, which are not thinned: all of most runs."""
        plain = self.thinned.plain if self.thinned else self.trials
        return min(plain, self.trials)

    @property
    def steps(self) -> NDArray[np.int64] | None:
        """Integration steps of each trial; None where nothing is integrated."""
        return self.columns.get(STEPS)

    def results(self, trials: Integers | slice = slice(None)) -> TrialResults:
        """Return the results of some trials, as a model has them."""
        names = [response.name for response in self.responses]
        responses = np.stack([self.columns[name][trials] for name in names], axis=1)
        steps = None if self.steps is None else self.steps[trials]
        return TrialResults(responses, self.status[trials].astype(np.int64), steps)

    def columns_of(self, outcome: TrialResults) -> dict[str, NDArray[Any]]:
        """Return the columns that trials with these answers fill."""
        names = [response.name for response in self.responses]
        columns = dict[str, NDArray[Any]](zip(names, outcome.responses.T, strict=True))
        columns[STATUS] = outcome.status.astype(np.uint8)
        return columns if outcome.steps is None else columns | {STEPS: outcome.steps}

    @cached_property
    def nominal_values(self) -> dict[str, Any]:
        """Responses (SI), status (a word) and steps of the nominal trial."""
        (responses,), (status,), steps, _ = self.nominal_results
        names = [response.name for response in self.responses]
        values: dict[str, Any] = dict(zip(names, responses.tolist(), strict=True))
        values[STATUS] = self.words.get(int(status), "unknown")
        return values if steps is None else values | {STEPS: int(steps[0])}

    @property
    def nominal(self) -> pd.Series[Any]:
        """The nominal trial: its responses (SI), status and steps."""
        import pandas as pd

        series = pd.Series(self.nominal_values, name="nominal")
        series.attrs["units"] = {**self.units}
        return series

    def frame(self, units: str | Mapping[str, str] = SI) -> pd.DataFrame:
        """Return swept settings, contributors, responses, status and steps.

        Parameters
        ----------
        units : str or mapping
            "SI": contributors are deviations. "shown": in the units of pages, and
            contributors that have a nominal value are sizes. A mapping of names to
            units, `{"play": "um"}`, is "shown" with these.

        Returns
        -------
        DataFrame
            Indexed by trial; `attrs["units"]` holds the units, status is a word; steps
            only where something is integrated.

        Raises
        ------
        UnitError
            If there is no such column or unit, or it is of another kind.

        Examples
        --------
        >>> run = tolstat.open("runs/stack-up.h5")
        >>> run.frame({"gap": "um"})[["housing", "gap"]].mean().round(2).tolist()
        [120.3, 440.56]
        """
        import pandas as pd

        names = [*self.units, *(detail.name for detail in self.details)]
        columns: dict[str, Any] = {name: self.columns[name] for name in names}
        columns[STATUS] = status_words(self.status, self.words)
        if self.steps is not None:
            columns[STEPS] = self.steps
        frame = pd.DataFrame(columns)
        frame.index.name = "trial"
        frame.attrs["units"] = {**self.units}
        return frame if units == SI else self._in_units(frame, units)

    def _in_units(
        self, frame: pd.DataFrame, units: str | Mapping[str, str]
    ) -> pd.DataFrame:
        """Return a table of trials in the units shown, or in others, with sizes."""
        chosen = {} if isinstance(units, str) else units
        if isinstance(units, str) and units != SHOWN:
            raise UnitError(f"units = {units!r}; {allowed_names(units, [SI, SHOWN])}")
        shown = {column.name: self.scales[column.name] for column in self.described}
        for name, unit in chosen.items():
            if name not in shown:
                raise UnitError(f"no column {name}; {allowed_names(name, shown)}")
            to_si(1.0, unit, shown[name].unit)  # of the same kind
            shown[name] = shown[name]._replace(shown=unit)
        sizes = {part.name: part.size or 0.0 for part in self.contributors}
        for name, scale in shown.items():
            if frame[name].dtype.kind == "f":
                frame[name] = scale.factor * (frame[name] + sizes.get(name, 0.0))
        others = {name: scale.shown for name, scale in shown.items()}
        frame.attrs["units"] = {**self.units, **others}
        return frame

    def __repr__(self) -> str:
        """Return a summary in one line."""
        became = "sought in stages" if self.aim else f"{self.failed} failed"
        return (
            f"<tolstat run {str(self.path)!r}: {self.title!r}, {self.progress} "
            f"trials of {self.model}, {became}>"
        )

    def _repr_html_(self) -> str:
        """Show the first trials under a line of words, in a notebook."""
        table: str = self.frame().head().to_html()
        return f"<p>{html.escape(repr(self))}</p>\n{table}"

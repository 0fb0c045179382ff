"""What is known of a run before its first trial."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.limits.limit import Limit
from tolstat.store import run_records as records
from tolstat.store.codec import ELSEWHERE, Stored

STATUS, STEPS = "status", "steps"  # columns that trials fill, beside the responses


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run is asked to do: its columns, limits, sampling, settings and source.

    Attributes
    ----------
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
    """

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

    @property
    def aim(self) -> str:
        """The response whose limit is searched; empty without a search."""
        return self.sampled.aim if self.sampled else ""

    @property
    def described(self) -> Sequence[records.Swept | Contributor | Response]:
        """Swept settings, contributors and responses."""
        return [*self.swept, *self.contributors, *self.responses]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column; "1" where there is none."""
        return {column.name: column.unit for column in self.described}

    @property
    def input_names(self) -> list[str]:
        """Names of the columns that are sampled before a trial runs."""
        columns = (self.swept, self.contributors, self.details)
        return [column.name for group in columns for column in group]

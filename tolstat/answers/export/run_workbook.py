"""A run as a workbook: its trials, limits, responses, contributors, provenance."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tolstat.answers.reports import summary
from tolstat.answers.run_answer import AboutRun
from tolstat.document.inline import Number, Row
from tolstat.errors import RunFileError
from tolstat.render.workbook import MOST_ROWS, Sheet, sheet_of_rows, workbook_of
from tolstat.store.stored_run import Run
from tolstat.units.scale import PER_CENT

if TYPE_CHECKING:
    import pandas as pd


def run_workbook(run: Run, path: Path, trials: pd.DataFrame) -> bytes:
    """Return the workbook of a run with its trials as a table.

    Raises
    ------
    RunFileError
        If a sheet has not enough rows, or XlsxWriter is not installed.
    """
    if len(trials) > MOST_ROWS:
        raise RunFileError(
            f"{path}: a sheet has {MOST_ROWS} rows and the run {len(trials)} trials; "
            "name a file that ends in .parquet"
        )
    answer = summary(run)
    sheets = (
        Sheet("trials", ["trial", *trials.columns], trials.itertuples(name=None)),
        sheet_of_rows("limits", [*_limits(run, answer)]),
        sheet_of_rows("responses", answer.rows()),
        sheet_of_rows("contributors", [*_contributors(run)]),
        Sheet("provenance", ["name", "value"], [*_provenance(answer)]),
    )
    return workbook_of(sheets, str(run.provenance["started_at"]))


def _limits(run: Run, answer: AboutRun) -> Iterator[Row]:
    """Yield what each limit permits, and its verdict; more is among the responses."""
    verdicts = {row["response"]: row.get("verdict", "") for row in answer.rows()}
    for name, limit in run.limits.items():
        scale = run.scales[name]
        lower, upper = limit.permitted
        yield {
            "response": name,
            "limit": limit.words,
            "unit": scale.shown,
            "lower [unit]": Number(lower, scale),
            "upper [unit]": Number(upper, scale),
            "demanded [%]": Number(limit.demanded, PER_CENT),
            "verdict": verdicts[name],
            "out of limit": int(run.beyond(name).sum()),
            "trials": run.ended,
        }


def _contributors(run: Run) -> Iterator[Row]:
    for contributor in run.contributors:
        if (part := run.assumed.get(contributor.name)) is None:
            continue
        scale = run.scales[contributor.name]
        lower, upper = part.tolerance
        yield {
            "contributor": contributor.name,
            "description": contributor.sentence,
            "distribution": part.words,
            "unit": scale.shown,
            "lower [unit]": Number(lower, scale),
            "upper [unit]": Number(upper, scale),
            "mean [unit]": Number(part.mean, scale),
            "sigma [unit]": Number(part.sigma, scale),
            "measured parts": part.parts,
        }


def _provenance(answer: AboutRun) -> Iterator[tuple[str, str]]:
    yield "title", answer.title
    yield "model", answer.model
    for name, value in answer.provenance.items():
        lines = str(value).splitlines() if name == "study" else [str(value)]
        yield from ((name.replace("_", " "), line) for line in lines)

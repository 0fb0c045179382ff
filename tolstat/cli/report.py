"""Answers of stored runs: report, comparison, trials as a table."""

import gc
from pathlib import Path

import click

from tolstat.answers import reports
from tolstat.answers.compare.compare_runs import compare as comparison
from tolstat.answers.export.trials_table import export as write_trials
from tolstat.answers.relimit import limited
from tolstat.cli import options
from tolstat.cli.what_if import fresh_run_advice, limits_in
from tolstat.document.blocks import PICTURES
from tolstat.errors import QuestionError, UnitError
from tolstat.execution.compatibility import edits_since
from tolstat.render.screen import Screen
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import SHOWN, SI
from tolstat.study.editor import StudyChange
from tolstat.units.grammar import quantity


@click.command()
@options.run_file
@options.delivered("The page to write; default: the run's name ending in .html.")
@options.closely
@options.repeated(
    'A quantile, such as "2.5 %". May be repeated.',
    "PERCENT", "--quantile", "quantiles",
)  # fmt: skip
@options.limits
def report(
    source: Path,
    delivery: options.Delivery,
    responses: tuple[str, ...],
    quantiles: tuple[str, ...],
    limits: tuple[str, ...],
) -> None:
    """Write the statistical tolerance report of a run: one page of HTML.

    With --json or --csv it writes the numbers alone, to the screen or to a file (-o).
    """
    gc.disable()  # the process ends with the page: nothing needs collecting
    delivery.check()
    run = open_run(source)
    for edit in edits_since(run):
        Screen(stderr=True).say(f"warning: {edit}")
    if limits:
        try:
            run = limited(run, limits_in(limits))
        except QuestionError as error:
            advice = fresh_run_advice(source, StudyChange(limits=limits_in(limits)))
            raise QuestionError(f"{error}{advice}", *error.advice) from None
    answer = reports.report(run, responses, [_share(text) for text in quantiles])
    if delivery.form:
        delivery.deliver(answer)
    else:
        page = delivery.output or run.path.with_suffix(".html")
        path = answer.save(page, delivery.figure)
        options.say(f"{'figure' if path.suffix in PICTURES else 'report'} in {path}")


def _share(text: str) -> float:
    """Return a quantile's share of trials."""
    try:
        return quantity(text, "1")
    except UnitError as error:
        raise QuestionError(f"--quantile '{text}' {error}") from None


@click.command()
@options.path_argument("runs", "A.h5 B.h5...", nargs=-1, required=True)
@options.delivered()
@options.closely
def compare(
    runs: tuple[Path, ...], delivery: options.Delivery, responses: tuple[str, ...]
) -> None:
    """Compare each run with the first: B less A.

    It compares trial by trial if seed and sampling are the same. A Latin hypercube also
    needs the same number of trials.
    """
    delivery.check()
    delivery.deliver(comparison(*runs, responses=responses))


@click.command()
@options.run_file
@options.output_option(
    "The table to write.", metavar="FILE.csv|.parquet|.xlsx", required=True
)
@click.option(
    "--units",
    type=click.Choice([SI, SHOWN]),
    help="SI, or units and sizes as on pages; default: as on pages in XLSX, else SI.",
)
@options.force("Replace an existing file.")
def export(source: Path, output: Path, units: str | None, force: bool) -> None:
    """Write the trials of a run as a table.

    It has a row for each trial, and units in its heads. A workbook (XLSX) also has the
    limits, responses, contributors and the provenance.
    """
    run = open_run(source)
    write_trials(run, output, units=units or "", force=force)
    options.say(f"{run.trials} trials in {output}")
    if run.thinned:
        options.say(
            f"note: after the first {run.random_trials} these are not equally likely; "
            "each stands for one over its thinned-chance"
        )

"""Runs and models on the screen: summaries, lists, progress of a run."""

import json
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import click
from rich.live import Live

from tolstat import catalogue
from tolstat.answers.answer import ENDINGS
from tolstat.answers.index_memory import memory_of, page_with_memory, with_memory
from tolstat.answers.model_sheet import model_document, models_document
from tolstat.answers.next_steps import to_resume
from tolstat.answers.output_file import check_ending, replace
from tolstat.answers.reports import summary
from tolstat.answers.run_entries import RunIndex, entry_of, stored_runs, with_reports
from tolstat.answers.runs_document import progress_table
from tolstat.answers.sweep.curves import save_sweeps
from tolstat.answers.sweep.extremes_document import comparisons
from tolstat.cli.entry import INTERRUPTED, stop_on_interrupt
from tolstat.cli.options import output_option, path_argument, plot_option, repeated, say
from tolstat.document.blocks import Document
from tolstat.render.screen import Screen, as_rich
from tolstat.render.screen import show as print_document
from tolstat.store.files_beside import writer_of
from tolstat.store.open_run import open as open_run
from tolstat.study.editor_schema import editor_schema

LOOK_AGAIN = 1.0  # s, between two reads
SHARE = 5.0  # times the duration of a read, at least


@click.command()
@click.argument("sources", metavar="RUN.h5...|MODEL", nargs=-1, required=True)
@plot_option("Draw grid runs as curves: a .png, .svg or .pdf file.")
@repeated(
    "A response to draw; default: all with a limit. May be repeated.",
    None, "--response", "responses",
)  # fmt: skip
@click.option("--follow", is_flag=True, help="Follow a run while it is being written.")
def show(
    sources: tuple[str, ...],
    plot: Path | None,
    responses: tuple[str, ...],
    follow: bool,
) -> None:
    """Show the summary of stored runs, or what a model has."""
    if responses and not plot:
        raise click.UsageError("--response needs --plot")
    if follow and (plot or len(sources) > 1):
        raise click.UsageError("--follow takes one run and no --plot")
    if follow:
        follow_run(Path(sources[0]))
    if plot:
        runs = [open_run(Path(source)) for source in sources]
        save_sweeps(runs, plot, responses)
        for run in runs:
            print_document(Document("", tuple(comparisons(run))))
        say(f"picture in {plot}")
        return
    for source in sources:
        if source.endswith((".h5", ".toml")) or Path(source).is_file():
            print_document(summary(Path(source)).document())
        else:
            print_document(model_document(source))


@click.command()
@path_argument("folder", default=".")
@output_option("Write one page of all runs instead: .html, .csv, .json or .xlsx.")
def runs(folder: Path, output: Path | None) -> None:
    """List the runs stored in FOLDER and its subfolders.

    The page has verdicts, fractions out of limit, histograms, and what changed since
    the run before of the same drawing. Exit code 1 if a file is damaged, has another
    format, or is not a run.
    """
    if output:
        check_ending(output, "an answer", ENDINGS)
        index = with_reports(stored_runs(folder), output.parent)
        if output.suffix.lower() == ".html":
            memory = memory_of(output)
            index = with_memory(index, memory)
            replace(output, page_with_memory(index, memory).encode())
        else:
            index.dated.save(output)
        say(f"{len(index.entries)} runs in {output}")
    else:
        index = stored_runs(folder)
        print_document(index.document())
    if any(entry.problem for entry in index.entries):
        sys.exit(1)


@click.command()
@click.option("--schema", is_flag=True, help="Print a JSON Schema of studies instead.")
def models(schema: bool) -> None:
    """List the models: built-in, installed, and of --machine."""
    if schema:
        schemas = editor_schema(map(catalogue.find, catalogue.names()))
        click.echo(json.dumps(schemas, indent=1))
    else:
        print_document(models_document())


def follow_run(path: Path) -> None:
    """Show the progress of a run, until it is complete or no process writes it."""
    console, printed = Screen(stderr=True), ""
    live = Live(console=console, transient=True) if console.is_terminal else None
    with stop_on_interrupt() as stop, live or nullcontext():
        while True:
            began = time.monotonic()
            writer = writer_of(path)  # first: else its last trials might be missed
            run = open_run(path)
            failed = "" if run.aim else f", {run.failed} failed"
            status = f"{path}: {run.progress} trials{failed}"
            if live:
                index = RunIndex("", path.parent, (entry_of(run),))
                live.update(as_rich(progress_table(index), console.width))
            elif status != printed:
                console.say(printed := status)
            if run.complete or not writer:
                break
            if stop.wait(max(LOOK_AGAIN, SHARE * (time.monotonic() - began))):
                sys.exit(INTERRUPTED)
    if not run.complete:
        console.say(
            f"no process writes {path}: {run.progress} trials have run; "
            "continue it with:"
        )
        console.type(to_resume(path, run.machine).text)

"""Runs and models printed on the screen."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from tolstat import catalogue
from tolstat.machines import settings as model_settings
from tolstat.report.summary_table import summary_table
from tolstat.store.run import Run
from tolstat.store.run import open as open_run

# wide enough for every column where the output is no terminal
PIPED_WIDTH = 160


def screen() -> Console:
    """Return the standard output."""
    console = Console(highlight=False)
    return (
        console if console.is_terminal else Console(width=PIPED_WIDTH, highlight=False)
    )


def print_summary(run: Run) -> None:
    """Print the summary table of a run.

    Parameters
    ----------
    run : Run
        Complete or not.
    """
    summary = summary_table(run)
    table = Table(*summary.heads, title=summary.title, box=box.SIMPLE_HEAD)
    for column in table.columns[2:]:
        column.justify = "right"
        column.no_wrap = True
    for row in summary.rows:
        table.add_row(*row)
    console = screen()
    console.print(table)
    for note in summary.notes:
        console.print(note)


def show_run(path: Path) -> None:
    """Print what a stored run is and its summary."""
    print_summary(open_run(path))


def list_models() -> None:
    """Print the names and titles of all models."""
    table = Table("model", "title", box=box.SIMPLE_HEAD)
    for name in catalogue.names():
        table.add_row(name, catalogue.find(name).title)
    screen().print(table)


def show_model(name: str) -> None:
    """Print settings, contributors and responses of a model.

    Parameters
    ----------
    name : str
        Of the catalogue.
    """
    model = catalogue.find(name)
    description = model.describe(model.settings())
    console = screen()
    console.print(f"{model.name}: {model.title}", style="bold")
    table = Table("setting", "default", "", box=box.SIMPLE_HEAD, title="settings")
    for field in model_settings.fields_of(model).values():
        declared = field.metadata
        default = field.default
        for word, value in declared["presets"].items():
            default = word if value == default else default
        choices = declared["choices"] or declared["presets"]
        words = f" ({', '.join(choices)})" if choices else ""
        table.add_row(
            field.name, f"{default} {declared['unit']}", declared["sentence"] + words
        )
    console.print(table)
    for title, listed in (
        ("contributors: deviations", description.contributors),
        ("responses", description.responses),
    ):
        heads = (title.split(":")[0].rstrip("s"), "unit", "symbol", "", "equation")
        table = Table(*heads, box=box.SIMPLE_HEAD, title=title)
        for each in listed:
            unit = (
                "relative" if each.unit == "1" and "deviations" in title else each.unit
            )
            table.add_row(each.name, unit, each.symbol, each.sentence, each.source)
        console.print(table)

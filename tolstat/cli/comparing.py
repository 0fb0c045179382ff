"""Two runs of the same machines, compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from tolstat.cli.reporting import deliver, write
from tolstat.cli.showing import in_lines, screen
from tolstat.report.comparison import compared, comparison_table, pair_of
from tolstat.store.run import open as open_run


def compare_runs(
    first: Path,
    second: Path,
    output: Path | None,
    form: str,
    responses: Sequence[str],
) -> None:
    """Compare two runs of the same machines, on the screen or as a page.

    Parameters
    ----------
    first, second : Path
        The runs.
    output : Path, optional
        Where to; a page if it is to be one. JSON and CSV go to the standard output if
        not given.
    form : str
        "", "json" or "csv".
    responses : sequence of str
        What is looked at closely.
    """
    pair = pair_of(open_run(first), open_run(second))
    found = compared(pair, responses)
    if form:
        deliver(found, output, form)
        return
    console = screen()
    summary = comparison_table(found)
    table = Table(title=summary.title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in summary.heads:
        words = head in ("response", "unit")
        table.add_column(head, justify="left" if words else "right", no_wrap=True)
    for row in summary.rows:
        table.add_row(*(in_lines(cell, wide=False) for cell in row))
    console.print(table)
    for note in summary.notes:
        console.print(note)
    if output:
        from tolstat.report.comparison_page import make_comparison_page

        write(output, make_comparison_page(pair, found))
        console.print(f"report in {output}")

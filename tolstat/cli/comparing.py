"""Two runs of the same machines, compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tolstat.cli.reporting import deliver
from tolstat.cli.showing import print_table, screen
from tolstat.reporting.comparison import compared, comparison_table, pair_of
from tolstat.reporting.making import check_folder, write
from tolstat.store.opening import open as open_run


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
    if output:
        check_folder(output)
    found = compared(pair, responses)
    if form:
        deliver(found, output, form)
        return
    console = screen()
    summary = comparison_table(found)
    print_table(summary.title, summary.heads, summary.rows, wide=False)
    for note in summary.notes:
        console.print(note)
    if output:
        from tolstat.reporting.comparison_page import make_comparison_page

        write(output, make_comparison_page(pair, found))
        console.print(f"report in {output}")

"""Runs compared, each with the first."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tolstat.answers.compare.comparison import compared_with_first
from tolstat.answers.compare.comparison_table import comparison_table
from tolstat.answers.pages import write
from tolstat.answers.report.report_csv import comparison_csv
from tolstat.cli.reporting import deliver
from tolstat.cli.showing import print_table, screen
from tolstat.render.output_file import check_output
from tolstat.store.open_run import open as open_run


def compare_runs(
    paths: Sequence[Path],
    output: Path | None,
    form: str,
    responses: Sequence[str],
) -> None:
    """Compare runs with the first of them, on the screen or as a page.

    JSON and CSV (`form`) go to the standard output where no file is given; a page needs
    one.
    """
    if output:
        check_output(output)
    pairs, found = compared_with_first([open_run(path) for path in paths], responses)
    if form:
        of = (found.alone or found) if form == "json" else found
        deliver(of, output, form, lambda _: comparison_csv(found))
        return
    console = screen()
    summary = comparison_table(found)
    print_table(summary.title, summary.heads, summary.rows, wide=False)
    if summary.limit_rows:
        print_table("limits", summary.limit_heads, summary.limit_rows, wide=False)
    for note in summary.notes:
        console.print(note)
    if output:
        from tolstat.answers.compare.comparison_page import make_comparison_page

        write(output, make_comparison_page(pairs, found))
        console.print(f"report in {output}")

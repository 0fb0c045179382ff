"""What if: the trials of a run weighted, on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tolstat.answers.pages import write
from tolstat.answers.report.report_csv import what_if_csv
from tolstat.answers.report.summary_table import Cell, estimate_in_words
from tolstat.answers.what_if.scenario import what_if
from tolstat.answers.what_if.what_if_answer import WhatIf, make_what_if_page
from tolstat.cli.reporting import deliver, limits_in, value_in
from tolstat.cli.showing import WIDE, print_table, screen
from tolstat.errors import StudyError
from tolstat.render.output_file import check_output
from tolstat.render.plain import in_line, share_words
from tolstat.statistics.summary import Limited
from tolstat.units.scale import PER_CENT, PPM

SHARES = (0.5, 0.95)  # quantiles on the screen


def ask_what_if(
    path: Path,
    changes: Sequence[str],
    limits: Sequence[str],
    output: Path | None,
    form: str,
) -> None:
    """Say what a run would have found with other deviations.

    `changes` are as "rod_length=+-0.6 mm", `limits` as "rod_force <= 120 kN". JSON and
    CSV (`form`) go to the standard output where no file is given; a page needs one.
    """
    if output:
        check_output(output)
    found = what_if(path, _changes(changes), limits=limits_in(limits))
    if form:
        deliver(found, output, form, what_if_csv)
        return
    _print(found)
    if output:
        write(output, make_what_if_page(found))
        screen().print(f"page in {output}")


def _changes(texts: Sequence[str]) -> dict[str, Any]:
    """Read contributors and what is asked of them."""
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise StudyError(f'{text}: NAME=TOLERANCE, such as rod_length="+-0.6 mm"')
        if name.strip() in found:
            raise StudyError(f"{text}: {name.strip()} stands there already")
        found[name.strip()] = value_in(value, text)
    return found


def _print(found: WhatIf) -> None:
    """Print the changes, the limits and all responses, each as run and with what-if."""
    console, asked = screen(), found.what_if
    wide = console.width >= WIDE
    rows: list[list[Cell]] = [
        [name, each.as_run, each.what_if, f"{PER_CENT.number(each.worth, 2)} %"]
        for name, each in asked.deviations.items()
    ]
    heads = ["contributor", "as run", "what if", "trials left"]
    print_table(f"{found.title}: what if", heads, rows, wide=wide)
    first = [name for name, each in found.responses.items() if each.limited]
    judged: list[list[Cell]] = []
    rows = []
    for name in dict.fromkeys([*first, *found.responses]):
        each = found.responses[name]
        if each.limited and each.as_run.limited:
            cells = [*_judged(each.as_run.limited), *_judged(each.limited)]
            judged.append([name, each.limited.limit.words, *cells])
        row: list[Cell] = [name, each.scale.mark]
        for share in SHARES:
            for of in (each.as_run, each):
                row.append(estimate_in_words(of.quantiles[share], each.scale))
        rows.append(row)
    if judged:
        # short heads, for a line of 80 columns
        heads = ["response", "limit", "as run", "verdict", "what if", "verdict"]
        print_table("limits: machines beyond, ppm", heads, judged, wide=wide)
    heads = ["response", "unit"]
    for share in SHARES:
        heads += [share_words(share), f"what if: {share_words(share)}"]
    print_table("responses", heads, rows, wide=wide)
    console.print(
        f"{asked.trials} trials, weighted as if drawn so, are worth {asked.effective} "
        "independent ones; nothing was simulated"
    )
    if found.joint and found.joint_as_run:
        console.print(
            f"within all limits at once: {in_line(found.joint_as_run.within)} as run, "
            f"what if: {in_line(found.joint.within)}"
        )
    for note in found.notes:  # one may hold what is to be typed: in one line
        console.print(note, soft_wrap=True)


def _judged(limited: Limited) -> list[Cell]:
    """Write the share beyond, per million, and the verdict."""
    beyond = limited.yields.out_of_limit
    said = estimate_in_words(beyond, PPM) if beyond.sure else beyond.reason
    return [said, limited.yields.verdict]

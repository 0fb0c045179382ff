"""The command that judges measured parts of a file."""

from pathlib import Path
from typing import Any

import click

from tolstat.cli import options


@click.command()
@options.path_argument("file", "FILE")
@options.repeated(
    "A column or a characteristic; default: all. May be repeated.",
    "NAME", "--column", "columns",
)  # fmt: skip
@click.option(
    "--tolerance",
    default="",
    metavar="TEXT",
    help='Of the drawing: "+-0.05 mm", "19.98..20.02 mm" or "<= 6.3 um".',
)
@click.option("--nominal", default="", metavar="TEXT", help='Such as "20 mm".')
@click.option("--lots", default="", metavar="NAME", help="The column of the lots.")
@click.option("--unit", metavar="TEXT", help="Of the numbers, if the file has none.")
@click.option("--decimal", metavar="SIGN", help='The decimal sign, "." or ",".')
@click.option("--delimiter", metavar="SIGN", help="The sign between columns.")
@click.option("--encoding", metavar="NAME", help="Of a text, such as cp850.")
@click.option("--sheet", metavar="NAME", help="The sheet of a workbook.")
@click.option("--part", metavar="NUMBER", help="The part of a Q-DAS file.")
@options.repeated(
    'Only rows that have this word, such as "id=Bore 1".', "COLUMN=WORD", "--rows"
)
@options.repeated(
    'What cells without a value have, such as -999; "" for none.', "TEXT", "--no-value"
)
@options.delivered()
def parts(
    file: Path,
    columns: tuple[str, ...],
    tolerance: str,
    nominal: str,
    lots: str,
    rows: tuple[str, ...],
    no_value: tuple[str, ...],
    delivery: options.Delivery,
    **keys: str | None,
) -> None:
    """Judge measured parts of a file by the tolerance of their drawing.

    FILE is a text such as CSV, a workbook (XLSX, XLSM, ODS, XLS) or a Q-DAS file (DFQ,
    DFD). No study is needed.
    """
    from tolstat.answers.parts.parts_answer import parts as judged

    delivery.check()
    typed: dict[str, Any] = {k: value for k, value in keys.items() if value is not None}
    if wrong := [text for text in rows if "=" not in text]:
        raise click.BadParameter(f"'{wrong[0]}': COLUMN=WORD is expected")
    typed["rows"] = dict(text.split("=", 1) for text in rows)
    if no_value:
        typed["no_value"] = [*no_value]
    answer = judged(
        file, columns, tolerance=tolerance, nominal=nominal, lots=lots, **typed
    )
    delivery.deliver(answer)

"""A new study of a model."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.new_study import new_study
from tolstat.errors import RunFileError
from tolstat.literal import visible
from tolstat.render.output_file import check_folder


@click.command()
@click.argument("model")
@click.option(
    "-o", "--output", metavar="STUDY.toml", help="The study file; default: the screen.",
    type=click.Path(path_type=Path, dir_okay=False),
)  # fmt: skip
def new(model: str, output: Path | None) -> None:
    """Write a commented study of a model, for you to edit."""
    text = new_study(model)
    if output is None:
        click.echo(text, nl=False)
        return
    check_folder(output)
    try:
        with output.open("x") as file:  # an existing study may have been edited
            file.write(text)
    except FileExistsError:
        raise RunFileError(f"{output} exists; give another name") from None
    click.echo(f"study in {visible(str(output))}")

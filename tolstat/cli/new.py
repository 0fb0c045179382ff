"""A new study of a model, or a new model."""

from pathlib import Path

import click

from tolstat.answers.new_study import new_model, new_study
from tolstat.answers.output_file import check_folder
from tolstat.catalogue import custom_names
from tolstat.cli.options import say
from tolstat.errors import RunFileError


@click.command()
@click.argument("model", required=False)
@click.option(
    "-o", "--output", metavar="STUDY.toml", help="The study file; default: the screen.",
    type=click.Path(path_type=Path, dir_okay=False),
)  # fmt: skip
@click.option(
    "--model", "template", metavar="NAME.py",
    help="Write a custom model that moves instead: a template that runs.",
    type=click.Path(path_type=Path, dir_okay=False),
)  # fmt: skip
def new(model: str | None, output: Path | None, template: Path | None) -> None:
    """Write a commented study of a model, for you to edit.

    Without MODEL it is of the model of --machine.
    """
    if model is None and template is None:
        model = next(reversed(custom_names()), None)
    if (model is None) == (template is None) or (template and output):
        raise click.UsageError("give a MODEL for a study, or --model NAME.py alone")
    if template:
        _write(template, new_model(template), "model")
    elif output:
        _write(output, new_study(model or ""), "study")
    else:
        click.echo(new_study(model or ""), nl=False)


def _write(output: Path, text: str, kind: str) -> None:
    """Write a new file; an existing one may have been edited."""
    check_folder(output)
    try:
        with output.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise RunFileError(f"{output} exists; give another name") from None
    except OSError as error:
        output.unlink(missing_ok=True)  # a part of it
        raise RunFileError(f"{output} cannot be written: {error}") from error
    say(f"{kind} in {output}")

"""Answers delivered: on the screen, as JSON or CSV, into a file."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.answer import ENDINGS, Answer
from tolstat.errors import RunFileError
from tolstat.literal import visible
from tolstat.render.output_file import check_output, replace


def check_delivery(output: Path | None, form: str | None) -> None:
    """Refuse a file that the answer cannot be written to, before it is computed."""
    if output:
        check_output(output)
        if not form and output.suffix.lower() not in ENDINGS:
            raise RunFileError(f"{output}: an answer ends in {', '.join(ENDINGS)}")


def deliver(answer: Answer, output: Path | None, form: str | None) -> None:
    """Show an answer, or write its numbers; into a file if one is given."""
    if form:
        text = answer.json() if form == "json" else answer.csv()
        if output:
            replace(output, text.encode())
        else:
            click.echo(text, nl=False)
        return
    from tolstat.render.screen import show

    show(answer.document())
    if output:
        click.echo(f"written to {visible(str(answer.save(output)))}")

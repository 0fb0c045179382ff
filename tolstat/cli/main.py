"""The commands of tolstat. What a command needs it loads when it is called."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import click

from tolstat.errors import TolstatError

USAGE_ERROR = 2


class _Group(click.Group):
    """Commands whose refusals are sentences and not tracebacks."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except TolstatError as error:
            click.echo(f"tolstat: {error}", err=True)
            sys.exit(USAGE_ERROR)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="tolstat", prog_name="tolstat")
def main() -> None:
    """Monte Carlo tolerance analysis with the dynamics in the loop.

    A machine is built thousands of times on paper, each time with its own random
    deviations of rods, cranks and gears; every one of them is simulated.
    """


@main.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--trials", type=click.IntRange(min=1), help="Instead of the study's.")
@click.option("--seed", type=click.IntRange(min=0), help="Instead of the study's.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Threads; all processors if not given. The numbers do not depend on it.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Run file; beside the study, ending in .h5, if not given.",
)
@click.option("--force", is_flag=True, help="Replace an existing run file.")
def run(
    study: Path,
    trials: int | None,
    seed: int | None,
    workers: int | None,
    output: Path | None,
    force: bool,
) -> None:
    """Run the study STUDY.toml and store it in an HDF5 file.

    Ctrl-C stops within two seconds; what is finished by then is stored.
    """
    from tolstat.cli.running import run_study
    from tolstat.study.study import load

    asked = load(study, trials=trials, seed=seed)
    path = output or study.with_suffix(".h5")
    run_study(asked, path, workers=workers, force=force)


@main.command()
@click.argument("what", metavar="RUN.h5|MODEL")
def show(what: str) -> None:
    """Show the summary of a stored run, or what a model can be asked."""
    from tolstat.cli.showing import show_model, show_run

    if what.endswith(".h5") or Path(what).is_file():
        show_run(Path(what))
    else:
        show_model(what)


@main.command()
def models() -> None:
    """List the models."""
    from tolstat.cli.showing import list_models

    list_models()


def entry(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; the entry point of the package."""
    main(arguments)

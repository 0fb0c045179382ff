"""One trial simulated again, and the views of a model."""

import sys
from pathlib import Path

import click

from tolstat.answers.output_file import check_ending
from tolstat.answers.views.animation import ANIMATIONS
from tolstat.answers.views.evaluate import view_of
from tolstat.answers.views.replay import nominal_trial, replay
from tolstat.answers.views.view_file import VIEWS, save_view, view_on_screen
from tolstat.cli import options
from tolstat.errors import ModelError
from tolstat.model.checked_views import offers
from tolstat.render.screen import show
from tolstat.study.study import load


@click.command()
@options.path_argument("source", "RUN.h5|STUDY.toml")
@click.argument("index", type=click.IntRange(min=0), required=False)
@options.isolate
@click.option("--nominal", is_flag=True, help="Simulate the trial without deviations.")
@options.plot_option("Write its histories to a .png, .svg, .pdf, .csv or .html file.")
@click.option(
    "--animate",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.html|.gif",
    help="Write its parts in motion, before the nominal machine in grey.",
)
def trial(
    source: Path,
    index: int | None,
    nominal: bool,
    plot: Path | None,
    animate: Path | None,
) -> None:
    """Simulate one stored trial again, with its histories.

    It repeats bit for bit. Exit code 1 if it differs from the stored trial.
    """
    if nominal == (index is not None):
        raise click.UsageError("give the number of a trial, or --nominal")
    if source.suffix == ".toml" and index is not None:
        raise click.UsageError(
            f"{source} is a study; its trials are in its run "
            f"{source.with_suffix('.h5')}; or give --nominal"
        )
    if plot:
        check_ending(plot, "a view", VIEWS)
    if animate:
        check_ending(animate, "an animation", ANIMATIONS)
    if source.suffix == ".toml":
        answer = nominal_trial(load(source))
    else:
        answer = replay(source, index)
    show(answer.document())
    if plot:
        if answer.history is None:
            raise ModelError("this model does not move: it has no histories")
        save_view(answer.history, plot, answer.title)
        options.say(f"picture in {plot}")
    if animate:
        answer.animate().save(animate)
        options.say(f"animation in {animate}")
    if answer.differences:
        sys.exit(1)


@click.command()
@options.path_argument("study", "STUDY.toml")
@click.argument("name")
@options.isolate
@options.output_option(
    "Write a .png, .svg, .pdf, .csv or .html file; default: a table here."
)
def view(study: Path, name: str, output: Path | None) -> None:
    """Show a view of a model, such as a diagram or a history.

    `tolstat show MODEL` lists the names. Views are diagrams, charts, lists and
    histories of the nominal trial of STUDY.toml. Bands show the effect of its
    tolerances.
    """
    if output:
        check_ending(output, "a view", VIEWS)
    loaded = load(study)
    result = view_of(loaded.model, loaded.settings, name, study=loaded)
    title = f"{loaded.title}: {name}"
    if output:
        save_view(result, output, title, offers(loaded.model)[name].sentence)
        options.say(f"written to {output}")
    else:
        show(view_on_screen(result, title))

"""Arguments and options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from tolstat.errors import RunFileError
from tolstat.literal import visible

if TYPE_CHECKING:
    from tolstat.answers.answer import Answer
    from tolstat.execution.workers.block_scheduler import Workers
    from tolstat.execution.workers.cluster import Cluster

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]
# starts workers that stop when its argument tells
Crew = Callable[[Callable[[], bool]], AbstractContextManager["Workers"]]

MOST = 1024  # threads: far more than any processor has
COUNT = click.IntRange(min=1)


def path_argument(name: str, metavar: str | None = None, **more: Any) -> Decorator:
    """Return an argument for a file, or several."""
    kind = click.Path(path_type=Path)
    return click.argument(name, metavar=metavar, type=kind, **more)


def path_option(*names: str, **more: Any) -> Decorator:
    """Return an option for a file."""
    return click.option(*names, type=click.Path(path_type=Path), **more)


def output_option(help: str, **more: Any) -> Decorator:
    """Return the option for the output file."""
    return path_option("-o", "--output", help=help, **more)


def plot_option(help: str) -> Decorator:
    """Return the option for a picture."""
    return path_option("--plot", help=help)


def flag(help: str, *names: str) -> Decorator:
    """Return an option without a value."""
    return click.option(*names, is_flag=True, help=help)


def force(help: str) -> Decorator:
    """Return the option that replaces an existing file."""
    return flag(help, "--force")


def repeated(help: str, metavar: str | None, *names: str) -> Decorator:
    """Return an option of several values, each with the option before it."""
    return click.option(*names, multiple=True, metavar=metavar, help=help)


def form(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --json and --csv to a command: its argument `form`."""

    def choose(ctx: click.Context, option: click.Parameter, chosen: bool) -> None:
        before = ctx.params.setdefault("form", None)
        if chosen and before:
            raise click.UsageError("give --json or --csv, not both")
        if chosen:
            ctx.params["form"] = option.name

    for name in ("csv", "json"):
        help = f"Write the numbers as {name.upper()}."
        option = click.option(
            f"--{name}", is_flag=True, callback=choose, expose_value=False, help=help
        )
        command = option(command)
    return command


figure = click.option(
    "--figure",
    default="",
    metavar="NAME",
    help="The figure that -o FILE.svg, .png or .pdf holds, by how its name begins; "
    "default: the first one.",
)


class Delivery(NamedTuple):
    """How an answer is delivered: on the screen, or as a file."""

    output: Path | None
    form: str | None  # "json" or "csv": its numbers alone
    figure: str  # that the file holds, by how its name begins

    def check(self) -> None:
        """Refuse a file that cannot be written, before the answer is computed."""
        from tolstat.answers.answer import ENDINGS
        from tolstat.answers.output_file import check_ending, check_output
        from tolstat.document.blocks import PICTURES

        output, form, figure = self
        if figure and (form or not output or output.suffix.lower() not in PICTURES):
            raise click.UsageError("--figure needs -o with a .svg, .png or .pdf file")
        if output and form:
            check_output(output)
        elif output:
            check_ending(output, "an answer", ENDINGS)

    def deliver(self, answer: Answer) -> None:
        """Show an answer, or write its numbers; into a file if one is given."""
        from tolstat.answers.output_file import replace
        from tolstat.render.screen import show

        if self.form:
            text = answer.json() if self.form == "json" else answer.csv()
            if self.output:
                replace(self.output, text.encode())
            else:
                click.echo(text, nl=False)
            return
        show(answer.document())
        if self.output:
            say(f"written to {answer.save(self.output, self.figure)}")


def delivered(
    help: str = "Also write a file: .html, .csv, .json, .xlsx, .svg, .png or .pdf.",
) -> Decorator:
    """Add -o, --json, --csv and --figure to a command: its argument `delivery`."""

    def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def delivering(
            *arguments: Any, output: Path | None, form: str | None, figure: str,
            **options: Any,
        ) -> Any:  # fmt: skip
            delivery = Delivery(output, form, figure)
            return command(*arguments, delivery=delivery, **options)

        return output_option(help)(form(figure(delivering)))

    return with_options


run_file = path_argument("source", "RUN.h5")
regardless = flag(
    "Continue although source, processor or study file have changed.", "--regardless"
)
closely = repeated(
    "A response in focus; default: all with a limit. May be repeated.",
    "NAME", "--response", "responses",
)  # fmt: skip
limits = repeated(
    "Add a limit, or replace one of the study. May be repeated.",
    '"NAME <= VALUE"', "--limit", "limits",
)  # fmt: skip
checking = flag(
    "End as `tolstat check`: 3 if a limit is not met, 4 if one is undecided.", "--check"
)


@contextmanager
def _crew(
    number: int | None, address: str | None, stopping: Callable[[], bool]
) -> Iterator[Workers]:
    """Start workers; end them when they are not needed, or have to stop."""
    from tolstat.execution.workers.block_scheduler import Workers

    cluster: AbstractContextManager[Cluster | None] = nullcontext()
    if address:
        from tolstat.execution.workers.cluster import Cluster

        cluster = Cluster(address)
    with cluster as executor, Workers(number, stopping, executor=executor) as crew:
        yield crew


workers = click.option(
    "--workers",
    type=click.IntRange(1, MOST),
    metavar="N",
    help="Threads; default: all processors. Results do not depend on it.",
)
_cluster = click.option(
    "--cluster",
    metavar="tcp://HOST:8786",
    help="Evaluate on the workers of this Dask scheduler.",
)


def _isolate(ctx: click.Context, option: click.Parameter, chosen: bool) -> None:
    if chosen:
        from tolstat.catalogue import isolating

        ctx.with_resource(isolating())


isolate = click.option(
    "--isolate",
    is_flag=True,
    expose_value=False,
    callback=_isolate,
    is_eager=True,
    help="Evaluate in other processes: a crash, a hang or a leak costs its trial "
    "alone.",
)


def computing(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --workers, --cluster and --isolate to a command.

    Its argument `crew` starts workers.
    """

    @wraps(command)
    def computed(
        *arguments: Any, workers: int | None, cluster: str | None, **options: Any
    ) -> Any:
        if workers and cluster:
            raise click.UsageError("give --workers or --cluster, not both")
        crew = partial(_crew, workers, cluster)
        return command(*arguments, crew=crew, **options)

    return workers(_cluster(isolate(computed)))


def say(words: str) -> None:
    """Print a line, in which every character is visible; it never wraps."""
    click.echo(visible(words))


def check_study_output(path: Path) -> None:
    """Refuse a file that cannot hold a study, before anything is computed."""
    from tolstat.answers.output_file import check_folder

    check_folder(path)
    if path.suffix != ".toml":
        raise RunFileError(f"{path}: the name of a study ends in .toml")

"""Arguments and options that several commands have in common, and what they do."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from tolstat.errors import RunFileError
from tolstat.literal import visible

if TYPE_CHECKING:
    from tolstat.answers.answer import Answer
    from tolstat.execution.workers.crew import Workers

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

MOST = 1024  # threads: far more than any processor has
COUNT = click.IntRange(min=1)


def path_argument(name: str, metavar: str | None = None, **more: Any) -> Decorator:
    """Let a command be given a file, or several."""
    kind = click.Path(path_type=Path)
    return click.argument(name, metavar=metavar, type=kind, **more)


def path_option(*names: str, **more: Any) -> Decorator:
    """Let a command be given a file by an option."""
    return click.option(*names, type=click.Path(path_type=Path), **more)


def output_option(help: str, **more: Any) -> Decorator:
    """Let a command be told where to write."""
    return path_option("-o", "--output", help=help, **more)


def plot_option(help: str) -> Decorator:
    """Let a command be told where to draw."""
    return path_option("--plot", help=help)


def force(help: str) -> Decorator:
    """Let a command replace what is there."""
    return click.option("--force", is_flag=True, help=help)


def form(command: Callable[..., Any]) -> Callable[..., Any]:
    """Let a command be asked for its numbers, for other tools: its argument `form`."""

    def choose(ctx: click.Context, option: click.Parameter, given: bool) -> None:
        before = ctx.params.setdefault("form", None)
        if given and before:
            raise click.UsageError("--json or --csv, not both")
        if given:
            ctx.params["form"] = option.name

    for name in ("csv", "json"):
        help = f"The numbers as {name.upper()}."
        option = click.option(
            f"--{name}", is_flag=True, callback=choose, expose_value=False, help=help
        )
        command = option(command)
    return command


run_file = path_argument("source", "RUN.h5")
regardless = click.option(
    "--regardless",
    is_flag=True,
    help="Continue although source, processor or study file have changed.",
)
closely = click.option(
    "--response",
    "responses",
    multiple=True,
    help="Put it in focus, instead of all that is limited. May be repeated.",
)
limits = click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar='"NAME <= VALUE"',
    help="Judged beside or instead of the study's limits. May be repeated.",
)


class Compute(NamedTuple):
    """Who evaluates."""

    workers: int | None = None  # threads; as many as there are processors if not given
    # address of a Dask scheduler; threads of this process if not given
    cluster: str | None = None

    @contextmanager
    def crew(self, stopping: Callable[[], bool]) -> Iterator[Workers]:
        """Let them work until they are not needed any more, or have to stop."""
        from tolstat.execution.workers.crew import Workers

        with ExitStack() as stack:
            cluster = None
            if self.cluster:
                from tolstat.execution.workers.cluster import Cluster

                cluster = stack.enter_context(Cluster(self.cluster))
            crew = Workers(self.workers, stopping, executor=cluster)
            yield stack.enter_context(crew)


workers = click.option(
    "--workers",
    type=click.IntRange(1, MOST),
    help="Threads; all processors if not given. The numbers do not depend on it.",
)
_cluster = click.option(
    "--cluster",
    metavar="tcp://HOST:8786",
    help="Evaluate on the workers of this Dask scheduler, instead of here.",
)


def computing(command: Callable[..., Any]) -> Callable[..., Any]:
    """Let a command be told who evaluates: its argument `compute`."""

    @wraps(command)
    def told(
        *arguments: Any, workers: int | None, cluster: str | None, **options: Any
    ) -> Any:
        if workers and cluster:
            raise click.UsageError("--workers are of this computer, not of a --cluster")
        return command(*arguments, compute=Compute(workers, cluster), **options)

    return workers(_cluster(told))


def check_delivery(output: Path | None, form: str | None) -> None:
    """Refuse a file that the answer cannot be written to, before it is computed."""
    from tolstat.answers.answer import ENDINGS
    from tolstat.render.output_file import check_ending, check_output

    if output and form:
        check_output(output)
    elif output:
        check_ending(output, "an answer", ENDINGS)


def check_study_output(path: Path) -> None:
    """Refuse a file that no study can be written to, before anything is done for it."""
    from tolstat.render.output_file import check_folder

    check_folder(path)
    if path.suffix != ".toml":
        raise RunFileError(f"{path}: a study ends in .toml")


def deliver(answer: Answer, output: Path | None, form: str | None) -> None:
    """Show an answer, or write its numbers; into a file if one is given."""
    from tolstat.render.output_file import replace
    from tolstat.render.screen import show

    if form:
        text = answer.json() if form == "json" else answer.csv()
        if output:
            replace(output, text.encode())
        else:
            click.echo(text, nl=False)
        return
    show(answer.document())
    if output:
        click.echo(f"written to {visible(str(answer.save(output)))}")

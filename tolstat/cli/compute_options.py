"""Who evaluates: threads of this process, or a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

MOST = 1024  # threads: far more than any processor has

if TYPE_CHECKING:
    from tolstat.execution.workers.crew import Workers


class Compute(NamedTuple):
    """Who evaluates."""

    workers: int | None = None  # threads; as many as there are processors if not given
    # address of a Dask scheduler; threads of this process if not given
    cluster: str | None = None

    @contextmanager
    def crew(self, stopping: Callable[[], bool]) -> Iterator[Workers]:
        """Let them work until they are not needed any more, or have to stop."""
        from tolstat.execution.workers.crew import Workers

        if self.cluster is None:
            with Workers(self.workers, stopping) as crew:
                yield crew
            return
        from tolstat.execution.workers.cluster import Cluster

        with (
            Cluster(self.cluster) as cluster,
            Workers(stopping=stopping, executor=cluster) as crew,
        ):
            yield crew


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

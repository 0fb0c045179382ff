"""Who evaluates: threads of this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

if TYPE_CHECKING:
    from tolstat.execution.workers import Workers


class Power(NamedTuple):
    """Who evaluates.

    Attributes
    ----------
    workers : int or None
        Threads; as many as there are processors if not given.
    """

    workers: int | None = None

    @contextmanager
    def crew(self, stopping: Callable[[], bool]) -> Iterator[Workers]:
        """Let them work until they are not needed any more, or have to stop."""
        from tolstat.execution.workers import Workers

        with Workers(self.workers, stopping) as crew:
            yield crew


workers = click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Threads; all processors if not given. The numbers do not depend on it.",
)


def powered(command: Callable[..., Any]) -> Callable[..., Any]:
    """Let a command be told who evaluates: its argument `power`."""

    @wraps(command)
    def told(*arguments: Any, workers: int | None, **options: Any) -> Any:
        return command(*arguments, power=Power(workers), **options)

    return workers(told)

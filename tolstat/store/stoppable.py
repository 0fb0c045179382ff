"""Long work, such as writing a large file, that somebody may stop."""

from collections.abc import Callable
from typing import Any, Protocol


class Stoppable(Protocol):
    """What long work is done by; either method may raise an error to end it."""

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a long function returns; once ended, nobody awaits it."""

    def check(self) -> None:
        """Raise the error if the work has to end."""


class _ToTheEnd:
    """Long work that is not stopped."""

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns."""
        return function(*arguments)

    def check(self) -> None:
        """Let the work go on."""


TO_THE_END = _ToTheEnd()

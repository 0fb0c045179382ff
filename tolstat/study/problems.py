"""All problems of a study, collected and reported at once."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from tolstat.errors import Advice, StudyError, TolstatError
from tolstat.model.setting_kinds import as_typed

Value = TypeVar("Value")
LONGEST = 300  # characters that a message quotes
LONGEST_MESSAGE = 2000
ALLOWED = "; allowed: "  # after what is wrong
MOST_SAID = 50  # problems of one study


class Problems:
    """Problems of one study file."""

    def __init__(self, source: str, verdict: str = "cannot be run") -> None:
        self.source, self.verdict = source, verdict
        self.found: list[str] = []
        self._places, self._allowed = set[str](), set[str]()
        self.advice: list[Advice] = []

    def add(self, key: str, value: Any, message: str) -> None:
        """Note one problem.

        The key says where: "trials", "[limits] extra_loss". The message says what is
        wrong, what is allowed and what to do. More than MOST_SAID problems are raised
        immediately.
        """
        if value is None and key in self._places:  # wrong, not missing
            return
        self._places.add(key)
        typed = "" if value is None else f" = {shortened(toml_of(value))}"
        wrong, _, allowed = message.partition(ALLOWED)
        if len(allowed) < LONGEST or allowed not in self._allowed:
            wrong = shortened(message, LONGEST_MESSAGE)
        self._allowed.add(allowed)  # a long list is given once
        self.found.append(f"{shortened(key)}{typed}: {wrong}")
        if len(self.found) > MOST_SAID:
            self.raise_if_any()

    def noted(self, key: str) -> bool:
        """Return whether a problem of a key was noted."""
        return key in self._places

    def noted_in(self, *sections: str) -> bool:
        """Return whether a problem was noted of one of some sections or their keys."""
        return any(p.strip("[").partition("]")[0] in sections for p in self._places)

    @contextmanager
    def noting(self, key: str, value: Any) -> Iterator[None]:
        """Note an error that is raised inside, and continue after it."""
        try:
            yield
        except TolstatError as error:
            self.advice += error.advice
            self.add(key, value, str(error))

    def required(self, key: str, value: Any, read: Callable[[], Value]) -> Value:
        """Return the result of `read`; if it is refused, raise all problems."""
        with self.noting(key, value):
            return read()
        raise self.refusal

    def raise_if_any(self) -> None:
        """Refuse the study if any problem was noted, with one line for each."""
        if self.found:
            raise self.refusal

    @property
    def refusal(self) -> StudyError:
        """The error with one line for each problem."""
        problems = self.found[:MOST_SAID]
        problems += ["there are more"] * (len(self.found) > MOST_SAID)
        lines = "\n".join(f"  {problem}" for problem in problems)
        return StudyError(f"{self.source} {self.verdict}:\n{lines}", *self.advice)


def shortened(text: str, longest: int = LONGEST) -> str:
    """Return a text, cut to the length that a message quotes."""
    return text if len(text) <= longest else f"{text[:longest]}..."


def toml_of(value: Any) -> str:
    """Return a value as TOML, in one line."""
    return as_typed(value, quoted=True)

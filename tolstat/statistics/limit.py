"""What is permitted of a response."""

from __future__ import annotations

from typing import NamedTuple

DEMANDED = 0.9973  # yield that a limit asks for where the study says nothing


class Limit(NamedTuple):
    """What is permitted of a response, and of how many machines it is asked.

    Attributes
    ----------
    lower, upper : float
        Least and greatest permitted value, SI; infinite where an end is open.
    demanded : float
        Share of the machines that is to be within.
    words : str
        The values as the study writes them.
    """

    lower: float
    upper: float
    demanded: float = DEMANDED
    words: str = ""

    @property
    def permitted(self) -> tuple[float, float]:
        """Both ends."""
        return self.lower, self.upper

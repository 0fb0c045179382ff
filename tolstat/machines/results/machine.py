"""Results of another program as a model: what the rows of its file hold.

The study's table has the answers, see `tolstat.study.results_table`. Only its rows have
any: nothing can be evaluated here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tolstat.arrays import Array
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response
from tolstat.model.settings import column, setting
from tolstat.units.conversion import dimension, si_unit
from tolstat.units.grammar import Measure

FAILED, NOT_IN_FILE = "failed elsewhere", "not in the file"


@dataclass(frozen=True)
class Settings:
    """Inputs and responses of another program."""

    links: dict[str, Any] = setting(
        {},
        "inputs, by the names of their columns; a study gives them in its section "
        "[links], with their tolerances",
        columns={"nominal": column("its size", like=Measure(0.0, "m"))},
    )
    responses: dict[str, Any] = setting(
        {"stroke": {"unit": "mm"}},
        "responses, by the names of their columns; a study gives them in its section "
        "[responses]",
        columns={"unit": column("its unit, or 1 for a plain number", like="1")},
    )

    def __post_init__(self) -> None:
        """Check that units are known."""
        for row in self.responses.values():
            dimension(row["unit"])


class Results(Model):
    """Rows of a file, evaluated by another program."""

    name = "results"
    title = "results from elsewhere: the rows of a file that another program wrote"
    settings = Settings
    failures: ClassVar[Mapping[str, str]] = {
        FAILED: "the file says that the program came to an answer",
        NOT_IN_FILE: "the file has the row; nothing else has an answer",
    }
    assumptions = ("Responses are those of the file; nothing was evaluated here.",)

    def describe(self, settings: Settings) -> Description:
        """Return inputs and responses."""
        return Description(
            tuple(
                Contributor(name, size.unit, size=size.value, shown=size.shown)
                for name, row in settings.links.items()
                for size in [row["nominal"]]
            ),
            tuple(
                Response(name, si_unit(dimension(row["unit"])), shown=row["unit"])
                for name, row in settings.responses.items()
            ),
        )

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        """Return that no trial has an answer."""
        trials = len(deviations)
        none = np.full((trials, len(settings.responses)), np.nan)
        return Outcome(none, failed={NOT_IN_FILE: np.ones(trials, np.bool_)})

"""Explore: the scenarios of a run on a page that answers at once."""

import os
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from tolstat.answers.explore.page_data import PageData
from tolstat.answers.next_steps import command
from tolstat.answers.output_file import save
from tolstat.answers.report.summaries import reportable
from tolstat.answers.what_if.reweighted_trials import check_assumed
from tolstat.errors import Advice, QuestionError, Remedy
from tolstat.execution.compatibility import study_of
from tolstat.model.contract import Model
from tolstat.render.page import explore_page
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

READINGS = (
    "Readings of many scenarios: the best of them is read too good. A verdict that "
    "counts is that of a run."
)

IN_PART = ". The verdicts are of a run in part: its other trials have not run."

RANDOM_TRIALS = (
    ". Only the random trials: a report has the verdicts of all that were decided"
)


@dataclass(frozen=True, repr=False)
class Explore:
    """A page with scenarios of a run; see `explore`."""

    run: Run
    data: PageData
    thinned: bool  # these are its random trials; those that were thinned are left out

    def html(self) -> str:
        """Return the page: one file, which asks for no other."""
        run, folder = self.run, files(__package__)
        sample = self.data.sampled.sample
        ran, all_trials = int(sample.ran.sum()), len(sample.ran)
        in_part = ran < all_trials
        trials = f"{ran} of {all_trials} trials" if in_part else f"{ran} trials"
        how = "evaluated again" if self.data.evaluated else "weighted"
        data = self.data.data
        return explore_page(
            {
                name: folder.joinpath(file).read_text("utf-8")
                for name, file in FILES.items()
            },
            title=run.title,
            data=self.data.text(),
            entries=[*map(self._offered, data["entries"])],
            responses=data["responses"],
            evaluated=self.data.evaluated,
            lead=f"{run.path.name}: {trials}, {how} at each move; {run.model}"
            + (IN_PART if in_part else "")
            + (RANDOM_TRIALS if self.thinned else ""),
            report=command("report", run.path, machine=run.machine).text,
            note=READINGS,
        )

    def _offered(self, entry: dict[str, Any]) -> dict[str, Any]:
        """Return an entry with its choices as value and words."""
        kinds, grades = self.data.data["distributions"], entry["grades"]
        return {
            **entry,
            "kinds": [(name, kinds[name]["label"]) for name in entry["kinds"]],
            "grades": [("", "no grade"), *((x, x) for x in grades)] if grades else [],
            "sized": entry["sized"] and self.data.evaluated,
        }

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file that ends in .html.

        Raises
        ------
        RunFileError
            If the ending is another, or the file cannot be written or replaced.
        """
        return save(path, "a page", {".html": self.html, ".htm": self.html})

    def __repr__(self) -> str:
        """Return a description in one line."""
        return f"<tolstat explore: {self.run.path.name}>"

    def _repr_html_(self) -> str:
        """Show the page in a notebook, in a frame."""
        frame = 'width="100%" height="900" style="border: 0"'
        return f'<iframe srcdoc="{escape(self.html())}" {frame}></iframe>'


FILES = {
    "page": "page.html", "style": "page.css", "model": "model.js", "script": "page.js",
}  # fmt: skip


def explore(run: RunSource, *, model: Model | None = None) -> Explore:
    """Return a page on which tolerances, shifts and limits of a run are moved.

    The formula of a chain is evaluated again for its trials; of any other model the
    stored trials are weighted by the ratio of densities, as by `what_if`.

    Parameters
    ----------
    run : Run or path
        Of sampled trials; of thinned ones the random trials alone take part.
    model : Model, optional
        A custom model, if the run is of one.

    Returns
    -------
    Explore
        `save` writes the page.

    Raises
    ------
    QuestionError
        If its trials are no sample, or are to be weighted and depend on each other.
    """
    run = open_run(run)
    thinned = run.random_trials < run.trials
    run = run.first(run.random_trials)
    sampled, _ = reportable(run)
    if run.aim:
        raise QuestionError(
            f"{run.path}: a rare run has few trials as the study samples them; "
            "`tolstat what-if` answers for it"
        )
    study = study_of(run, model=model)
    check_assumed(run, study)
    data = PageData(run, study, sampled)
    if sampled.sample.replicates and not data.evaluated:
        raise QuestionError(
            f"{run.path}: weights are {RANDOM_ONLY}; {run.sampling} trials depend on "
            "each other",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )
    return Explore(run, data, thinned)

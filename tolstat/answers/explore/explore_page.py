"""Explore: the scenarios of a run on a page that answers at once."""

import os
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path

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


@dataclass(frozen=True, repr=False)
class Explore:
    """A page with scenarios of a run; see `explore`."""

    run: Run
    data: PageData
    thinned: bool  # these are its random trials; those that were thinned are left out

    def html(self) -> str:
        """Return the page: one file, which asks for no other."""
        run, data, folder = self.run, self.data.data, files(__package__)
        ran = self.data.sampled.sample.ran
        return explore_page(
            {
                name: folder.joinpath(file).read_text("utf-8")
                for name, file in FILES.items()
            },
            title=run.title,
            data=self.data.text(),
            entries=data["entries"],
            labels={"": "no grade"}
            | {name: kind["label"] for name, kind in data["distributions"].items()},
            responses=data["responses"],
            evaluated=self.data.evaluated,
            run_name=run.path.name,
            model_name=run.model,
            ran=int(ran.sum()),
            trials=len(ran),
            thinned=self.thinned,
            report=command("report", run.path, machine=run.machine).text,
        )

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

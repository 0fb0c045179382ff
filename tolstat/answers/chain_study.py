"""A chain from Python: a study built link by link, and its run."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Annotated, Any

from tolstat.answers.reports import report
from tolstat.answers.what_if.scenarios import what_if
from tolstat.errors import StudyError
from tolstat.execution.execute import run as run_study
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import as_typed
from tolstat.store.stored_fields import ELSEWHERE
from tolstat.store.stored_run import Run
from tolstat.study.editor import Entries
from tolstat.toml import toml_text

if TYPE_CHECKING:
    from tolstat.answers.rare.rare_answer import RareSummary
    from tolstat.answers.report.full_report import Report
    from tolstat.answers.sweep.extremes import Extremes
    from tolstat.answers.what_if.what_if_answer import WhatIf

TRIALS = 10_000
ONCE = "links", "gaps", "loops"  # sections where a second entry of a name is a slip
DIMENSION_CHAIN = "dimension_chain"


@dataclass(frozen=True, kw_only=True, repr=False)
class ChainRun(Run):
    """The run of a `Chain`: a `Run` that answers by methods."""

    custom: Annotated[Model | None, ELSEWHERE] = None  # a function as its model

    def report(self) -> Report | RareSummary | Extremes:
        """Return its report; see `tolstat.report`."""
        return report(self)

    def what_if(self, *, limits: Entries | None = None, **deviations: Any) -> WhatIf:
        """Return its results with other tolerances; see `tolstat.what_if`."""
        return what_if(self, deviations, limits=limits, model=self.custom)

    def plot(self, response: str = "", picture: str = "") -> Any:
        """Return the histogram of a response: a figure of Matplotlib.

        Without a name it is that of the response which decides. A `picture` is another
        figure of its report, such as "Waterfall" or "Chain".
        """
        if picture:
            return report(self, [response] if response else []).plot(picture)
        from tolstat.answers.report.response_figures import histogram_of
        from tolstat.render.figures import draw  # slow to import

        figure = histogram_of(self, response)
        return draw(figure.picture, figure.alt)

    def to_toml(self) -> str:
        """Return its study."""
        return self.study.text


@dataclass(frozen=True)
class Chain:
    """A study of a dimension chain, built in Python. Each method returns a new one.

    A second link, gap or loop of a name is a `StudyError`; a second limit or case takes
    the place of the first.

    Parameters
    ----------
    title : str
        Text for pages.
    trials, seed : int
        As in a study.
    model : Model, optional
        A function as `as_model` makes it, whose inputs are the links: instead of gaps.
    study : mapping, optional
        More keys of a study, such as `{"sampling": "sobol"}`.

    Examples
    --------
    >>> chain = (
    ...     tolstat.Chain("Ring in its seat")
    ...     .link("seat", "25 +0.1/-0.05 mm")
    ...     .link("ring", "24.9 h8 mm")
    ...     .gap("play", "seat - ring")
    ...     .limit("play", "0..0.3 mm")
    ... )
    >>> run = chain.run()
    >>> run.report()
    <tolstat report: run in memory, 10000 trials; play met>
    >>> run.what_if(seat="H8").all_limits.scenario.within.value > 0.99
    True
    """

    title: str = ""
    trials: int = TRIALS
    seed: int = 1
    model: Model | None = None
    study: Mapping[str, Any] | None = None

    def link(self, name: str, size: str, **keys: Any) -> Chain:
        """Add a link: `"25 +0.1/-0.05 mm"`, and keys of its deviation such as `cp`."""
        return self._with("links", name, {"nominal": size, **keys} if keys else size)

    def gap(self, name: str, formula: str) -> Chain:
        """Add a closing link, as a formula of links and other gaps."""
        return self._with("gaps", name, formula)

    def loop(self, name: str, vectors: str, **starts: str) -> Chain:
        """Add a vector loop, and near which values its unknowns are looked for."""
        chain = self._with("loops", name, vectors)
        for unknown, start in starts.items():
            chain = chain._with("loops", unknown, start)
        return chain

    def limit(
        self, name: str, limit: str, *, yield_: str | None = None, **demand: Any
    ) -> Chain:
        """Add the limit of a response, with its demand.

        It is one of `yield_="99 %"`, `ppm=100` and `ppk=1.33`.
        """
        if yield_ is not None:
            demand["yield"] = yield_
        entry = {"limit": limit, **demand} if demand else limit
        return self._with("limits", name, entry)

    def case(self, name: str, **changes: Any) -> Chain:
        """Add a case: other sizes of links for the same units, `dT="-40 K"`."""
        return self._with("cases", name, changes)

    def _with(self, section: str, name: str, entry: Any) -> Chain:
        study = dict(self.study or {})
        entries = study.get(section, {})
        if name in entries and section in ONCE:
            raise StudyError(
                f"[{section}] {name} is given twice, as {as_typed(entries[name])} and "
                f"as {as_typed(entry)}; start from a chain without it"
            )
        study[section] = {**entries, name: entry}
        return replace(self, study=study)

    def to_dict(self) -> dict[str, Any]:
        """Return the study as `tolstat.run` takes it."""
        model = self.model.name if self.model else DIMENSION_CHAIN
        head = {"title": self.title} if self.title else {}
        numbers = {"trials": self.trials, "seed": self.seed}
        return {**head, "model": model, **numbers, **(self.study or {})}

    def to_toml(self) -> str:
        """Return the study as the text of a file."""
        return toml_text(self.to_dict())

    def run(
        self,
        *,
        trials: int | None = None,
        seed: int | None = None,
        workers: int | None = None,
        output: str | os.PathLike[str] | None = None,
        force: bool = False,
    ) -> ChainRun:
        """Run it, in memory or into a file; arguments as of `tolstat.run`.

        Raises
        ------
        StudyError
            If the study is wrong: a link, a formula, a limit.
        """
        run = run_study(
            self.to_dict(), trials=trials, seed=seed, workers=workers, output=output,
            force=force, model=self.model,
        )  # fmt: skip
        values = {field.name: getattr(run, field.name) for field in fields(Run)}
        return ChainRun(**values, custom=self.model)

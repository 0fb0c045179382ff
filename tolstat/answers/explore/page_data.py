"""The data of a page: what its script reads, and all that it knows."""

import json
import math
from typing import Any

import numpy as np

from tolstat.answers.explore.formula_trees import formula_trees
from tolstat.answers.explore.interval_tables import interval_tables
from tolstat.answers.explore.packed import packed
from tolstat.answers.explore.page_entries import PageEntries
from tolstat.answers.explore.page_trials import (
    density_scores,
    page_trials,
    sampled_scores,
)
from tolstat.answers.next_steps import as_typed
from tolstat.answers.report.gather import summary_of
from tolstat.answers.report.response_summary import DescribedResponse
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Integers
from tolstat.deviations.dependence import correlations, equal_parts
from tolstat.deviations.spread import spread_of
from tolstat.statistics.limits.limit import DEMANDED
from tolstat.store.files_beside import free_name
from tolstat.store.stored_run import Run
from tolstat.study.study import Study
from tolstat.toml import toml_key, toml_keys


class PageData:
    """The data of a page of a run whose trials were sampled."""

    def __init__(self, run: Run, study: Study, drawn: Drawn) -> None:
        self.run, self.study, self.drawn = run, study, drawn
        self.summary = summary_of(drawn, responses_in_focus(run))
        deviating = study.deviating.distributions
        plain = study.model.unwrapped is study.model and not run.swept
        trees = formula_trees(study.settings, deviating) if plain else None
        self.evaluated = trees is not None
        self.entries = PageEntries(run, study, evaluated=self.evaluated)
        self.parts = self._parts()
        self.trees = trees or {}

    def _parts(self) -> list[str]:
        """Return the contributors whose scores or deviations the page needs."""
        moving = self.entries.moving
        if self.evaluated:
            return [*self.study.deviating.distributions]
        others = [name for group in self.entries.groups(moving) for name in group]
        return [*dict.fromkeys([*moving, *others])]

    def data(self) -> dict[str, Any]:
        """Return the data of the page, fit for JSON."""
        run, drawn, moving = self.run, self.drawn, self.entries.moving
        places = {name: place for place, name in enumerate(self.parts)}
        stored = 0 if self.evaluated else len(self.summary.responses)
        trials = page_trials(drawn, len(self.parts), stored)
        if self.evaluated:
            scores = sampled_scores(self.study, drawn)
        else:
            of = self.parts
            scores = {name: density_scores(self.study, drawn, name) for name in of}
        entries, kinds = self.entries.data(places)
        study = run.study_file or run.path.with_suffix(".toml")
        return {
            "title": run.title,
            "model": run.model,
            "file": run.path.name,
            "path": str(as_typed(run.path)),
            "fresh": str(as_typed(free_name(study, "explore"))),
            "machine": run.machine,
            "version": run.made.get("version_tolstat", ""),
            "started": run.made.get("started_at", "")[:10],
            "sampling": run.sampling,
            "random": not drawn.sample.replicates,
            "evaluated": self.evaluated,
            "correlated": not run.independent,
            "parts": [self._part(name, moving, trials.places) for name in self.parts],
            "entries": entries,
            "distributions": kinds,
            "groups": self._groups(places),
            "responses": [
                self._response(name, response, trials.places)
                for name, response in self._ordered()
            ],
            **trials.data([scores[name][trials.places] for name in self.parts]),
            **interval_tables(trials.number),
        }

    def _ordered(self) -> list[tuple[str, DescribedResponse]]:
        """Return the responses of the page, those that decide first."""
        by_name = self.summary.responses
        decided = [name for name in self.summary.limits if name in by_name]
        names = dict.fromkeys([*decided, *by_name])
        return [(name, by_name[name]) for name in names]

    def _part(
        self, name: str, moving: dict[str, int], places: Integers
    ) -> dict[str, Any]:
        part: dict[str, Any] = {"name": name, "entry": moving.get(name, -1)}
        equal = equal_parts(name, self.study.deviating.dependence)
        if name != equal[0] and not self.evaluated:
            part["repeats"] = True
        if self.evaluated and name not in moving:  # it stays as it was sampled
            spread = spread_of(self.study.deviating.distributions[name])
            sizes = {x.name: x.size for x in self.run.contributors}
            part |= {
                "fixed": packed(self.drawn.values(name)[places], "<f4"),
                "nominal": sizes[name] or 0.0,
                "lower": spread.lower,
                "upper": spread.upper,
                "mean": spread.mean,
                "sigma": spread.sigma,
            }
        return part

    def _groups(self, places: dict[str, int]) -> list[dict[str, Any]]:
        """Return the dependent groups, with the inverse of their correlations."""
        if self.evaluated:
            return []
        dependence = self.study.deviating.dependence
        return [
            {
                "members": [places[name] for name in group],
                "inverse": np.linalg.inv(correlations(group, dependence)).tolist(),
            }
            for group in self.entries.groups(places)
        ]

    def _response(
        self, name: str, response: DescribedResponse, places: Integers
    ) -> dict[str, Any]:
        limit, limited = self.run.limits.get(name), response.limited
        data: dict[str, Any] = {
            "name": name,
            "key": toml_key(name),
            "sentence": response.sentence,
            "unit": response.scale.mark,
            "factor": response.scale.factor,
            "nominal": response.nominal,
            "lower": limit.lower if limit else None,
            "upper": limit.upper if limit else None,
            "demanded": limit.demanded if limit else DEMANDED,
            "demand": self._demand(name),
            "run": None,
        }
        if limited:
            data["run"] = {
                "out": [*limited.yields.fraction_out_of_limit[:3]],
                "verdict": limited.yields.verdict,
                "words": limited.yields.words,
            }
        if self.evaluated:
            data["formula"] = self.trees[name]
        else:
            data["values"] = packed(self.drawn.values(name)[places], "<f4")
        return data

    def _demand(self, name: str) -> str:
        """Return the keys of a limit beside its ends, as a study has them."""
        entry = self.study.document.limits.get(name)
        if not isinstance(entry, dict):
            return ""
        return toml_keys({key: x for key, x in entry.items() if key != "limit"})

    def text(self) -> str:
        """Return the data as JSON that may stand in a page."""
        text = json.dumps(_finite(self.data()), separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c")


def _finite(value: Any) -> Any:
    """Return data without numbers that JSON lacks: they are null."""
    if isinstance(value, dict):
        return {key: _finite(x) for key, x in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(x) for x in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

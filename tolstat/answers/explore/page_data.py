"""The data of a page: what its script reads, and all that it knows."""

import json
import math
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.answers.explore.interval_tables import interval_tables
from tolstat.answers.explore.packed import packed
from tolstat.answers.explore.page_entries import PageEntries, track
from tolstat.answers.explore.page_trials import (
    density_scores,
    page_trials,
    sampled_scores,
)
from tolstat.answers.explore.scripted_formulas import ChainFormulas
from tolstat.answers.next_steps import as_typed
from tolstat.answers.report.summaries import summaries_of
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Integers
from tolstat.deviations.dependence import correlations
from tolstat.deviations.names import expand
from tolstat.deviations.spread import spread_of
from tolstat.statistics.limits.limit import DEMANDED
from tolstat.statistics.limits.yields import WORST_FIRST
from tolstat.store.files_beside import free_name
from tolstat.store.stored_run import Run
from tolstat.study.study import Study
from tolstat.toml import toml_key, toml_keys

REACH = 8.0  # sigmas: how far from the mean the slider of a limit goes


class PageData:
    """The data of a page of a run whose trials were sampled."""

    def __init__(self, run: Run, study: Study, sampled: Drawn) -> None:
        self.run, self.study, self.sampled = run, study, sampled
        self.summaries = summaries_of(sampled)
        deviating = study.deviating.distributions
        formulas = ChainFormulas(study.model, study.settings)
        self.formulas = {} if run.swept else formulas.scripts(deviating)
        self.evaluated = bool(self.formulas)
        spreads = {name: spread_of(x) for name, x in deviating.items()}
        self.turning = formulas.turning(spreads) if self.evaluated else {}
        self.entries = PageEntries(
            run, study, evaluated=self.evaluated, fixed_sizes=formulas.changed
        )

    @cached_property
    def parts(self) -> list[str]:
        """The contributors whose scores or deviations the page needs."""
        moving = self.entries.moving
        if self.evaluated:
            return [*self.study.deviating.distributions]
        others = [name for group in self.entries.groups(moving) for name in group]
        return [*dict.fromkeys([*moving, *others])]

    @cached_property
    def data(self) -> dict[str, Any]:
        """The data of the page."""
        run, sampled, moving = self.run, self.sampled, self.entries.moving
        places = {name: number for number, name in enumerate(self.parts)}
        names = self._ordered()
        stored = 0 if self.evaluated else len(names)
        trials = page_trials(sampled, len(self.parts), stored)
        if self.evaluated:
            scores = sampled_scores(self.study, sampled)
        else:
            scores = {
                name: density_scores(self.study, sampled, name) for name in self.parts
            }
        entries, kinds = self.entries.data(places)
        study = run.study_file or run.path.with_suffix(".toml")
        return {
            "path": str(as_typed(run.path)),
            "fresh": str(as_typed(free_name(study, "explore"))),
            "machine": run.machine,
            "random": not sampled.sample.replicates,
            "evaluated": self.evaluated,
            "correlated": not run.independent,
            "parts": [self._part(name, moving, trials.places) for name in self.parts],
            "entries": entries,
            "distributions": kinds,
            "groups": self._groups(places),
            "responses": [self._response(name, trials.places) for name in names],
            **trials.data([scores[name][trials.places] for name in self.parts]),
            **interval_tables(trials.number),
        }

    def _ordered(self) -> list[str]:
        """Return the responses in focus, those that decide first."""

        def urgency(name: str) -> tuple[int, float]:
            limited = self.summaries[name].limited
            return limited.yields.urgency if limited else (len(WORST_FIRST), 0.0)

        return sorted(responses_in_focus(self.run), key=urgency)

    def _part(
        self, name: str, moving: dict[str, int], places: Integers
    ) -> dict[str, Any]:
        part: dict[str, Any] = {
            "name": name,
            "entry": moving.get(name, -1),
            "nominal": self.entries.contributors[name].size or 0.0,
        }
        if self.evaluated and name not in moving:  # it stays as it was sampled
            spread = spread_of(self.study.deviating.distributions[name])
            part |= {
                "fixed": packed(self.sampled.values(name)[places], "f4"),
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

    def _response(self, name: str, places: Integers) -> dict[str, Any]:
        run, summary = self.run, self.summaries[name]
        limited, mean = summary.limited, summary.mean.value
        reach = REACH * summary.sigma.value
        written, demand = self._limit_entry(name)
        limit, scale = run.limits.get(name), run.scales[name]
        # whether Ppk by moments holds, as the report shows it
        normal = limited and limited.moments.ppk.sure and summary.normal_tails
        data: dict[str, Any] = {
            "name": name,
            "limit_entry": written,
            "key": toml_key(written),
            "unit": scale.mark,
            "factor": scale.factor,
            "nominal": run.nominal_values[name],
            "lower": limit.lower if limit else None,
            "upper": limit.upper if limit else None,
            "demanded": limit.demanded if limit else DEMANDED,
            "demand": demand,
            "track": track(mean - reach, mean + reach, scale.factor),
            "run": None,
            "normal": bool(normal),
        }
        if limited:
            data["run"] = {
                "out": [*limited.yields.fraction_out_of_limit[:3]],
                "verdict": limited.yields.verdict,
            }
        if self.evaluated:
            data["formula"] = self.formulas[name]
            data["turning"] = self.turning[name]
        else:
            data["values"] = packed(self.sampled.values(name)[places], "f4")
        return data

    def _limit_entry(self, name: str) -> tuple[str, str]:
        """Return the entry that limits a response, and its keys beside the ends.

        As the study has them: one entry may limit several responses, which move as one.
        """
        names = [response.name for response in self.run.responses]
        for written, entry in self.study.document.limits.items():
            if name in expand(written, names):
                keys = entry if isinstance(entry, dict) else {}
                rest = {key: x for key, x in keys.items() if key != "limit"}
                return written, toml_keys(rest)
        return name, ""

    def text(self) -> str:
        """Return the data as JSON that may stand in a page."""
        text = json.dumps(_finite(self.data), separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c")


def _finite(value: Any) -> Any:
    """Return data without numbers that JSON lacks: they are null."""
    if isinstance(value, dict):
        return {key: _finite(x) for key, x in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(x) for x in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

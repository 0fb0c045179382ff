"""Monte Carlo tolerance analysis with the dynamics in the loop."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.answers.allocate.allocate_tolerances import allocate
    from tolstat.answers.compare.compare_runs import compare
    from tolstat.answers.relimit import limited
    from tolstat.answers.report.ask import report, summary
    from tolstat.answers.views.evaluate import evaluate
    from tolstat.answers.views.machine_view import trajectory, view
    from tolstat.answers.views.replay import replay
    from tolstat.answers.what_if.reweighted_trials import what_if
    from tolstat.answers.what_if.scenario import fresh_study
    from tolstat.catalogue import names as models
    from tolstat.execution.execute import extend, resume, run
    from tolstat.execution.verification import verify
    from tolstat.model.contract import History, Model, Outcome
    from tolstat.model.description import (
        Contributor,
        Description,
        Response,
        StudyNumber,
    )
    from tolstat.model.settings import column, setting
    from tolstat.model.view import (
        Axis,
        Band,
        Chart,
        Curve,
        Level,
        Listing,
        Mark,
        Offer,
        Panel,
        Region,
        Span,
    )
    from tolstat.store.open_run import open
    from tolstat.store.stored_run import Run
    from tolstat.units.grammar import Measure, Range

# loaded when first used: `import tolstat` and `tolstat --help` stay quick
_HOMES = {
    "Axis": "tolstat.model.view",
    "Band": "tolstat.model.view",
    "Chart": "tolstat.model.view",
    "Curve": "tolstat.model.view",
    "Level": "tolstat.model.view",
    "Listing": "tolstat.model.view",
    "Mark": "tolstat.model.view",
    "Offer": "tolstat.model.view",
    "Panel": "tolstat.model.view",
    "Region": "tolstat.model.view",
    "Span": "tolstat.model.view",
    "allocate": "tolstat.answers.allocate.allocate_tolerances",
    "Contributor": "tolstat.model.description",
    "Description": "tolstat.model.description",
    "History": "tolstat.model.contract",
    "Model": "tolstat.model.contract",
    "Outcome": "tolstat.model.contract",
    "Measure": "tolstat.units.grammar",
    "Range": "tolstat.units.grammar",
    "Response": "tolstat.model.description",
    "Run": "tolstat.store.stored_run",
    "StudyNumber": "tolstat.model.description",
    "column": "tolstat.model.settings",
    "compare": "tolstat.answers.compare.compare_runs",
    "evaluate": "tolstat.answers.views.evaluate",
    "extend": "tolstat.execution.execute",
    "fresh_study": "tolstat.answers.what_if.scenario",
    "limited": "tolstat.answers.relimit",
    "models": "tolstat.catalogue",
    "open": "tolstat.store.open_run",
    "replay": "tolstat.answers.views.replay",
    "report": "tolstat.answers.report.ask",
    "resume": "tolstat.execution.execute",
    "run": "tolstat.execution.execute",
    "setting": "tolstat.model.settings",
    "summary": "tolstat.answers.report.ask",
    "trajectory": "tolstat.answers.views.machine_view",
    "verify": "tolstat.execution.verification",
    "view": "tolstat.answers.views.machine_view",
    "what_if": "tolstat.answers.what_if.reweighted_trials",
}
_ELSEWHERE = {"models": "names"}

__all__ = [
    "Axis", "Band", "Chart", "Contributor", "Curve", "Description", "History",
    "Level", "Listing", "Mark", "Measure", "Model", "Offer", "Outcome", "Panel",
    "Range", "Region", "Response", "Run", "Span", "StudyNumber", "allocate", "column",
    "compare", "evaluate", "extend", "fresh_study", "limited", "models", "open",
    "replay", "report", "resume", "run", "setting", "summary", "trajectory", "verify",
    "view", "what_if",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tolstat")
    if name not in _HOMES:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOMES[name]), _ELSEWHERE.get(name, name))
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

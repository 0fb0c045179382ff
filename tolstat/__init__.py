"""Monte Carlo tolerance analysis with the dynamics in the loop."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.answers.allocate.allocate_tolerances import allocate
    from tolstat.answers.compare.compare_runs import compare
    from tolstat.answers.new_study import new_study
    from tolstat.answers.relimit import limited
    from tolstat.answers.report.gather import report, summary
    from tolstat.answers.views.evaluate import evaluate, trajectory, view
    from tolstat.answers.views.replay import replay
    from tolstat.answers.what_if.fresh_study import fresh_study
    from tolstat.answers.what_if.reweighted_trials import what_if
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
    from tolstat.store.run_writer import save
    from tolstat.store.stored_run import Run
    from tolstat.units.grammar import Measure, Range

# loaded when first used: `import tolstat` and `tolstat --help` stay quick
_NAMES = {
    "tolstat.answers.allocate.allocate_tolerances": ("allocate",),
    "tolstat.answers.compare.compare_runs": ("compare",),
    "tolstat.answers.new_study": ("new_study",),
    "tolstat.answers.relimit": ("limited",),
    "tolstat.answers.report.gather": ("report", "summary"),
    "tolstat.answers.views.evaluate": ("evaluate", "trajectory", "view"),
    "tolstat.answers.views.replay": ("replay",),
    "tolstat.answers.what_if.reweighted_trials": ("what_if",),
    "tolstat.answers.what_if.fresh_study": ("fresh_study",),
    "tolstat.catalogue": ("models",),
    "tolstat.execution.execute": ("extend", "resume", "run"),
    "tolstat.execution.verification": ("verify",),
    "tolstat.model.contract": ("History", "Model", "Outcome"),
    "tolstat.model.description": (
        "Contributor", "Description", "Response", "StudyNumber",
    ),
    "tolstat.model.settings": ("column", "setting"),
    "tolstat.model.view": (
        "Axis", "Band", "Chart", "Curve", "Level", "Listing", "Mark", "Offer", "Panel",
        "Region", "Span",
    ),
    "tolstat.store.open_run": ("open",),
    "tolstat.store.run_writer": ("save",),
    "tolstat.store.stored_run": ("Run",),
    "tolstat.units.grammar": ("Measure", "Range"),
}  # fmt: skip
_HOMES = {name: home for home, names in _NAMES.items() for name in names}
_ELSEWHERE = {"models": "names"}

__all__ = [
    "Axis", "Band", "Chart", "Contributor", "Curve", "Description", "History",
    "Level", "Listing", "Mark", "Measure", "Model", "Offer", "Outcome", "Panel",
    "Range", "Region", "Response", "Run", "Span", "StudyNumber", "allocate", "column",
    "compare", "evaluate", "extend", "fresh_study", "limited", "models", "new_study",
    "open", "replay", "report", "resume", "run", "save", "setting", "summary",
    "trajectory", "verify", "view", "what_if",
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

"""Monte Carlo tolerance analysis with the dynamics in the loop."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # `__getattr__` loads these names: `tolstat --help` stays quick
    from tolstat.answers.allocate.allocate_tolerances import allocate
    from tolstat.answers.chain_study import Chain
    from tolstat.answers.compare.compare_runs import compare
    from tolstat.answers.explore.explore_page import explore
    from tolstat.answers.new_study import new_study
    from tolstat.answers.parts.parts_answer import parts
    from tolstat.answers.relimit import limited
    from tolstat.answers.reports import report, summary
    from tolstat.answers.views.evaluate import evaluate, trajectory, view
    from tolstat.answers.views.replay import replay
    from tolstat.answers.what_if.fresh_study import fresh_study
    from tolstat.answers.what_if.scenarios import what_if
    from tolstat.catalogue import names as models
    from tolstat.execution.execute import decide, extend, resume, run
    from tolstat.execution.verification import verify
    from tolstat.model.contract import History, Model, Outcome
    from tolstat.model.description import (
        Contributor,
        Description,
        Response,
        StudyNumber,
    )
    from tolstat.model.function_model import as_model
    from tolstat.model.mechanism import Line, Mechanism
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

__all__ = [
    "Axis", "Band", "Chain", "Chart", "Contributor", "Curve", "Description", "History",
    "Level", "Line", "Listing", "Mark", "Measure", "Mechanism", "Model", "Offer",
    "Outcome", "Panel", "Range", "Region", "Response", "Run", "Span", "StudyNumber",
    "allocate", "as_model", "column", "compare", "decide", "evaluate", "explore",
    "extend", "fresh_study", "limited", "models", "new_study", "open", "parts",
    "replay", "report", "resume", "run", "save", "setting", "summary", "trajectory",
    "verify", "view", "what_if",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tolstat")
    if name not in __all__:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    from tolstat.lazy_names import lazy_name

    value = globals()[name] = lazy_name(__file__, name)
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

"""What settles a verdict that integration errors leave undecided: a finer run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.answers.next_steps import as_typed, to_run_again
from tolstat.document.inline import Name, Parts, Typed, listed, say, text
from tolstat.units.conversion import dimension, si_unit
from tolstat.units.grammar import typed, unit_of
from tolstat.units.scale import figures

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import RunSummary
    from tolstat.store.stored_run import Run

MOST_RTOL = 1e-6  # an audit of a far too rough run is too rough, too


def settle(found: RunSummary) -> Parts:
    """Say how to decide limits that integration errors leave undecided; () if none."""
    names = [Name(n) for n, each in found.limits.items() if each.yields.reason]
    return settled_by(found.stored_run, names) if names else ()


def settled_by(run: Run, names: list[Name]) -> Parts:
    """Say which settings decide limits, and how to run the study with them."""
    audited, again = run.audited, to_run_again(run)
    assert audited is not None
    lines = [_line(run, *each) for each in audited.settings.items()]
    study = as_typed(run.study_file) if again and run.study_file else "the study"
    return say(
        f"Decide {{}}: integration errors are too large. In [settings] of {study} "
        "write {}{}.",
        listed(names), listed([text(Typed(line)) for line in lines]),
        text(", then run ", Typed(again)) if again else ", then run it again",
    )  # fmt: skip


def _line(run: Run, name: str, value: float) -> str:
    """Return a setting as a study has it: that of the audit, or a finer one."""
    if name == "rtol":
        return f"rtol = {figures(min(value, MOST_RTOL))}"
    unit = unit_of(run.settings[name].words)
    if unit == "1":
        return f"{name} = {value:.10g}"
    return f'{name} = "{typed(si_unit(dimension(unit)), value)}"'

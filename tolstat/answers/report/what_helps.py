"""What would help a limit: the parts to tighten, and the effect of that."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tolstat.answers.cells import ppm
from tolstat.answers.halved_entries import MOVED, halved_entries
from tolstat.document.blocks import Cell
from tolstat.document.inline import Name, Parts, listed, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET
from tolstat.statistics.summary import Limited
from tolstat.store.stored_run import Run

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import Causes, NamedCause

MOST_NAMED = 4  # parts in a sentence


def cell(run: Run, causes: Causes | None, limited: Limited) -> Cell:
    """Return what to tighten, above the fraction out of limit that this leaves.

    Where that is not estimable, the reason stands below. A limit that is met needs
    nothing.
    """
    if limited.yields.verdict == MET or causes is None or (main := causes.main) is None:
        return Cell(())
    entries = halved_entries(run, main.members)
    halves = {
        name: entry if isinstance(entry, str) else str(entry["tolerance"])
        for name, entry in entries.items()
    }
    change = say("halve {}", named(main))
    # a tolerance alone is no remedy where other keys have to change with it
    alone = all(isinstance(e, str) or not e.keys() & {*MOVED} for e in entries.values())
    if alone and len({*halves.values()}) == 1 and len(halves) <= MOST_NAMED:
        (half,) = {*halves.values()}
        change = text(listed([*map(Name, halves)]), f" to {half}")
    if math.isnan(main.halved.value):
        return Cell(change, text("effect not estimable: ", main.halved.reason))
    now = limited.yields.fraction_out_of_limit
    same = main.halved.sure and not differ(main.halved, now)
    said = ", no significant change" if same else still(main, limited.limit)
    return Cell(change, text(ppm(main.halved), said or None))


def still(main: NamedCause, limit: Limit) -> str:
    """Say that a limit is not met with half the tolerances; empty if it may be."""
    return ", still not met" if main.halved.lower > 1 - limit.demanded else ""


def named(main: NamedCause) -> Parts:
    """Name the parts of the main cause: each of a few, in one word if many."""
    if len(main.members) > MOST_NAMED:
        return text(main.words)
    return listed([Name(part) for part in main.members])


def differ(one: Estimate, other: Estimate) -> bool:
    """Tell whether two fractions differ significantly.

    They do if their intervals do not overlap. Each end errs in 2.5 % of all runs, so
    one of the two facing ends errs in at most 5 %. The trials are the same: an interval
    of the difference would be narrower, but its coverage was not measured.
    """
    return one.upper < other.lower or other.upper < one.lower

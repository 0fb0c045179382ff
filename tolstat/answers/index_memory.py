"""What an index page remembers of its runs, to say later what has changed.

A run that replaces another leaves nothing of it; the index that was written before
still has what that one was made of.
"""

import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from tolstat.answers.revisions import Revision, changes_since
from tolstat.answers.run_entries import RunIndex
from tolstat.errors import RunFileError
from tolstat.regular_files import content
from tolstat.statistics.estimate import Estimate

MEGABYTES = 50  # of a page
BROKEN = (  # what a page may lead to that tolstat did not write
    OSError, RunFileError, ValueError, TypeError, LookupError, AttributeError,
    ArithmeticError, RecursionError,
)  # fmt: skip
TAG = '<script type="application/json" id="revisions">'
_TAGGED = re.compile(re.escape(TAG) + "(.*?)</script>", re.DOTALL)


class Remembered(NamedTuple):
    """A run file as an index page knew it, and what stood there before."""

    latest: Revision
    before: Revision | None


Memory = Mapping[str, Remembered]  # by run file, relative to the page


def memory_of(page: Path) -> Memory:
    """Return what an index page remembers; nothing where there is no such page."""
    with suppress(*BROKEN):
        tagged = _TAGGED.search(content(page, MEGABYTES).decode())
        rows = json.loads(tagged[1]) if tagged else {}
        return {
            run: Remembered(_read(latest), before and _read(before))
            for run, (latest, before) in rows.items()
        }
    return {}


def with_memory(index: RunIndex, memory: Memory) -> RunIndex:
    """Return an index that says what changed where a run replaced another."""
    entries = []
    for entry in index.entries:
        stored = memory.get(index.relative(entry.run))
        if stored and entry.revision:
            replaced = stored.latest.started_at != entry.revision.started_at
            before = stored.latest if replaced else stored.before
            if before:
                changes = entry.changes or changes_since("", before, entry.revision)
                entry = entry.but(before=before, changes=changes)
        entries.append(entry)
    return replace(index, entries=tuple(entries))


def page_with_memory(index: RunIndex, memory: Memory) -> str:
    """Return the page of an index; it remembers its runs, and others that exist."""
    rows = {
        run: both for run, both in memory.items()
        if os.path.exists(index.folder / run)  # False for too long a name
    }  # fmt: skip
    rows |= {
        index.relative(entry.run): Remembered(entry.revision, entry.before)
        for entry in index.entries if entry.revision
    }  # fmt: skip
    written = {run: [x and x._asdict() for x in both] for run, both in rows.items()}
    text = json.dumps(written, separators=(",", ":")).replace("<", "\\u003c")
    return index.html().replace("</body>", f"{TAG}{text}</script>\n</body>")


def _read(row: Mapping[str, Any]) -> Revision:
    """Return a revision that was written; ValueError if it holds anything else."""
    fields = dict(row)
    shares = fields.pop("fractions_out_of_limit")
    texts = [*fields.values()]
    texts = [*texts[:3], *(x for part in texts[3:] for x in (*part, *part.values()))]
    if not all(isinstance(text, str) for text in texts):
        raise ValueError("a text is expected")
    estimates = dict[str, Estimate]()
    for name, (value, lower, upper, reason) in shares.items():
        numbers = float(value), float(lower), float(upper)
        estimates[name] = Estimate(*numbers, str(reason))
    return Revision(fractions_out_of_limit=estimates, **fields)

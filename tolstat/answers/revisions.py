"""What changed between two runs of one drawing: tolerances, limits, verdicts."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from tolstat.arrays import Array
from tolstat.document.inline import Number, in_line, plain
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import Yield
from tolstat.store.run_records import differences
from tolstat.store.stored_run import Run
from tolstat.units.scale import PPM

LINKS = "links", "gaps", "loops"  # settings whose rows stand in the study
# keys of a study that are compared as they were read, or only name and count trials
ELSEWHERE = {
    "title", "document", "trials", "seed", "settings", "deviations", "limits", "at_most"
}  # fmt: skip


class Revision(NamedTuple):
    """What a run was made of, and how its limits came out; all in words."""

    drawing: str  # number of the drawing in its title block; else its title
    revision: str
    started_at: str
    # by name: sizes of parts, tolerances, settings, limits
    sizes: Mapping[str, str]
    tolerances: Mapping[str, str]
    settings: Mapping[str, str]
    limits: Mapping[str, str]
    study: Mapping[str, str]  # all else of the study, such as gaps.play
    data: Mapping[str, str]  # measured parts
    sources: Mapping[str, str]  # digest of the code of the model
    verdicts: Mapping[str, str]
    fractions_out_of_limit: Mapping[str, Estimate]


class Change(NamedTuple):
    """One thing that differs; a word is empty where one of both has none."""

    # "size", "tolerance", "setting", "limit", "study", "data", "source", "verdict",
    # "out of limit"
    kind: str
    name: str
    before: str
    after: str


class Changes(NamedTuple):
    """What changed since the run before of the same drawing."""

    against: str  # the file of that run; empty: the same, which was replaced
    started_at: str  # that run
    revisions: tuple[str, str]  # as their title blocks name them
    changes: tuple[Change, ...]


def revision_of(run: Run, yields: Mapping[str, Yield]) -> Revision:
    """Return the revision of a run, with the yields of its limits."""
    entries, table = run.entries, {**run.study.table}
    links = table.get("links", {})  # those with a tolerance are compared as parts
    table["links"] = {n: x for n, x in links.items() if n not in entries["deviation"]}
    rest = {name: table[name] for name in table if name not in ELSEWHERE}
    return Revision(
        run.document.get("drawing", "") or f"{run.model}: {run.title}",
        run.document.get("revision", ""),
        run.provenance["started_at"],
        {c.name: run.scales[c.name].words(c.size) for c in run.contributors if c.size},
        entries["deviation"],
        {n: words for n, words in entries["setting"].items() if n not in LINKS},
        entries["limit"],
        dict(_flat(rest)),
        {parts.name: _words_of(parts.values) for parts in run.measured},
        {run.model: run.source_digest[:12]},
        {name: str(x.verdict) for name, x in yields.items()},
        {name: x.fraction_out_of_limit for name, x in yields.items()},
    )


def before_each(revisions: Iterable[Revision | None]) -> list[int | None]:
    """Return for each revision which one of the same drawing was run last before it."""
    numbered = [*enumerate(revisions)]
    dated = [(x.started_at, number, x.drawing) for number, x in numbered if x]
    latest, before = dict[str, int](), dict[int, int]()
    for _, number, drawing in sorted(dated):
        if drawing in latest:
            before[number] = latest[drawing]
        latest[drawing] = number
    return [before.get(number) for number, _ in numbered]


def changes_since(against: str, before: Revision, after: Revision) -> Changes:
    """Return what changed since a revision, whose file may be named."""
    names = before.revision, after.revision
    differences = changes_between(before, after)
    return Changes(against, before.started_at, names, differences)


def changes_between(before: Revision, after: Revision) -> tuple[Change, ...]:
    """Return what differs, in the order of the study, then of its results.

    Fractions out of limit differ where their intervals do not overlap.
    """
    kinds = (
        ("size", before.sizes, after.sizes),
        ("tolerance", before.tolerances, after.tolerances),
        ("setting", before.settings, after.settings),
        ("limit", before.limits, after.limits),
        ("study", before.study, after.study),
        ("data", before.data, after.data),
        ("source", before.sources, after.sources),
        ("verdict", before.verdicts, after.verdicts),
    )
    changes = [
        Change(kind, name, was or "", now or "")
        for kind, earlier, later in kinds
        for name, was, now in differences(earlier, later)
    ]
    shares = after.fractions_out_of_limit
    for name, was in before.fractions_out_of_limit.items():
        now = shares.get(name, was)
        if was.upper < now.lower or now.upper < was.lower:
            changes.append(Change("out of limit", name, _ppm(was), _ppm(now)))
    return tuple(changes)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield what a table and those in it hold, by names such as gaps.play."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, str(value)


def _words_of(values: Array) -> str:
    digest = hashlib.sha256(values.tobytes()).hexdigest()[:8]
    return f"{len(values)} values, digest {digest}"


def _ppm(share: Estimate) -> str:
    """Return a fraction in ppm, with its interval."""
    return plain(in_line(Number(share, PPM)))

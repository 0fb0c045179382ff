"""Document of stored runs, or of the studies of a batch."""

from collections import Counter
from datetime import datetime

from tolstat.answers.cells import ppm
from tolstat.answers.run_entries import Entry, RunIndex
from tolstat.document import blocks
from tolstat.document.inline import Link, Name, Number, Word
from tolstat.document.sentences import counted, listed, text
from tolstat.statistics.limits.yields import WORST_FIRST
from tolstat.units.scale import AS_IS

SIZE = AS_IS._replace(most=2)


def runs_document(index: RunIndex) -> blocks.Document:
    """Return a table of the runs, and their problems."""
    if not index.entries:
        none = blocks.paragraph(f"no run is stored in {index.folder}")
        return blocks.Document(index.title, (none,))
    problems = (
        blocks.Verbatim(
            f"{entry.run or entry.study}: "
            + entry.problem.removeprefix(str(entry.run)).lstrip(": ")
        )
        for entry in index.entries
        if entry.problem
    )
    return blocks.Document(index.title, blocks.shown(
        blocks.section("", _lead(index), page_only=True),
        progress_table(index),
        blocks.section("What changed since the run before", _changes(index.dated),
                       page_only=True),
        blocks.section("", *problems),
    ))  # fmt: skip


def _lead(index: RunIndex) -> blocks.Paragraph:
    """Say how many studies meet their limits, and how many do not run."""
    worst = Counter(_worst(entry) for entry in index.entries)
    words = {"met": "all limits met", "not met": "a limit not met",
             "undecided": "a limit undecided", "": "without a verdict"}  # fmt: skip
    listed_parts = [
        (Word(f"{worst[verdict]}", verdict) if verdict else f"{worst[verdict]}",
         f" {words[verdict]}")
        for verdict in ("not met", "undecided", "met", "") if worst[verdict]
    ]  # fmt: skip
    problems = sum(bool(entry.problem) for entry in index.entries)
    broken = ("; ", counted(problems, "problem"), " below") if problems else ()
    plural = "studies" if index.noun == "study" else "runs"
    studies = counted(len(index.entries), index.noun, plural)
    return blocks.Paragraph(
        text(studies, ": ", listed(listed_parts, ""), broken, "."), "lead"
    )


def _worst(entry: Entry) -> str:
    """Return the worst verdict of a run; nothing where there is none."""
    verdicts = entry.revision.verdicts.values() if entry.revision else ()
    return next((str(x) for x in WORST_FIRST if x in verdicts), "")


def _changes(index: RunIndex) -> blocks.Table:
    """Return a row for each thing that changed; of what stayed the same one row."""
    rows: list[dict[str, blocks.Given]] = []
    for entry in index.entries:
        if not entry.changes:
            continue
        against, started, revisions, changes = entry.changes
        named = f"{revisions[0]} to {revisions[1]}" if any(revisions) else None
        first: dict[str, blocks.Given] = {
            "study": blocks.Cell(
                text(entry.study),
                text(
                    f"since {against or 'its run'} of {started[:16].replace('T', ' ')}"
                ),
            ),
            "revision": named,
        }
        for kind, name, before, after in changes or [("nothing", "", "", "")]:
            rows.append({
                **first, "changed": blocks.Cell(text(kind), text(Name(name))),
                "before": before or "none" * bool(name),
                "now": after or "none" * bool(name),
            })  # fmt: skip
            first = {"study": None}
    return blocks.table_of(rows, words=["before", "now"], look="dense")


def progress_table(index: RunIndex) -> blocks.Table:
    """Return a table with a row for each: state, limits, trials."""
    rows: list[dict[str, blocks.Given]] = []
    for entry in index.entries:
        page, failed = index.relative(entry.report), entry.failed
        time = entry.written and datetime.fromisoformat(entry.written)
        size = text(Number(entry.bytes / 1e6, SIZE), " MB")
        ran = () if entry.ran == entry.trials else (Number(entry.ran), " of ")
        rows.append({
            "study": Link(entry.study, page) if page else entry.study,
            "state": entry.state,
            "limits": entry.verdicts,
            "out of limit, ppm": blocks.Cell(
                text(ppm(entry.fraction_out_of_limit)) if entry.limit else (),
                text(Name(entry.limit)) if entry.limit else (),
                entry.sketch,
            ),
            "trials": (*ran, Number(entry.trials)) if entry.trials else (),
            "failed": Number(failed) if entry.ran and failed is not None else None,
            "model": entry.model,
            "written": f"{time:%Y-%m-%d %H:%M}" if time else None,
            "size": size if entry.bytes else None,
            "title": entry.title,
            "time, s": Number(entry.seconds) if entry.run else None,
        })  # fmt: skip
    return blocks.table_of(
        rows, words=["limits", "title"],
        page_only=["out of limit, ppm", "title", "time, s"], look="dense",
        spare=["size", "written", "model", "failed"],
    )  # fmt: skip

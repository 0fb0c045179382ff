"""Document of stored runs, or of the studies of a batch."""

from datetime import datetime

from tolstat.answers.run_entries import RunIndex
from tolstat.document import blocks
from tolstat.document.inline import Link, Number, text
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
    return blocks.Document(index.title, blocks.shown(progress_table(index), *problems))


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
            "trials": (*ran, Number(entry.trials)) if entry.trials else (),
            "failed": Number(failed) if entry.ran and failed is not None else None,
            "model": entry.model,
            "written": f"{time:%Y-%m-%d %H:%M}" if time else None,
            "size": size if entry.bytes else None,
            "title": entry.title,
            "s": Number(entry.seconds),
        })  # fmt: skip
    return blocks.table_of(
        rows, words=["limits", "title"], page_only=["title", "s"], look="dense",
        spare=["size", "written", "model", "failed"],
    )  # fmt: skip

"""What tolstat runs on here, and whether it computes as it should."""

from __future__ import annotations

from tolstat.document.blocks import Column, Document, paragraph, table
from tolstat.document.inline import counted
from tolstat.execution.self_check import Check


def surroundings_document(found: dict[str, str]) -> Document:
    """Return versions, processor, cores, and where compiled code is kept."""
    columns = "what", Column("here", words=True)
    return Document("", (table(columns, list(found.items())),))


def check_document(found: Check) -> Document:
    """Return how fast trials are evaluated, and whether they repeat bit for bit."""
    same = "the same trials have the same responses, bit for bit"
    if not found.same:
        same = (
            "the same trials have different responses: memory, processor or compiled "
            "code is damaged; remove the folder of compiled code above, and try again"
        )
    speed = paragraph(
        f"ready after {found.ready:.1f} s; ", *counted(found.trials, "trial"),
        f" of the stand in {found.seconds:.1f} s: "
        f"{found.trials / found.seconds:.0f} trials/s",
    )  # fmt: skip
    return Document("", (speed, paragraph(same)))

"""The document about a file of measured parts."""

from tolstat.answers.parts.parts_answer import PartsAnswer
from tolstat.answers.parts.parts_section import (
    ALL_PARTS,
    INTERVALS,
    parts_section,
    parts_table,
)
from tolstat.document import blocks


def parts_document(answer: PartsAnswer) -> blocks.Document:
    """Return a table of all characteristics, and a section for each."""
    characteristics = answer.characteristics
    judged = any(part.tolerance.finite for part in characteristics.values())
    sections = (
        parts_section(name, part, anchor=f"part-{i}")
        for i, (name, part) in enumerate(characteristics.items())
    )
    return blocks.Document(
        f"Measured parts: {answer.file}",
        blocks.shown(
            parts_table(characteristics.items()),
            blocks.note(ALL_PARTS if judged else INTERVALS),
            *sections,
        ),
    )

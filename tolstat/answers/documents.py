"""Which document an answer has: an answer is types, and knows none of its words."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from tolstat.document.blocks import Document

# by the name of an answer: the module of this folder with its document, the function
WRITERS = {
    "compare": ("compare.comparison_document", "comparison_document"),
    "extremes": ("sweep.extremes_document", "extremes_document"),
    "rare": ("rare.rare_document", "rare_document"),
    "report": ("report.report_document", "report_document"),
    "summary": ("report.summary_document", "summary_document"),
}


def document_of(answer: Any) -> Document:
    """Return the document of an answer: headings, sentences, tables, figures.

    `answer` is an `Answer`, whose file imports this one.
    """
    module, function = WRITERS[answer.answers]
    writer = getattr(import_module(f"tolstat.answers.{module}"), function)
    document: Document = writer(answer)
    return document

"""The base of all answers: printed, saved, shown in a notebook."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from tolstat.document.blocks import PICTURES, Document
from tolstat.document.inline import Row
from tolstat.errors import QuestionError, allowed_names

if TYPE_CHECKING:
    import pandas as pd

ENDINGS = (".html", ".csv", ".json", ".xlsx", *PICTURES)
# by the name of an answer: the module of this folder that has its document, made by the
# function of that name. An answer is types, and knows none of its words.
DOCUMENTS = {
    "allocate": "allocate.allocation_document",
    "compare": "compare.comparison_document",
    "extremes": "sweep.extremes_document",
    "parts": "parts.parts_document",
    "rare": "rare.rare_document",
    "report": "report.report_document",
    "runs": "runs_document",
    "scenarios": "what_if.scenarios_document",
    "summary": "report.summary_document",
    "trial": "views.replay_document",
    "what_if": "what_if.what_if_document",
}


class Answer(ABC):
    """An answer: typed fields, one document, one wide table.

    Attributes
    ----------
    answers : str
        Its name in JSON.
    index : str
        Column of `rows` that names a row.
    """

    answers: ClassVar[str]
    index: ClassVar[str] = "response"

    def document(self, **options: bool) -> Document:
        """Return its document: headings, sentences, tables, figures.

        Of a report with `whole=True` its tables have all rows.
        """
        path = DOCUMENTS[self.answers]
        module = import_module(f"tolstat.answers.{path}")
        document: Document = getattr(module, path.rpartition(".")[2])(self, **options)
        return document

    @abstractmethod
    def rows(self) -> Sequence[Row]:
        """Return its wide table, as in CSV and `frame`."""

    @property
    @abstractmethod
    def _short(self) -> str:
        """A description in a few words."""

    def frame(self) -> pd.DataFrame:
        """Return its wide table as a DataFrame, SI."""
        from tolstat.render.serialize import rows_as_frame  # a screen needs none

        return rows_as_frame(self.rows(), self.index)

    def json(self) -> str:
        """Return it as JSON, SI; `tolstat/answers/schemas` has the schema of each."""
        from tolstat.render.serialize import as_json

        return as_json(self, self.answers)

    def csv(self) -> str:
        """Return its wide table as CSV, in the units shown."""
        from tolstat.render.serialize import rows_as_csv

        return rows_as_csv(self.rows())

    def workbook(self) -> bytes:
        """Return it as XLSX: its wide table, and each table of its page."""
        from tolstat.render.workbook import (
            sheet_of_rows,
            sheets_of_document,
            workbook_of,
        )

        wide = sheet_of_rows(self.answers.replace("_", " "), self.rows())
        return workbook_of((wide, *sheets_of_document(self._whole())))

    def _whole(self) -> Document:
        """Return its document with all rows of its tables."""
        return self.document()

    def html(self, run: str = "") -> str:
        """Return it as a self-contained page; `run` in its head identifies a file."""
        from tolstat.render.page import page

        return page(self.document(), run)

    def plot(self, words: str = "") -> Any:
        """Return a figure of its page: a figure of Matplotlib.

        Parameters
        ----------
        words : str
            What its description begins with, such as "Waterfall" or "Histogram of gap";
            without any it is the first one.

        Raises
        ------
        QuestionError
            If its page has no such figure.
        """
        from tolstat.document.blocks import figures_in
        from tolstat.render.figures import draw  # slow to import

        figures = {x.alt: x.picture for x in figures_in(*self.document().blocks)}
        for description, picture in figures.items():
            if description.startswith(words):
                return draw(picture, description.partition(":")[0])
        if not figures:
            raise QuestionError("its page has no figure")
        names = sorted({description.partition(":")[0] for description in figures})
        raise QuestionError(f"figure {words!r}: {allowed_names(words, names)}")

    def save(self, path: str | os.PathLike[str], figure: str = "") -> Path:
        """Write it to a file: .html, .csv, .json or .xlsx, by its ending.

        A figure of its page to .png, .svg or .pdf: the first one, or `figure`, see
        `plot`.

        Raises
        ------
        RunFileError
            If the ending is not allowed, or the file cannot be written or replaced.
        QuestionError
            If its page has no such figure.
        """
        from tolstat.answers.output_file import as_pictures, save

        return save(path, "an answer", {
            ".html": self.html, ".csv": self.csv, ".json": self.json,
            ".xlsx": self.workbook, **as_pictures(lambda: self.plot(figure)),
        })  # fmt: skip

    def __repr__(self) -> str:
        """Return a description in one line."""
        return f"<tolstat {self.answers}: {self._short}>"

    def _repr_html_(self) -> str:
        """Show its page in a notebook, in a frame."""
        return in_frame(self.html())


def in_frame(html: str) -> str:
    """Return a page in a frame as high as the page, for a notebook."""
    from html import escape

    return (
        f'<iframe srcdoc="{escape(html)}" title="tolstat" height="600" '
        'onload="this.height = this.contentDocument.body.scrollHeight + 40" '
        'style="width: 100%; border: 0"></iframe>'
    )

"""A run that was stopped; no pages."""

from __future__ import annotations

import pytest

from tests.cli.command_line import chain
from tolstat.answers.report.full_report import Report
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.render.page import mark_of
from tolstat.study.study import load

PAGE = '<head>\n<meta name="generator" content="tolstat">\na page'


@pytest.fixture
def no_pages(monkeypatch):
    """Reports are tested elsewhere, and take a second each."""

    def html(self, run=""):
        return f"{mark_of(run)}\n{PAGE}" if run else PAGE

    monkeypatch.setattr(Report, "html", html)


@pytest.fixture
def half(tmp_path):
    """A run that was stopped, in a folder whose name needs quotes."""
    folder = tmp_path / "my runs"
    folder.mkdir()
    study, looked = chain(folder, "half"), []
    with Workers(1, lambda: len(looked) > 20 or looked.append(0), block=50) as crew:
        return execute(load(study), study.with_suffix(".h5"), crew)

"""The report that several files test."""

from __future__ import annotations

import pytest

from tests.answers.page_checks import Made
from tolstat.answers.report.full_report import report_of


@pytest.fixture(scope="session")
def report(mill, tmp_path_factory):
    return Made(report_of(mill), tmp_path_factory.mktemp("page") / "report.html")

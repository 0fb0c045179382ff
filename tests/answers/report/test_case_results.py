"""The section of a report about cases: a table, and curves over one number."""

from __future__ import annotations

import pytest

import tolstat
from tests.answers.page_checks import rows_of, table_under
from tests.study.chains import chain
from tolstat.answers.report.case_results import cases_section
from tolstat.document.blocks import Gallery, Table
from tolstat.render.screen import as_text

PLATES = {"a": "10 +-0.1 mm", "b": "9.6 +-0.1 mm"}


def section(cases, **more):
    study = chain("a - b", PLATES, cases=cases, **more)
    return cases_section(tolstat.report(tolstat.run(study)))


def of_kind(kind, blocks):
    return [block for block in blocks if isinstance(block, kind)]


def test_a_number_that_cases_change_is_an_axis():
    limits = {"gap": ">= 0.3 mm"}
    found = section({"b": ["9.65 mm", "9.60 mm", "9.55 mm"]}, limits=limits)
    (table,), (gallery,) = of_kind(Table, found.blocks), of_kind(Gallery, found.blocks)
    assert len(table.rows) == 3
    mean, fraction = (figure.picture.panels[0] for figure in gallery.figures)
    assert mean.at == pytest.approx([9.65e-3, 9.60e-3, 9.55e-3])
    assert mean.x.label == "b, mm" and fraction.y.scale == "log"
    assert mean.layers[0].values == pytest.approx([0.35e-3, 0.4e-3, 0.45e-3], abs=1e-5)


def test_cases_of_other_kinds_have_a_table_alone():
    cases = {"thin": {"b": "9.5 mm"}, "other": {"gap": "a - b + 0*b"}}
    found = section(cases)
    assert of_kind(Table, found.blocks) and not of_kind(Gallery, found.blocks)
    assert section({}) is None


def test_the_condition_of_a_case_stands_with_its_name():
    cases, limits = {"b": ["9.65 mm", "9.55 mm"]}, {"gap": ">= 0.3 mm"}
    study = chain("a - b", PLATES, cases=cases, limits=limits)
    document = tolstat.report(tolstat.run(study)).document()
    first = rows_of(table_under(document, "Limits"))[0]["response"]
    assert as_text(first.main) == "gap_at_1, b 9.65 mm"
    assert as_text(first.below) == "a - b"

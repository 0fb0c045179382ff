"""The results of a report by case: a table, and figures over what the cases change."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from tolstat.answers.cells import ppm
from tolstat.answers.report.first_page import CASES
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.response_summary import ReportedResponse
from tolstat.deviations.names import IN_CASE
from tolstat.document import blocks, plot
from tolstat.document.inline import Number
from tolstat.document.sentences import text
from tolstat.model.case_changes import CaseAxis, case_axis, changes_of
from tolstat.model.setting_kinds import as_typed
from tolstat.model.view import Band, Level
from tolstat.units.scale import scale_of

MOST_SHOWN = 4  # responses in the table and the figures
LEAST_DRAWN = 3  # cases of a curve
MIDDLE = (0.05, 0.95)  # quantiles of a figure, about the mean
LEAST = 1e-7  # of a fraction, on an axis without zero
SAME = (
    "The units are the same in all cases. The yield of all limits counts units that "
    "meet them in every case."
)
Family = Mapping[str, ReportedResponse]  # one response by case


def cases_section(report: Report) -> blocks.Section | None:
    """Return mean, sigma and fraction out of limit by case; None without cases."""
    cases: dict[str, Any] = report.stored_run.study.table.get(CASES, {})
    if not cases:
        return None
    changes = changes_of(cases)
    families = _families(report, changes)
    rows: list[dict[str, blocks.Given]] = []
    for case, typed in changes.items():
        row: dict[str, blocks.Given] = {"case": case}
        row |= {name: as_typed(value) for name, value in typed.items()}
        for name, family in families.items():
            row |= _cells(name, family[case])
        rows.append(row)
    figures = list[blocks.Figure]()
    axis = case_axis(cases)
    if axis and len(axis.values) >= LEAST_DRAWN:
        for name, family in families.items():
            figures.append(_values(name, family, axis))
            if all(response.limited for response in family.values()):
                figures.append(_fractions(name, family, axis))
    return blocks.section(
        "Cases",
        blocks.table_of(rows),
        blocks.note(SAME),
        blocks.Gallery(tuple(figures)) if figures else None,
        anchor=CASES,
    )


def over_cases(report: Report, name: str) -> blocks.Figure | None:
    """Draw a response over what the cases change; None unless it is a number."""
    cases: dict[str, Any] = report.stored_run.study.table.get(CASES, {})
    axis, stem = case_axis(cases) if cases else None, name.rpartition(IN_CASE)[0]
    if axis is None or len(axis.values) < LEAST_DRAWN or not stem:
        return None
    names = (f"{stem}{IN_CASE}{case}" for case in changes_of(cases))
    return _values(stem, {name: report.responses[name] for name in names}, axis)


def _families(report: Report, cases: Iterable[str]) -> dict[str, Family]:
    """Return responses by name and case: those with limits, else the first ones."""
    responses = report.responses
    stems = dict.fromkeys(name.rpartition(IN_CASE)[0] for name in responses)
    families = {
        stem: {case: responses[f"{stem}{IN_CASE}{case}"] for case in cases}
        for stem in stems
    }
    limited = [
        stem
        for stem, family in families.items()
        if any(response.limited for response in family.values())
    ]
    return {stem: families[stem] for stem in (limited or [*stems])[:MOST_SHOWN]}


def _cells(name: str, response: ReportedResponse) -> dict[str, blocks.Given]:
    """Return the cells of a response in a case."""
    scale = response.scale
    cells: dict[str, blocks.Given] = {
        scale.label(f"{name} mean"): Number(response.mean.value, scale),
        scale.label(f"{name} sigma"): Number(response.sigma.value, scale),
    }
    if response.limited:
        share = response.limited.yields.fraction_out_of_limit
        cells[f"{name} out of limit, ppm"] = ppm(share)
    return cells


def _values(name: str, family: Family, axis: CaseAxis) -> blocks.Figure:
    """Draw the mean of a response, and where most of its trials lie, over the cases."""
    responses = [*family.values()]
    lower, upper = (
        np.array([response.quantiles[share].value for response in responses])
        for share in MIDDLE
    )
    mean = np.array([response.mean.value for response in responses])
    limits = dict.fromkeys(r.limited.limit for r in responses if r.limited)
    levels = [
        Level(end, "" if number else f"limit {limit.words}")
        for limit in limits
        for number, end in enumerate(limit.finite)
    ]
    return _figure(
        f"{name} by case", axis, plot.PlotAxis.of(name, responses[0].scale),
        plot.curve(axis.values, mean, name="mean", look="dotted"),
        Band("5 to 95 %", "", lower, upper, colour="first"), *levels,
        caption=f"Mean of {name}, and its 5 to 95 % quantiles, over {axis.name}.",
    )  # fmt: skip


def _fractions(name: str, family: Family, axis: CaseAxis) -> blocks.Figure:
    """Draw the fraction out of limit over the cases."""
    limits = [response.limited for response in family.values() if response.limited]
    shares = [limited.yields.fraction_out_of_limit for limited in limits]
    value, lower, upper = np.array([share[:3] for share in shares]).T
    permitted = {1 - limited.limit.demanded for limited in limits}
    return _figure(
        f"Fraction of {name} out of limit by case", axis,
        plot.PlotAxis("out of limit, ppm", "log", factor=1e6),
        plot.curve(
            axis.values, np.where(value > 0, value, np.nan), name="trials",
            look="dotted",
        ),
        Band("95 %", "", np.maximum(lower, LEAST), upper, colour="first"),
        *(Level(share, "permitted") for share in permitted),
        caption=f"Fraction of {name} out of limit, with 95 % intervals, over "
        f"{axis.name}.",
    )  # fmt: skip


def _figure(
    alt: str, axis: CaseAxis, y: plot.PlotAxis, *layers: plot.Layer, caption: str
) -> blocks.Figure:
    """Return a figure over the numbers of the cases, ascending."""
    x = plot.PlotAxis.of(axis.name, scale_of(axis.unit, axis.shown))
    panel = plot.PlotPanel(x, y, layers, at=axis.values)
    return blocks.Figure(alt, plot.Plot((panel,)), text(caption))

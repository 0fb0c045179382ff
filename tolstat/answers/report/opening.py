"""What one sees first of a report: tiles, and pictures of what decides."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tolstat.answers.cells import demand_words, limit_row
from tolstat.answers.report.case_results import over_cases
from tolstat.answers.report.chain_figures import chain_of, vectors, waterfall
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.report.response_figures import (
    SCATTERED,
    figure_of,
    histogram,
    pareto,
)
from tolstat.answers.report.response_summary import ReportedResponse
from tolstat.answers.sampled_trials import Drawn, drawn_trials
from tolstat.answers.sketches import sketch_of
from tolstat.document import blocks, plot
from tolstat.document.blocks import Cell, Columns, Sketch, Tile, Tiles
from tolstat.document.inline import Name, Number
from tolstat.document.sentences import say, text
from tolstat.model.view import Level
from tolstat.statistics.summary import Performance
from tolstat.units.scale import PER_CENT, PPM

MOST_PARETO = 5  # bars on the first page
MOST_WITHIN = 1500  # trials within the limit that are drawn as points
FEW_LIMITS = 2  # more leave room for two pictures on a printed sheet
LOW = 1.8  # inches: height of a picture on the first page


def deciding(report: Report) -> str:
    """Return the response that decides; without a limit the first in focus."""
    return next(iter(report.limits), report.focus[0])


def opening(report: Report) -> tuple[blocks.Block, ...]:
    """Return tiles and pictures of the response that decides.

    Nothing until a trial is done, and of weighted trials, which are not spread as
    units are.
    """
    drawn = drawn_trials(report.stored_run)
    if drawn is None or not report.trials.done or drawn.sample.weights:
        return ()
    name = deciding(report)
    return _tiles(report, name), _pictures(report, drawn, name)


def _tiles(report: Report, name: str) -> Tiles:
    """Return verdict, fraction out of limit, Ppk and yield of what decides."""
    response, trials = report.responses[name], report.trials
    limited, together = response.limited, report.all_limits
    if limited is None or together is None:
        return Tiles(())
    ran = trials.done + trials.failed
    alone = together.limits == 1
    row = limit_row(limited, ran, trials.failed, report.stopped)
    cells = {head: blocks.cell_of(cell) for head, cell in row.items()}
    out = cells["out of limit, ppm"]
    permitted = f"permitted {PPM.number(1 - limited.limit.demanded)}"
    method, indices = _performance(response)
    width = say("Pp {}", Number(indices.pp.value)) if indices.pp.sure else ()
    decides, demand = "" if alone else "decides: ", demand_words(limited.limit)
    tiles = {
        text(decides, Name(name), f" {limited.limit.words} for {demand}"): (
            cells["verdict"]
        ),
        text("out of limit, ppm"): out._replace(
            below=text(f"{permitted}; " if out.below else permitted, out.below)
        ),
        text(f"Ppk by {method}"): Cell((Number(indices.ppk),), width),
        text("equivalent Ppk"): cells["equivalent Ppk"],
        text(f"yield, {'this limit' if alone else 'all limits'}, %"): Cell(
            (Number(together.within, PER_CENT, of=ran),)
        ),
    }
    return Tiles(tuple(Tile(label, cell) for label, cell in tiles.items()))


def _performance(response: ReportedResponse) -> tuple[str, Performance]:
    """Return the method and its indices: by moments unless the tails are not normal."""
    limited = response.limited
    assert limited
    if response.normal_tails is False or not limited.moments.ppk.sure:
        return "percentiles", limited.percentiles
    return "moments", limited.moments


def _pictures(report: Report, drawn: Drawn, name: str) -> Columns:
    """Return the histogram, and the chain or where units fail."""
    response = report.responses[name]
    if response.still or not len(drawn.done(name)):
        return Columns((), ())
    values = histogram(drawn, name, response, LOW, marked=())
    if cases := over_cases(report, name):
        return Columns(
            (values,), (replace(cases, picture=cases.picture._replace(height=LOW)),)
        )
    if chain := chain_of(report, name):
        if len(report.limits) > FEW_LIMITS:
            return Columns((values,), (waterfall(chain),))
        left = blocks.shown(values, vectors(chain))
        return Columns(left, blocks.shown(waterfall(chain), _shares(response)))
    where = _where_units_fail(drawn, name, response) or _shares(response)
    return Columns((values,), blocks.shown(where))


def _shares(response: ReportedResponse) -> blocks.Figure | None:
    return pareto(response, MOST_PARETO)


def _where_units_fail(
    drawn: Drawn, name: str, response: ReportedResponse
) -> blocks.Figure | None:
    """Draw trials out of limit over what causes them; None without a cause."""
    causes, run = response.causes, drawn.run
    if causes is None or causes.main is None or response.limited is None:
        return None
    across, *rest = dict.fromkeys((*causes.main.members, *response.leading[:SCATTERED]))
    up = rest[0] if rest and len(causes.main.members) > 1 else name
    limit = response.limited.limit
    out = run.beyond(name)[drawn.trials][drawn.sample.done]
    within = np.flatnonzero(~out)[:MOST_WITHIN]
    scales = run.scales
    columns = {n: scales[n].factor * drawn.done(n) for n in (across, up)}
    layers: list[plot.Layer] = [
        plot.curve(columns[across][within], columns[up][within], look="faint"),
        plot.curve(columns[across][out], columns[up][out], "limit", look="dots"),
    ]
    if up == name:
        layers += [Level(scales[name].factor * end, "") for end in limit.finite]
    else:
        zone = (scales[n].factor * np.array(run.assumed[n].tolerance) for n in columns)
        (left, right), (low, high) = zone
        box = np.array([left, right, right, left, left])
        layers.append(plot.curve(box, np.array([low, low, high, high, low]), "ink"))
    x, y = (plot.PlotAxis(scales[n].label(n)) for n in (across, up))
    kind = "random trials" if run.thinned else "trials"
    drawn_within = f"{len(within)} of {np.count_nonzero(~out)} within are drawn"
    return figure_of(
        f"Trials of {name} out of limit, over {across} and {up}",
        x, y, *layers, height=LOW, caption=say(
            f"Main cause of {{}}: {causes.main.words}. Red: {np.count_nonzero(out)} "
            f"{kind} out of limit; {drawn_within}.", Name(name),
        ),
    )  # fmt: skip


def sketches_of(summary: RunSummary) -> Mapping[str, Sketch]:
    """Return a small histogram of each limited response, where trials are done."""
    drawn = drawn_trials(summary.stored_run)
    if drawn is None or drawn.sample.weights:
        return {}
    sketches = {}
    for name, limited in summary.limits.items():
        scale, values = summary.responses[name].scale, drawn.done(name)
        if sketch := sketch_of(name, values, limited.limit, scale):
            sketches[name] = sketch
    return sketches

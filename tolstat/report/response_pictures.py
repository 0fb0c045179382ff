"""What a response is owed to, how its estimate settles, how machines moved: drawn."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup
from matplotlib.ticker import NullLocator

from tolstat.machines.description import History
from tolstat.report.contributions_found import leading_contributors
from tolstat.report.distribution_pictures import ends_of
from tolstat.report.drawn import Drawn
from tolstat.report.page_picture import (
    BEYOND,
    INK,
    MOST_POINTS,
    WITHIN,
    few_ticks,
    inline,
    legend_above,
    page_figure,
)
from tolstat.report.picture import COLOURS, axis_label, factor
from tolstat.report.plain import Found, share_words
from tolstat.statistics.convergence import running
from tolstat.statistics.statistic import Statistic

MOST_BARS = 10
MISS = 0.025  # a quantile has an interval from log(MISS)/log(share) trials
SETTLING = 4  # times as many, so that there is something to see


def pareto(found: Found, kind: str = "contributions") -> Markup | None:
    """Draw the shares of the variance, the largest first; None without any.

    Parameters
    ----------
    found : dict
        What the findings say of the response.
    kind : str
        "contributions", from the trials at hand, or "indices", made for them.
    """
    if kind == "indices":
        first, total = found["indices"]["first"], found["indices"]["total"]
        rows = [("alone (first order)", first), ("with others (total)", total)]
    else:
        first = found["contributions"].get("first_order", {})
        rows = [("alone (first order)", first)]
    known = {name: each for name, each in first.items() if each["value"] is not None}
    if not known:
        return None
    leading = sorted(known, key=lambda name: -known[name]["value"])[:MOST_BARS]
    with page_figure(height=0.26 * len(leading) * len(rows) + 1.1) as figure:
        axes = figure.subplots()
        height = 0.36 if len(rows) > 1 else 0.7
        for row, (label, shares) in enumerate(rows):
            at = np.arange(len(leading)) + (0.4 * row if len(rows) > 1 else 0)
            value = 100 * np.array([shares[name]["value"] for name in leading])
            sure = all(shares[name]["lower"] is not None for name in leading)
            ends = [[shares[n][end] for n in leading] for end in ("lower", "upper")]
            axes.barh(
                at, value, height, color=COLOURS[row], label=label,
                xerr=np.abs(100 * np.array(ends) - value) if sure else None,
                error_kw={"ecolor": INK, "elinewidth": 0.8, "capsize": 2},
            )  # fmt: skip
        axes.set_yticks(np.arange(len(leading)), leading)
        axes.invert_yaxis()
        axes.set_xlabel("% of the variance")
        axes.grid(visible=False, axis="y")
        legend_above(axes)
        words = ", ".join(
            f"{name} {100 * known[name]['value']:.0f} %" for name in leading[:3]
        )
        return inline(figure, f"Contributions, the largest first: {words}")


def convergence(drawn: Drawn, name: str, found: Found) -> Markup:
    """Draw how the outermost quantile that has long had an interval settles.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : dict
        What the findings say of it.
    """
    sure = [
        share
        for share in (0.99865, 0.99, 0.95)
        if len(drawn.trials) >= SETTLING * math.log(MISS) / math.log(share)
    ]
    share = sure[0] if sure else 0.5
    values, scale = drawn.values(name), factor(found["unit"])
    limit = drawn.run.limits.get(name)
    words = f"{share_words(share)}, {found['shown_unit']}"
    asked = [(Statistic(name, "quantile", share), scale, words)]
    if limit:
        asked.append((Statistic(name, "beyond"), 100.0, "beyond, %"))
    with page_figure() as figure:
        every = figure.subplots(len(asked), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (statistic, times, label) in zip(every, asked, strict=True):
            found_so = running(statistic, values, drawn.sample, limit)
            axes.fill_between(
                found_so.trials, times * found_so.lower, times * found_so.upper,
                color=WITHIN, alpha=0.25, linewidth=0, label="95 % interval",
            )  # fmt: skip
            axes.plot(found_so.trials, times * found_so.value, color=WITHIN)
            axes.set_ylabel(label)
            axes.set_xscale("log")
            axes.xaxis.set_minor_locator(NullLocator())
            axes.xaxis.set_major_formatter("{x:g}")
            few_ticks(axes, "y")
        every[-1].set_xlabel("trials")
        legend_above(every[0])
        return inline(
            figure, f"Running estimate of {name} with its interval, as trials are added"
        )


def scatter(drawn: Drawn, name: str, found: Found) -> Markup | None:
    """Draw the response over its three leading contributors; None without any.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : dict
        What the findings say of it.
    """
    leading = leading_contributors(found)
    if not leading:
        return None
    done = drawn.sample.done
    response = factor(found["unit"]) * drawn.values(name)[done]
    units = drawn.run.units
    many = len(response) > MOST_POINTS
    with page_figure(width=2.4 * len(leading) + 0.6, height=2.5) as figure:
        every = figure.subplots(1, len(leading), sharey=True, squeeze=False)[0]
        for axes, contributor in zip(every, leading, strict=True):
            deviation = factor(units[contributor]) * drawn.values(contributor)[done]
            axes.plot(
                deviation, response, ".", color=WITHIN, markersize=2, alpha=0.35,
                markeredgewidth=0, rasterized=many,
            )  # fmt: skip
            axes.set_xlabel(axis_label(contributor, units[contributor]))
            few_ticks(axes)
            for end in ends_of(found):
                axes.axhline(
                    factor(found["unit"]) * end, color=BEYOND, linestyle="--",
                    linewidth=1,
                )  # fmt: skip
        every[0].set_ylabel(axis_label(name, found["unit"]))
        return inline(
            figure, f"{name} over its leading contributors: {', '.join(leading)}"
        )


def sketch(history: History, response: str, trial: int) -> Markup:
    """Draw a small picture of how a machine moved.

    Parameters
    ----------
    history : History
        Of the machine.
    response : str
        The panel with the curve of that name is drawn, else the first.
    trial : int
        Its number, for the words beside the picture.
    """
    panel = next(
        (each for each in history.panels if response in each.curves), history.panels[0]
    )
    curves = {curve.name: curve for curve in history.curves}
    with page_figure(width=1.9, height=0.55) as figure:
        figure.set_layout_engine("none")
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        axes.axvspan(*history.window, color=INK, alpha=0.06, linewidth=0)
        for name, colour in zip(panel.curves, COLOURS, strict=False):
            axes.plot(history.time, curves[name].values, color=colour, linewidth=0.8)
        words = ", ".join(panel.curves)
        return inline(figure, f"Trial {trial}: {words} over time")

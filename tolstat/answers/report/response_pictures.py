"""What a response is owed to, and how its estimate settles, drawn."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup
from matplotlib.ticker import NullLocator

from tolstat.answers.report.distribution_pictures import ends_of
from tolstat.answers.report.findings import (
    IndicesFindings,
    ResponseFindings,
    clear_of,
    leading_of,
)
from tolstat.answers.sampled_trials import Drawn
from tolstat.render.page_picture import (
    BEYOND,
    INK,
    MOST_POINTS,
    WITHIN,
    few_ticks,
    inline,
    legend_above,
    page_figure,
)
from tolstat.render.picture import COLOURS, logarithmic
from tolstat.render.plain import share_words
from tolstat.statistics.intervals.convergence import running
from tolstat.statistics.intervals.quantiles import trials_needed
from tolstat.statistics.intervals.statistic import Statistic
from tolstat.statistics.sensitivity.contributions import Contributions

MOST_BARS = 10
SCATTERED = 3  # contributors that a response is drawn over
SETTLING = 4  # times as many, so that there is something to see


def pareto(found: Contributions | IndicesFindings | None) -> Markup | None:
    """Draw the shares of the variance, the largest first; None without any.

    None either where a few machines decide the variance: bars would show noise. No bar
    is negative; intervals may be.

    Parameters
    ----------
    found : Contributions or IndicesFindings
        From the trials at hand, or made for them.
    """
    if found is None or found.few_decide:
        return None
    if isinstance(found, IndicesFindings):
        first = found.first
        rows = [("alone (first order)", first), ("with others (total)", found.total)]
    else:
        first = found.first_order
        rows = [("alone (first order)", first)]
    known = {n: each.value for n, each in first.items() if not math.isnan(each.value)}
    if not known:
        return None
    leading = sorted(known, key=lambda name: -known[name])[:MOST_BARS]
    with page_figure(height=0.26 * len(leading) * len(rows) + 1.1) as figure:
        axes = figure.subplots()
        height = 0.36 if len(rows) > 1 else 0.7
        for row, (label, shares) in enumerate(rows):
            at = np.arange(len(leading)) + (0.4 * row if len(rows) > 1 else 0)
            value = 100 * np.array([max(shares[name].value, 0.0) for name in leading])
            sure = all(shares[name].sure for name in leading)
            ends = [
                [shares[n].lower for n in leading],
                [shares[n].upper for n in leading],
            ]
            reach = np.array([[-1.0], [1.0]]) * (100 * np.array(ends) - value)
            axes.barh(
                at, value, height, color=COLOURS[row], label=label,
                xerr=np.maximum(reach, 0.0) if sure else None,
                error_kw={"ecolor": INK, "elinewidth": 0.8, "capsize": 2},
            )  # fmt: skip
        axes.set_yticks(np.arange(len(leading)), leading)
        axes.invert_yaxis()
        axes.set_xlabel("% of the variance")
        axes.grid(visible=False, axis="y")
        legend_above(axes)
        words = ", ".join(f"{name} {100 * known[name]:.0f} %" for name in leading[:3])
        return inline(figure, f"Contributions, the largest first: {words}")


def convergence(drawn: Drawn, name: str, found: ResponseFindings) -> Markup:
    """Draw how the outermost quantile that has long had an interval settles.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : ResponseFindings
        What is said of it.
    """
    sure = [
        share
        for share in (0.99865, 0.99, 0.95)
        if len(drawn.trials) >= SETTLING * trials_needed(share)
    ]
    share = sure[0] if sure else 0.5
    values, scale = drawn.values(name), found.scale.factor
    limit = found.limited.limit.permitted if found.limited else None
    words = found.scale.label(share_words(share))
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
            logarithmic(axes.xaxis)
            axes.xaxis.set_minor_locator(NullLocator())
            few_ticks(axes)
        every[-1].set_xlabel("trials")
        legend_above(every[0])
        return inline(
            figure, f"Running estimate of {name} with its interval, as trials are added"
        )


def scatter(drawn: Drawn, name: str, found: ResponseFindings) -> Markup | None:
    """Draw the response over its three leading contributors; None without any.

    Where a few machines decide its variance, only over what clearly differs among the
    machines beyond the limit.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : ResponseFindings
        What is said of it.
    """
    leading = leading_of(found.contributions, found.culprits)
    if found.contributions and found.contributions.few_decide:
        leading = clear_of(found.culprits)
    leading = leading[:SCATTERED]
    if not leading:
        return None
    response = found.scale.factor * drawn.done(name)
    scales = drawn.run.scales
    many = len(response) > MOST_POINTS
    with page_figure(width=2.35 * SCATTERED, height=2.4) as figure:
        # always as wide: the page gives it the same room, however few there are
        every = figure.subplots(1, SCATTERED, sharey=True, squeeze=False)[0]
        for axes in every[len(leading) :]:
            axes.set_axis_off()
        every = every[: len(leading)]
        for axes, contributor in zip(every, leading, strict=True):
            deviation = scales[contributor].factor * drawn.done(contributor)
            axes.plot(
                deviation, response, ".", color=WITHIN, markersize=2, alpha=0.35,
                markeredgewidth=0, rasterized=many,
            )  # fmt: skip
            axes.set_xlabel(scales[contributor].label(contributor))
            for end in ends_of(found):
                axes.axhline(
                    found.scale.factor * end, color=BEYOND, linestyle="--", linewidth=1
                )
            few_ticks(axes)
        every[0].set_ylabel(found.scale.label(name))
        return inline(
            figure, f"{name} over its leading contributors: {', '.join(leading)}"
        )

"""The interval of a fraction out of limit at each look of a stopping rule."""

import numpy as np

from tolstat.answers.report.full_report import Report
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.document import blocks, plot
from tolstat.document.sentences import text
from tolstat.model.view import Band, Level
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit, within
from tolstat.store.stored_run import Run
from tolstat.units.scale import PPM

TITLE = "Fraction out of limit over trials"
FEWEST = 2  # looks of a figure
LEAST = 100  # trials of the first one
MOST_DRAWN = 2  # limits, the worst


def narrowing(report: Report) -> blocks.Section:
    """Draw how the intervals of the worst limits narrow with trials.

    At the looks of a stopping rule, and at halves of its trials: intervals of
    independent trials are anytime-valid. An empty section without a rule.
    """
    run, figures = report.stored_run, list[blocks.Figure]()
    looks = sorted(_looks(run))
    for name, limited in [*report.limits.items()][:MOST_DRAWN]:
        shares = {n: _share(run.first(n), name, limited.limit) for n in looks}
        sure = {n: share for n, share in shares.items() if share.sure}
        if len(sure) >= FEWEST:
            figures.append(_figure(name, sure, 1 - limited.limit.demanded))
    columns = blocks.Columns(tuple(figures[::2]), tuple(figures[1::2]))
    return blocks.section(TITLE, columns, page_only=True)


def _looks(run: Run) -> set[int]:
    """Return numbers of trials: those of the rule, and halves of the last one."""
    looks = set(run.stopped.stages) if run.stopped else set[int]()
    if looks and run.sampled and not run.sampled.replicates:
        last = max(looks)
        looks |= {last >> k for k in range(last.bit_length()) if last >> k >= LEAST}
    if run.thinned:  # after its random trials, at the ends of stages
        looks = {run.thinned.in_whole_stages(n) or n for n in looks}
    return looks


def _share(run: Run, name: str, limit: Limit) -> Estimate:
    """Return the fraction out of limit of the trials of a run."""
    sampled = drawn_trials(run)
    assert sampled
    drawn = sampled.judged(1 - limit.demanded)
    sample = drawn.sample_for(name)
    good = within(drawn.values(name), limit.permitted) & sample.done
    return sample.share(~good, sample.ran)


def _figure(name: str, shares: dict[int, Estimate], most: float) -> blocks.Figure:
    trials = np.array([*shares], dtype=float)
    value, lower, upper = np.array([share[:3] for share in shares.values()]).T
    band = Band("95 % interval", "1", lower, upper, colour="first")
    layers = (
        band,
        plot.curve(trials, value, name=name, look="dotted"),
        Level(most, f"permitted {PPM.number(most)}"),
    )
    x = plot.PlotAxis("trials", "log")
    y = plot.PlotAxis.of("out of limit", PPM)
    last = PPM.interval(*list(shares.values())[-1][:3])
    return blocks.Figure(
        f"Fraction of {name} out of limit after {int(trials[-1])} trials, in ppm: "
        f"{last[0]} ({last[1]} to {last[2]})",
        plot.Plot((plot.PlotPanel(x, y, layers, at=trials),), height=2.2),
        text(f"{name}: 95 % intervals after so many trials, anytime-valid."),
    )  # fmt: skip

"""Document of several scenarios: yields, limits and responses as columns."""

from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.report.response_figures import (
    edges_of,
    figure_of,
    limit_rules,
    paired_figure,
)
from tolstat.answers.what_if.what_if_answer import Method, Scenarios, WhatIf
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.plot import CURVE_COLOURS, Layer, PlotAxis, curve
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.intervals.weighted_estimates import ENOUGH
from tolstat.units.scale import PER_CENT, share_words

MOST_DRAWN = 12  # responses: as on the page of a run
Row = dict[str, blocks.Given]
EVALUATED = (
    "{} of the scenario were evaluated with the seed of the run: the same parts, trial "
    "by trial. Worse: within in the baseline and out of limit in the scenario."
)


def scenarios_document(answer: Scenarios) -> blocks.Document:
    """Return yields, limits and responses of all scenarios, figures, notes."""
    notes = dict.fromkeys(note for x in answer.scenarios for note in notes_of(x))
    sides = ["baseline", *(scenario.words for scenario in answer.scenarios)]
    rows = _yields(answer), _limits(answer), _numbers(answer)
    titles = "Yield", "Limits", "Responses"
    return blocks.Document(
        f"{answer.title}: what if",
        blocks.shown(
            blocks.paragraph("Scenarios beside the baseline. All else stays."),
            *(
                blocks.table_of(
                    [{**head, **dict(zip(sides, cells, strict=True))}
                     for head, cells in table],
                    title, look="dense", words=sides,
                )
                for title, table in zip(titles, rows, strict=True)
            ),
            figures_of(answer.scenarios),
            *map(blocks.note, notes),
        ),
        (answer.run, answer.model),
    )  # fmt: skip


Cells = Iterator[tuple[Row, Sequence[blocks.Given]]]


def _yields(answer: Scenarios) -> Cells:
    """Yield the share of units within all limits."""
    both = [x.all_limits for x in answer.scenarios if x.all_limits]
    if both:
        yields = [both[0].baseline, *(x.scenario for x in both)]
        whose = "all limits" if yields[0].limits > 1 else "this limit"
        yield {"": f"{whose}, %"}, [Number(x.within, PER_CENT) for x in yields]


def _limits(answer: Scenarios) -> Cells:
    """Yield what limits are like: verdict, fraction out of limit, difference, Ppk."""
    for name, first in answer.scenarios[0].responses.items():
        responses = [x.responses[name] for x in answer.scenarios]
        sides = [first.baseline.limited, *(x.scenario.limited for x in responses)]
        less = [x.difference and x.difference.limit for x in responses]
        changes = [x and ppm(x.fraction_out_of_limit_difference) for x in less]
        limited = [x for x in sides if x]
        if len(limited) < len(sides):
            continue
        verdicts = [Word(x.yields.words, x.yields.verdict) for x in limited]
        shares = [ppm(x.yields.fraction_out_of_limit) for x in limited]
        yield _head(name, "limit"), [x.limit.words for x in limited]
        yield _head("", "verdict"), verdicts
        yield _head("", "out of limit, ppm"), shares
        yield _head("", "less the baseline, ppm"), [None, *changes]
        yield (
            _head("", "equivalent Ppk"),
            [ppk_cell(x.equivalent_ppk) for x in limited],
        )


def _numbers(answer: Scenarios) -> Cells:
    """Yield the numbers of responses."""
    for name, first in answer.scenarios[0].responses.items():
        scale = first.scale
        others = (scenario.responses[name].scenario for scenario in answer.scenarios)
        sides = [first.baseline, *others]
        unit = f", {scale.mark}" if scale.mark else ""
        yield _head(name, f"mean{unit}"), [Number(x.mean, scale) for x in sides]
        yield _head("", f"sigma{unit}"), [Number(x.sigma, scale) for x in sides]
        high = [Number(x.quantiles[0.95], scale) for x in sides]
        yield _head("", f"{share_words(0.95)}{unit}"), high


def _head(name: str, words: str) -> Row:
    return {"response": Name(name) if name else None, "": words}


def figures_of(scenarios: Sequence[WhatIf]) -> blocks.Section | None:
    """Draw baseline and scenarios over each other: histograms of limited responses.

    None of weighted trials, which are not spread as units are.
    """
    scenarios = [x for x in scenarios if x.method is Method.EVALUATED]
    if not scenarios:
        return None
    first = scenarios[0]
    names = [name for name, x in first.responses.items() if x.scenario.limited]
    names = (names or [*first.responses])[:MOST_DRAWN]
    figures = tuple(
        figure
        for name in names
        for figure in (_histograms(scenarios, name), *_pairs(scenarios, name))
        if figure
    )
    return blocks.section("Distributions", blocks.Gallery(figures), page_only=True)


def _pairs(scenarios: Sequence[WhatIf], name: str) -> Iterator[blocks.Figure]:
    """Draw the trials of a scenario over the same ones of the baseline.

    They have the same seed: a trial is the same unit in both.
    """
    for scenario in scenarios:
        response = scenario.responses[name]
        sides = scenario.baseline, scenario.scenario
        if response.scenario.limited is None or len({len(s.trials) for s in sides}) > 1:
            continue
        done = sides[0].sample.done & sides[1].sample.done
        if done.any():
            first, second = (side.values(name)[done] for side in sides)
            limits = response.baseline.limited, response.scenario.limited
            labels = "baseline", "scenario" if len(scenarios) == 1 else scenario.words
            yield paired_figure(name, response.scale, labels, (first, second), limits)


def _histograms(scenarios: Sequence[WhatIf], name: str) -> blocks.Figure | None:
    """Draw the values of a response in baseline and scenarios, as outlines."""
    response = scenarios[0].responses[name]
    times, scale = response.scale.factor, response.scale
    sides = {"baseline": scenarios[0].baseline} | {
        x.words: x.scenario for x in scenarios
    }
    columns = {words: drawn.done(name) for words, drawn in sides.items()}
    everything = np.concatenate([*columns.values()])
    if not len(everything):
        return None
    edges, layers = edges_of(everything), list[Layer]()
    for colour, (words, values) in zip(cycle(CURVE_COLOURS), columns.items()):
        heights = np.histogram(values, edges)[0].astype(float)
        outline = np.array([0.0, *np.repeat(heights, 2), 0.0])
        layers.append(curve(np.repeat(times * edges, 2), outline, colour, words))
    return figure_of(
        f"Histograms of {name}: {', '.join(columns)}",
        PlotAxis(scale.label(name)), PlotAxis("trials per bin"),
        *layers, *limit_rules(response.scenario, scale),
        caption=f"{name}, trials done: "
        + ", ".join(f"{len(x)} of {words}" for words, x in columns.items()),
    )  # fmt: skip


def notes_of(answer: WhatIf) -> Iterator[Parts]:
    """Yield the notes for readers of the numbers."""
    stored = counted(answer.trials, "stored trial")
    if answer.method is Method.EVALUATED:
        trials = counted(answer.trials, "trial")
        yield say(EVALUATED, trials)
    elif answer.method is Method.STORED:
        yield say("Limits change alone: of the {} of the run.", stored)
    else:
        yield say(
            "Nothing was simulated: {}, reweighted, have an effective sample size of "
            "{}.",
            stored,
            Number(answer.effective_sample_size),
        )
    sizes = {name: x.out_of_limit_sample_size for name, x in answer.responses.items()}
    small = [
        (Name(name), " ", Number(size))
        for name, size in sizes.items()
        if size is not None and size < ENOUGH
    ]
    if small:
        yield say(
            "Few out-of-limit trials decide these fractions; their effective sample "
            "size: {}. A fresh run tells more (`tolstat what-if ... --write "
            "STUDY.toml`).",
            listed(small),
        )
    yield from map(text, answer.notes)
    if answer.method is not Method.REWEIGHTED:
        yield text("Each number has its 95 % interval below it.")
        return
    weighted = any(x.baseline.weighted for x in answer.responses.values())
    yield text(
        "Each number has its 95 % interval below it: of fractions out of limit from "
        "weighted counts, of all others for any distribution.",
        None
        if weighted
        else " Fractions and verdicts of the baseline are anytime-valid, those of the "
        "scenario for a single look. So they may differ although the trials are equal.",
    )

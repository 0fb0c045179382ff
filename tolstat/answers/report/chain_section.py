"""What a report says of the chain of a response: its links, and three ways to judge."""

import math
from collections.abc import Iterator

from tolstat.answers.report.report_answer import Report
from tolstat.document import blocks
from tolstat.document.blocks import Block, Given
from tolstat.document.inline import Name, Number, with_unit
from tolstat.model.description import Contributor
from tolstat.statistics.summary import HIGH, LOW, MIDDLE
from tolstat.store.stored_run import Run
from tolstat.units.scale import Ratio, Scale

FIGURES = 10  # of a nominal value, which is exact
NORMAL_SCORE = 3.0  # of the quantiles LOW and HIGH
AS_DRAWN = (
    "Slopes are those at the nominal trial: by how much the response grows with a link."
)
THREE_WAYS = (
    "Worst case: all links within their tolerances. Root sum square: a normal response "
    "with these slopes, 0.135 % and 99.865 % are three sigma from the mean. Monte "
    "Carlo: the trials."
)


def chain_blocks(report: Report, name: str) -> tuple[Block | None, ...]:
    """Return the links as on the drawing, and worst case, root sum square, trials.

    Nothing unless the model knows the worst case itself, as a chain does.
    """
    run = report.stored_run
    if not any(number.of == name and number.worst for number in run.numbers):
        return ()
    links = blocks.table_of([*_links(report, run, name)], words=["link", "direction"])
    ways = blocks.table_of([*_three_ways(report, name)], words=["answer"])
    return links, blocks.note(AS_DRAWN), ways, blocks.note(THREE_WAYS)


def _links(report: Report, run: Run, name: str) -> Iterator[dict[str, Given]]:
    """Yield a row for each link with a nominal value on which the response depends."""
    response = report.responses[name]
    for part in run.contributors:
        slope = response.slopes.get(part.name, 0.0)
        if part.size is None or not slope:
            continue
        assumed, scale = run.assumed[part.name], run.scales[part.name]
        lower, upper = assumed.tolerance
        yield {
            "link": Name(part.name),
            "nominal": size_words(run, part, 0.0),
            "upper deviation": _deviation(run, part, upper),
            "lower deviation": _deviation(run, part, lower),
            "mean": _without_zeros(size_words(run, part, assumed.mean)),
            "direction": "increasing" if slope > 0 else "decreasing",
            "slope": with_unit(Number(slope, Ratio(response.scale, scale))),
        }


def size_words(run: Run, part: Contributor, deviation: float) -> str:
    """Return the size of a part with a deviation, in the unit shown.

    It has as many decimals as its deviation and its nominal value need.
    """
    scale, size = run.scales[part.name], part.size or 0.0
    nominal = f"{scale.factor * size:.{FIGURES}g}"
    decimals = max(scale.place or 0, len(nominal.partition(".")[2]))
    number = scale.factor * (size + deviation)
    exact = f"{number:.{decimals}f}" if deviation else nominal
    return f"{exact} {scale.mark}".strip()


def _without_zeros(words: str) -> str:
    number, _, unit = words.partition(" ")
    if "." in number:
        number = number.rstrip("0").rstrip(".")
    return f"{number} {unit}".strip()


def _deviation(run: Run, part: Contributor, deviation: float) -> str:
    if not math.isfinite(deviation):
        return ""
    scale = run.scales[part.name]
    sign = "+" if deviation > 0 else ""
    return f"{sign}{scale.factor * deviation:.{FIGURES}g} {scale.mark}".strip()


def _three_ways(report: Report, name: str) -> Iterator[dict[str, Given]]:
    """Yield rows: what worst case, root sum square and trials say."""
    response, run = report.responses[name], report.stored_run
    linear, scale = response.root_sum_square, response.scale
    worst = {n.worst: n.value for n in run.numbers if n.of == name and n.worst}
    middle = 0.5 * sum(worst.values()) if len(worst) == 2 else math.nan
    mean, sigma = (linear.mean, linear.sigma) if linear else (math.nan, math.nan)
    quantiles = response.quantiles
    low, high = mean - NORMAL_SCORE * sigma, mean + NORMAL_SCORE * sigma
    rows = (
        ("mean", middle, mean, response.mean),
        ("sigma", math.nan, sigma, response.sigma),
        ("least, 0.135 %", worst.get("least", math.nan), low, quantiles[LOW]),
        ("50 %", math.nan, mean, quantiles[MIDDLE]),
        ("largest, 99.865 %", worst.get("largest", math.nan), high, quantiles[HIGH]),
    )
    head = f"{{}}, {scale.mark}" if scale.mark else "{}"
    for answer, of_worst, of_linear, of_trials in rows:
        yield {
            "answer": answer,
            head.format("worst case"): _number(of_worst, scale),
            head.format("root sum square"): _number(of_linear, scale),
            head.format("Monte Carlo"): Number(of_trials, scale),
        }


def _number(value: float, scale: Scale) -> Number | None:
    return None if math.isnan(value) else Number(value, scale)

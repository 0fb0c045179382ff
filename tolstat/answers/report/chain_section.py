"""What a report says of the chain of a response: its links, and three ways to judge."""

import math
from collections.abc import Iterator

from tolstat.answers.cells import ppm
from tolstat.answers.report.full_report import Report
from tolstat.answers.sketches import sketch_of
from tolstat.document import blocks
from tolstat.document.blocks import Block, Cell, Given
from tolstat.document.inline import Name, Number
from tolstat.document.sentences import text, with_unit
from tolstat.model.description import Contributor
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.summary import HIGH, LOW, MIDDLE
from tolstat.store.stored_run import Run
from tolstat.units.scale import PPM, Ratio, Scale

FIGURES = 10  # of a nominal value, which is exact
NORMAL_SCORE = 3.0  # of the quantiles LOW and HIGH
AS_DRAWN = (
    "Slopes are those at the nominal trial: by how much the response grows with a link."
)
NO_LINEAR_PART = "no linear part at the nominal: all slopes are zero"
THREE_WAYS = (
    "Worst case: all links within their tolerances. Root sum square: a normal response "
    "with these slopes. Least and largest of it and of the trials (Monte Carlo): "
    "0.135 % lie outside each."
)


def chain_blocks(report: Report, name: str) -> tuple[Block | None, ...]:
    """Return the links as on the drawing, and worst case, root sum square, trials.

    Nothing unless the model knows the worst case itself, as a chain does.
    """
    if not is_chain(report.stored_run, name):
        return ()
    links = links_table(report, name)
    ways = three_ways(report, name)
    return links, blocks.note(AS_DRAWN), ways, blocks.note(THREE_WAYS)


def is_chain(run: Run, name: str) -> bool:
    """Whether the model knows the worst case of a response, as a chain does."""
    return any(number.of == name and number.worst for number in run.numbers)


def links_table(report: Report, name: str, *, brief: bool = False) -> blocks.Table:
    """Return the links on which a response depends, as on the drawing.

    A brief one is without means and slopes.
    """
    rows = [*_links(report, report.stored_run, name)]
    for row in rows if brief else ():
        del row["mean"], row["slope"]
    words = ["link", "direction", "distribution"]
    return blocks.table_of(rows, words=words, look="dense")


def _links(report: Report, run: Run, name: str) -> Iterator[dict[str, Given]]:
    """Yield a row for each link with a nominal value on which the response depends."""
    response = report.responses[name]
    drawn = {
        each: (sample.lower, sample.upper)
        for sample in run.measured
        for each in sample.contributors
    }
    as_measured = {
        n for sample in run.measured if not sample.fit for n in sample.contributors
    }
    for part in run.contributors:
        slope = response.slopes.get(part.name, 0.0)
        if part.size is None or not (slope or response.no_linear_part):
            continue
        direction = "increasing" if slope > 0 else "decreasing"
        assumed, scale = run.assumed[part.name], run.scales[part.name]
        lower, upper = drawn.get(part.name, assumed.tolerance)
        yield {
            "link": Name(part.name),
            "nominal": size_words(run, part, 0.0),
            "upper deviation": _deviation(run, part, upper),
            "lower deviation": _deviation(run, part, lower),
            "mean": _without_zeros(size_words(run, part, assumed.mean)),
            "direction": direction if slope else "none at the nominal",
            "slope": with_unit(Number(slope, Ratio(response.scale, scale))),
            "sigma": with_unit(Number(assumed.sigma, scale)),
            "distribution": _measured(report, part.name)
            if part.name in as_measured
            else assumed.words,
        }


def _measured(report: Report, name: str) -> Cell:
    """Return a small histogram of measured parts within their tolerance."""
    run = report.stored_run
    sample = next(x for x in run.measured if name in x.contributors)
    drawing = Limit(sample.lower, sample.upper)
    sketch = sketch_of(name, sample.values, drawing, run.scales[name])
    return Cell(text("measured"), (), sketch)


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


def three_ways(report: Report, name: str) -> blocks.Table:
    """Return what worst case, root sum square and trials say, with 0.135 % outside."""
    response, run = report.responses[name], report.stored_run
    linear, scale = response.root_sum_square, response.scale
    quantiles = response.quantiles
    worst = {n.worst: n.value for n in run.numbers if n.of == name and n.worst}
    least, largest = worst.get("least", math.nan), worst.get("largest", math.nan)
    unit = f", {scale.mark}" if scale.mark else ""
    numbers = ("mean", "sigma", "least", "50 %", "largest")
    middle = 0.5 * (least + largest)
    reach = NORMAL_SCORE * linear.sigma if linear else math.nan
    ways: dict[str, list[Estimate | float]] = {
        "worst case": [middle, math.nan, least, math.nan, largest],
        "root sum square": [
            linear.mean, linear.sigma, linear.mean - reach, linear.mean,
            linear.mean + reach,
        ] if linear else [],
        "Monte Carlo": [
            response.mean, response.sigma, quantiles[LOW], quantiles[MIDDLE],
            quantiles[HIGH],
        ],
    }  # fmt: skip
    words = dict[str, str]()
    if response.no_linear_part:
        words["root sum square"] = f"root sum square: {NO_LINEAR_PART}"
    rows: dict[str, dict[str, Given]] = {
        way: {"answer": words.get(way, way)} | {
            f"{head}{unit}": _number(value, scale)
            for head, value in zip(numbers, values, strict=False)
        }
        for way, values in ways.items()
    }  # fmt: skip
    if limited := response.limited:
        out, ppk = "ppm", "Ppk"
        if linear:
            permitted = limited.limit.permitted
            rows["root sum square"] |= {
                out: Number(linear.fraction_out(permitted), PPM),
                ppk: Number(linear.ppk(permitted)),
            }
        rows["Monte Carlo"] |= {
            out: ppm(limited.yields.fraction_out_of_limit, report.trials.done),
            ppk: Number(limited.moments.ppk),
        }
    return blocks.table_of(rows.values(), words=["answer"], look="dense")


def _number(value: Estimate | float, scale: Scale) -> Number | None:
    if isinstance(value, float) and math.isnan(value):
        return None
    return Number(value, scale)

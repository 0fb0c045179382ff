"""A document as a self-contained page of HTML."""

import math
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.document.blocks import (
    Animated,
    Cell,
    Document,
    Figure,
    Ranges,
    Section,
    Sketch,
)
from tolstat.document.inline import (
    Inline,
    Link,
    Name,
    Number,
    Parts,
    Typed,
    Word,
    Written,
    in_cell,
    in_line,
)
from tolstat.literal import visible

# five digits or more before a point, in groups of three with thin spaces
LONG, THIN = re.compile(r"(?<![\d.])\d{5,}(?!\d*e)"), "\u202f"
GENERATOR = '<meta name="generator" content="tolstat">'  # in each page
MOST_DECADES = 5  # along the axis of intervals
BELOW = 0.07  # of that axis, linear from 0 to its first power of ten


def page(document: Document, run: str = "") -> str:
    """Return the page of a document: HTML with its style and pictures.

    Each number has its full value beside it, SI, for programs (`data-value`). `run`
    identifies the run file of which it is the report; see `mark_of`.
    """
    style = files("tolstat.render").joinpath("templates/page.css").read_text("utf-8")
    contents = [
        b for b in document.blocks if isinstance(b, Section) and b.anchor and b.title
    ]
    foot = _css_string(" · ".join(filter(None, document.foot)))
    template = environment().get_template("document.html")
    html: str = template.render(
        document=document, style=Markup(style), foot=foot, contents=contents,
        region=Regions(),
        marks=[Markup(mark) for mark in (run and mark_of(run), GENERATOR) if mark],
    )  # fmt: skip
    return html


def explore_page(sources: Mapping[str, str], data: str, **words: Any) -> str:
    """Return a page with scripts: its sources by name, and the words of its template.

    The words are escaped; the data are JSON that may stand in a page.
    """
    base = files("tolstat.render").joinpath("templates/page.css").read_text("utf-8")
    parts = {name: Markup(text) for name, text in sources.items()}
    parts |= {"style": Markup(base) + parts["style"], "data": Markup(data)}
    return environment().from_string(sources["page"]).render(**parts, **words)


def mark_of(run: str) -> str:
    """Return what names a run file in the head of its page, by `identity`."""
    return f'<meta name="run" content="{run}">'


@cache  # templates are compiled once
def environment() -> Environment:
    """Return the template environment: texts are escaped, names must exist."""
    templates = Environment(
        loader=PackageLoader("tolstat.render"),
        autoescape=True,
        finalize=lambda text: visible(text) if type(text) is str else text,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(parts=_parts, cell=_cell, breaking=_breaking, svg=_svg)
    templates.filters.update(track=Track, digits=_digits, moving=_moving)
    return templates


def _svg(figure: Figure) -> Markup:
    from tolstat.render.drawing import as_svg  # a page without figures needs none

    return as_svg(figure.picture, figure.alt)


def _moving(block: Animated) -> Any:
    from tolstat.render.moving import as_moving  # seldom needed

    return as_moving(block.scene, block.alt)


def _parts(parts: Parts) -> Markup:
    """Return the parts of a sentence as HTML."""
    return Markup("").join(map(_inline, parts))


def _inline(part: Inline) -> Markup:
    match part:
        case Number():
            return _written(in_line(part))
        case Name(text, link):
            words = Markup(f"<bdi>{_breaking(text)}</bdi>")
            return Markup('<a href="#{}">{}</a>').format(link, words) if link else words
        case Word(text, tone):
            if tone == "strong":
                return Markup("<strong>{}</strong>").format(visible(text))
            if tone == "limit":
                ends = escape(visible(text)).split("..")
                return Markup('<span class="whole">{}</span>').format(
                    Markup("..<wbr>").join(ends)
                )
            name = tone.replace(" ", "-")
            return Markup('<span class="verdict {}">{}</span>').format(name, text)
        case Link(text, target):
            return Markup('<a href="{}">{}</a>').format(quote(target), visible(text))
        case Typed():
            return Markup("<code>{}</code>").format(visible(part.text))
        case _:
            return escape(visible(part))


def _written(written: Written) -> Markup:
    """Return a number as HTML; no line ends between its digits and its unit."""
    html = "".join(
        escape(part)
        if isinstance(part, str)
        else f'<span data-value="{part.value!r}">{_digits(part.text)}</span>'
        for part in written
    )
    return Markup(f'<span class="whole">{html}</span>')


def _digits(text: str) -> Markup:
    """Return digits in groups; no line ends before an exponent."""
    grouped = LONG.sub(lambda m: f"{int(m[0]):,}".replace(",", THIN), visible(text))
    return Markup(re.sub(r"\S+e-\d+", r"<bdi>\g<0></bdi>", str(escape(grouped))))


def _cell(cell: Cell) -> Markup:
    """Return a number above its interval, or words above smaller ones."""
    below = Markup("")
    main = Markup("")
    if len(cell.main) == 1 and isinstance(cell.main[0], Number):
        value, under = in_cell(cell.main[0])
        main += _written(value) if value else ""
        if under:
            words = _written(under) if len(under) > 1 else escape(visible(str(*under)))
            below += Markup(f'<span class="range">{words}</span>')
    else:
        main += _parts(cell.main)
    if cell.below:
        below += Markup(f'<span class="range">{_parts(cell.below)}</span>')
    return main + below + (_sketch(cell.sketch) if cell.sketch else "")


def _sketch(sketch: Sketch) -> Markup:
    """Return a small histogram as SVG, its limits as upright lines."""
    seen = *sketch.edges, *sketch.ends
    first, last = min(seen), max(seen)
    places = [100 * (x - first) / (last - first) for x in seen]
    edges, ends = places[: len(sketch.edges)], places[len(sketch.edges) :]
    bars = zip(edges, edges[1:], sketch.heights, sketch.out_of_limit, strict=False)
    paths = ["", ""]
    for left, right, height, out in bars:
        if height:
            top = 20 * (1 - height)
            paths[out] += f"M{left:.1f} 20V{top:.1f}H{right:.1f}V20"
    paths.append("".join(f"M{x:.1f} 0V20" for x in ends))
    kinds = zip(paths, ("bar", "out", "end"), strict=True)
    drawn = (Markup('<path class="{}" d="{}"/>').format(k, d) for d, k in kinds if d)
    head = '<svg class="sketch" role="img" aria-label="{}" viewBox="0 0 100 20">'
    return Markup(f"{head}{{}}</svg>").format(visible(sketch.alt), Markup().join(drawn))


def _breaking(name: str) -> Markup:
    """Return a name whose line may end behind any _."""
    return Markup("_<wbr>").join(escape(visible(name)).split("_"))


def _css_string(text: str) -> str:
    """Return a text for a style sheet, escaped."""
    plain = (c if c.isalnum() else f"\\{ord(c):x} " for c in visible(text))
    return '"' + "".join(plain) + '"'


class Regions:
    """The parts of a page that scroll: reached by keyboard, each by its own name."""

    def __init__(self) -> None:
        self._times: dict[str, int] = {}

    def __call__(self, name: str) -> Markup:
        """Return the attributes of a part; a name that is taken gets its number."""
        times = self._times[name] = self._times.get(name, 0) + 1
        name = f"{name} ({times})" if times > 1 else name
        attributes = 'role="region" tabindex="0" aria-label="{}"'
        return Markup(attributes).format(visible(name))


class Track:
    """The logarithmic axis of intervals against a level, from 0 to above all values.

    `ticks` are its numbers, as shown.
    """

    def __init__(self, ranges: Ranges) -> None:
        self.times, rows = ranges.scale.factor, ranges.rows
        levels = [self.times * row.level for row in rows]
        seen = [self.times * x for row in rows for x in (row.found[0], row.found[2])]
        seen = [x for x in (*seen, *levels, min(levels) / 100) if 0 < x < math.inf]
        self.last = math.ceil(math.log10(max(seen)) - 1e-9)
        first = math.floor(math.log10(min(seen)))
        self.first = max(first, self.last - MOST_DECADES)
        powers = range(self.first, self.last + 1)
        self.ticks = (0.0, *(10.0**power for power in powers))
        self.shared = f"{ranges.level} {min(levels):.4g}" if len({*levels}) == 1 else ""

    def percent(self, value: float) -> float:
        """Return where a value, SI, lies: in % of the axis."""
        x = self.times * value
        part = BELOW * x / 10.0**self.first
        if part > BELOW:
            decades = (math.log10(x) - self.first) / (self.last - self.first)
            part = BELOW + (1 - BELOW) * decades
        return round(100 * min(max(part, 0.0), 1.0), 2)

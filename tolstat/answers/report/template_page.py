"""The statistical tolerance report: one page that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.literal import visible
from tolstat.render.plain import key_words, share_words
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, KNOWN, PART, PER_CENT, PPM, Ratio, Scale

NAMED = 3  # contributors beside a worst trial
LONGEST = 60  # characters of a title at the foot of a sheet
WORDS = {
    "%": PER_CENT,
    "ppm": PPM,
    "plain": AS_IS,
    "part": PART,
    "level": PER_CENT.beside(1.0),  # that of chance: no test is better than that
}

Path = Sequence[Any]  # the way to a number: names, keys, places


@cache  # templates are compiled once
def environment() -> Environment:
    """Return where pages are made: every text is escaped, every name must exist."""
    made = Environment(
        loader=PackageLoader("tolstat.render"),
        autoescape=True,
        finalize=lambda each: visible(each) if type(each) is str else each,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.globals["infinity"] = math.inf
    made.filters["breaking"] = _breaking
    made.filters["limit"] = _limit
    return made


def _breaking(name: str) -> Markup:
    """Let a long name end its line behind any _ of it."""
    return Markup("_<wbr>").join(escape(visible(name)).split("_"))


def _limit(words: str) -> Markup:
    """Let the words of a limit end their line behind .. and at blanks, in no number."""
    ends = Markup("..<wbr>").join(escape(visible(words)).split(".."))
    return Markup('<span class="whole">{}</span>').format(ends)


def style() -> Markup:
    """Return the style sheet that goes into a page."""
    text = files("tolstat.render").joinpath("templates/page.css").read_text("utf-8")
    return Markup(text)


class Numbers:
    """Prints numbers of findings by their path, and nothing else.

    Parameters
    ----------
    found : dataclass instance
        Findings.
    """

    def __init__(self, found: Any) -> None:
        self.found = found

    def at(self, path: Path) -> Any:
        """Return what lies at a path."""
        found: Any = self.found
        for key in path:
            if isinstance(found, Mapping) or isinstance(key, int):
                found = found[key]
            else:
                found = getattr(found, key)
        return found

    def show(
        self, path: Path, scale: Scale | Ratio | str = "%", bound: str = ""
    ) -> Markup:
        """Print a number with its full value beside it, for programs.

        Parameters
        ----------
        path : sequence
            Where it lies in the findings.
        scale : Scale, Ratio or str
            How it is shown; "%", "ppm" (a share per million), "fitted", "level",
            "demanded", "typed", "part" or "plain".
        bound : str
            "at_least" or "at_most" of a bound.
        """
        value = self.at(path)
        if isinstance(value, float) and math.isnan(value):
            return Markup("failed" if path[-1] == "nominal" else "none")
        joined = "/".join(key_words(key) for key in path)
        words = in_words(value, scale)
        of = self.at(path[:-1])
        shown = WORDS.get(scale) if isinstance(scale, str) else scale
        if isinstance(shown, Scale) and bound:
            words = getattr(shown, bound)(value)
        elif isinstance(shown, Scale) and isinstance(of, Estimate):
            words = shown.interval(*of[:3])[Estimate._fields.index(path[-1])]
        return Markup(
            f'<span data-value="{escape(repr(value))}" data-path="{escape(joined)}">'
            f"{escape(words).replace(' ', Markup(' <wbr>'))}</span>"
        )

    def estimate_line(self, path: Path, scale: Scale | str = "%") -> Markup:
        """Print an estimate in a line of text."""
        found: Estimate = self.at(path)
        if math.isnan(found.value):
            return Markup(escape(found.reason))
        text = self.show([*path, "value"], scale)
        if not found.sure:
            return text + Markup(f" ({escape(found.reason)})")
        ends = [self.show([*path, end], scale) for end in ("lower", "upper")]
        if ends[0].striptags() == ends[1].striptags() and found.value:
            return text
        return text + Markup(" (") + ends[0] + Markup(" .. ") + ends[1] + Markup(")")


def in_words(value: float, scale: Scale | Ratio | str) -> str:
    """Write a number as the page shows it; a whole number whole."""
    if isinstance(value, int):  # a truth value too
        return str(value)
    if scale == "demanded":
        return share_words(value).removesuffix(" %")
    if scale == "typed":
        return f"{value:.{KNOWN}g}"
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    return (WORDS[scale] if isinstance(scale, str) else scale).number(value)


def page_of(template: str, found: Any, **context: Any) -> str:
    """Make a page whose numbers are all printed from findings.

    Parameters
    ----------
    template : str
        Its name.
    found : dataclass instance
        Every number on the page is one of these.
    **context
        What else the template needs: its title.
    """
    numbers = Numbers(found)
    page: str = (
        environment()
        .get_template(template)
        .render(
            style=style(),
            f=found,
            at=numbers.at,
            show=numbers.show,
            estimate_line=numbers.estimate_line,
            **context,
        )
    )
    return page

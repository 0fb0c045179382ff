"""The statistical tolerance report: one page that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.answers.report import distribution_pictures as distributions
from tolstat.answers.report import response_pictures as pictures
from tolstat.answers.report.findings import (
    Culprit,
    Findings,
    ResponseFindings,
    leading_of,
)
from tolstat.answers.report.sketch import sketch
from tolstat.answers.report.verdict_sentences import (
    sentences_of,
    told_apart,
    worst_first,
)
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.literal import visible
from tolstat.render.plain import key_words, share_words
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.summary import QUANTILES
from tolstat.store.commands import to_replay
from tolstat.store.stored_run import Run
from tolstat.units.scale import AS_IS, KNOWN, PART, PER_CENT, PPM, Ratio, Scale

NAMED = 3  # contributors beside a worst trial
LONGEST = 60  # characters of a title at the foot of a sheet
WORDS = {
    "%": PER_CENT,
    "ppm": PPM,
    "fitted": distributions.FITTED,
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


Pictures = Mapping[str, Mapping[str, Markup | None]]


def make_page(run: Run, found: Findings, drawn: Pictures) -> str:
    """Make the report of a run.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    found : Findings
        Every number on the page is one of these.
    drawn : mapping
        Of `pictures_of`.

    Returns
    -------
    str
        HTML.
    """
    return page_of(
        "report.html",
        found,
        title=found.title,
        limited=[name for name, each in found.responses.items() if each.limited],
        sentences=sentences_of(found),
        told_apart=told_apart,
        leading=leading_response(found),
        sheet=_css_string(" · ".join(filter(None, _sheet(found)))),
        shares=QUANTILES,
        ranged=[r.name for r in run.responses if Reach(r.range).known],
        one_in=lambda share: math.floor(1 / share),
        share_words=share_words,
        thousands=lambda number: f"{number:,}".replace(",", " "),
        by_share={
            n: leading_of(r.contributions, r.culprits)
            for n, r in found.responses.items()
        },
        every=_contributors,
        by_level=_clearest_first,
        by_group=_largest_first,
        ratio=Ratio,
        parameter_scale=_parameter_scale,
        parameter_suffix=_parameter_suffix,
        named=NAMED,
        exact=run.sampled is not None and not run.sampled.replicates,
        scales=run.scales,
        pictures=drawn,
        sketches=_sketches(run, found),
        again=lambda trial: to_replay(run.path, trial, run.machine),
    )


def pictures_of(run: Run, found: Findings) -> Pictures:
    """Draw what a page shows of a run.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    found : Findings
        Of `findings_of`.

    Returns
    -------
    dict
        By response and kind of picture.
    """
    drawn = drawn_trials(run)
    assert drawn is not None  # there are no findings otherwise
    if not drawn.sample.done.any():
        return {name: {} for name in found.interest}  # nothing to be drawn
    return {
        name: {
            "histogram": distributions.histogram(drawn, name, each),
            "distribution": distributions.distribution(drawn, name, each),
            "pareto": pictures.pareto(each.contributions),
            "indices": pictures.pareto(each.indices) if each.indices else None,
            "convergence": pictures.convergence(drawn, name, each),
            "scatter": pictures.scatter(drawn, name, each),
        }
        for name, each in ((n, found.responses[n]) for n in found.interest)
    }


def leading_response(found: Findings) -> str:
    """Name the response that the first page shows: the worst of those limited."""
    shown = [name for name in worst_first(found.responses) if name in found.interest]
    return [*shown, *found.interest][0]


def _sheet(found: Findings) -> tuple[str, ...]:
    """Say what stands at the foot of each printed sheet."""
    document = found.document
    title = found.title[:LONGEST] + "..." * (len(found.title) > LONGEST)
    return document.drawing, document.revision, title, found.run


def _css_string(text: str) -> str:
    """Write a text for a style sheet, where none of it is an instruction."""
    plain = (c if c.isalnum() else f"\\{ord(c):x} " for c in visible(text))
    return '"' + "".join(plain) + '"'


def _sketches(run: Run, found: Findings) -> dict[tuple[str, int], Markup]:
    """Draw the worst trials of what is looked at closely."""
    return {
        (name, worst.trial): sketch(worst.sketch, worst.trial)
        for name in found.interest
        for worst in run.evidence.worst.get(name, ())
        if worst.sketch
    }


def _contributors(each: ResponseFindings) -> list[str]:
    """Name all contributors of which something is known, what matters first."""
    known = [*leading_of(each.contributions, each.culprits), *each.slopes]
    for case in each.worst_cases.values():
        known += [name for name, off in case.deviations.items() if off]
    return list(dict.fromkeys(known))


def _largest_first(contributions: Contributions) -> list[str]:
    def share(group: str) -> float:
        for shares in (contributions.together, contributions.groups):
            if not math.isnan(shares[group].value) and shares[group].value:
                return shares[group].value
        return 0.0

    return sorted(contributions.groups, key=lambda group: -share(group))


def _clearest_first(found: Mapping[str, Culprit]) -> list[str]:
    """Sort by how clearly it differs, then by what halving leaves beyond."""

    def place(name: str) -> tuple[float, float]:
        left = found[name].halved.value
        return found[name].level, math.inf if math.isnan(left) else left

    return sorted(found, key=place)


def _parameter_scale(each: ResponseFindings, key: str) -> Scale:
    """Tell how a parameter of a named distribution is shown."""
    assert each.distribution
    logarithmic = each.distribution.shape.name == "lognormal" or key == "shape"
    return AS_IS if logarithmic else each.scale


def _parameter_suffix(each: ResponseFindings, key: str) -> str:
    assert each.distribution
    if each.distribution.shape.name == "lognormal":
        unit = each.scale.unit
        of = "" if unit == "1" else f" of the number in {unit}"
        return f" (natural logarithm{of})"
    return "" if key == "shape" else f" {each.scale.mark}"

"""The statistical tolerance report: one page that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.literal import visible
from tolstat.reporting import distribution_pictures as distributions
from tolstat.reporting import response_pictures as pictures
from tolstat.reporting.drawn import drawn_trials
from tolstat.reporting.findings import Culprit, Findings, ResponseFindings, leading_of
from tolstat.reporting.plain import key_words, share_words
from tolstat.reporting.sketch import sketch
from tolstat.reporting.summary_table import AS_IS, PER_CENT
from tolstat.statistics.contributions import Contributions
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.moments import Reach
from tolstat.statistics.summary import QUANTILES
from tolstat.store.run import Run
from tolstat.units.scale import Scale

MATTERS = 0.05  # share of the variance from which a contributor is named
NAMED = 3  # contributors beside a worst trial
DEMANDED = 10  # digits of a share close to 1
WORDS = {"%": PER_CENT, "ppm": Scale("1", "ppm"), "plain": AS_IS}

Path = Sequence[Any]  # the way to a number: names, keys, places


def environment() -> Environment:
    """Return where pages are made: every text is escaped, every name must exist."""
    made = Environment(
        loader=PackageLoader("tolstat.reporting"),
        autoescape=True,
        finalize=lambda each: visible(each) if type(each) is str else each,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.globals["infinity"] = math.inf
    return made


def style() -> Markup:
    """Return the style sheet that goes into a page."""
    text = files("tolstat.reporting").joinpath("templates/page.css").read_text("utf-8")
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

    def show(self, path: Path, scale: Scale | str = "%") -> Markup:
        """Print a number with its full value beside it, for programs.

        Parameters
        ----------
        path : sequence
            Where it lies in the findings.
        scale : Scale or str
            How it is shown; "%", "ppm" (a share per million), "whole ppm" (no smaller
            one) or "plain".
        """
        value = self.at(path)
        if isinstance(value, float) and math.isnan(value):
            return Markup("failed" if path[-1] == "nominal" else "none")
        joined = "/".join(key_words(key) for key in path)
        return Markup(
            f'<span data-value="{escape(repr(value))}" data-path="{escape(joined)}">'
            f"{escape(in_words(value, scale))}</span>"
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
        return text + Markup(" (") + ends[0] + Markup(" .. ") + ends[1] + Markup(")")


def in_words(value: float, scale: Scale | str) -> str:
    """Write a number as the page shows it; a whole number whole."""
    if isinstance(value, int):  # a truth value too
        return str(value)
    if scale == "whole ppm":
        return f"{1e6 * value:.0f}" if value >= 1e-6 or value == 0 else "< 1"
    if scale == "demanded":
        return f"{100 * value:.{DEMANDED}g}"
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    return (scale if isinstance(scale, Scale) else WORDS[scale]).number(value)


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
    numbers = Numbers(found)
    template = environment().get_template("report.html")
    page: str = template.render(
        title=found.title,
        style=style(),
        f=found,
        at=numbers.at,
        show=numbers.show,
        estimate_line=numbers.estimate_line,
        limited=[name for name, each in found.responses.items() if each.limited],
        blame={name: _blame(name, each) for name, each in found.responses.items()},
        shares=QUANTILES,
        ranged=[r.name for r in run.responses if Reach(r.range).known],
        one_in=lambda share: math.floor(1 / share),
        share_words=share_words,
        thousands=lambda number: f"{number:,}".replace(",", " "),
        by_share={
            n: leading_of(r.contributions, r.culprits)
            for n, r in found.responses.items()
        },
        by_level=_clearest_first,
        by_group=_largest_first,
        parameter_scale=_parameter_scale,
        parameter_suffix=_parameter_suffix,
        named=NAMED,
        exact=run.sampled is not None and not run.sampled.replicates,
        scales=run.scales,
        pictures=drawn,
        sketches=_sketches(run, found),
    )
    return page


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


def _sketches(run: Run, found: Findings) -> dict[tuple[str, int], Markup]:
    """Draw the worst trials of what is looked at closely."""
    return {
        (name, worst.trial): sketch(worst.sketch, worst.trial)
        for name in found.interest
        for worst in run.evidence.worst.get(name, ())
        if worst.sketch
    }


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


class Blame(NamedTuple):
    """Who is to blame: paths of shares by name, and what is known of these.

    Attributes
    ----------
    shares : list of (str, path)
        At most three, the largest first.
    sure : bool
        Whether they have intervals.
    few_decide : bool
        Whether a few machines decide the variance: it is the least shares then.
    """

    shares: list[tuple[str, list[str]]]
    sure: bool
    few_decide: bool


def _blame(name: str, each: ResponseFindings) -> Blame:
    """Name who is to blame for the variance of a response: groups, and single parts."""
    found = each.contributions
    if found is None:
        return Blame([], True, False)
    grouped = {member for members in each.members.values() for member in members}
    single = [part for part in found.first_order if part not in grouped]
    known = {}
    for part in [*each.members, *single]:
        # what parts do together, where that can be told
        kinds = [
            kind
            for kind in ("together", "groups", "first_order")
            if not math.isnan(getattr(found, kind).get(part, UNKNOWN).value)
        ]
        if not kinds or (found.few_decide and kinds[0] != "together"):
            continue
        share = getattr(found, kinds[0])[part]
        size = share.lower if found.few_decide else share.value
        if size >= MATTERS and not (share.sure and share.lower <= 0):
            known[part] = size, ["responses", name, "contributions", kinds[0], part]
    leading = sorted(known, key=lambda part: -known[part][0])[:3]
    paths = [(part, known[part][1]) for part in leading]
    sure = all(getattr(found, path[-2])[part].sure for part, path in paths)
    return Blame(paths, sure, found.few_decide)


UNKNOWN = Estimate(math.nan)


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

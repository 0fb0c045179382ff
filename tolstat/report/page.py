"""The statistical tolerance report: one page that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.resources import files
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.report import distribution_pictures as distributions
from tolstat.report import response_pictures as pictures
from tolstat.report.contributions_found import leading_contributors
from tolstat.report.drawn import drawn_trials
from tolstat.report.numbers import in_engineering_unit, limit_in_words, number
from tolstat.report.plain import Found, share_words
from tolstat.statistics import summary
from tolstat.statistics.evidence import Evidence
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

SHARES = tuple(share_words(share) for share in summary.QUANTILES)
MATTERS = 0.05  # share of the variance from which a contributor is named


def environment() -> Environment:
    """Return where pages are made: every text is escaped, every name must exist."""
    return Environment(
        loader=PackageLoader("tolstat.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def style() -> Markup:
    """Return the style sheet that goes into a page."""
    text = files("tolstat.report").joinpath("templates/page.css").read_text("utf-8")
    return Markup(text)


class Numbers:
    """Prints numbers of findings by their path, and nothing else.

    Parameters
    ----------
    found : dict
        Findings.
    """

    def __init__(self, found: Found) -> None:
        self.found = found

    def at(self, path: Sequence[str | int]) -> Any:
        """Return what lies at a path."""
        found: Any = self.found
        for key in path:
            found = found[key]
        return found

    def show(self, path: Sequence[str | int], unit: str) -> Markup:
        """Print a number with its full value beside it, for programs.

        Parameters
        ----------
        path : sequence
            Where it lies in the findings.
        unit : str
            SI unit; "1" is shown in per cent; "ppm": a share per million; "plain": as
            it is.
        """
        value = self.at(path)
        if value is None:
            return Markup("failed" if path[-1] == "nominal" else "none")
        joined = "/".join(str(key) for key in path)
        words = in_words(value, unit)
        return Markup(
            f'<span data-value="{escape(repr(value))}" data-path="{escape(joined)}">'
            f"{escape(words)}</span>"
        )

    def estimate_line(self, path: Sequence[str | int], unit: str) -> Markup:
        """Print an estimate in a line of text."""
        found = self.at(path)
        if found["value"] is None:
            return Markup(escape(found["reason"]))
        text = self.show([*path, "value"], unit)
        if found["lower"] is None:
            return text + Markup(f" ({escape(found['reason'])})")
        ends = [self.show([*path, end], unit) for end in ("lower", "upper")]
        return text + Markup(" (") + ends[0] + Markup(" .. ") + ends[1] + Markup(")")


def in_words(value: float, unit: str) -> str:
    """Write a number as the page shows it; a whole number whole."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return str(value)
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    if unit == "ppm":
        return number(1e6 * value)
    if unit == "plain":
        return number(value)
    return in_engineering_unit(value, unit)


Pictures = dict[str, dict[str, Markup | None]]


def make_page(run: Run, found: Found, drawn: Pictures, evidence: Evidence) -> str:
    """Make the report of a run.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    found : dict
        Of `with_evidence`: every number on the page is one of these.
    drawn : dict
        Of `pictures_of`.
    evidence : Evidence
        Histories of the worst trials.

    Returns
    -------
    str
        HTML.
    """
    numbers = Numbers(found)
    responses = found["responses"]
    leading = {
        name: leading_contributors(responses[name]) for name in found["interest"]
    }
    template = environment().get_template("report.html")
    page: str = template.render(
        title=found["title"],
        style=style(),
        f=found,
        at=numbers.at,
        show=numbers.show,
        estimate_line=numbers.estimate_line,
        limited=[name for name in responses if responses[name]["limit"]],
        limit_words=lambda name: limit_in_words(
            run.limits[name], responses[name]["unit"]
        ),
        blame={name: _blame(name, each) for name, each in responses.items()},
        shares=SHARES,
        one_in=lambda share: f"{round(1 / float(share)):,}".replace(",", " "),
        by_share=lambda name: leading_contributors(responses[name], 10**6),
        by_group=lambda name: _largest_first(responses[name]["contributions"]),
        parameter_unit=_parameter_unit,
        parameter_suffix=_parameter_suffix,
        leading=leading,
        units=run.units,
        shown_unit=engineering_unit,
        done_key="done",
        pictures=drawn,
        sketches=_sketches(found, evidence),
    )
    return page


def pictures_of(run: Run, found: Found) -> Pictures:
    """Draw what a page shows of a run alone.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    found : dict
        Of `findings_of`.

    Returns
    -------
    dict
        By response and kind of picture.
    """
    drawn = drawn_trials(run)
    assert drawn is not None  # there are no findings otherwise
    return {
        name: {
            "histogram": distributions.histogram(drawn, name, each),
            "distribution": distributions.distribution(drawn, name, each),
            "pareto": pictures.pareto(each),
            "indices": pictures.pareto(each, "indices") if "indices" in each else None,
            "convergence": pictures.convergence(drawn, name, each),
            "scatter": pictures.scatter(drawn, name, each),
        }
        for name, each in ((n, found["responses"][n]) for n in found["interest"])
    }


def _sketches(found: Found, evidence: Evidence) -> dict[str, Markup]:
    """Draw the worst trials."""
    return {
        f"{name}/{worst['trial']}": pictures.sketch(
            evidence.histories[worst["trial"]], name, worst["trial"]
        )
        for name, each in found["responses"].items()
        for worst in each["worst_trials"]
        if worst["trial"] in evidence.histories and name in found["interest"]
    }


def _largest_first(contributions: Found) -> list[str]:
    shares, summed = contributions["together"], contributions["groups"]
    return sorted(
        summed, key=lambda n: -(shares[n]["value"] or summed[n]["value"] or 0.0)
    )


class Blame(NamedTuple):
    """Who is to blame: paths of shares by name, and whether they have intervals."""

    shares: list[tuple[str, list[str]]]
    sure: bool


def _blame(name: str, each: Found) -> Blame:
    """Name who is to blame for the variance of a response: groups, and single parts."""
    found = each.get("contributions")
    if not found:
        return Blame([], True)
    grouped = {member for members in found["members"].values() for member in members}
    known = {}
    for part in [
        *found["members"],
        *(n for n in found["first_order"] if n not in grouped),
    ]:
        # what parts do together, where that can be told
        kinds = [
            kind
            for kind in ("together", "groups", "first_order")
            if part in found[kind] and found[kind][part]["value"] is not None
        ]
        if not kinds:
            continue
        share = found[kinds[0]][part]
        sure = share["lower"] is not None
        if share["value"] >= MATTERS and not (sure and share["lower"] <= 0):
            known[part] = (share, ["responses", name, "contributions", kinds[0], part])
    leading = sorted(known, key=lambda part: -known[part][0]["value"])[:3]
    return Blame(
        [(part, known[part][1]) for part in leading],
        all(known[part][0]["lower"] is not None for part in leading),
    )


def _parameter_unit(each: Found, key: str) -> str:
    """Tell in which unit a parameter of a named distribution is shown."""
    logarithmic = each["distribution"]["name"] == "lognormal" or key == "shape"
    return "plain" if logarithmic else str(each["unit"])


def _parameter_suffix(each: Found, key: str) -> str:
    if each["distribution"]["name"] == "lognormal":
        unit = "" if each["unit"] == "1" else f" of the number in {each['unit']}"
        return f" (natural logarithm{unit})"
    return "" if key == "shape" else f" {each['shown_unit']}"

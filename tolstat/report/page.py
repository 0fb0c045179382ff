"""The statistical tolerance report: one page that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tolstat.report import response_pictures as pictures
from tolstat.report.drawn import Drawn, drawn_trials
from tolstat.report.numbers import in_engineering_unit, limit_in_words, number
from tolstat.statistics.evidence import Evidence
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

Found = dict[str, Any]
SHARES = ("0.135 %", "5 %", "50 %", "95 %", "99 %", "99.865 %")
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


def make_page(run: Run, found: Found, evidence: Evidence) -> str:
    """Make the report of a run.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    found : dict
        Of `findings_of`: every number on the page is one of these.
    evidence : Evidence
        Histories of the worst trials.

    Returns
    -------
    str
        HTML.
    """
    drawn = drawn_trials(run)
    assert drawn is not None  # there are no findings otherwise
    numbers = Numbers(found)
    responses = found["responses"]
    leading = {
        name: pictures.leading_contributors(responses[name])
        for name in found["interest"]
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
        blame={name: _blame(each) for name, each in responses.items()},
        shares=SHARES,
        one_in=lambda share: f"{round(1 / float(share)):,}".replace(",", " "),
        by_share=lambda name: pictures.leading_contributors(responses[name], 10**6),
        by_group=lambda name: _largest_first(responses[name]["contributions"]),
        parameter_unit=_parameter_unit,
        parameter_suffix=_parameter_suffix,
        leading=leading,
        deviation=lambda name, trial: _quantity(run, name, trial),
        pictures={name: _pictures(drawn, name, found) for name in found["interest"]},
        sketches=_sketches(found, evidence),
    )
    return page


def _pictures(drawn: Drawn, name: str, found: Found) -> dict[str, Markup | None]:
    each = found["responses"][name]
    return {
        "histogram": pictures.histogram(drawn, name, each),
        "distribution": pictures.distribution(drawn, name, each),
        "pareto": pictures.pareto(each),
        "indices": pictures.pareto(each, "indices") if "indices" in each else None,
        "convergence": pictures.convergence(drawn, name, each),
        "scatter": pictures.scatter(drawn, name, each),
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
    shares = contributions["together"]
    return sorted(shares, key=lambda name: -(shares[name]["value"] or 0.0))


def _blame(each: Found) -> str:
    """Name who is to blame, and for how much of the variance."""
    found = each.get("contributions") or {"first_order": {}, "together": {}}
    groups, alone = found["together"], found["first_order"]
    single = [n for n in alone if n.rpartition("_")[0] not in groups]
    shares = {**groups, **{name: alone[name] for name in single}}
    known = {
        name: share
        for name, share in shares.items()
        if share["value"] is not None
        and share["value"] >= MATTERS
        and (share["lower"] is None or share["lower"] > 0)
    }
    leading = sorted(known, key=lambda name: -known[name]["value"])[:3]
    words = [f"{name} {number(100 * known[name]['value'])} %" for name in leading]
    if any(known[name]["lower"] is None for name in leading):
        words.append("no trustworthy interval")
    return ", ".join(words)


def _parameter_unit(each: Found, key: str) -> str:
    """Tell in which unit a parameter of a named distribution is shown."""
    logarithmic = each["distribution"]["name"] == "lognormal" or key == "shape"
    return "plain" if logarithmic else str(each["unit"])


def _parameter_suffix(each: Found, key: str) -> str:
    if each["distribution"]["name"] == "lognormal":
        unit = "" if each["unit"] == "1" else f" of the number in {each['unit']}"
        return f" (natural logarithm{unit})"
    return "" if key == "shape" else f" {each['shown_unit']}"


def _quantity(run: Run, name: str, trial: int) -> str:
    unit = run.units[name]
    value = float(run.column(name)[trial])
    return f"{in_engineering_unit(value, unit)} {engineering_unit(unit)}"

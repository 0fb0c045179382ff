"""The page of a rare run."""

from __future__ import annotations

from tolstat.reporting.page import Numbers, environment, style
from tolstat.reporting.rare import RareFindings


def rare_page(found: RareFindings) -> str:
    """Make the page of a rare run.

    Parameters
    ----------
    found : RareFindings
        Every number on the page is one of these.
    """
    numbers = Numbers(found)
    template = environment().get_template("rare.html")
    page: str = template.render(
        title=found.title,
        style=style(),
        f=found,
        at=numbers.at,
        show=numbers.show,
        estimate_line=numbers.estimate_line,
    )
    return page

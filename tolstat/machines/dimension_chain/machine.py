"""A dimension chain as a model: deviations of its links in, the closing link out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.numbers import Numbers
from tolstat.machines.dimension_chain.settings import Settings
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.units.scale import scale_of

Array = NDArray[np.float64]

GAP = "gap"


class DimensionChain(Model):
    """Links that deviate, and what they leave between them."""

    name = "dimension_chain"
    title = "a dimension chain: links in the study file, the gap as a formula of them"
    settings = Settings
    failures = ("the formula has no value",)
    assumptions = (
        "Parts are rigid and have the form that the formula gives them.",
        "Root sum square: slopes at the middle of the tolerances, links independent of "
        "each other.",
    )

    def describe(self, settings: Settings) -> Description:
        """List the links as contributors, and the gap.

        Parameters
        ----------
        settings : Settings
            Links and formula: they decide names and units.
        """
        links = []
        for name, unit in settings.units.items():
            size, scale = settings.nominal[name], scale_of(unit)
            sentence = f"link of {scale.factor * size:.10g} {scale.mark}".strip()
            length = abs(size) if unit == "m" else None
            links.append(Contributor(name, unit, sentence=sentence, size=length))
        gap = Response(GAP, settings.unit, sentence=settings.gap)
        return Description(tuple(links), (gap,))

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        """Close the chain of each machine.

        Parameters
        ----------
        deviations : float64[trial, link]
            SI.
        settings : Settings
            Nominals and formula.
        """
        links = {
            name: nominal + deviations[:, i]
            for i, (name, nominal) in enumerate(settings.nominal.items())
        }
        found = settings.formula.worked_out(Numbers(links))
        gap = np.broadcast_to(found, len(deviations))[:, None]
        return Outcome(gap, failed={self.failures[0]: ~np.isfinite(gap[:, 0])})

    def numbers(
        self, settings: Settings, spreads: Mapping[str, Spread]
    ) -> tuple[StudyNumber, ...]:
        """Return worst case, root sum square, and the slope and share of each link.

        Parameters
        ----------
        settings : Settings
            Nominals and formula.
        spreads : mapping of str to Spread
            Of the links that deviate, SI.
        """
        found = answers(settings.formula, settings.nominal, spreads)
        worst = "closing link within the tolerances, all links at once"
        if found.turning:
            turns = ", ".join(found.turning)
            worst += f"; found by a search: it rises and falls with {turns}"
        of_gap = (
            ("worst_min", found.worst_min, f"least {worst}"),
            ("worst_max", found.worst_max, f"largest {worst}"),
            ("rss_mean", found.rss_mean, "mean of the linear chain"),
            ("rss_sigma", found.rss_sigma, "its sigma, by root sum square"),
        )
        return (
            *(
                StudyNumber(n, settings.unit, x, words, of=GAP)
                for n, x, words in of_gap
            ),
            *(
                StudyNumber(f"share_{n}", "1", x, f"of {n} in that variance")
                for n, x in found.shares.items()
            ),
        )

"""Rows of a file as trials, and whether they are what the study states of them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tolstat.deviations.rows import Correlated, Misfit, Outside, contradictions
from tolstat.model.description import Contributor, Description
from tolstat.study.deviations_section import Deviations
from tolstat.study.evaluated_table import read_table
from tolstat.study.given_points import Points, Setup
from tolstat.study.study_schema import RESULTS
from tolstat.units.scale import figures, scale_of

MOST_PAIRS = 8  # of correlated inputs, in warnings


def read_rows(setup: Setup, deviating: Deviations) -> Points:
    """Return the trials of a file, with results from elsewhere where it has them.

    Their warnings say what contradicts the study.
    """
    read = read_table
    if setup.document.model == RESULTS:
        from tolstat.study.results_table import read_results  # seldom needed

        read = read_results
    points = read(setup)
    warnings = _contradicted(points, deviating, setup.description)
    return replace(points, warnings=(*points.warnings, *warnings))


def _contradicted(
    points: Points, deviating: Deviations, description: Description
) -> Iterator[str]:
    """Yield a sentence for each statement that rows contradict."""
    parts = {part.name: part for part in description.contributors}
    columns = dict(zip(parts, points.deviations.T, strict=True))
    deviations = {name: values for name, values in columns.items() if np.any(values)}
    stated = {n: d for n, d in deviating.distributions.items() if n in deviations}
    sampled, pairs = points.sampler is not None, 0
    for contradiction in contradictions(
        deviations, stated, deviating.dependence, sample=sampled
    ):
        match contradiction:
            case Outside(name, rows):
                row, more = int(rows[0]), len(rows) - 1
                others = f"; in {more} more rows, too" if more else ""
                yield (
                    f"{points.places[row]}: {name} is "
                    f"{_words(parts[name], deviations[name][row])}, outside its "
                    f"tolerance ({deviating.words[name]}){others}"
                )
            case Misfit(name, p_value):
                yield (
                    f"{name}: the rows are not distributed as stated "
                    f"({deviating.words[name]}; Kolmogorov-Smirnov, p = "
                    f"{figures(p_value, 2)}); what-if rests on that distribution"
                )
            case Correlated((first, second), correlation, by_study) if (
                pairs < MOST_PAIRS
            ):
                pairs += 1
                yield (
                    f"{first} and {second}: rank correlation "
                    f"{figures(correlation, 2)} in the rows, "
                    f"{figures(by_study, 2) if by_study else 'none'} in the study"
                )


def _words(part: Contributor, deviation: float) -> str:
    """Return a deviation in words, or of a part with a nominal value its size."""
    return scale_of(part.unit, part.shown).words((part.size or 0.0) + deviation)

"""All deviations of some contributors, sampled at once."""

from __future__ import annotations

from tolstat.deviations.dependence import Dependence
from tolstat.deviations.draw import draw_in_stages


def draw(contributors, distributions, *, dependence=None, **more):
    """Return float64[trial, contributor], SI, of the first stage."""
    dependence = dependence or Dependence()
    course = draw_in_stages(contributors, distributions, dependence=dependence, **more)
    return next(course)[1]

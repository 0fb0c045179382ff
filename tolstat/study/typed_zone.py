"""Zones and the places in them, as an entry of a study types them."""

from collections.abc import Sequence

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.spread import PLACES, unshifted
from tolstat.units.scale import KNOWN, Scale, figures


def typed(ends: Sequence[float], scale: Scale) -> str:
    """Return a quantity, or a zone, SI, as it is typed."""
    words = [figures(scale.factor * end, KNOWN) for end in ends]
    if words[0] == f"-{words[-1]}":
        words = [f"+-{words[1]}"]
    return f"{'..'.join(words)} {scale.mark}".strip()


def typed_places(distribution: Distribution, scale: Scale) -> dict[str, str]:
    """Return mode, median and plateau of a distribution as keys of its entry."""
    inner = unshifted(distribution)
    places = {key: getattr(inner, key, None) for key in PLACES}
    return {
        key: typed(place if isinstance(place, tuple) else (place,), scale)
        for key, place in places.items()
        if place is not None
    }

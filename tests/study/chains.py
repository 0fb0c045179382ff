"""Studies of a dimension chain, and what is read from them."""

from __future__ import annotations

import pytest

from tolstat.errors import StudyError
from tolstat.study.study import load

CHAIN = {"model": "dimension_chain", "trials": 8, "seed": 1}


def problems_of(study):
    with pytest.raises(StudyError) as refused:
        load(study)
    return str(refused.value)


def chain(gap, links, **more):
    return {
        "model": "dimension_chain", "trials": 2000, "seed": 1,
        "settings": {"gap": gap}, "links": links, **more,
    }  # fmt: skip


def zone(nominal, tolerance, **keys):
    """Return the zone that is read, SI, and the warnings about it."""
    link = {"nominal": nominal, "tolerance": tolerance, **keys}
    study = load(chain("a", {"a": link}))
    return study.deviating.distributions["a"], study.reading_warnings

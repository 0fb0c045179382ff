"""The default settings against rtol 1e-9, on 256 machines drawn as in khpt75."""

from __future__ import annotations

from tests.benchmarks.accuracy import BOUNDS, STUDY, errors, machines, responses
from tolstat.study.study import load


def test_default_settings_meet_the_bounds():
    study = load(STUDY)
    deviations = machines(study, 256)
    truth, _ = responses(study, deviations, 1e-9, 1e-4)
    default, _ = responses(
        study, deviations, study.settings.rtol, study.settings.max_step
    )
    found = errors(default, truth)
    assert all(found[name] <= bound for name, bound in BOUNDS.items()), found

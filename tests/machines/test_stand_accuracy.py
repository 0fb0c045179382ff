"""The default settings against rtol 1e-9, on 256 machines drawn as in khpt75."""

from __future__ import annotations

import numpy as np
import pytest

from tests.studies.benchmarks.accuracy import (
    BOUNDS,
    STUDY,
    claimed,
    errors,
    machines,
    responses,
)
from tolstat.study.study import load


@pytest.fixture(scope="module")
def measured():
    study = load(STUDY)
    deviations = machines(study, 256)
    return study, deviations, responses(study, deviations, 1e-9, 1e-4)[0]


def test_default_settings_meet_the_bounds(measured):
    study, deviations, truth = measured
    settings = type(study.settings)()
    default, steps = responses(study, deviations, settings.rtol, settings.max_step)
    found = errors(default, truth)
    assert all(found[name] <= bound for name, bound in BOUNDS.items()), found
    assert steps.mean() <= 4700


def test_the_audit_finds_the_true_error(measured):
    """A thousandth of the default rtol sees every response's error as it is."""
    share = claimed(*measured)
    assert all(0.9 < value < 1.1 for value in share.values()), share


def test_responses_err_by_little_of_their_sigma(measured):
    """Those of the meshes have small sigmas: within 1 % of it, others 0.1 %."""
    study, deviations, truth = measured
    settings = study.settings
    default, _ = responses(study, deviations, settings.rtol, settings.max_step)
    largest = {
        name: np.abs(default[name] - values).max() / values.std(ddof=1)
        for name, values in truth.items()
        if values.std() > 0.0 and name != "energy_residual"  # zero but for the error
    }
    assert max(largest.values()) < 1e-2, largest
    assert sum(error > 1e-3 for error in largest.values()) <= 5, largest

"""Each distribution against SciPy's, and the keys that do not fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.deviations import distributions
from tolstat.deviations.distributions.normal import Normal
from tolstat.deviations.distributions.triangular import Triangular
from tolstat.deviations.distributions.uniform import Uniform
from tolstat.deviations.parts import find_in, names_in
from tolstat.deviations.samplers.random import Random
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError

ZONE = Tolerance(-1e-4, 3e-4)  # unequal ends
MIDDLE, HALF = 1e-4, 2e-4

CASES = [
    (Normal(), stats.norm(MIDDLE, HALF / 3)),
    (Normal(cp=1.33), stats.norm(MIDDLE, HALF / 3.99)),
    (Normal(cp=1.33, shift=5e-5), stats.norm(MIDDLE + 5e-5, HALF / 3.99)),
    (Normal(cpk=1.33), stats.norm(MIDDLE, HALF / 3.99)),
    (Normal(cp=2.0, cpk=1.5), stats.norm(MIDDLE + HALF / 4, HALF / 6)),
    (Normal(cpk=1.0, shift=-5e-5), stats.norm(MIDDLE - 5e-5, 1.5e-4 / 3)),
    (Uniform(), stats.uniform(-1e-4, 4e-4)),
    (Triangular(), stats.triang(0.5, -1e-4, 4e-4)),
    (Triangular(mode=0.0), stats.triang(0.25, -1e-4, 4e-4)),
    (Triangular(mode=-1e-4), stats.triang(0.0, -1e-4, 4e-4)),
    (Triangular(mode=3e-4), stats.triang(1.0, -1e-4, 4e-4)),
]


@pytest.mark.parametrize(("distribution", "known"), CASES)
def test_inverse_is_that_of_scipy(distribution, known):
    u = np.concatenate([np.linspace(1e-9, 1 - 1e-9, 1001), [2**-53, 1 - 2**-53]])
    found = distribution.deviations(u, ZONE)
    np.testing.assert_allclose(found, known.ppf(u), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("distribution", "known"), CASES[:9])
def test_draws_follow_the_distribution(distribution, known):
    u = Random().unit_samples(75, ["rod_length_1"], 100_000)[:, 0]
    draws = distribution.deviations(u, ZONE)
    assert stats.kstest(draws, known.cdf).pvalue > 1e-4
    for moment, function in ((known.mean(), np.mean), (known.std(), np.std)):
        assert function(draws) == pytest.approx(moment, abs=4 * known.std() / 316)
    if not isinstance(distribution, Normal):
        assert ZONE.lower <= draws.min() and draws.max() <= ZONE.upper


@pytest.mark.parametrize(
    ("distribution", "words"),
    [
        (Normal(cp=0.0), "above zero"),
        (Normal(cp=-1.0), "above zero"),
        (Normal(cp=1.0, cpk=1.33), "at most cp"),
        (Normal(cp=1.0, cpk=0.9, shift=1e-5), "one thing too many"),
        (Normal(shift=3e-4), "outside the tolerance"),
        (Triangular(mode=4e-4), "outside the tolerance"),
    ],
)
def test_what_does_not_fit_is_refused(distribution, words):
    with pytest.raises(DistributionError, match=words):
        distribution.deviations(np.array([0.5]), ZONE)


def test_distributions_are_found_by_their_file():
    assert names_in(distributions) == ["normal", "triangular", "uniform"]
    assert find_in(distributions, "triangular") is Triangular

"""Geometrical tolerances as links of a chain: known fractions."""

from __future__ import annotations

import math
import re
import tomllib

import numpy as np
import pytest
from scipy import integrate, stats

import tolstat
from tests.conftest import ROOT
from tolstat.deviations.distributions import Circular, Tolerance

TRIALS = 100_000


def near(fraction):
    """Return what a sample may have: four sigma about a fraction."""
    sigma = math.sqrt(fraction * (1 - fraction) / TRIALS)
    return pytest.approx(fraction, abs=4 * sigma)


def test_a_position_at_maximum_material_has_the_fractions_of_a_quadrature(tmp_path):
    run = tolstat.run(ROOT / "runs" / "position.toml", output=tmp_path / "p.h5")

    def out(size):  # Rayleigh beyond half the zone
        zone = 0.2 + size - 10  # ISO 2692: the virtual size is 9.8
        outside = stats.rayleigh.sf(zone / 2, scale=0.05)
        return outside * stats.norm.pdf(size, 10.1, 0.1 / 3)

    bonus = integrate.quad(out, 9.8, 10.4, points=[10.1], epsabs=1e-12)[0]
    assert bonus == pytest.approx(0.016528, abs=1e-6)
    assert run.beyond("at_mmc").mean() == near(bonus)
    assert run.beyond("regardless").mean() == near(math.exp(-2))


def test_fasteners_have_the_tolerances_of_asme_y14_5():
    page = (ROOT / "runs" / "how-to" / "geometry.md").read_text()
    blocks = re.findall(r"```toml\n(.+?)```", page, re.DOTALL)
    study = next(tomllib.loads(text) for text in blocks if "fixed" in text)
    head = {"model": "dimension_chain", "trials": TRIALS, "seed": 5}
    run = tolstat.run({**head, **study})
    numbers = {number.name: number.value for number in run.numbers}
    smallest_hole, largest_bolt = 6.4e-3, 6e-3
    position = smallest_hole - largest_bolt
    assert numbers["worst_min_floating"] == pytest.approx(position)
    assert numbers["worst_min_fixed"] == pytest.approx(position / 2)

    def jams(clearance):  # Rayleigh: twice the distance of both axes
        apart = stats.rayleigh.sf(clearance, scale=2 * math.sqrt(2) * 0.05)
        return apart * stats.norm.pdf(clearance, 0.5, math.hypot(0.1, 0.1) / 6)

    exact = integrate.quad(jams, 0.3, 0.7, epsabs=1e-12)[0]
    assert exact == pytest.approx(0.002255, abs=1e-6)
    assert run.beyond("clearance").mean() == near(exact)


def test_two_pins_and_two_holes():
    chain = tolstat.Chain(trials=TRIALS).gap("apart", "abs(pins - holes)")
    chain = chain.link("pins", "100 +-0.03 mm").link("holes", "100 +-0.03 mm")
    run = chain.limit("apart", "<= 0.03 mm").run()
    exact = 2 * stats.norm.sf(0.03 / math.hypot(0.01, 0.01))
    assert exact == pytest.approx(0.033895, abs=1e-6)
    assert run.beyond("apart").mean() == near(exact)


def test_a_circular_zone_is_the_coordinate_of_points_in_a_disc():
    zone = Circular(Tolerance(-0.1, 0.1))
    u = np.array([1e-9, 0.1, 0.5, 0.9, 1 - 1e-9])
    np.testing.assert_allclose(
        zone.deviations(u), 0.1 * stats.semicircular.ppf(u), rtol=1e-5, atol=1e-12
    )
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.1, 0.1, (2, 40_000))
    inside = points[0][np.hypot(*points) <= 0.1]
    sample = zone.deviations(rng.uniform(size=len(inside)))
    assert stats.ks_2samp(sample, inside).pvalue > 1e-3

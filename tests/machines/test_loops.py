"""Vector loops of a chain: closed forms, slopes, and loops that do not close."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tests.study.chains import problems_of
from tolstat.machines.dimension_chain.algebras import Slopes
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.machines.dimension_chain.loops import Loops
from tolstat.status import Status
from tolstat.units.grammar import measure

TRIALS = 50_000
SLIDER = "crank @ phi + rod @ theta - slide @ 0 deg"
CRANK = {"crank": "50 mm", "rod": "150 mm", "phi": "60 deg"}
FOUR_BAR = "crank @ phi + rod @ theta - rocker @ psi - base @ 0 deg"
BARS = {"crank": "50 mm", "rod": "150 mm", "rocker": "120 mm", "base": "160 mm"}


def looped(loops, links, **more):
    return {
        "model": "dimension_chain", "trials": 1000, "seed": 1, "loops": loops,
        "links": links, **more,
    }  # fmt: skip


def measures(links):
    return {name: measure(text) for name, text in links.items()}


def clutch(**more):
    """Chase's one-way clutch: hub a, roller c, ring e; the angle of contact psi."""
    loop = "b @ 0 deg + (a + c) @ 90 deg - (e - c) @ (90 deg - psi)"
    links = {
        "a": "27.645 +-0.0125 mm", "c": "11.43 +-0.01 mm", "e": "50.8 +-0.0125 mm",
    }  # fmt: skip
    limits = {"psi": "6.65..7.35 deg"}
    return looped({"main": loop}, links, limits=limits, **more)


def slider(crank, rod, phi):
    """Return the way of the slide, the other closed form."""
    return crank * np.cos(phi) + np.sqrt(rod**2 - (crank * np.sin(phi)) ** 2)


def clutch_by_quadrature():
    """Return mean, sigma and fraction outside 6.65 to 7.35 deg of its closed form."""
    z, weights = np.polynomial.hermite_e.hermegauss(40)
    weights = weights / weights.sum()
    a, c, e = (
        np.reshape(size + half / 3 * z, shape)
        for size, half, shape in (
            (27.645, 0.0125, (-1, 1, 1)), (11.43, 0.01, (-1, 1)), (50.8, 0.0125, -1),
        )
    )  # fmt: skip
    psi = np.degrees(np.arccos((a + c) / (e - c)))
    joint = np.einsum("i,j,k", weights, weights, weights)
    mean = np.sum(joint * psi)
    # a is large where the angle is small
    largest, least = (
        ((e - c) * np.cos(np.radians(limit)) - c - 27.645) / (0.0125 / 3)
        for limit in (6.65, 7.35)
    )
    outside = np.einsum("j,k,jk", weights, weights, norm.sf(largest) + norm.cdf(least))
    return mean, math.sqrt(np.sum(joint * (psi - mean) ** 2)), outside


def test_a_clutch_has_the_angle_and_the_failures_of_its_closed_form():
    run = tolstat.run(clutch(), trials=TRIALS)
    frame = run.frame()
    a, c, e = (
        (np.array([27.645, 11.43, 50.8]) + 1e3 * frame[["a", "c", "e"]]).to_numpy().T
    )
    closed = np.arccos((a + c) / (e - c))
    np.testing.assert_allclose(frame["psi"], closed, rtol=1e-12)
    degrees = np.degrees(frame["psi"])
    mean, sigma, beyond = clutch_by_quadrature()
    exact = (7.01759, 0.10562, 991.0e-6)
    assert (mean, sigma, beyond) == pytest.approx(exact, rel=1e-4)
    assert degrees.mean() == pytest.approx(mean, abs=4 * sigma / math.sqrt(TRIALS))
    assert degrees.std() == pytest.approx(sigma, rel=0.01)
    out = (degrees < 6.65) | (degrees > 7.35)
    assert abs(out.sum() - TRIALS * beyond) < 4 * math.sqrt(TRIALS * beyond)
    numbers = {number.name: number.value for number in run.numbers}
    sides = [
        np.arccos(
            (27.645 + s * 0.0125 + 11.43 + s * 0.01)
            / (50.8 - s * 0.0125 - 11.43 - s * 0.01)
        )
        for s in (1, -1)
    ]
    assert numbers["worst_min_psi"] == pytest.approx(sides[0])
    assert numbers["worst_max_psi"] == pytest.approx(sides[1])


def test_slopes_of_unknowns_are_those_of_the_closed_form():
    loops = Loops({"main": SLIDER}, measures(CRANK))
    gap = Formula("2*slide", tuple(CRANK), loops=loops)
    links = {name: np.float64(link.value) for name, link in measures(CRANK).items()}
    value, by_link = gap.worked_out(Slopes(links))
    assert value == pytest.approx(2 * slider(**links), rel=1e-14)
    for slope, name in zip(by_link, links, strict=True):
        ends = (2 * slider(**{**links, name: links[name] + h}) for h in (1e-6, -1e-6))
        assert slope == pytest.approx(-np.diff([*ends])[0] / 2e-6, rel=1e-8)
    assert gap.used == tuple(CRANK)


def test_an_unknown_is_the_same_whatever_its_neighbours():
    loops = Loops(
        {"main": FOUR_BAR, "psi": "90 deg"}, measures({**BARS, "phi": "60 deg"})
    )
    rng = np.random.default_rng(1)
    links = {
        n: x.value * (1 + 0.01 * rng.standard_normal(50))
        for n, x in loops.links.items()
    }
    together = loops.solved(Slopes(links)).solved["psi"]
    for trial in (0, 7, 49):
        alone = {name: x[[trial]] for name, x in links.items()}
        value, by_link = loops.solved(Slopes(alone)).solved["psi"]
        assert value[0] == together.value[trial]
        assert np.all(by_link[:, 0] == together.by_link[:, trial])


@pytest.mark.parametrize("phi", range(0, 360, 30))
def test_a_four_bar_keeps_its_way_over_a_turn(phi):
    links = measures({**BARS, "phi": f"{phi} deg"})
    loops = Loops({"main": FOUR_BAR, "psi": "90 deg"}, links)
    values = {name: np.float64(link.value) for name, link in links.items()}
    psi = loops.solved(Slopes(values)).solved["psi"].value
    crank, rod, rocker, base = (values[name] for name in BARS)
    x, y = crank * math.cos(values["phi"]) - base, crank * math.sin(values["phi"])
    away = math.hypot(x, y)
    corner = math.acos((rocker**2 + away**2 - rod**2) / (2 * rocker * away))
    assert psi == pytest.approx((math.atan2(y, x) - corner) % math.tau)


def test_a_trial_far_from_the_nominal_is_followed_on_its_way():
    loops = Loops({"main": SLIDER}, measures({**CRANK, "crank": "140 mm"}))
    phi = np.radians(np.array([0, 60, 100, 179, 260, 300, 420]))
    links = {"crank": np.full(7, 0.14), "rod": np.full(7, 0.15), "phi": phi}
    slide = loops.solved(Slopes(links)).solved["slide"].value
    np.testing.assert_allclose(slide, slider(0.14, 0.15, phi), rtol=1e-9)


def test_a_loop_that_does_not_close_fails_its_trial():
    links = {"crank": "149.9 +-0.3 mm", "rod": "150 mm", "phi": "90 deg"}
    study = looped({"main": SLIDER}, links, settings={"gap": "slide"})
    run = tolstat.run(study)
    too_long = run.column("crank") + 0.1499 > 0.15
    assert 0 < run.counts["a loop does not close"] == too_long.sum()
    assert np.all((run.status != Status.DONE) == too_long)
    exact = np.sqrt(0.15**2 - (0.1499 + run.column("crank")[~too_long]) ** 2)
    np.testing.assert_allclose(run.column("gap")[~too_long], exact, rtol=1e-9)


@pytest.mark.parametrize(
    "loops, links, words",
    [
        ({"main": SLIDER}, {**CRANK, "crank": "200 mm"}, "main does not close with"),
        ({"main": "crank @ a + rod @ b - base @ 0 deg"},
         {"crank": "50 mm", "rod": "30 mm", "base": "80.1 mm"},
         "about 0.10 mm are missing"),
        ({"main": SLIDER}, {**CRANK, "crank": "150 mm", "phi": "90 deg"},
         "main is at a dead point"),
        ({"main": FOUR_BAR}, {**BARS, "phi": "60 deg"},
         'main closes in 2 ways with every link at its nominal value: theta = 30.69 '
         'deg, psi = 92.87 deg; or theta = -66.25 deg, psi = -128.4 deg; give the '
         'right one as a start, such as theta = "30.69 deg"'),
        ({"main": "crank @ phi + rod @ theta - slide"}, CRANK, "'slide': a term of a"),
        ({"main": "crank @ phi + rod @ theta - slide @ 0 deg + 30 deg"}, CRANK,
         "'30': a term of a loop is a length and its direction"),
        ({"main": "crank @ phi @ phi + rod @ theta - slide @ 0 deg"}, CRANK,
         "a vector has one direction"),
        ({"main": "crank @ phi + rd @ theta - slide @ 0 deg"}, CRANK,
         "3 unknowns (rd, theta, slide), but 2 equations"),
        ({"main": SLIDER, "thet": "3 deg"}, CRANK, "did you mean 'theta'?"),
        ({"main": SLIDER, "phi": "3 deg"}, CRANK, "phi is a link"),
        ({"main": SLIDER, "theta": "3 m x"}, CRANK, "unknown unit 'x'"),
        ({"main": SLIDER, "theta": "-3 mm"}, CRANK, "cos takes an angle"),
        ({"theta": "-3 deg"}, CRANK, "neither a loop, such as 'crank @ phi"),
        ({"main": "crank @ phi + rod @ theta - slide @ 0"}, {**CRANK, "phi": "6 mm"},
         "cos takes an angle"),
        ({"main": 3}, CRANK, "expected a vector loop"),
    ],
)  # fmt: skip
def test_wrong_loops_are_refused(loops, links, words):
    problems = problems_of(looped(loops, links))
    assert words in problems
    assert "[loops]" in problems


def test_unknowns_belong_to_chains_and_have_names_of_their_own():
    wrong = looped({"main": SLIDER}, CRANK, gaps={"slide": "2*rod"})
    assert "slide is an unknown of [loops]" in problems_of(wrong)
    wrong = looped({}, CRANK, gaps={"play": "rod @ phi"})
    assert "a direction after @ stands in [loops]" in problems_of(wrong)
    wrong = {"model": "stand", "trials": 8, "seed": 1, "loops": {"main": SLIDER}}
    assert "model 'stand' has no loops" in problems_of(wrong)


def test_angles_stand_in_formulas_with_their_unit():
    links = {"r": np.float64(2.0)}
    for text, value in [("r*sin(30 deg)", 1.0), ("r*cos(-60deg)", 1.0),
                        ("r*sin(1.570796 rad)", 2.0), ("r*1e1", 20.0)]:  # fmt: skip
        assert Formula(text, ("r",)).worked_out(Slopes(links)).value == pytest.approx(
            value
        )


def test_unknowns_stand_in_gaps_and_in_the_variance():
    """The variance of a linear loop is known: two unknown lengths."""
    loops = {"main": "a @ 0 deg + b @ 90 deg - x @ 0 deg - y @ 90 deg"}
    links = {"a": "3 +-0.3 mm", "b": "4 +-0.6 mm"}
    run = tolstat.run(looped(loops, links, gaps={"d": "hypot(x, y)"}), trials=20_000)
    numbers = {number.name: number.value for number in run.numbers}
    assert numbers["rss_sigma_d"] == pytest.approx(1e-3 * math.hypot(0.06, 0.16))
    assert numbers["share_a_d"] == pytest.approx(0.06**2 / (0.06**2 + 0.16**2))
    spread = run.column("d").std() / numbers["rss_sigma_d"]
    assert spread == pytest.approx(1, abs=4 / math.sqrt(2 * 20_000) + 0.01)

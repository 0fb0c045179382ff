"""Worst case and root sum square against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from tests.answers.allocate.linear_stack import LIMIT, SLOPES, Linear, Two, reciprocal
from tolstat import Outcome
from tolstat.answers.allocate.linear_schemes import LinearSchemes
from tolstat.deviations.density_ratio import correlations
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.study.study import load


def correlated_by(parts, share):
    """Correlated by this much, as a matrix."""
    R = np.eye(3)
    R[np.ix_(parts, parts)] += share * (1 - np.eye(len(parts)))
    return R


@pytest.mark.parametrize(
    ("change", "correlation"),
    [
        ({}, np.eye(3)),
        ({"correlation": {"link_1": {"link_3": 0.6}}},
         correlated_by([0, 2], 2 * math.sin(math.pi * 0.6 / 6))),
    ],
)  # fmt: skip
def test_linear_schemes_are_closed_forms(change, correlation):
    study, T = load(reciprocal(**change), model=Linear()), np.array([1, 2, 3]) * 4e-5
    with Workers(1) as crew:
        linear = LinearSchemes(study, crew)
    own = SLOPES * T / 3
    share = 2 * float(ndtr(-LIMIT / math.sqrt(own @ correlation @ own)))
    assert linear.root_sum_square(tuple(np.log(T))) == pytest.approx(
        math.log(share / 0.02), rel=1e-9
    )
    worst = np.abs(SLOPES) @ T / LIMIT - 1
    assert linear.worst_case(tuple(np.log(T))) == pytest.approx([worst, worst])


@pytest.mark.parametrize("nearest", [0.0, 0.1])
def test_a_nominal_out_of_limit_has_no_worst_case(nearest):
    """At an end nothing may scatter at all, and beyond it nothing helps."""
    limits = {"gap": f"{nearest}..0.9 mm", "any": f"-0.9..{-nearest} mm"}
    T = np.array([1, 2, 3]) * 4e-5
    with Workers(1) as crew:
        study = load(reciprocal(limits=limits), model=Two())
        found = LinearSchemes(study, crew).worst_case(tuple(np.log(T)))
    gap = np.abs(SLOPES) @ T / 0.9e-3 - 1
    beyond = [(off + nearest * 1e-3) / 0.9e-3 for off in (np.abs(SLOPES) @ T, T[0])]
    assert found == pytest.approx([beyond[0], gap, T[0] / 0.9e-3 - 1, beyond[1]])


def test_linear_schemes_include_fixed_and_one_sided_parts():
    given = reciprocal()
    given["deviations"]["link_2"] = {"distribution": "constant", "value": "0.05 mm"}
    one_sided = given["deviations"]["link_3"]
    one_sided["tolerance"], one_sided["distribution"] = "0..0.2 mm", "uniform"
    T1, T3 = 0.04e-3, 0.06e-3
    with Workers(1) as crew:
        linear = LinearSchemes(load(given, model=Linear()), crew)
    choice = (math.log(T1), math.log(T3))
    centre = -2 * 0.05e-3  # of the constant part
    least, most = centre - T1, centre + T1 + 0.5 * 2 * T3
    assert linear.worst_case(choice) == pytest.approx(
        [
            (-LIMIT - least) / (LIMIT - centre),  # of the larger room
            (most - centre) / (LIMIT - centre) - 1,
        ]
    )
    mean, sigma = centre + 0.5 * T3, math.hypot(T1 / 3, 0.5 * T3 / math.sqrt(3))
    share = ndtr((-LIMIT - mean) / sigma) + ndtr((mean - LIMIT) / sigma)
    assert linear.root_sum_square(choice) == pytest.approx(math.log(share / 0.02))


def test_slopes_are_taken_with_constant_parts_in_place():
    class Lever(Linear):
        def evaluate(self, deviations, settings):
            return Outcome((deviations[:, :1] * deviations[:, 1:2]) / 1e-3)

    given = reciprocal()
    given["deviations"]["link_2"] = {"distribution": "constant", "value": "0.5 mm"}
    with Workers(1) as crew:
        linear = LinearSchemes(load(given, model=Lever()), crew)
    assert linear.slopes["gap"]["link_1"] == pytest.approx(0.5)


def test_parts_of_a_batch_are_correlated_by_its_share():
    names = ["part_1", "part_2", "part_3", "still"]
    for share in (0.4, 1.0):
        batch = Batch("part", share)
        dependence = Dependence({name: batch for name in names[:3:2]})
        expected = np.eye(4)
        expected[:3, :3] = correlated_by([0, 2], share)
        assert np.allclose(correlations(names, dependence), expected)

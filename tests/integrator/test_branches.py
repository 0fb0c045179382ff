"""Branches of hand-written rates that no crossing names, found without any trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.integrator.switching import BALL, SWITCH, bouncing
from tolstat.integrator.branches import unnamed_branches
from tolstat.integrator.problem import System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write


@compiled(within=True)
def push_of(x, k):
    return np.where(x < 0.0, -k * x, 0.0)


@compiled(rates_signature)
def nested(moment, y, p, out):
    """The branch stands in a function of its own."""
    Y, P = rows(y), rows(p)
    write(out, 0, (Y[1], push_of(Y[0] - P[1], P[0]) - np.abs(Y[0]), Y[0] - P[1]))


@compiled(rates_signature)
def unrecorded(moment, y, p, out):
    Y = rows(y)
    write(out, 0, (Y[1], np.where(np.isfinite(Y[0]), -Y[0], 0.0)))


NESTED = System(nested, np.ones(2), n_above=1, crossings=(0,))


def test_a_branch_without_a_crossing_is_named_with_its_line():
    assert unnamed_branches(BALL, 2) == ()
    (line,) = unnamed_branches(replace(BALL, crossings=()), 2)
    assert line == f"switching.py, line {bouncing.py_func.__code__.co_firstlineno + 5}"


def test_branches_in_called_functions_and_bends():
    assert unnamed_branches(NESTED, 2) == ()
    (line,) = unnamed_branches(replace(NESTED, crossings=()), 2)
    assert (
        line == f"test_branches.py, line {push_of.py_func.__code__.co_firstlineno + 2}"
    )
    # they bend only, and are no alarm
    assert unnamed_branches(replace(SWITCH, crossings=()), 4) == ()


def test_of_what_cannot_be_recorded_nothing_is_said():
    assert unnamed_branches(System(unrecorded, np.ones(2)), 2) == ()


@pytest.mark.parametrize("name", ["oscillator_system", "damped_system"])
def test_smooth_rates_have_none(name, request):
    assert unnamed_branches(request.getfixturevalue(name), 3) == ()

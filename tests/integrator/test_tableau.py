"""The constants satisfy, exactly, every condition of their orders."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
from scipy.integrate import RK45

from tolstat.integrator import tableau

STAGES = range(7)


def trees(order):
    """List the rooted trees of an order, each as the sorted tuple of its branches."""
    if order == 1:
        return [()]
    found = set()

    def branches(left, most):
        if left == 0:
            yield ()
            return
        for size in range(min(left, most), 0, -1):
            for tree in trees(size):
                for rest in branches(left - size, size):
                    yield tuple(sorted((tree, *rest)))

    found.update(branches(order - 1, order - 1))
    return sorted(found)


def size(tree):
    return 1 + sum(size(branch) for branch in tree)


def density(tree):
    product = F(size(tree))
    for branch in tree:
        product *= density(branch)
    return product


def inner(tree, i):
    """Stage weight of a tree at stage i."""
    product = F(1)
    for branch in tree:
        product *= sum((tableau.A[i][j] * inner(branch, j) for j in range(i)), F(0))
    return product


def weigh(weights, tree):
    return sum((weights[i] * inner(tree, i) for i in STAGES), F(0))


def test_number_of_trees():
    assert [len(trees(order)) for order in range(1, 6)] == [1, 1, 2, 4, 9]


def test_rows_sum_to_the_nodes():
    for i in STAGES:
        assert sum(tableau.A[i], F(0)) == tableau.C[i]


def test_order_conditions():
    for order in range(1, 6):
        for tree in trees(order):
            assert weigh(tableau.B, tree) == 1 / density(tree)
            if order <= 4:
                assert weigh(tableau.B_EMBEDDED, tree) == 1 / density(tree)
    fifth = [weigh(tableau.B_EMBEDDED, tree) - 1 / density(tree) for tree in trees(5)]
    assert any(fifth), "the embedded formula must differ at order 5"


def test_dense_output_is_of_order_four_everywhere():
    for theta in (F(1, 7), F(1, 2), F(9, 11), F(1)):
        weights = tableau.dense_weights(theta)
        for order in range(1, 5):
            for tree in trees(order):
                # the interpolant's fractions are rounded by their author
                error = weigh(weights, tree) - theta**order / density(tree)
                assert abs(float(error)) < 1e-16, (theta, tree)
    ends = zip(tableau.dense_weights(F(1)), tableau.B, strict=True)
    assert max(abs(float(a - b)) for a, b in ends) < 1e-16


def test_constants_match_scipy():
    for i, row in enumerate(tableau.A[:6]):
        np.testing.assert_allclose([float(a) for a in row], RK45.A[i, :i], rtol=1e-15)
    np.testing.assert_allclose([float(e) for e in tableau.E], -RK45.E, atol=1e-16)
    np.testing.assert_allclose(np.array(tableau.DENSE, float), RK45.P, rtol=1e-15)

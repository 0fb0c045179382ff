"""A quadratic surface of all responses, by least squares."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers

BLOCK = 4096  # trials whose terms are in memory at a time
TRIALS_PER_TERM = 4  # at least, with products
MOST_TERMS = 600  # of a fit, whose time grows with their cube
WELL_EXPLAINED = 0.01  # of sigma: where squares leave less, products do not pay
SIGNIFICANT, ROUNDING = 3.0, 1e-9  # standard errors; of sigma: terms below are 0
NONLINEAR = 0.25  # part of what bends add that may be wrong
UNEXPLAINED, REMAINDER = 0.02, 0.5  # of sigma: from there half of it may change
RANK = 1e-10  # of the largest singular value: terms below it depend on others


class Gains(NamedTuple):
    """What responses gain by a step, float64[trial, response].

    Attributes
    ----------
    linear, bent : float64[trial, response]
        By the slopes, and by all second derivatives.
    """

    linear: Array
    bent: Array

    @property
    def both(self) -> Array:
        """The sum."""
        return self.linear + self.bent


class Surface(NamedTuple):
    """Responses as quadratic functions of scaled deviations z.

    Attributes
    ----------
    slopes, bends : float64[contributor, response]
        First and second derivatives at z = 0.
    main : int64[main]
        Contributors whose products take part.
    products : float64[response, main, main]
        Their mixed second derivatives; 0 on the diagonal.
    remainders : float64[response]
        Standard deviation of what the surface does not explain.
    """

    slopes: Array
    bends: Array
    main: Integers
    products: Array
    remainders: Array

    @property
    def straight(self) -> Surface:
        """The surface without what bends."""
        return self._replace(bends=0 * self.bends, products=0 * self.products)

    @property
    def is_straight(self) -> bool:
        """Whether nothing bends."""
        return not (self.bends.any() or self.products.any())

    def slopes_at(self, z: Array) -> Array:
        """Return first derivatives at float64[contributor], as `slopes`."""
        slopes = self.slopes + z[:, None] * self.bends
        slopes[self.main] += (self.products @ z[self.main]).T
        return slopes

    def change(self, z: Array, shift: Array, ratio: Array) -> Array:
        """Return float64[trial, response]: what responses gain.

        Deviations z change to shift + ratio * z. Exact if a response is a quadratic
        function plus a remainder that each trial keeps.
        """
        changed = np.flatnonzero((shift != 0) | (ratio != 1))
        step = shift[changed] + (ratio[changed] - 1) * z[:, changed]
        return self.along(z, changed)(step).both

    def along(self, z: Array, columns: Integers) -> Callable[[Array], Gains]:
        """Return what responses gain by steps of some contributors, as a function.

        Its argument is float64[trial, column].
        """
        among = np.flatnonzero(np.isin(columns, self.main))  # columns with products
        rows = np.searchsorted(self.main, columns[among])
        here, around = z[:, columns], z[:, self.main]
        turns = {
            response: (around @ products[rows].T, products[np.ix_(rows, rows)] / 2)
            for response, products in enumerate(self.products)
            if len(rows) and products.any()
        }

        def gains(step: Array) -> Gains:
            linear = np.asarray(step @ self.slopes[columns])
            bent = (step * (here + step / 2)) @ self.bends[columns]
            mixed = step[:, among]
            for response, (turn, halves) in turns.items():
                whole = turn + mixed @ halves
                bent[:, response] += np.einsum("ti,ti->t", mixed, whole)
            return Gains(linear, bent)

        return gains


def fitted_surface(z: Array, responses: Array, weights: Array | None = None) -> Surface:
    """Fit float64[trial, response] to scaled deviations, float64[trial, contributor].

    `weights`, float64[trial], tell how much trials count; equally without them.
    Products of two contributors take part if there are four trials a term, and if some
    response is not nearly explained without them; of many contributors the main ones.
    """
    trials, contributors = z.shape
    sigma = responses.std(axis=0)
    surface = _fitted(z, responses, weights, np.empty(0, int))
    main = np.arange(contributors)
    terms = 1 + 2 * contributors + contributors * (contributors - 1) // 2
    unexplained = np.any(surface.remainders > WELL_EXPLAINED * sigma)
    if not (unexplained and contributors > 1 and terms * TRIALS_PER_TERM < trials):
        return surface
    if terms > MOST_TERMS:
        influence = np.abs(surface.slopes) + np.abs(surface.bends)
        share = influence * z.std(axis=0)[:, None] / np.where(sigma > 0, sigma, 1.0)
        most = int(np.sqrt(2 * max(MOST_TERMS - 2 * contributors, 0)))
        main = np.sort(np.argsort(-share.max(axis=1), kind="stable")[:most])
    return _fitted(z, responses, weights, main)


def _fitted(
    z: Array, responses: Array, weights: Array | None, main: Integers
) -> Surface:
    """Fit with products of the main contributors."""
    trials, contributors = z.shape
    left, right = np.triu_indices(len(main), 1)
    first, second = main[left], main[right]
    centre, spread = z.mean(axis=0), z.std(axis=0)
    spread = np.where(spread > 0, spread, 1.0)
    mean, sigma = responses.mean(axis=0), responses.std(axis=0)
    sigma = np.where(sigma > 0, sigma, 1.0)
    terms = 1 + 2 * contributors + len(first)
    relative, total = None, np.full(len(mean), float(trials))  # sum of squares
    if weights is not None:
        relative = weights[:, None] / weights.mean()
        total = np.sum(relative * ((responses - mean) / sigma) ** 2, axis=0)
    with_y = np.zeros((terms, len(mean)))
    among = np.zeros((terms, terms)) if terms <= trials else None
    size = trials if among is None else BLOCK
    for start in range(0, trials, size):
        block = slice(start, start + size)
        u = (z[block] - centre) / spread  # near orthogonal terms: a stable solution
        columns = np.hstack(
            [np.ones((len(u), 1)), u, u * u - 1, u[:, first] * u[:, second]]
        )
        counted = columns if relative is None else columns * relative[block]
        y = (responses[block] - mean) / sigma
        with_y += counted.T @ y
        if among is not None:
            among += counted.T @ columns
    if among is None:  # fewer trials than terms: the same least squares, far sooner
        root = 1.0 if relative is None else np.sqrt(relative)
        solution = np.linalg.lstsq(columns * root, y * root, rcond=RANK**0.5)[0]
    else:
        solution = np.linalg.lstsq(among, with_y, rcond=RANK)[0]
    explained = np.einsum("kj,kj->j", solution, with_y)
    free = max(trials - terms, 1)
    remainders = sigma * np.sqrt(np.maximum(total - explained, 0) / free)
    chance = SIGNIFICANT * remainders / sigma / np.sqrt(trials) + ROUNDING
    terms_of_z = solution[1:]  # by chance, a shift along them would lead anywhere
    terms_of_z[np.abs(terms_of_z) < chance] = 0.0
    solution *= sigma
    linear, squares, mixed = np.split(solution[1:], [contributors, 2 * contributors])
    bends = 2 * squares / spread[:, None] ** 2
    products = np.zeros((len(mean), len(main), len(main)))
    products[:, left, right] = products[:, right, left] = mixed.T
    products /= spread[main] * spread[main, None]
    slopes = linear / spread[:, None]
    surface = Surface(slopes, bends, main, products, remainders)
    return surface._replace(slopes=surface.slopes_at(-centre))

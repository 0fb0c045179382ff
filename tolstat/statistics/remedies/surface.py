"""A quadratic surface of all responses, by least squares."""

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
    slopes : float64[contributor, response]
        First derivatives at z = 0.
    bends : float64[response, contributor, contributor]
        Second derivatives.
    remainders : float64[response]
        Standard deviation of what the surface does not explain.
    """

    slopes: Array
    bends: Array
    remainders: Array

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
        turns = [z @ bend[columns].T if bend.any() else None for bend in self.bends]

        def gains(step: Array) -> Gains:
            linear = np.asarray(step @ self.slopes[columns])
            bent = np.zeros_like(linear)
            for response, turn in enumerate(turns):
                if turn is not None:
                    bend = self.bends[response][np.ix_(columns, columns)]
                    whole = turn + step @ (bend / 2)
                    bent[:, response] = np.einsum("ti,ti->t", step, whole)
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
    surface = _fitted(z, responses, weights, *np.empty((2, 0), int))
    first, second = np.triu_indices(contributors, 1)
    terms = 1 + 2 * contributors + len(first)
    unexplained = np.any(surface.remainders > WELL_EXPLAINED * sigma)
    if not (unexplained and len(first) and terms * TRIALS_PER_TERM < trials):
        return surface
    if terms > MOST_TERMS:
        influence = np.abs(surface.slopes) + np.abs(np.einsum("jii->ij", surface.bends))
        share = influence * z.std(axis=0)[:, None] / np.where(sigma > 0, sigma, 1.0)
        most = int(np.sqrt(2 * max(MOST_TERMS - 2 * contributors, 0)))
        main = np.sort(np.argsort(-share.max(axis=1), kind="stable")[:most])
        first, second = (main[i] for i in np.triu_indices(len(main), 1))
    return _fitted(z, responses, weights, first, second)


def _fitted(
    z: Array,
    responses: Array,
    weights: Array | None,
    first: Integers,
    second: Integers,
) -> Surface:
    """Fit with products of the first with the second contributors."""
    trials, contributors = z.shape
    centre, spread = z.mean(axis=0), z.std(axis=0)
    spread = np.where(spread > 0, spread, 1.0)
    mean, sigma = responses.mean(axis=0), responses.std(axis=0)
    sigma = np.where(sigma > 0, sigma, 1.0)
    terms = 1 + 2 * contributors + len(first)
    relative, total = None, np.full(len(mean), float(trials))  # sum of squares
    if weights is not None:
        relative = weights[:, None] / weights.mean()
        total = np.sum(relative * ((responses - mean) / sigma) ** 2, axis=0)
    among, with_y = np.zeros((terms, terms)), np.zeros((terms, len(mean)))
    for start in range(0, trials, BLOCK):
        block = slice(start, start + BLOCK)
        u = (z[block] - centre) / spread  # near orthogonal terms: a stable solution
        columns = np.hstack(
            [np.ones((len(u), 1)), u, u * u - 1, u[:, first] * u[:, second]]
        )
        counted = columns if relative is None else columns * relative[block]
        among += counted.T @ columns
        with_y += counted.T @ ((responses[block] - mean) / sigma)
    solution = np.linalg.lstsq(among, with_y, rcond=RANK)[0]
    explained = np.einsum("kj,kj->j", solution, with_y)
    free = max(trials - terms, 1)
    remainders = sigma * np.sqrt(np.maximum(total - explained, 0) / free)
    chance = SIGNIFICANT * remainders / sigma / np.sqrt(trials) + ROUNDING
    terms_of_z = solution[1:]  # by chance, a shift along them would lead anywhere
    terms_of_z[np.abs(terms_of_z) < chance] = 0.0
    solution *= sigma
    linear, squares, products = np.split(solution[1:], [contributors, 2 * contributors])
    bends = np.zeros((len(mean), contributors, contributors))
    diagonal = np.arange(contributors)
    bends[:, diagonal, diagonal] = 2 * squares.T
    bends[:, first, second] = bends[:, second, first] = products.T
    bends /= spread * spread[:, None]
    slopes = linear / spread[:, None] - (bends @ centre).T
    return Surface(slopes, bends, remainders)

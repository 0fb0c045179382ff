"""Which masses a model of the lowest modes may leave out.

A mass may go where the highest frequency wanted is far below its partial frequency
sqrt(K_ii/Q_i)/(2 pi), which it has with all others held. "Far" is assumed: a third.
The paper, "Model of the block": condition number and partial frequencies.
"""

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.parameters import Drive, drives
from tolstat.machines.rolling_block.structure import MASSES, stiffness_matrix
from tolstat.model.view import Listing

FAR = 1 / 3


def without(goes: Truths, drive: Drive) -> Array:
    """Return the elastic frequencies, Hz, of the first drive without some inertias."""
    K, root = stiffness_matrix(drive.C)[0], np.sqrt(drive.Q[0, ~goes])
    coupled = K[np.ix_(goes, ~goes)]
    taken = coupled.T @ np.linalg.solve(K[np.ix_(goes, goes)], coupled)
    K = K[np.ix_(~goes, ~goes)] - taken
    squares: Array = np.linalg.eigvalsh(K / root / root[:, None])[1:]
    return np.sqrt(squares) / (2 * np.pi)


def masses(deviations: Array, settings: Settings) -> Listing:
    """Return each mass, whether it may go, and the error of each mode without them."""
    drive = drives(deviations[:1], settings)
    frequency = drive.modes.omega[0] / (2 * np.pi)
    n, K = settings.kept_modes, np.diag(stiffness_matrix(drive.C)[0])
    partial = np.sqrt(K / drive.Q[0]) / (2 * np.pi)
    ratio = frequency[n - 1] / partial
    goes = ratio < FAR
    error = np.full(len(MASSES), np.nan)
    lowest = without(goes, drive) / frequency[: np.sum(~goes) - 1]
    error[:n] = lowest[:n].round(12) - 1.0
    return Listing.of(
        f"a mass; it may go where modes 1 to {n} are wanted. In row r: error of mode r "
        "without the masses that go",
        ("mass", "1", "", np.array(MASSES)),
        ("Q", "kg m^2", "kg m^2", drive.Q[0]),
        ("partial frequency", "Hz", "Hz", partial),
        (f"f{n} over it", "1", "1", ratio),
        ("may go", "1", "", np.where(goes, "yes", "no")),
        ("error of mode", "1", "%", error),
    )

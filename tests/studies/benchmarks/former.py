"""Two engines with the former settings, without the scales of the states.

    pip install numbalsoda   # optional; needs a Fortran compiler
    python -m tests.studies.benchmarks.former   # 2 min

SciPy's RK45 with sizes of elastic deflections and their speeds that were guessed; one
absolute tolerance, SI, for numbalsoda, which has the energies in its error control.
Beside `tests.studies.benchmarks.engines`: what a fair setting makes of these two.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
from numba import carray, cfunc, types

from tests.studies.benchmarks.engines import (
    STUDY,
    TRIALS,
    beside,
    drawn,
    ladder,
    print_line,
)
from tests.studies.benchmarks.peers import (
    Engine,
    Machines,
    N,
    P,
    Q,
    Responses,
    doubles,
    responses,
    right_hand_side,
    scipy_engine,
    tolstat,
)
from tolstat.study.study import load

SIZES = np.array([3e-4, 3e-4, 1e-3, 1e-3, 3e-2, 3e-2, 1e-1, 1e-1, *[1e30] * Q])


@cfunc(types.void(types.double, doubles, doubles, doubles))
def in_si(t, y, dy, row):
    """Give numbalsoda its right-hand side, SI."""
    right_hand_side(t, carray(y, (N + Q,)), carray(row, (P,)), carray(dy, (N + Q,)))


def numbalsoda_in_si() -> Engine:
    """Make numbalsoda's LSODA with one absolute tolerance for metres and joules."""
    from numbalsoda import lsoda

    def engine(machines: Machines, rtol: float) -> Callable[[], Responses]:
        start, table, marks = machines.start, machines.table, machines.marks

        def one(i: int):
            y, success = lsoda(
                in_si.address, start[i], marks, table[i],
                rtol=rtol, atol=rtol * 1e-3, mxstep=10_000_000,
            )  # fmt: skip
            return y[:, N:] if success else np.full_like(y[:, N:], np.nan)

        return lambda: responses(np.stack([one(i) for i in range(len(start))]))

    return engine


def main() -> None:
    """Print the lines."""
    study = load(STUDY)
    machines = Machines(study, drawn(study, TRIALS))
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    truth = tolstat(machines, 1e-9, max_step=1e-4)()
    makers = {
        "SciPy RK45": lambda: scipy_engine("RK45", SIZES),
        "numbalsoda": numbalsoda_in_si,
    }
    for name, maker in makers.items():
        try:
            engine = maker()
        except ImportError as problem:
            print(f"{name:<18} left out: {problem}")
            continue
        _, point = ladder(engine, machines, truth, 0)
        print_line(name, point, *beside(engine, point, machines))


if __name__ == "__main__":
    main()

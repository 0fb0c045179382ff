"""Other engines on the stand's equations: SciPy, numbalsoda, heyoka, diffrax.

Every one takes the scale of each state, times the tolerance, as that state's absolute
tolerance, leaves the energies out of its error control, and steps 1 ms at most. An
engine is a function of machines and a tolerance that compiles what it needs and returns
what is to be timed; a maker of one raises ImportError where its package is missing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from numba import carray, cfunc, njit, types
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.studies.benchmarks.accuracy import ENERGIES, Responses
from tolstat.machines.stand import motion as equations
from tolstat.machines.stand.declarations import END, WINDOW
from tolstat.machines.stand.machine import marks_of, start_of
from tolstat.machines.stand.motion import SCALE, State
from tolstat.machines.stand.parameters import Parameters, build
from tolstat.moving import Moment
from tolstat.study.study import Study

Array = NDArray[np.float64]
N, Q, P = len(SCALE), len(ENERGIES), len(Parameters._fields)
LONGEST = 1e-3  # s, a step
# what is no state is never what a step is too long for
SCALES = np.array([*SCALE, *[1e30] * Q])
NOTHING = 3e-14  # the relative tolerance, where SCALES alone are to decide


@dataclass(frozen=True)
class Machines:
    """Machines of a study: deviations[machine, contributor], and as the peers see them.

    `start` and `table` are float64[machine, state and energy], [machine, parameter].
    """

    study: Study
    deviations: Array

    def __len__(self) -> int:
        return len(self.deviations)

    def first(self, n: int) -> Machines:
        """Return the first n of them."""
        return replace(self, deviations=self.deviations[:n])

    @property
    def marks(self) -> Array:
        return marks_of(self.study.settings)

    @property
    def table(self) -> Array:
        return np.stack(build(self.deviations, self.study.settings), axis=1)

    @property
    def start(self) -> Array:
        p = build(self.deviations, self.study.settings)
        at_rest = start_of(p, self.study.settings)
        return np.hstack([at_rest, np.zeros((len(self), Q))])


Engine = Callable[[Machines, float], Callable[[], Responses]]


def tolstat(machines: Machines, rtol: float, **tight: float) -> Callable[[], Responses]:
    """Run this engine, peaks and shares included."""
    study = machines.study
    settings = replace(study.settings, rtol=rtol, **tight)
    names = [response.name for response in study.description.responses]

    def run() -> Responses:
        values = study.model.evaluate(machines.deviations, settings).responses
        return dict(zip(names, values.T, strict=True))

    return run


def responses(energy: Any) -> Responses:
    """Turn energies at the marks, float64[machine, mark, energy], into responses."""
    window, run = energy[:, END] - energy[:, WINDOW], energy[:, END]
    return {
        **{f"{e}_energy": window[:, i] for i, e in enumerate(ENERGIES)},
        "extra_loss": window[:, 2] / window[:, 0],
        "extra_loss_run": run[:, 2] / run[:, 0],
    }


def in_terms_of(numpy: Any) -> Callable[..., Any]:
    """Return the equations of motion, `np` in them being something else."""
    names, own = {**vars(equations), "np": numpy}, equations.motion
    return FunctionType(own.__code__, names, argdefs=own.__defaults__)


scalar_motion = njit(fastmath={"contract", "nsz", "arcp"}, error_model="numpy")(
    equations.motion
)


@njit(error_model="numpy")
def right_hand_side(t, y, row, dy):
    """Evaluate one machine in plain doubles: states, then energies."""
    p = Parameters(*to_fixed_tuple(row, P))
    state = State(y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7])
    at = scalar_motion(Moment(t, 0.0), state, p)
    i = 0
    for value in at.derivative:
        dy[i] = value
        i += 1
    for value in at.powers:
        dy[i] = value
        i += 1


# Radau and BDF hand over columns of a matrix
@njit(types.float64[::1](types.float64, types.float64[:], types.float64[::1]))
def for_scipy(t, y, row):
    """Give SciPy its right-hand side."""
    dy = np.empty(len(y))
    right_hand_side(t, y, row, dy)
    return dy


doubles = types.CPointer(types.double)


@cfunc(types.void(types.double, doubles, doubles, doubles))
def for_lsoda(t, scaled, dy_, row):
    """Give numbalsoda its right-hand side, states and energies in their scales."""
    dy = carray(dy_, (N + Q,))
    right_hand_side(t, carray(scaled, (N + Q,)) * SCALES, carray(row, (P,)), dy)
    for i in range(N + Q):
        dy[i] /= SCALES[i]


def scipy_engine(method: str, scales: Array = SCALES) -> Engine:
    """Make one of SciPy's engines."""

    def engine(machines: Machines, rtol: float) -> Callable[[], Responses]:
        start, table, marks = machines.start, machines.table, machines.marks

        def one(i: int) -> Array:
            found = solve_ivp(
                for_scipy, (0, marks[-1]), start[i], method=method, t_eval=marks,
                rtol=NOTHING, atol=rtol * scales, max_step=LONGEST, args=(table[i],),
            )  # fmt: skip
            return found.y[N:].T if found.success else np.full((len(marks), Q), np.nan)

        return lambda: responses(np.stack([one(i) for i in range(len(start))]))

    return engine


def numbalsoda_engine() -> Engine:
    """Make numbalsoda's LSODA.

    It has one absolute tolerance for all states, so it is given them in their scales,
    and no limit of the step.
    """
    from numbalsoda import lsoda

    def engine(machines: Machines, rtol: float) -> Callable[[], Responses]:
        start, table, marks = machines.start / SCALES, machines.table, machines.marks

        def one(i: int) -> Array:
            y, success = lsoda(
                for_lsoda.address, start[i], marks, table[i],
                rtol=NOTHING, atol=rtol, mxstep=10_000_000,
            )  # fmt: skip
            return y[:, N:] * SCALES[N:] if success else np.full_like(y[:, N:], np.nan)

        return lambda: responses(np.stack([one(i) for i in range(len(start))]))

    return engine


def heyoka_engine() -> Engine:
    """Make heyoka's Taylor series, one machine in each lane.

    Its one tolerance decides the order of the series and is relative to the largest
    state. With the states in their scales it needs 1e-7; fastest found: SI, the yaw in
    mrad, energies out of sight. |x|, min and max are written with its ramp `relu`; its
    step does not see their corners.
    """
    import heyoka as hy

    lanes = hy.recommended_simd_size()
    sizes = np.array([1.0] * N + [1e12] * Q)
    sizes[State._fields.index("alpha")] = 1e-3
    motion = in_terms_of(
        SimpleNamespace(
            sin=hy.sin, cos=hy.cos, sqrt=hy.sqrt, arctan=hy.atan,
            abs=lambda x: 2.0 * hy.relu(x) - x,
            maximum=lambda a, b: b + hy.relu(a - b),
            minimum=lambda a, b: a - hy.relu(a - b),
        )
    )  # fmt: skip
    variables = hy.make_vars(*(f"y{i}" for i in range(N + Q)))
    y = [v * size for v, size in zip(variables, sizes, strict=True)]
    p = Parameters(*(hy.par[i] for i in range(P)))
    at = motion(Moment(hy.time, 0.0), State(*y[:N]), p)
    rates = [*at.derivative, *at.powers]
    system = [
        (v, rate / size) for v, rate, size in zip(variables, rates, sizes, strict=True)
    ]

    @cache
    def compiled(tolerance: float) -> Any:
        empty = np.zeros((N + Q, lanes)), np.zeros((P, lanes))
        return hy.taylor_adaptive_batch(
            system, empty[0], pars=empty[1], tol=tolerance, compact_mode=False
        )

    def engine(machines: Machines, rtol: float) -> Callable[[], Responses]:
        start, table, marks = machines.start / sizes, machines.table, machines.marks
        taylor = compiled(rtol)

        def batch(first: int) -> Array:
            """Run as many as there are lanes; their number divides that of machines."""
            energy = np.zeros((lanes, len(marks), Q))
            taylor.set_time(0.0)
            taylor.state[:] = start[first : first + lanes].T
            taylor.pars[:] = table[first : first + lanes].T
            for k, mark in enumerate(marks[1:], 1):
                taylor.propagate_until([mark] * lanes, max_delta_t=[LONGEST] * lanes)
                reached = [
                    result[0] == hy.taylor_outcome.time_limit
                    for result in taylor.propagate_res
                ]
                energy[:, k] = (taylor.state[N:] * sizes[N:, None]).T
                energy[~np.array(reached), k] = np.nan
            return energy

        firsts = range(0, len(start), lanes)
        return lambda: responses(np.concatenate([batch(i) for i in firsts]))

    return engine


def diffrax_engine(solver: str) -> Engine:
    """Make one of diffrax's engines, all machines in one vmap, in doubles."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    motion = in_terms_of(jnp)

    def rates(t: Any, y: Any, row: Any) -> Any:
        at = motion(Moment(t, 0.0), State(*y[:N]), Parameters(*row))
        return jnp.stack([*at.derivative, *at.powers])

    def one(rtol: Any, marks: Any, start: Any, row: Any) -> Any:
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rates), getattr(diffrax, solver)(),
            marks[0], marks[-1], None, start, row,
            saveat=diffrax.SaveAt(ts=marks), max_steps=10_000_000, throw=False,
            stepsize_controller=diffrax.PIDController(
                rtol=NOTHING, atol=rtol * SCALES, dtmax=LONGEST
            ),
            adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        done = found.result == diffrax.RESULTS.successful
        return jnp.where(done, found.ys[:, N:], jnp.nan)

    many = jax.jit(jax.vmap(one, in_axes=(None, None, 0, 0)))

    @cache
    def compiled(n: int, marks: int) -> Any:
        kinds = [(), (marks,), (n, N + Q), (n, P)]
        return many.lower(
            *(jax.ShapeDtypeStruct(kind, jnp.float64) for kind in kinds)
        ).compile()

    def engine(machines: Machines, rtol: float) -> Callable[[], Responses]:
        start, table, marks = machines.start, machines.table, machines.marks
        run = compiled(len(start), len(marks))
        return lambda: responses(np.asarray(run(np.float64(rtol), marks, start, table)))

    return engine


PEERS: dict[str, Callable[[], Engine]] = {
    "heyoka Taylor": heyoka_engine,
    "diffrax Tsit5": lambda: diffrax_engine("Tsit5"),
    "diffrax Kvaerno3": lambda: diffrax_engine("Kvaerno3"),
    "numbalsoda LSODA": numbalsoda_engine,
    "SciPy LSODA": lambda: scipy_engine("LSODA"),
    "SciPy RK45": lambda: scipy_engine("RK45"),
    "SciPy BDF": lambda: scipy_engine("BDF"),
    "SciPy Radau": lambda: scipy_engine("Radau"),
}

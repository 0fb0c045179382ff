"""What crosses the border of compiled code, in Numba's types.

Explicit, with the rates as plain function pointers: one compiled integrator serves all
machines, and the disk cache finds it again.
"""

from __future__ import annotations

from typing import Any

from numba import types

from tolstat.integrator.problem import Accuracy, Block, Damping, Lanes, Solution, Step

numbers = types.float64[::1]
table = types.float64[:, ::1]
tables = types.float64[:, :, ::1]
integers = types.int64[::1]


def _tuple_type(fields: tuple[Any, ...]) -> Any:
    """Turn a named tuple of types into the type of such a named tuple."""
    return types.BaseTuple.from_types(fields, type(fields))


# (moment, y, p, out); see `problem.System`
rates_signature = types.void(table, table, table, table)
rates_type = types.FunctionType(rates_signature)

accuracy_type = _tuple_type(
    Accuracy(rtol=types.float64, max_step=types.float64, max_steps=types.int64)
)
block_type = _tuple_type(
    Block(
        start=table,
        parameters=table,
        marks=table,
        samples=numbers,
        watch_from=types.int64,
        accuracy=accuracy_type,
    )
)
solution_type = _tuple_type(
    Solution(
        states=tables,
        quadratures=tables,
        greatest=table,
        least=table,
        above=table,
        history=tables,
        status=integers,
        steps=integers,
    )
)

lanes_type = _tuple_type(
    Lanes(
        clock=table,
        y=table,
        p=table,
        quadratures=table,
        greatest=table,
        least=table,
        above=table,
        trial=integers,
        sample=integers,
    )
)
step_type = _tuple_type(
    Step(
        moment=table,
        k=tables,
        middle=table,
        end=table,
        filled_middle=table,
        filled_inside=table,
        watched_middle=table,
        watched_inside=table,
        crossings=integers,
        damping=_tuple_type(Damping(states=integers, lambda_h=table, share=table)),
    )
)

# (rates, watch, per_scale, lanes, step, block, solution)
march_signature = types.void(
    rates_type, rates_type, numbers, lanes_type, step_type, block_type, solution_type
)

"""What crosses the border of compiled code, in Numba's types.

Explicit, with the rates as plain function pointers: one compiled integrator serves all
machines, and the disk cache finds it again.
"""

from __future__ import annotations

from typing import Any

from numba import types

from tolstat.integrator.trials import Accuracy, Block, Solution

numbers = types.float64[::1]
table = types.float64[:, ::1]
tables = types.float64[:, :, ::1]
integers = types.int64[::1]


def _tuple_type(fields: tuple[Any, ...]) -> Any:
    """Turn a named tuple of types into the type of such a named tuple."""
    return types.BaseTuple.from_types(fields, type(fields))


# (moment, y, p, out); see `integrate.System`
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

# (rates, watch, scale, damped, block, solution)
march_signature = types.void(
    rates_type, rates_type, numbers, integers, block_type, solution_type
)

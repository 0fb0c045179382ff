"""Numba types of the arguments of compiled code.

They are explicit, with the rates as plain function pointers: one compiled integrator
serves all models, and the disk cache finds it.
"""

from typing import Any

from numba import types

from tolstat.integrator.problem import Accuracy, Block, Lanes, Results, Step

numbers = types.float64[::1]
table = types.float64[:, ::1]
tables = types.float64[:, :, ::1]
integers = types.int64[::1]


def tuple_type(names: type[Any], **others: Any) -> Any:
    """Return the type of a named tuple: every field is a table except for `others`."""
    fields = [others.get(name, table) for name in names._fields]
    return types.BaseTuple.from_types(fields, names)


# (moment, y, p, out); see `problem.System`
rates_signature = types.void(table, table, table, table)
rates_type = types.FunctionType(rates_signature)

number, integer = types.float64, types.int64
accuracy_type = tuple_type(Accuracy, rtol=number, max_step=number, max_steps=integer)
block_type = tuple_type(
    Block,
    parameters=tables,
    samples=numbers,
    watch_from=integer,
    accuracy=accuracy_type,
    jumps_at_marks=integer,
    ends=integers,
    sizes=numbers,
)
results_type = tuple_type(
    Results,
    arrived=tables,
    history=tables,
    status=integers,
    steps=integers,
    survey=tables,
)
lanes_type = tuple_type(Lanes)
step_type = tuple_type(
    Step, k=tables, crossings=integers, damped=integers, sloped=integers
)

# (rates, watch, jump, per_scale, lanes, step, block, results)
march_signature = types.void(
    *(rates_type,) * 3, numbers, lanes_type, step_type, block_type, results_type
)

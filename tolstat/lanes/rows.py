"""Views of plain arrays [row, lane], so that model equations are plain NumPy.

The same functions serve both ways of running the equations: uncompiled on NumPy
arrays of any number of lanes, compiled on arrays of WIDTH lanes in registers.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import (
    intrinsic,
    make_attribute_wrapper,
    models,
    overload,
    register_model,
)
from numpy.typing import NDArray

from tolstat.lanes import exponentials, trigonometry  # noqa: F401  NumPy's on them
from tolstat.lanes.vector import DOUBLES, WIDTH, instructions, vector

Names = TypeVar("Names")


def rows(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an array [row, lane] as rows of lanes.

    Parameters
    ----------
    array : float64[n, lanes]
        In compiled code C-contiguous with exactly WIDTH lanes.

    Returns
    -------
    rows
        `view[i]` is the i-th row of lanes, `view[i] = v` stores one, `len(view)` is n,
        `view[i:]` and `view[i:j]` are rows. Uncompiled it is the array itself.
    """
    return array


def named(names: type[Names], array: NDArray[np.float64]) -> Names:
    """Return an array [row, lane] as a named tuple, one row a field.

    Parameters
    ----------
    names : type
        A NamedTuple class; its i-th field names the i-th row.
    array : float64[n, lanes]
        Has at least as many rows as the class has fields.

    Returns
    -------
    names
        The fields hold rows of lanes.
    """
    return names(*array[: len(names._fields)])  # type: ignore[attr-defined]


class RowsType(types.Type):
    """Rows of lanes: the address of the first and their number."""

    def __init__(self) -> None:
        super().__init__(name="rows of lanes")


rows_type = RowsType()


@register_model(RowsType)
class RowsModel(models.StructModel):
    """An address and a count."""

    def __init__(self, dmm, fe_type):
        members = [("data", types.CPointer(types.float64)), ("count", types.intp)]
        super().__init__(dmm, fe_type, members)


make_attribute_wrapper(RowsType, "count", "count")


def _row_address(builder, data, index):
    """Return the address of a row; NumPy guarantees only 8-byte alignment."""
    lane = builder.mul(index, ir.Constant(index.type, WIDTH))
    return builder.bitcast(builder.gep(data, [lane]), DOUBLES.as_pointer())


def _load(builder, data, index):
    loaded = builder.load(_row_address(builder, data, index))
    loaded.align = 8
    return loaded


def _store(builder, data, index, value):
    builder.store(value, _row_address(builder, data, index)).align = 8


def _is_array_of_rows(array):
    return isinstance(array, types.Array) and array.ndim == 2 and array.layout == "C"


@intrinsic
def _view(typingctx, array):
    def codegen(context, builder, sig, args):
        plain = context.make_array(sig.args[0])(context, builder, args[0])
        view = cgutils.create_struct_proxy(rows_type)(context, builder)
        view.data = plain.data
        view.count = cgutils.unpack_tuple(builder, plain.shape)[0]
        return view._getvalue()

    return rows_type(array), codegen


@overload(rows)
def rows_of_array(array):
    """Compile `rows`."""
    return (lambda array: _view(array)) if _is_array_of_rows(array) else None


@intrinsic
def _named(typingctx, names, array):
    instance = names.instance_class
    tuple_type = types.NamedUniTuple(vector, len(instance._fields), instance)

    def codegen(context, builder, sig, args):
        plain = context.make_array(sig.args[1])(context, builder, args[1])
        index = [ir.Constant(ir.IntType(64), i) for i in range(len(tuple_type))]
        values = [_load(builder, plain.data, i) for i in index]
        return context.make_tuple(builder, tuple_type, values)

    return tuple_type(names, array), codegen


@overload(named)
def named_of_array(names, array):
    """Compile `named`."""
    if isinstance(names, types.NamedTupleClass) and _is_array_of_rows(array):
        return lambda names, array: _named(names, array)
    return None


@overload(len)
def length(view):
    """Compile `len(view)`."""
    return (lambda view: view.count) if view is rows_type else None


@instructions(vector, rows_type, types.intp)
def _get(builder, view, index):
    return _load(builder, builder.extract_value(view, 0), index)


@instructions(types.void, rows_type, types.intp, vector)
def _set(builder, view, index, value):
    _store(builder, builder.extract_value(view, 0), index, value)
    return ir.Constant(cgutils.voidptr_t, None)


@instructions(rows_type, rows_type, types.intp, types.intp)
def _part(builder, view, start, stop):
    data = builder.extract_value(view, 0)
    first = builder.bitcast(_row_address(builder, data, start), data.type)
    moved = builder.insert_value(view, first, 0)
    return builder.insert_value(moved, builder.sub(stop, start), 1)


@overload(operator.getitem)
def getitem(view, index):
    """Compile `view[i]` and, for i and j from 0 to n, `view[i:j]`."""
    if view is rows_type and isinstance(index, types.Integer):
        return lambda view, index: _get(view, index)
    if view is rows_type and isinstance(index, types.SliceType):
        # an omitted end is the greatest whole number
        return lambda view, index: _part(view, index.start, min(index.stop, len(view)))
    return None


@overload(operator.setitem)
def setitem(view, index, value):
    """Compile `view[i] = v`."""
    if view is rows_type and isinstance(index, types.Integer):
        return lambda view, index, value: _set(view, index, value)
    return None


def write(array: NDArray[np.float64], first: int, values: tuple[Any, ...]) -> None:
    """Store a tuple of rows in an array [row, lane], from a row onwards.

    Parameters
    ----------
    array : float64[n, lanes]
        Destination.
    first : int
        The row that takes the first value.
    values : tuple of float64[lanes], or of such tuples
        Values, in order.
    """
    for i, value in enumerate(_leaves(values)):
        array[first + i] = value


def _leaves(values: tuple[Any, ...]) -> Iterator[Any]:
    for value in values:
        yield from _leaves(value) if isinstance(value, tuple) else (value,)


def _flat(builder, values, kind):
    """Yield the values of a nested tuple, with their types."""
    for i, each in enumerate(kind):
        value = builder.extract_value(values, i)
        if isinstance(each, types.BaseTuple):
            yield from _flat(builder, value, each)
        else:
            yield value, each


@intrinsic
def _write(typingctx, array, first, values):
    def codegen(context, builder, sig, args):
        plain = context.make_array(sig.args[0])(context, builder, args[0])
        for i, (value, fromty) in enumerate(_flat(builder, args[2], sig.args[2])):
            value = context.cast(builder, value, fromty, vector)
            index = builder.add(args[1], ir.Constant(args[1].type, i))
            _store(builder, plain.data, index, value)
        return context.get_dummy_value()

    return types.void(array, types.intp, values), codegen


@overload(write)
def write_to_array(array, first, values):
    """Compile `write`."""
    if _is_array_of_rows(array) and isinstance(values, types.BaseTuple):
        return lambda array, first, values: _write(array, first, values)
    return None

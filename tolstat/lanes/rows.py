"""Views of plain arrays [row, lane], so that model equations are plain NumPy.

The same functions serve both ways of running the equations: uncompiled on NumPy
arrays of any number of lanes, compiled on arrays of WIDTH lanes in registers.
"""

import operator
from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typeconv import Conversion
from numba.extending import intrinsic, lower_cast, models, overload, register_model
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

from tolstat.lanes import elementary  # noqa: F401  NumPy's functions on vectors
from tolstat.lanes.vector import DOUBLES, WIDTH, Taught, teach, vector

Names = TypeVar("Names")


def rows(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an array [row, lane] as rows of lanes.

    Parameters
    ----------
    array : float64[n, lanes]
        In compiled code C-contiguous with exactly WIDTH lanes; there also a named tuple
        of such arrays, and float64[table, n, lanes].

    Returns
    -------
    rows
        `view[i]` is the i-th row of lanes, `view[i] = v` stores one, `len(view)` is n,
        `view[i:]` and `view[i:j]` are rows. Uncompiled it is the array itself. A named
        tuple has its arrays as rows; the i-th item of tables are rows.
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


class RowsType(Taught):
    """Rows of lanes: the address of the first and their number."""

    def __init__(self) -> None:
        super().__init__(name="rows of lanes")

    def can_convert_to(self, typingctx, other):
        """Return the conversion to a plain array, as equations take it."""
        return Conversion.safe if _is_array_of_rows(other) else None


class StackType(Taught):
    """Tables of rows: the address of the first, and the number of rows of each."""

    def __init__(self) -> None:
        super().__init__(name="tables of rows of lanes")


rows_type = RowsType()
stack_type = StackType()


@register_model(RowsType)
@register_model(StackType)
class RowsModel(models.StructModel):
    """An address and a count."""

    def __init__(self, dmm, fe_type):
        members = [("data", types.CPointer(types.float64)), ("count", types.intp)]
        super().__init__(dmm, fe_type, members)


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


@lower_cast(RowsType, types.Array)
def cast_rows(context, builder, fromty, toty, val):
    """Return a plain array of the rows."""
    data, count = (builder.extract_value(val, i) for i in (0, 1))
    size, lanes = (ir.Constant(ir.IntType(64), n) for n in (8, WIDTH))
    array = context.make_array(toty)(context, builder)
    shape, strides = [count, lanes], [ir.Constant(ir.IntType(64), 8 * WIDTH), size]
    populate_array(array, data, shape, strides, size, meminfo=None)
    return array._getvalue()


def _viewed(array):
    """Return the type of the view of an array or of a named tuple of arrays."""
    if isinstance(array, types.BaseNamedTuple):
        fields = [_viewed(field) or field for field in array.types]
        return types.BaseTuple.from_types(fields, array.instance_class)
    if isinstance(array, types.Array) and array.layout == "C":
        return {2: rows_type, 3: stack_type}.get(array.ndim)
    return None


def _view(context, builder, kind, value):
    if isinstance(kind, types.BaseNamedTuple):
        values = cgutils.unpack_tuple(builder, value)
        pairs = zip(kind, values, strict=True)
        views = [_view(context, builder, *pair) for pair in pairs]
        return context.make_tuple(builder, _viewed(kind), views)
    if _viewed(kind) is None:
        return value
    plain = context.make_array(kind)(context, builder, value)
    count = builder.extract_value(plain.shape, kind.ndim - 2)
    view = cgutils.create_struct_proxy(_viewed(kind))(context, builder)
    view.data, view.count = plain.data, count
    return view._getvalue()


@intrinsic
def _views(typingctx, array):
    def codegen(context, builder, sig, args):
        views = _view(context, builder, sig.args[0], args[0])
        # arrays of a tuple that are no rows are used twice
        return impl_ret_borrowed(context, builder, sig.return_type, views)

    return _viewed(array)(array), codegen


@overload(rows)
def rows_of_array(array):
    """Compile `rows`."""
    return (lambda array: _views(array)) if _viewed(array) else None


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


def _get(builder, view, index):
    return _load(builder, builder.extract_value(view, 0), index)


def _set(builder, view, index, value):
    _store(builder, builder.extract_value(view, 0), index, value)


def _number_address(builder, view, integer_pair):
    row, lane = (builder.extract_value(integer_pair, i) for i in (0, 1))
    first = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.gep(builder.extract_value(view, 0), [builder.add(first, lane)])


def _get_number(builder, view, integer_pair):
    return builder.load(_number_address(builder, view, integer_pair))


def _set_number(builder, view, integer_pair, value):
    builder.store(value, _number_address(builder, view, integer_pair))


def _part(builder, view, ends):
    """Return the rows from `start` to `stop`, both from 0 to the count."""
    start, stop = (builder.extract_value(ends, i) for i in (0, 1))
    data, count = builder.extract_value(view, 0), builder.extract_value(view, 1)
    # an omitted end is the greatest whole number
    inside = builder.icmp_signed("<", stop, count)
    stop = builder.select(inside, stop, count)
    first = builder.bitcast(_row_address(builder, data, start), data.type)
    moved = builder.insert_value(view, first, 0)
    return builder.insert_value(moved, builder.sub(stop, start), 1)


def _table(builder, stack, index):
    data, count = builder.extract_value(stack, 0), builder.extract_value(stack, 1)
    first = _row_address(builder, data, builder.mul(index, count))
    return builder.insert_value(stack, builder.bitcast(first, data.type), 0)


integer, integer_pair = types.intp, types.UniTuple(types.intp, 2)
teach(len, lambda builder, view: builder.extract_value(view, 1), integer, rows_type)
teach(operator.getitem, _get, vector, rows_type, integer)
teach(operator.getitem, _get_number, types.float64, rows_type, integer_pair)
teach(operator.getitem, _part, rows_type, rows_type, types.slice2_type)
teach(operator.getitem, _table, rows_type, stack_type, integer)
teach(operator.setitem, _set, types.void, rows_type, integer, vector)
teach(operator.setitem, _set_number, types.void, rows_type, integer_pair, types.float64)


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
    for i, item_type in enumerate(kind):
        value = builder.extract_value(values, i)
        if isinstance(item_type, types.BaseTuple):
            yield from _flat(builder, value, item_type)
        else:
            yield value, item_type


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

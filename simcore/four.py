"""Vectors of four numbers in compiled code: points, and what is done to all their coordinates."""

import operator

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import intrinsic, overload, register_model


class _Four(types.Type):
    """Four numbers that the machine takes at once: a point or a vector, and one more.

    Numba makes no such vectors of loops over three coordinates. Between two of them, kernels write
    + − × ÷ as between numbers: in every place that is what it would be for the numbers there, to
    the bit, as nothing is fused. They live in compiled code only.
    """


_FOUR, _REALS = _Four("Four"), ir.VectorType(ir.DoubleType(), 4)
_PLACE, _INDEX = ir.IntType(32), ir.IntType(64)
_ALIGNED = 8  # bytes, as numpy aligns numbers


@register_model(_Four)
class _FourModel(PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _REALS)


def _between_fours(operation, instruction: str) -> None:
    """Let kernels write an operation between two fours."""

    @intrinsic
    def at_once(typing, left, right):
        def generate(context, builder, signature, arguments):
            return getattr(builder, instruction)(*arguments)

        return _FOUR(left, right), generate

    @overload(operation)
    def choose(left, right):
        if left == right == _FOUR:
            return lambda left, right: at_once(left, right)
        return None


_between_fours(operator.add, "fadd")
_between_fours(operator.sub, "fsub")
_between_fours(operator.mul, "fmul")
_between_fours(operator.truediv, "fdiv")


@intrinsic
def spread(typing, number):
    """Return a number in all four places."""

    def generate(context, builder, signature, arguments):
        nothing = ir.Constant(_REALS, ir.Undefined)
        one = builder.insert_element(nothing, arguments[0], _PLACE(0))
        return _shuffled(builder, one, [0] * 4)

    return _FOUR(types.float64), generate


@intrinsic
def four_of(typing, rows, row):
    """Return a row of an (n, 4) float64."""

    def generate(context, builder, signature, arguments):
        start = _start(context, builder, signature, arguments, 4)
        loaded = builder.load(builder.bitcast(start, _REALS.as_pointer()))
        loaded.align = _ALIGNED
        return loaded

    return _FOUR(rows, types.uint64), generate


@intrinsic
def three_of(typing, rows, row):
    """Return a row of an (n, 3) float64, and 0: the number behind the last row is not read."""

    def generate(context, builder, signature, arguments):
        start = builder.bitcast(
            _start(context, builder, signature, arguments, 3), _REALS.as_pointer()
        )
        wanted = ir.Constant(ir.VectorType(ir.IntType(1), 4), [1, 1, 1, 0])
        load = get_or_insert_function(
            builder.module,
            ir.FunctionType(_REALS, [start.type, _PLACE, wanted.type, _REALS]),
            "llvm.masked.load.v4f64.p0",
        )
        return builder.call(load, [start, _PLACE(_ALIGNED), wanted, ir.Constant(_REALS, [0.0] * 4)])

    return _FOUR(rows, types.uint64), generate


@intrinsic
def put_four(typing, four, rows, row):
    """Write a row of an (n, 4) float64."""

    def generate(context, builder, signature, arguments):
        start = _start(context, builder, signature, arguments, 4)
        builder.store(arguments[0], builder.bitcast(start, _REALS.as_pointer())).align = _ALIGNED
        return context.get_dummy_value()

    return types.void(_FOUR, rows, types.uint64), generate


@intrinsic
def put_three(typing, four, rows, row):
    """Write the first three numbers as a row of an (n, 3) float64."""

    def generate(context, builder, signature, arguments):
        start = _start(context, builder, signature, arguments, 3)
        two = _shuffled(builder, arguments[0], [0, 1])
        builder.store(two, builder.bitcast(start, two.type.as_pointer())).align = _ALIGNED
        third = builder.extract_element(arguments[0], _PLACE(2))
        builder.store(third, builder.gep(start, [_INDEX(2)]))
        return context.get_dummy_value()

    return types.void(_FOUR, rows, types.uint64), generate


@intrinsic
def turned(typing, four):
    """Return (y, z, x, ·) of (x, y, z, ·).

    So that a × b is `turned(a * turned(b) - turned(a) * b)`, and so is a sum of such.
    """

    def generate(context, builder, signature, arguments):
        return _shuffled(builder, arguments[0], [1, 2, 0, 3])

    return _FOUR(_FOUR), generate


@intrinsic
def first_three(typing, four):
    """Return the first three numbers as a tuple."""
    signature = types.UniTuple(types.float64, 3)(_FOUR)

    def generate(context, builder, signature, arguments):
        numbers = [builder.extract_element(arguments[0], _PLACE(k)) for k in range(3)]
        return context.make_tuple(builder, signature.return_type, numbers)

    return signature, generate


def _start(context, builder, signature, arguments, width: int):
    """Return where a row starts; the array and the row are the last arguments."""
    kind, rows, row = signature.args[-2], *arguments[-2:]
    assert kind.layout == "C", kind  # rows are looked for where these have them
    data = context.make_array(kind)(context, builder, rows).data
    return builder.gep(data, [builder.mul(row, _INDEX(width))])


def _shuffled(builder, four, places: list[int]):
    """Return what is in these places."""
    chosen = ir.Constant(ir.VectorType(_PLACE, len(places)), places)
    return builder.shuffle_vector(four, four, chosen)

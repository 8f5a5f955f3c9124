"""Eight points at once against one: distances in the vectors of the machine.

Written in LLVM's own terms, as numba makes no vectors of a loop over eight entries: a fifth of the
time. They are compiled into the kernels that call them. Nothing is fused or summed in another
order, so that a distance is what a plain loop gives, to the bit.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

EIGHT = 8

_INDEX = ir.IntType(64)
_REALS, _INDICES = ir.VectorType(ir.DoubleType(), EIGHT), ir.VectorType(_INDEX, EIGHT)
_SINGLES = ir.VectorType(ir.FloatType(), EIGHT)
_PLACES, _BITS = ir.VectorType(ir.IntType(32), EIGHT), ir.IntType(EIGHT)
_ALIGNED = {_REALS: 8, _INDICES: 8, _SINGLES: 4}  # bytes, as numpy aligns numbers


@intrinsic
def nearest_of_eight(typing, points, group, targets, near, first, last, square, index):
    """Find which of the targets is nearest to each of eight points.

    Parameters
    ----------
    points : (g, 3, 8) float64
        Groups of eight points; infinite where there is none.
    group : int
        Which group.
    targets : (n, 3) float64
    near : (k,) int64
        Of the targets, those between `first` and `last` are looked at.
    square : (8,) float64, index : (8,) int64
        Written: squared distance and index of the nearest, the first of equals; infinite and −1
        where there is none.
    """
    signature = types.void(
        points, types.int64, targets, near, types.int64, types.int64, square, index
    )

    def generate(context, builder, signature, arguments):
        points, group, targets, near, first, last, square, index = _with_data(
            context, builder, signature, arguments
        )
        place = _eight_points(builder, points, group)
        least = cgutils.alloca_once_value(builder, _everywhere(float("inf")))
        found = cgutils.alloca_once_value(builder, ir.Constant(_INDICES, [-1] * EIGHT))
        with cgutils.for_range_slice(builder, first, last, _INDEX(1)) as (entry, _):
            target = builder.load(builder.gep(near, [entry]))
            here = _squares(builder, place, targets, target, _REALS)
            before = builder.load(least)
            closer = builder.fcmp_ordered("<", here, before)
            builder.store(builder.select(closer, here, before), least)
            known, this = builder.load(found), _eight_times(builder, target, _INDICES)
            builder.store(builder.select(closer, this, known), found)
        _store(builder, builder.load(least), square, _REALS)
        _store(builder, builder.load(found), index, _INDICES)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def squares_of_eight(typing, points, targets, count, squares, least):
    """Write the squared distances of eight points from the first targets, in single precision.

    Parameters
    ----------
    points : (3, 8) float32
        Infinite where there is none.
    targets : (m, 3) float32
    count : int
        Of the targets, so many are looked at.
    squares : (m, 8) float32
        Overwritten as far.
    least : (8,) float32
        Overwritten with the least of each point, infinite without any.
    """
    signature = types.void(points, targets, types.int64, squares, least)

    def generate(context, builder, signature, arguments):
        points, targets, count, squares, least = _with_data(context, builder, signature, arguments)
        place = [
            _load(builder, builder.gep(points, [_INDEX(a * EIGHT)]), _SINGLES) for a in range(3)
        ]
        nearest = cgutils.alloca_once_value(builder, _everywhere(float("inf"), _SINGLES))
        with cgutils.for_range(builder, count, intp=_INDEX) as loop:
            here = _squares(builder, place, targets, loop.index, _SINGLES)
            _store(
                builder, here, builder.gep(squares, [builder.mul(loop.index, _INDEX(EIGHT))]),
                _SINGLES,
            )
            before = builder.load(nearest)
            closer = builder.fcmp_ordered("<", here, before)
            builder.store(builder.select(closer, here, before), nearest)
        _store(builder, builder.load(nearest), least, _SINGLES)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def within_of_eight(typing, squares, target, limit):
    """Return whether any of eight points is as near to a target as its squared limit (8,) float32.

    `squares` (m, 8) are those of `squares_of_eight`.
    """
    signature = types.int64(squares, types.int64, limit)

    def generate(context, builder, signature, arguments):
        squares, target, limit = _with_data(context, builder, signature, arguments)
        here = _load(
            builder, builder.gep(squares, [builder.mul(target, _INDEX(EIGHT))]), _SINGLES)
        inside = builder.fcmp_ordered("<=", here, _load(builder, limit, _SINGLES))
        some = builder.icmp_unsigned("!=", builder.bitcast(inside, _BITS), _BITS(0))
        return builder.zext(some, _INDEX)

    return signature, generate


@intrinsic
def freedom_of_eight(typing, points, group, targets, near, first, last, normals, least, free):
    """Write how far eight points are free, as one target or another allows the least.

    A target allows the greater of (d − least)/2 and −n·(target − p)/(1 + b d), at a distance d. In
    single precision from the differences on.

    Parameters
    ----------
    normals : (n, 4) float64
        n, and b [1/m], of the targets.
    least : (8,) float32
        Distance of the nearest target from each point.
    free : (8,) float32
        Written: infinite without any target.
    Others
        As in `nearest_of_eight`.
    """
    signature = types.void(
        points, types.int64, targets, near, types.int64, types.int64, normals, least, free
    )

    def generate(context, builder, signature, arguments):
        points, group, targets, near, first, last, normals, least, free = _with_data(
            context, builder, signature, arguments
        )
        place, nearest = _eight_points(builder, points, group), _load(builder, least, _SINGLES)
        root = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(_SINGLES, [_SINGLES]), "llvm.sqrt.v8f32"
        )
        found = cgutils.alloca_once_value(builder, _everywhere(float("inf"), _SINGLES))
        with cgutils.for_range_slice(builder, first, last, _INDEX(1)) as (entry, _):
            target = builder.load(builder.gep(near, [entry]))
            ways = [
                builder.fptrunc(way, _SINGLES)
                for way in _ways(builder, place, targets, target, _REALS)
            ]
            *normal, bend = [
                _eight_times(builder, builder.fptrunc(each, ir.FloatType()), _SINGLES)
                for each in _row(builder, normals, target, 4)
            ]
            distance = builder.call(root, [_sum(builder, [builder.fmul(w, w) for w in ways])])
            # `ways` go from the target to the points, so that this is −n·(target − p).
            outside = _sum(builder, [
                builder.fmul(way, along) for way, along in zip(ways, normal, strict=True)
            ])
            turning = builder.fadd(_everywhere(1.0, _SINGLES), builder.fmul(distance, bend))
            until_touch = builder.fdiv(outside, turning)
            ahead = builder.fsub(distance, nearest)
            until_nearest = builder.fmul(ahead, _everywhere(0.5, _SINGLES))
            later = builder.fcmp_ordered(">", until_touch, until_nearest)
            allowed = builder.select(later, until_touch, until_nearest)
            before = builder.load(found)
            less = builder.fcmp_ordered("<", allowed, before)
            builder.store(builder.select(less, allowed, before), found)
        _store(builder, builder.load(found), free, _SINGLES)
        return context.get_dummy_value()

    return signature, generate


def _with_data(context, builder, signature, arguments) -> list:
    """Return the arguments, arrays as pointers to their entries."""
    return [
        context.make_array(kind)(context, builder, value).data
        if isinstance(kind, types.Array) else value
        for kind, value in zip(signature.args, arguments, strict=True)
    ]


def _eight_points(builder, points, group) -> list:
    """Return the coordinates of a group, each a vector."""
    start = builder.mul(group, _INDEX(3 * EIGHT))
    return [
        _load(builder, builder.gep(points, [builder.add(start, _INDEX(a * EIGHT))]), _REALS)
        for a in range(3)
    ]


def _squares(builder, place, targets, target, vector):
    """Return the squared distances of eight points from one target."""
    ways = _ways(builder, place, targets, target, vector)
    return _sum(builder, [builder.fmul(way, way) for way in ways])


def _ways(builder, place, targets, target, vector) -> list:
    """Return the coordinates of the ways from one target to eight points."""
    at = _row(builder, targets, target, 3)
    return [builder.fsub(place[a], _eight_times(builder, at[a], vector)) for a in range(3)]


def _row(builder, rows, index, width) -> list:
    """Return the numbers of one row of an array so wide."""
    start = builder.mul(index, _INDEX(width))
    return [builder.load(builder.gep(rows, [builder.add(start, _INDEX(a))])) for a in range(width)]


def _sum(builder, terms):
    """Return the sum of three vectors."""
    return builder.fadd(builder.fadd(terms[0], terms[1]), terms[2])


def _everywhere(number: float, vector=_REALS):
    """Return a constant vector."""
    return ir.Constant(vector, [number] * EIGHT)


def _eight_times(builder, value, vector):
    """Return a vector that holds the value in every place."""
    nothing = ir.Constant(vector, ir.Undefined)
    one = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, nothing, ir.Constant(_PLACES, [0] * EIGHT))


def _load(builder, pointer, vector):
    """Return the eight numbers that start at a pointer."""
    loaded = builder.load(builder.bitcast(pointer, vector.as_pointer()))
    loaded.align = _ALIGNED[vector]
    return loaded


def _store(builder, values, pointer, vector) -> None:
    """Write eight numbers from a pointer on."""
    stored = builder.store(values, builder.bitcast(pointer, vector.as_pointer()))
    stored.align = _ALIGNED[vector]

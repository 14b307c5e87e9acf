# mypy: disable-error-code="no-untyped-call, misc"
"""Several numbers at once in compiled code: one of each of ``WIDTH`` runs of the same computation, its lanes.

Loops over lanes are not left to the compiler: it does not know that arrays are apart, and computes one after
the other. A value of lanes is one of LLVM's vectors. Each lane is computed as a number alone would be:
products and sums are rounded one by one, in the order they are written. In arrays (n, ``WIDTH``) lanes come
last; nothing is checked.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic, models, register_model

WIDTH = 4
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
INT = ir.IntType(64)
DOUBLE_BYTES = 8
primitive: Callable[[Any], Any] = intrinsic


class LanesType(types.Type):
    """The type of a value of lanes."""

    def __init__(self) -> None:
        super().__init__("Lanes")


LANES = LanesType()


@register_model(LanesType)
class LanesModel(models.PrimitiveModel):
    """It is held in one register."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


def place_of(context: Any, builder: Any, kinds: Any, array: Any, row: Any) -> Any:
    """Where a row of an array (n, ``WIDTH``) is."""
    data = context.make_array(kinds[0])(context, builder, array).data
    first = builder.mul(context.cast(builder, row, kinds[1], types.intp), INT(WIDTH))
    return builder.bitcast(builder.gep(data, [first]), VECTOR.as_pointer())


@primitive
def at(typing_context: Any, array: Any, row: Any) -> Any:
    """The lanes in a row of an array (n, ``WIDTH``)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found = builder.load(place_of(context, builder, signature.args, *arguments))
        found.align = DOUBLE_BYTES
        return found

    return LANES(array, row), generate


@primitive
def put(typing_context: Any, array: Any, row: Any, lanes: Any) -> Any:
    """Row of an array (n, ``WIDTH``) ← lanes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *where, value = arguments
        builder.store(value, place_of(context, builder, signature.args, *where)).align = DOUBLE_BYTES
        return context.get_dummy_value()

    return types.void(array, row, lanes), generate


@primitive
def put_from(typing_context: Any, numbers: Any, first: Any, lanes: Any) -> Any:
    """``numbers`` (n,) from ``first`` on ← lanes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = context.cast(builder, arguments[1], signature.args[1], types.intp)
        there = builder.bitcast(builder.gep(data, [place]), VECTOR.as_pointer())
        builder.store(arguments[2], there).align = DOUBLE_BYTES
        return context.get_dummy_value()

    return types.void(numbers, first, lanes), generate


@primitive
def gathered(typing_context: Any, array: Any, column: Any) -> Any:
    """The lanes in a column of an array (``WIDTH``, n)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        struct = context.make_array(signature.args[0])(context, builder, arguments[0])
        place = context.cast(builder, arguments[1], signature.args[1], types.intp)
        size, found = builder.extract_value(struct.shape, 1), ir.Constant(VECTOR, ir.Undefined)
        for lane in range(WIDTH):
            item = builder.load(builder.gep(struct.data, [builder.add(place, builder.mul(size, INT(lane)))]))
            found = builder.insert_element(found, item, INT(lane))
        return found

    return LANES(array, column), generate


@primitive
def alike(typing_context: Any, number: Any) -> Any:
    """The same number in all lanes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = context.cast(builder, arguments[0], signature.args[0], types.float64)
        found = ir.Constant(VECTOR, ir.Undefined)
        for lane in range(WIDTH):
            found = builder.insert_element(found, value, INT(lane))
        return found

    return LANES(number), generate


@primitive
def plus(typing_context: Any, a: Any, b: Any) -> Any:
    """A + b."""
    return LANES(LANES, LANES), lambda context, builder, signature, args: builder.fadd(*args)


@primitive
def times(typing_context: Any, a: Any, b: Any) -> Any:
    """A b."""
    return LANES(LANES, LANES), lambda context, builder, signature, args: builder.fmul(*args)


@primitive
def over(typing_context: Any, a: Any, b: Any) -> Any:
    """a/b."""
    return LANES(LANES, LANES), lambda context, builder, signature, args: builder.fdiv(*args)


@primitive
def at_least(typing_context: Any, a: Any, least: Any) -> Any:
    """The larger one of each lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", *arguments), *arguments)

    return LANES(LANES, LANES), generate


@primitive
def is_any(typing_context: Any, a: Any) -> Any:
    """Whether a lane differs from 0."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        differs = builder.fcmp_unordered("!=", arguments[0], ir.Constant(VECTOR, [0.0] * WIDTH))
        bits = ir.IntType(WIDTH)
        return builder.icmp_unsigned("!=", builder.bitcast(differs, bits), bits(0))

    return types.boolean(LANES), generate


@primitive
def plus_product(typing_context: Any, x: Any, a: Any, b: Any) -> Any:
    """X + a b."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fadd(arguments[0], builder.fmul(*arguments[1:]))

    return LANES(LANES, LANES, LANES), generate


@primitive
def less_product(typing_context: Any, x: Any, a: Any, b: Any) -> Any:
    """X − a b."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fsub(arguments[0], builder.fmul(*arguments[1:]))

    return LANES(LANES, LANES, LANES), generate

"""Numbers at any byte of a buffer, little-endian, inside compiled code. Nothing is checked."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _loader(number: Any, n_bits: Any) -> Any:
    """``load(data, place)``: the number that starts at that byte of a contiguous array of bytes."""

    @intrinsic
    def load(typing_context: Any, data: Any, place: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            start = builder.gep(array.data, [arguments[1]])
            found = builder.load(builder.bitcast(start, n_bits.as_pointer()))
            found.align = 1
            return found

        return number(data, place), generate

    return load


load_u16 = _loader(types.uint16, ir.IntType(16))
load_u32 = _loader(types.uint32, ir.IntType(32))
load_i64 = _loader(types.int64, ir.IntType(64))
load_u64 = _loader(types.uint64, ir.IntType(64))
load_f64 = _loader(types.float64, ir.DoubleType())
load_f32 = _loader(types.float32, ir.FloatType())

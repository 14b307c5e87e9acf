"""Numbers at any byte of a buffer, little-endian, inside compiled code. Nothing is checked.

A load that need not be aligned is generated directly; with a version of numba that was not tried, the bytes
are copied to where they are aligned.
"""

from typing import Any

import numpy as np

from wmr_schemas.compiled.internals import kernel_class


def _generated(number: Any, n_bits: Any) -> Any:
    """``load(data, place)``: the number that starts at that byte of a contiguous array of bytes."""
    from numba.extending import intrinsic  # noqa: PLC0415

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


def _copied(dtype: Any) -> Any:
    """The same by a copy of the bytes."""
    from numba import njit  # noqa: PLC0415

    size = np.dtype(dtype).itemsize

    @njit
    def load(data: Any, place: Any) -> Any:
        return data[place : place + size].copy().view(dtype)[0]

    return load


def _loader(dtype: Any) -> Any:
    if kernel_class() is None:
        return _copied(dtype)
    from llvmlite import ir  # noqa: PLC0415
    from numba import from_dtype  # noqa: PLC0415

    kind, n_bits = np.dtype(dtype).kind, 8 * np.dtype(dtype).itemsize
    floats = {32: ir.FloatType(), 64: ir.DoubleType()}
    return _generated(from_dtype(np.dtype(dtype)), floats[n_bits] if kind == "f" else ir.IntType(n_bits))


load_u16 = _loader(np.uint16)
load_u32 = _loader(np.uint32)
load_i64 = _loader(np.int64)
load_u64 = _loader(np.uint64)
load_f64 = _loader(np.float64)
load_f32 = _loader(np.float32)

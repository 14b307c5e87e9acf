# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""Loops over ``range`` as values where numba's lowering puts them into memory; see :mod:`.lowering`."""

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types

INT = ir.IntType(64)


def range_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """``range(stop)``, ``range(start, stop)`` or ``range(start, stop, step)`` as a value."""
    start, stop, step = (INT(0), *args, INT(1)) if len(args) == 1 else (*args, INT(1))[:3]
    made = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    for place, value in enumerate((start, stop, step)):
        made = builder.insert_value(made, value, place)
    return made


def iterator_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """The iterator of a range with the step 1; None for others."""
    start, stop, step = (builder.extract_value(args[0], place) for place in range(3))
    if not (isinstance(step, ir.Constant) and int(step.constant) == 1):
        return None
    count = builder.sub(stop, start)
    count = builder.select(builder.icmp_signed(">", count, INT(0)), count, INT(0))
    made = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    for place, value in enumerate((start, stop, step, count)):
        held = value if place in (1, 2) else cgutils.alloca_once(builder, INT)
        if held is not value:
            builder.store(value, held)
        made = builder.insert_value(made, held, place)
    return made


def next_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """The next number and whether there is one, a pair; what is left is counted down."""
    now, step, left = (builder.extract_value(args[0], place) for place in (0, 2, 3))
    count, value = builder.load(left), builder.load(now)
    valid = builder.icmp_signed(">", count, INT(0))
    with builder.if_then(valid):
        builder.store(builder.sub(count, INT(1), flags=["nsw"]), left)
        builder.store(builder.add(value, step), now)
    pair = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    return builder.insert_value(builder.insert_value(pair, value, 0), valid, 1)


def implementation_of(get_function: Any) -> Any:
    """``BaseContext.get_function`` with those of ranges of 64-bit numbers."""

    def found(self: Any, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        def bound(implement: Any, usual: Any = None) -> Any:
            def implemented(builder: Any, args: Any, loc: Any = None) -> Any:
                made = implement(self, builder, sig, args)
                return usual(builder, args, loc) if made is None else made

            return implemented

        if fn == "iternext" and sig.args == (types.range_iter64_type,):
            return bound(next_of)
        usual = get_function(self, fn, sig, _firstcall)
        if fn == "getiter" and sig.args == (types.range_state64_type,):
            return bound(iterator_of, usual)
        is_range = sig.return_type == types.range_state64_type and getattr(fn, "typing_key", None) is range
        return bound(range_of) if is_range and set(sig.args) == {types.int64} else usual

    return found


def pair_first(self: Any, builder: Any, value: Any, kind: Any) -> Any:
    """``BaseContext.pair_first``."""
    return builder.extract_value(value, 0)


def pair_second(self: Any, builder: Any, value: Any, kind: Any) -> Any:
    """``BaseContext.pair_second``."""
    return builder.extract_value(value, 1)

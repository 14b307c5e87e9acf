# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""numba's lowering to LLVM, in fewer instructions; see :mod:`.front_end`.

numba puts an array into memory for each item that is read, and the compiler takes it out again. More than
half of a module's instructions come from this, from loops over ``range``, and from arguments that are taken
apart and put together. Each of them costs time four times: where it is made, written as text, read back, and
optimised away. Here arrays and ranges stay values; items, views and loops are computed by numba's formulas.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

from llvmlite.ir import IRBuilder
from llvmlite.ir.instructions import InsertValue
from numba.core.analysis import must_use_alloca
from numba.core.base import BaseContext
from numba.core.ir import Assign
from numba.core.lowering import Lower
from numba.np import arrayobj

from wmr_schemas.compiled import arrays, ranges


def extracted(extract_value: Any) -> Any:
    """``IRBuilder.extract_value`` that finds a member which was put in before, without an instruction."""

    def extract(self: Any, agg: Any, idx: Any, name: str = "") -> Any:
        wanted, holder = (list(idx) if isinstance(idx, (tuple, list)) else [idx]), agg
        while type(holder) is InsertValue:
            if list(holder.indices) == wanted:
                return holder.value
            if len(holder.indices) != len(wanted):
                break
            holder = holder.aggregate
        return extract_value(self, agg, idx, name)

    return extract


def variables_as_values(find: Any) -> Any:
    """``Lower._find_singly_assigned_variable``: those of numba, and variables that the first block assigns
    once for the whole function. They need no memory, since every block comes after the first.

    One that holds a counted reference is left in memory, where numba marks that it was given up.
    """

    def found(self: Any) -> None:
        find(self)
        first = min(self.blocks)
        is_in_loop = any(first in block.terminator.get_targets() for block in self.blocks.values())
        if self.func_ir.func_id.is_generator or is_in_loop:
            return
        times = Counter(s.target.name for block in self.blocks.values() for s in block.find_insts(Assign))
        once = {s.target.name for s in self.blocks[first].find_insts(Assign) if times[s.target.name] == 1}
        models = self.context.data_model_manager
        if self.context.enable_nrt:
            once = {name for name in once if not models[self.typeof(name)].contains_nrt_meminfo()}
        self._singly_assigned_vars |= once - must_use_alloca(self.blocks)

    return found


def replacements() -> Iterator[tuple[Any, str, Any]]:
    """Owner, attribute and the value in its place."""
    yield IRBuilder, "extract_value", extracted(IRBuilder.extract_value)
    yield Lower, "_find_singly_assigned_variable", variables_as_values(Lower._find_singly_assigned_variable)
    yield arrayobj, "make_array", arrays.structure_of(arrayobj.make_array)
    yield arrayobj, "basic_indexing", arrays.item_pointer(arrayobj.basic_indexing)
    yield arrayobj, "_getitem_array_generic", arrays.item_or_view
    yield BaseContext, "get_function", ranges.implementation_of(BaseContext.get_function)
    yield BaseContext, "pair_first", ranges.pair_first
    yield BaseContext, "pair_second", ranges.pair_second

# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""Arrays as values where numba's lowering puts them into memory; see :mod:`.lowering`."""

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.np import arrayobj

INT = ir.IntType(64)


class ArrayValue:
    """The members of an array that is a value; in place of ``arrayobj.make_array``'s structure in memory."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self._context, self._builder, self._fe_type, self._value = context, builder, kind, value
        self._datamodel = context.data_model_manager[kind]

    def __getattr__(self, field: str) -> Any:
        if field.startswith("_"):
            raise AttributeError(field)
        return self._builder.extract_value(self._value, self._datamodel.get_field_position(field))

    def _getvalue(self) -> Any:
        return self._value


def structure_of(make_array: Any) -> Any:
    """``arrayobj.make_array`` that leaves a given value as it is."""

    def structure(kind: Any) -> Any:
        def made(context: Any, builder: Any, value: Any = None, ref: Any = None) -> Any:
            if value is None or ref is not None or type(kind) is not types.Array:
                return make_array(kind)(context, builder, value, ref)
            return ArrayValue(context, builder, kind, value)

        return made

    return structure


def place_of(context: Any, builder: Any, index: Any, kind: Any, size: Any) -> Any:
    """A whole number as an index along an axis; a negative one counts from the end."""
    place = context.cast(builder, index, kind, types.intp)
    if isinstance(place, ir.Constant) and int(place.constant) >= 0:
        return place
    negative = builder.icmp_signed("<", place, INT(0))
    return builder.select(negative, builder.add(place, size), place)


def item_pointer(basic_indexing: Any) -> Any:
    """``arrayobj.basic_indexing``, quick where all indices are whole numbers."""

    def pointed(
        context: Any, builder: Any, kind: Any, array: Any, index_kinds: Any, indices: Any, boundscheck: Any
    ) -> Any:
        whole = all(isinstance(t, types.Integer) and t.signed for t in index_kinds)
        if boundscheck or not whole or not indices or kind.layout == "F":
            return basic_indexing(context, builder, kind, array, index_kinds, indices, boundscheck)
        n, axes = len(indices), range(kind.ndim)
        sizes = [builder.extract_value(array.shape, axis) for axis in axes]
        strides = [builder.extract_value(array.strides, axis) for axis in axes]
        places = [
            place_of(context, builder, index, t, size)
            for index, t, size in zip(indices, index_kinds, sizes, strict=False)
        ]
        if kind.layout == "A":
            bytes_in = total(builder, [builder.mul(s, i) for s, i in zip(strides, places, strict=False)])
            return cgutils.pointer_add(builder, array.data, bytes_in), sizes[n:], strides[n:]
        steps = [product(builder, [place, *sizes[axis + 1 :]]) for axis, place in enumerate(places)]
        return builder.gep(array.data, [total(builder, steps)]), sizes[n:], strides[n:]

    return pointed


def product(builder: Any, factors: list[Any]) -> Any:
    """The first factor times the product of the others, as numba multiplies them; 0 without instructions."""
    first, *others = factors
    if not others or (isinstance(first, ir.Constant) and int(first.constant) == 0):
        return first
    step = others[0]
    for other in others[1:]:
        step = builder.mul(step, other)
    return builder.mul(first, step)


def total(builder: Any, terms: list[Any]) -> Any:
    """The sum of whole numbers; zeros take no instruction."""
    terms = [t for t in terms if not (isinstance(t, ir.Constant) and int(t.constant) == 0)] or [INT(0)]
    summed = terms[0]
    for term in terms[1:]:
        summed = builder.add(summed, term)
    return summed


def item_or_view(
    context: Any, builder: Any, result: Any, kind: Any, array: Any, index_kinds: Any, indices: Any
) -> Any:
    """``arrayobj._getitem_array_generic``: a view is a value."""
    data, shapes, strides = arrayobj.basic_indexing(
        context, builder, kind, array, index_kinds, indices, boundscheck=context.enable_boundscheck
    )
    if not isinstance(result, types.Buffer):
        return arrayobj.load_item(context, builder, kind, data)
    model = context.data_model_manager[result]
    members = {
        "meminfo": array.meminfo,
        "parent": array.parent,
        "nitems": product(builder, shapes) if shapes else INT(1),
        "itemsize": array.itemsize,
        "data": data,
        "shape": cgutils.pack_array(builder, shapes, INT),
        "strides": cgutils.pack_array(builder, strides, INT),
    }
    view = ir.Constant(model.get_value_type(), ir.Undefined)
    for name, value in members.items():
        view = builder.insert_value(view, value, model.get_field_position(name))
    return view

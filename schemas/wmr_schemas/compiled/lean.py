"""Compiled functions that only read and write the arrays they are given."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from wmr_schemas.compiled import compiled

P = ParamSpec("P")
R = TypeVar("R")


def lean(function: Callable[P, R]) -> Callable[P, R]:
    """Compiled without numba's count of references to arrays; such a function cannot allocate.

    It may make views of arrays, but not return one. Division by zero gives inf or NaN. Where small functions
    call each other for every number, counting takes longer than the work, and half of the code that is
    compiled serves it.
    """
    return compiled(nogil=True, _nrt=False, error_model="numpy")(function)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """:func:`lean`, its code repeated in every compiled function that calls it.

    A call passes every field of every array, and of every array in a named tuple, one by one, which can take
    as long as the work. For what is called for every row, from few places: more code takes longer to compile.
    """
    return compiled(nogil=True, forceinline=True, _nrt=False, error_model="numpy")(function)

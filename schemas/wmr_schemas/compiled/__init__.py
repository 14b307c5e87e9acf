"""The one way in which this project compiles functions: numba's ``njit`` with a cache."""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, overload

from numba import njit

P = ParamSpec("P")
R = TypeVar("R")


@overload
def compiled(function: Callable[P, R]) -> Callable[P, R]: ...
@overload
def compiled(**options: Any) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def compiled(function: Any = None, **options: Any) -> Any:
    """``function`` compiled on its first call; ``options`` as of ``numba.njit``."""
    decorator = njit(cache=True, **options)
    return decorator if function is None else decorator(function)

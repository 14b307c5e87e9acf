"""The one way in which this project compiles functions, and where the compiled code is kept.

``@compiled`` and ``@lean`` (see :mod:`wmr_schemas.compiled.lean`) compile a function on its first call.
The result is kept in the user's cache directory, below a hash of everything that it depends on: the sources
of all packages whose functions may call each other, the versions of Python, numba and llvmlite, and the
processor. Code compiled from other sources is therefore never found. See :mod:`wmr_schemas.compiled.state`.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, overload

from wmr_schemas.compiled.notice import on_compiling
from wmr_schemas.compiled.state import CACHE_VARIABLE, register_sources, state_directory

P = ParamSpec("P")
R = TypeVar("R")

__all__ = ["CACHE_VARIABLE", "compiled", "on_compiling", "register_sources", "state_directory"]


@overload
def compiled(function: Callable[P, R]) -> Callable[P, R]: ...
@overload
def compiled(**options: Any) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def compiled(function: Any = None, **options: Any) -> Any:
    """``function`` compiled on its first call; ``options`` as of ``numba.njit``."""
    from wmr_schemas.compiled.internals import decorate  # noqa: PLC0415 – numba is loaded where it is needed

    if function is None:
        return lambda later: decorate(later, options)
    return decorate(function, options)

"""Who is told that a function is about to be compiled: compiling takes seconds, and nothing else shows it."""

from collections.abc import Callable

_callbacks: list[Callable[[str], None]] = []


def on_compiling(callback: Callable[[str], None]) -> Callable[[], None]:
    """Call ``callback`` with a function's name whenever one that is not in the cache is about to be compiled.

    Returns a function that takes the callback away again.
    """
    _callbacks.append(callback)
    return lambda: _callbacks.remove(callback) if callback in _callbacks else None


def tell(name: str) -> None:
    """Call every callback."""
    for callback in tuple(_callbacks):
        callback(name)

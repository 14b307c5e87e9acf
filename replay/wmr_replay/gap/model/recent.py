"""What was computed last, by what it follows from: a search asks for the same pass of a filter repeatedly."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

V = TypeVar("V")


class Recent(Generic[V]):
    """The values that were asked for last, up to ``most_bytes`` by ``size_of``, and the last two at least.

    Whoever gets a value shares it, and does not write to it.
    """

    def __init__(self, most_bytes: int, size_of: Callable[[V], int]) -> None:
        self._most_bytes, self._size_of = most_bytes, size_of
        self._kept: OrderedDict[Hashable, V] = OrderedDict()
        self._bytes = 0

    def __contains__(self, key: Hashable) -> bool:
        """Whether the value of ``key`` is kept."""
        return key in self._kept

    def get(self, key: Hashable, compute: Callable[[], V]) -> V:
        """The value of ``key``; computed where it is not kept."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        value = self._kept[key] = compute()
        self._bytes += self._size_of(value)
        while self._bytes > self._most_bytes and len(self._kept) > 2:
            self._bytes -= self._size_of(self._kept.popitem(last=False)[1])
        return value

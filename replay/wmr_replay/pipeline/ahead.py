"""Work in a thread ahead of the caller's: reading and aligning, while earlier rows pass the later stages."""

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

T = TypeVar("T")


class _End:
    """Stands behind the last item."""


_END: Final = _End()


def ahead(items: Iterable[T]) -> Iterator[T]:
    """The same items in their order, each made in another thread while the caller uses the one before.

    An error of making one is raised in its place. Whoever stops early waits for the one that is being made.
    """
    source = iter(items)

    def following() -> T | _End:
        return next(source, _END)

    with ThreadPoolExecutor(1, "ahead") as thread:
        made = thread.submit(following)
        while not isinstance(item := made.result(), _End):
            made = thread.submit(following)
            yield item

"""The same work on the workers of a Dask cluster that exists already (extra ``cluster``)."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, TypeVar

from wmr_schemas.errors import InvalidSetting, MissingExtra

T = TypeVar("T")
_CONNECT_S = 20
_RETRIES = 2


class Cluster(Generic[T]):
    """``map`` as of :class:`wmr_replay.fleet.pool.Pool`. Tasks of a worker that is lost are given to others;
    one that has taken three workers with it becomes a text that says so.

    Raises MissingExtra, and InvalidSetting when no scheduler answers at the address.
    """

    def __init__(self, address: str) -> None:
        try:
            import distributed  # noqa: PLC0415 – an extra
        except ImportError as error:
            raise MissingExtra("cluster", "--scheduler", error.name) from None
        try:
            self._dask: Any = distributed
            self._client = self._dask.Client(address, timeout=_CONNECT_S)
        except (OSError, ValueError) as error:
            raise InvalidSetting(f"--scheduler {address}: no Dask scheduler answers ({error})") from None

    def __enter__(self) -> "Cluster[T]":
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def map(
        self, function: Callable[..., T], tasks: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, T | Exception]]:
        """Call ``function(*task)`` for every task; what a task raises is its result."""
        submit = self._client.submit
        futures = [submit(function, *task, pure=False, retries=_RETRIES) for task in tasks]
        order = {future.key: index for index, future in enumerate(futures)}
        try:
            for future in self._dask.as_completed(futures):
                error = future.exception()
                yield order[future.key], future.result() if error is None else error
        finally:
            self._client.cancel(futures)

"""Which sums the monitors use: the compiled ones in a replay; plain ones where nothing is to be compiled."""

from collections.abc import Callable
from typing import NamedTuple

from wmr_replay.quality import compiled_sums, plain_sums
from wmr_schemas.arrays import F64, I64


class Sums(NamedTuple):
    """The functions of :mod:`~wmr_replay.quality.plain_sums` or :mod:`~wmr_replay.quality.compiled_sums`."""

    add_up: Callable[[F64, I64, F64, F64], None]
    add_rows: Callable[[F64, F64, F64, I64, F64], int]
    add_differences: Callable[[F64, F64, tuple[int, int, int], float, F64], None]
    count_votes: Callable[[I64, I64, F64, F64, F64, F64], None]


PLAIN, COMPILED = (
    Sums(module.add_up, module.add_rows, module.add_differences, module.count_votes)
    for module in (plain_sums, compiled_sums)
)

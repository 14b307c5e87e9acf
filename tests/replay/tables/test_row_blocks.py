"""Rows gathered into blocks."""

from itertools import pairwise

import numpy as np
import pytest

from wmr_replay.tables.row_blocks import RowBlocks

NAMES = ("t_ns", "mode", "alpha")


def batch(first: int, n: int, *, alpha: bool = True) -> dict[str, np.ndarray]:
    t_ns = np.arange(first, first + n)
    columns = {"t_ns": t_ns, "mode": (t_ns % 3).astype(np.int8), "further": t_ns}
    return columns | ({"alpha": t_ns / 7} if alpha else {})


@pytest.mark.parametrize("cuts", [[], [3], [10, 20], [1, 2, 11, 29], [0, 25]])
def test_blocks_depend_on_the_rows_alone(cuts):
    blocks, edges = RowBlocks(NAMES, 10), [0, *cuts, 33]
    parts = [batch(a, b - a) for a, b in pairwise(edges)]
    found = [block for part in parts for block in blocks.push(part)] + list(blocks.finish())
    assert [len(block["t_ns"]) for block in found] == [10, 10, 10, 3]
    for k, block in enumerate(found):
        expected = batch(10 * k, len(block["t_ns"]))
        assert set(block) == set(NAMES)
        assert all(np.array_equal(block[name], expected[name]) for name in NAMES)
        assert block["mode"].dtype == np.int8
    assert list(blocks.finish()) == []


@pytest.mark.parametrize("lacking", [0, 1])
def test_a_column_that_a_batch_lacks_is_unknown_there(lacking):
    blocks = RowBlocks(NAMES, 10)
    for k in range(2):
        list(blocks.push(batch(3 * k, 3, alpha=k != lacking)))
    (block,) = blocks.finish()
    assert np.array_equal(np.isnan(block["alpha"]), np.repeat([lacking == 0, lacking == 1], 3))

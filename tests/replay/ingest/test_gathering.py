"""Batches are joined in their order, with their bars, up to a number of rows."""

import numpy as np
import pytest

from wmr_replay.ingest import gathered
from wmr_replay.ingest.gathering import MOST_ROWS, n_rows
from wmr_replay.ingest.reading import PARTS
from wmr_schemas.batches import Bar, RawBatch, Rows
from wmr_schemas.status import Status


def rows(start, n, n_columns):
    order = np.arange(start, start + n)
    return Rows(10 * order, order, np.tile(order.astype(float), (n_columns, 1)))


def batch(start, n_pose, n_torque):
    bars = (Bar("tilted", start, Status.OK),)
    return RawBatch(rows(start, n_pose, 3), rows(start, n_torque, 4), rows(start, 0, 1), bars=bars)


def batches(sizes):
    starts = np.cumsum([0, *sizes])[:-1]
    return [batch(int(start), n, n // 2) for start, n in zip(starts, sizes, strict=True)]


@pytest.mark.parametrize(
    "sizes", [[], [5], [0, 3, 0], [MOST_ROWS // 4] * 7, [MOST_ROWS, 1, MOST_ROWS * 2, 10, 10]]
)
def test_rows_and_bars_are_the_same_in_their_order(sizes):
    given, joined = batches(sizes), list(gathered(batches(sizes)))
    for name in PARTS:
        for field in ("t_ns", "order", "values"):
            parts, whole = ([getattr(getattr(b, name), field) for b in bs] for bs in (given, joined))
            if parts:
                assert np.array_equal(np.concatenate(whole, axis=-1), np.concatenate(parts, axis=-1))
    assert [bar for b in joined for bar in b.bars] == [bar for b in given for bar in b.bars]


def test_no_batch_is_longer_than_it_was_given_or_may_be():
    third = MOST_ROWS // 4  # with its torques more than a third of what fits
    sizes = [third, third, third, MOST_ROWS, 10, 10, 10]
    lengths = [third * 3, third * 3 // 2, MOST_ROWS * 3 // 2, 45]
    assert [n_rows(b) for b in gathered(batches(sizes))] == lengths


def test_an_error_of_the_reader_comes_behind_the_rows_before_it():
    def failing():
        yield batch(0, MOST_ROWS, 0)
        yield batch(MOST_ROWS, 10, 0)
        raise ValueError("unreadable")

    seen = []
    with pytest.raises(ValueError, match="unreadable"):
        seen.extend(gathered(failing()))
    assert [len(b.pose) for b in seen] == [MOST_ROWS]

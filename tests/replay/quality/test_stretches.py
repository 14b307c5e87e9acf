"""Stretches of marked rows do not depend on the batches."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.quality import Stretches
from wmr_replay.quality.stretches import MOST_STRETCHES


def runs(marked: list[bool]) -> list[tuple[float, float]]:
    """First and last index of each run of marked rows, one row after another."""
    found: list[tuple[float, float]] = []
    for k, mark in enumerate(marked):
        if mark and k and marked[k - 1]:
            found[-1] = (found[-1][0], float(k))
        elif mark:
            found.append((float(k), float(k)))
    return found


@given(st.lists(st.booleans(), max_size=60), st.lists(st.integers(0, 60), max_size=6))
def test_stretches_are_the_runs_of_marked_rows_whatever_the_batches(
    marked: list[bool], cuts: list[int]
) -> None:
    stretches, t_s = Stretches(), np.arange(len(marked), dtype=float)
    edges = [0, *sorted(min(c, len(marked)) for c in cuts), len(marked)]
    for begin, end in pairwise(edges):
        stretches.push(t_s[begin:end], np.array(marked[begin:end], bool))
    assert stretches.n == sum(marked)
    assert stretches.n_stretches == len(runs(marked))
    assert list(stretches.where) == runs(marked)[:MOST_STRETCHES]

"""Of fast logs every few rows are looked at: the same ones in any batches."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.quality.thinning import STEP_NS, Thinning

STAMPS = st.lists(st.integers(1, 3 * STEP_NS), min_size=1, max_size=60).map(np.cumsum)


@given(STAMPS, st.lists(st.integers(0, 60), max_size=6), st.integers(-(10**18), 10**18))
def test_the_first_row_of_each_step_of_the_clock_is_kept_in_any_batches(t_ns, cuts, origin):
    t_ns = (t_ns + origin).astype(np.int64)
    expected = [k for k in range(len(t_ns)) if k == 0 or t_ns[k] // STEP_NS != t_ns[k - 1] // STEP_NS]
    edges = [0, *sorted(min(c, len(t_ns)) for c in cuts), len(t_ns)]
    thinning = Thinning()
    kept = [a + thinning.push(t_ns[a:b]) for a, b in pairwise(edges)]
    assert np.concatenate(kept).tolist() == expected


def test_of_a_log_at_250_hz_no_row_is_left_out_and_of_one_at_1_khz_three_of_four():
    t_ns = np.arange(1000) * STEP_NS + 123_456
    assert Thinning().push(t_ns).tolist() == list(range(1000))
    assert len(Thinning().push(np.arange(1000) * 1_000_000)) == 250

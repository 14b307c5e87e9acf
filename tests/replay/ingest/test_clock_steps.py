"""Clocks that are set while a log is recorded: what is taken for a correction, and what is not."""

from itertools import pairwise
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.ingest.channels.clock_steps import HOLDS_S, ClockSteps
from wmr_schemas.batches import Rows

TOPICS = {"pose": "/pose", "torque": "/wheel_torques"}
AT_S, LENGTH_S = 6.0, 12.0
RATES_HZ = {"pose": 50.0, "torque": 100.0}
NONE = MappingProxyType({})


def nothing(t_s):
    return np.zeros_like(t_s)


def after(size_s, at_s=AT_S, until_s=np.inf):
    return lambda t_s: np.where((t_s > at_s) & (t_s <= until_s), size_s, 0.0)


def draining(t_s):
    """A link that stalls for 4 s, then empties its queue at three times the speed."""
    return np.clip(AT_S + 4.0 - t_s, 0.0, 4.0) * (t_s > AT_S) + np.where(
        (t_s > AT_S) & (t_s < AT_S + 4), (t_s - AT_S) / 3, 0.0
    )


def arrivals(*, stamps=NONE, delays=NONE, recorder=nothing, seed=0):
    """Stamps, log times and ordinals by role, as a recorder sees them; transport jitters by 5 ms."""
    rng, found = np.random.default_rng(seed), {}
    for role, rate_hz in RATES_HZ.items():
        t_s = np.arange(0, LENGTH_S, 1 / rate_hz)
        arrival_s = t_s + np.abs(rng.normal(0.02, 0.005, len(t_s))) + delays.get(role, nothing)(t_s)
        found[role] = t_s, t_s + stamps.get(role, nothing)(t_s), np.sort(arrival_s)
    everything = np.concatenate([arrival_s for *_, arrival_s in found.values()])
    order = np.argsort(np.argsort(everything, kind="stable"))
    parts = np.split(order, [len(found["pose"][0])])
    ns = lambda s: np.rint(1e9 * s).astype(np.int64)  # noqa: E731
    return {
        role: (true_s, ns(stamp_s), ns(logged + recorder(logged)), part)
        for (role, (true_s, stamp_s, logged)), part in zip(found.items(), parts, strict=True)
    }


def restamped(messages, cuts=()):
    """Stamps in s by role after the stage, pushed in pieces cut at ordinals, and the findings."""
    watch, pieces = ClockSteps(TOPICS), {role: [] for role in messages}
    for begin, end in pairwise([0, *sorted(cuts), 10**9]):
        new = {}
        for role, (_, t_ns, log_ns, order) in messages.items():
            part = (order >= begin) & (order < end)
            new[role] = Rows(t_ns[part], order[part], np.zeros((1, part.sum()))), log_ns[part]
        for role, rows in watch.push(new).items():
            pieces[role].append(rows.t_ns)
    return {role: np.concatenate(parts) for role, parts in pieces.items()}, watch.findings()


@pytest.mark.parametrize("role", ["pose", "torque"])
@pytest.mark.parametrize("size_s", [-3.0, 40.0, -8328.0])
def test_a_clock_that_is_set_is_seen_and_both_channels_go_on_together(role, size_s):
    messages = arrivals(stamps={role: after(size_s)})
    stamps, found = restamped(messages)
    assert [f.code for f in found] == ["clocks_apart"]
    assert f"{TOPICS[role]} step by {size_s:+.4g}"[:-3] in found[0].text
    for name, (true_s, *_) in messages.items():
        settled = (true_s < AT_S) | (true_s > AT_S + HOLDS_S + 0.1)
        np.testing.assert_allclose(stamps[name][settled] * 1e-9, true_s[settled], atol=0.03)


def test_a_stamp_ahead_of_the_log_time_never_reaches_the_sorter():
    stamps, _ = restamped(messages := arrivals(stamps={"pose": after(40.0)}))
    np.testing.assert_allclose(stamps["pose"] * 1e-9, messages["pose"][0], atol=0.03)


@pytest.mark.parametrize("size_s", [-3.0, 40.0])
def test_where_recorder_and_wheels_are_set_and_the_pose_is_not_they_go_on_together(size_s):
    """The recorder runs on the robot: NTP sets its clock, the motion capture's stays as it is."""
    robot = after(size_s)
    messages = arrivals(stamps={"torque": robot}, recorder=lambda logged: robot(logged - 0.02))
    stamps, found = restamped(messages)
    assert [f.code for f in found] == ["clocks_apart"]
    true_s = messages["pose"][0]
    settled = true_s > AT_S + HOLDS_S + 0.1
    np.testing.assert_allclose(stamps["pose"][settled] * 1e-9, true_s[settled] + size_s, atol=0.03)


HARMLESS = {
    "nothing happens": {},
    "the link of the pose stalls": {"delays": {"pose": draining}},
    "the recorder stalls": {"delays": {"pose": draining, "torque": draining}},
    "the recorder's clock is set": {"recorder": after(-3.0)},
    "all clocks but the recorder's are set": {"stamps": {"pose": after(-3.0), "torque": after(-3.0)}},
    "log time jitters by seconds": {
        "recorder": lambda t_s: np.random.default_rng(1).uniform(0, 6, len(t_s)),
    },
    "log time stands still": {"recorder": lambda t_s: -t_s},
    "log time runs at half the speed": {"recorder": lambda t_s: -t_s / 2},
    "one stamp is wrong": {"stamps": {"pose": after(-30.0, AT_S, AT_S + 0.03)}},
    "a step within the bound": {"stamps": {"pose": after(-1.5)}},
}


@pytest.mark.parametrize("case", HARMLESS)
def test_what_is_no_correction_changes_no_stamp(case):
    messages = arrivals(**HARMLESS[case])
    stamps, found = restamped(messages)
    assert not found
    changed = sum(np.count_nonzero(stamps[role] != m[1]) for role, m in messages.items())
    assert changed == 0


def test_one_stamp_in_the_far_future_is_replaced_and_nothing_else():
    messages = arrivals(stamps={"pose": after(1e6, AT_S, AT_S + 0.03)})
    stamps, found = restamped(messages)
    assert not found
    assert np.count_nonzero(stamps["pose"] != messages["pose"][1]) == 1
    np.testing.assert_allclose(stamps["pose"] * 1e-9, messages["pose"][0], atol=0.03)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([-3.0, 40.0, 2.5]),
    st.sampled_from(["pose", "torque"]),
    st.lists(st.integers(0, 1800), max_size=12),
    st.integers(0, 1800),
)
def test_neither_batches_nor_later_messages_change_a_stamp(size_s, role, cuts, stop):
    messages = arrivals(stamps={role: after(size_s)}, seed=2)
    whole, found = restamped(messages)
    pieces, found_in_pieces = restamped(messages, cuts)
    assert found == found_in_pieces
    prefix, _ = restamped({r: tuple(c[m[3] < stop] for c in m) for r, m in messages.items()}, cuts)
    for name, (*_, order) in messages.items():
        np.testing.assert_array_equal(whole[name], pieces[name])
        np.testing.assert_array_equal(whole[name][order < stop], prefix[name])

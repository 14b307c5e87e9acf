"""Whether the stamps of pose and wheel signals belong to one clock, from their first messages.

The recorder receives both, so that the difference of their typical offsets ``stamp − log time`` is the offset
of their clocks, up to the difference of their transport delays. Beyond ``BOUND_S`` the log time is used for
all channels, unless the user has chosen a clock. The stamps give no answer at all there: no torque is in
force at any pose. By the log time a signal is late by its transport delay, .01 to .3 s, and as uneven as
that; so the finding is a warning.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.channels.clocks import Clock, FirstMessages, first_messages, short_time
from wmr_replay.ingest.channels.detect import Use
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.findings import Finding, Severity, finding

BOUND_S = 2.0
"""Clocks further apart are not used together. Transport takes .01 to .3 s, a slow SLAM 1 s; AMCL stamps its
transforms up to 1 s ahead; 2 s is as long as late messages are sorted into place.
"""
CERTAIN_S = 60.0
"""Beyond this an offset is one of the clocks, whatever the recorder buffers."""
LEAST_MESSAGES = 2
STEADY = (0.5, 2.0)
"""Log time passed per time stamped over the first messages; else the recorder wrote them from a buffer."""
LEAST_PASSED, LEAST_BETWEEN_S = 1e-3, 1e-3
"""Below these, within the channels and between them, the log time stands still, and is no clock at all."""
EXTRA = ("wheel_speed", "command")
"""Roles that a replay does without."""
REMEDY = "set the clocks (chrony, PTP) before recording"


@dataclass(frozen=True)
class ClockOffset:
    """A channel's clock against the recorder's: ``offset_s`` typical stamp − log time, ``spread_s`` its
    range from the 10th to the 90th percentile, ``log_s`` the typical log time, ``passed`` log time per time
    stamped.
    """

    offset_s: float
    spread_s: float
    log_s: float
    passed: float


def choose_clocks(uses: Mapping[str, Use]) -> tuple[dict[str, Clock], list[Finding]]:
    """The clock of each channel in use by role, and what is to be said about them."""
    firsts = {role: first_messages(use) for role, use in uses.items()}
    clocks = {role: Clock.choose(use, firsts[role]) for role, use in uses.items()}
    if not {"pose", "torque"} <= uses.keys():
        return clocks, []
    pose, torque = (clock_offset(clocks[role], firsts[role]) for role in ("pose", "torque"))
    if pose is None or torque is None or not are_apart(pose, torque):
        return clocks, []
    text = (
        f"the stamps of {uses['pose'].channel.topic} are {short_time(pose.offset_s)} off log time, those of "
        f"{uses['torque'].channel.topic} {short_time(torque.offset_s)}"
    )
    if any(uses[role].clock for role in ("pose", "torque")):
        said = "kept, since a clock was given", f"run with --clock log, and {REMEDY}"
    else:
        clocks = {role: Clock("log time", "clocks apart") for role in uses}
        said = "log time is used for both", f"{REMEDY}; --clock header keeps the stamps"
    return clocks, [finding("clocks_apart", Severity.WARNING, f"{text}: {said[0]}", advice=said[1])]


def apart_from_pose(uses: Mapping[str, Use], clocks: Mapping[str, Clock]) -> list[str]:
    """The roles besides pose and torque whose clock is apart from the pose's: their rows cannot be used."""
    if "pose" not in uses:
        return []
    pose = clock_offset(clocks["pose"], first_messages(uses["pose"]))
    offsets = {role: clock_offset(clocks[role], first_messages(uses[role])) for role in uses if role in EXTRA}
    return [role for role, own in offsets.items() if pose and own and are_apart(pose, own)]


def are_apart(pose: ClockOffset, torque: ClockOffset) -> bool:
    """Whether two clocks differ by more than ``BOUND_S`` and what the log times leave in doubt."""
    apart_s = abs(pose.offset_s - torque.offset_s)
    between_s = abs(pose.log_s - torque.log_s)
    if min(pose.passed, torque.passed) < LEAST_PASSED and between_s < LEAST_BETWEEN_S:
        return False
    if apart_s > CERTAIN_S:
        return True
    if not all(STEADY[0] <= clock.passed <= STEADY[1] for clock in (pose, torque)):
        return False
    drift = max(abs(1 - clock.passed) for clock in (pose, torque))
    doubt_s = pose.spread_s + torque.spread_s + drift * between_s
    return apart_s > BOUND_S + doubt_s


def clock_offset(clock: Clock, first: FirstMessages) -> ClockOffset | None:
    """The offset of a channel's clock; None with too few messages."""
    t_ns = first.times_ns(clock.name)
    stamped = t_ns != 0 if clock.zero_is_none else np.ones(len(t_ns), bool)
    if np.count_nonzero(stamped) < LEAST_MESSAGES:
        return None
    t_ns, log_ns = t_ns[stamped], first.log_ns[stamped]
    offsets_s: F64 = (t_ns - log_ns) / NS_PER_S
    low_s, middle_s, high_s = np.percentile(offsets_s, (10, 50, 90)).tolist()
    lasting_ns = max(int(np.ptp(t_ns)), 1)
    return ClockOffset(
        middle_s, high_s - low_s, float(np.median(log_ns)) / NS_PER_S, float(np.ptp(log_ns)) / lasting_ns
    )

"""The status of a row: why it says what it says."""

from enum import IntEnum


class Status(IntEnum):
    """``ok``, or what stands in the row's way; tables hold the label as an enumeration in this order."""

    OK = 0
    WARMING_UP = 1
    GAP = 2
    NO_TORQUE = 3
    NOT_EXCITED = 4
    NOT_TURNING = 5
    POSE_NOT_INDEPENDENT = 6
    POSE_JUMP = 7
    OUTLIER = 8
    CLOCKS_APART = 9
    NO_HEADING = 10
    RATE_TOO_LOW = 11
    IMPLAUSIBLE = 12
    OTHER_DRIVE = 13

    @property
    def label(self) -> str:
        """The name in tables and on screen, such as ``warming_up``."""
        return self.name.lower()


STATUS_MEANING = {
    Status.OK: "the row's mode is an estimate like any other",
    Status.WARMING_UP: "the first window is not full yet",
    Status.GAP: "a hole in the pose, or a frozen one; the window restarts and is not full again",
    Status.NO_TORQUE: (
        "no torque in force, or no wheel speed in a log without torques: "
        "ideal and slipping cannot be told apart"
    ),
    Status.NOT_EXCITED: "torques too small: ideal and slipping give the same motion",
    Status.NOT_TURNING: "no turning at speed: once it has decayed, a skid leaves no trace",
    Status.POSE_NOT_INDEPENDENT: "the pose was integrated from wheel speeds: skidding cannot be seen in it",
    Status.POSE_JUMP: "the pose jumped further than the robot can move; the window restarted",
    Status.OUTLIER: "the pose sample was set aside as an outlier",
    Status.CLOCKS_APART: "pose and wheel signals are stamped by clocks that do not belong together",
    Status.NO_HEADING: "the pose has no usable heading: sideslip cannot be seen",
    Status.RATE_TOO_LOW: "the pose comes too rarely for the motion",
    Status.IMPLAUSIBLE: "signs or units of the signals contradict one another",
    Status.OTHER_DRIVE: "the robot moves as no differential drive does",
}
"""What each status means, for the schema pages."""

BARRING = frozenset(
    {Status.CLOCKS_APART, Status.NO_HEADING, Status.RATE_TOO_LOW, Status.IMPLAUSIBLE, Status.OTHER_DRIVE}
)
"""Statuses of rows that a finding on the data's quality bars; see :mod:`wmr_schemas.findings`."""

WHOLE_LOG = frozenset(
    {
        Status.CLOCKS_APART,
        Status.NO_HEADING,
        Status.IMPLAUSIBLE,
        Status.OTHER_DRIVE,
        Status.POSE_NOT_INDEPENDENT,
    }
)
"""Statuses of faults that a log has from its beginning to its end, whenever they are noticed."""

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

    @property
    def label(self) -> str:
        """The name in tables and on screen, such as ``warming_up``."""
        return self.name.lower()


STATUS_MEANING = {
    Status.OK: "the row's mode is an estimate like any other",
    Status.WARMING_UP: "the first window is not full yet",
    Status.GAP: "a hole in the pose restarted the window, which is not full again",
    Status.NO_TORQUE: "no torque in force: ideal and slipping cannot be told apart",
    Status.NOT_EXCITED: "torques too small: ideal and slipping give the same motion",
    Status.NOT_TURNING: "no turning at speed: once it has decayed, a skid leaves no trace",
    Status.POSE_NOT_INDEPENDENT: "the pose was integrated from wheel speeds: skidding cannot be seen in it",
    Status.POSE_JUMP: "the pose jumped further than the robot can move; the window restarted",
    Status.OUTLIER: "the pose sample was set aside as an outlier",
}
"""What each status means, for the schema pages."""

"""Input and output of every monitor."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from wmr_replay.identify import Motion
from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.findings import Finding
from wmr_schemas.robot import RobotParameters


class Observed(NamedTuple):
    """n rows of strictly increasing time, outliers of the pose left out; no row depends on a later one.

    ``t_ns`` (n,) stamps and ``t_s`` (n,) seconds since the log's first pose. ``pose`` (3, n) repaired x, y in
    m and unwrapped yaw in rad. ``inputs`` (4, n) left and right effort in N·m, left and right wheel speed in
    rad/s, means over the interval that ends at the row, NaN where unknown. ``smoothed`` (4, n) the same
    through the window of the motion. ``motion`` at the instants t − δ, NaN while the window fills, and
    ``smoothed_pose`` (3, n) at these instants. ``pose_raw`` (3, n) is the pose as measured, jumps left in.
    ``variances`` (2, n) of the noise of position and yaw. ``robot`` holds the parameters that are known. The
    identifier's answer is not among them: it is found at the same time.
    """

    t_ns: I64
    t_s: F64
    pose: F64
    inputs: F64
    smoothed: F64
    motion: Motion
    variances: F64
    robot: RobotParameters
    smoothed_pose: F64
    pose_raw: F64


class Monitor(Protocol):
    """A stage that looks for one fault of the data.

    ``barred``: by code of a finding which rows of the last push it bars, where another finding may be the
    cause.
    """

    barred: Mapping[str, Bool]

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row, ``OK`` where nothing does."""

    def findings(self) -> list[Finding]:
        """What was found so far."""

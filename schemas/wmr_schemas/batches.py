"""What ingest hands on: rows of the signals in use, in file order, as columns."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.status import Status

POSE_COLUMNS = ("x_m", "y_m", "yaw_rad")
TORQUE_COLUMNS = ("left_nm", "right_nm", "left_radps", "right_radps")
MODE_COLUMNS = ("mode",)
WHEEL_COLUMNS = ("left_radps", "right_radps")
COMMAND_COLUMNS = ("left_radps", "right_radps")


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one signal: stamps ``t_ns`` (n,), ``order`` (n,), ``values`` (k, n), NaN where unknown.

    ``order`` is the message's ordinal among all messages in use, in file order, common to all signals: it
    tells later stages how the signals were interleaved, whatever the batches.
    """

    t_ns: I64
    order: I64
    values: F64

    def __len__(self) -> int:
        return len(self.t_ns)

    def moved(self, offset_s: float) -> "Rows":
        """The same rows, stamped ``offset_s`` later."""
        return Rows(self.t_ns + round(offset_s * NS_PER_S), self.order, self.values)

    @classmethod
    def empty(cls, n_columns: int) -> "Rows":
        """No rows."""
        return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((n_columns, 0)))


class Bar(NamedTuple):
    """From a stamp on, exclusive, poses get no answer, or one again where ``status`` is ``OK``.

    ``code`` is the finding's: bars of one code follow one another. ``after_ns`` is no earlier than any stamp
    that came before in the file, so that no row that was handed on changes.
    """

    code: str
    after_ns: int
    status: Status


@dataclass(frozen=True, eq=False)
class RawBatch:
    """One bounded piece of a log: rows of pose (x, y, yaw), torque (left, right, wheel speeds) and mode.

    A log without torques has its wheel speeds in the rows of ``torque``, with efforts NaN. ``wheels`` are
    those of a channel of their own beside one of torques without speeds. ``command`` holds commanded wheel
    speeds. Both (left, right) are read where they are asked for. ``bars`` are what the reader found in the
    pose's messages that these columns do not show.
    """

    pose: Rows
    torque: Rows
    mode: Rows
    bars: tuple[Bar, ...] = field(default=(), kw_only=True)
    wheels: Rows = field(default_factory=lambda: Rows.empty(len(WHEEL_COLUMNS)), kw_only=True)
    command: Rows = field(default_factory=lambda: Rows.empty(len(COMMAND_COLUMNS)), kw_only=True)

    def without_efforts(self) -> "RawBatch":
        """The batch with unknown efforts, as of a steered robot; wheel speeds stay."""
        values = self.torque.values.copy()
        values[:2] = np.nan
        return replace(self, torque=Rows(self.torque.t_ns, self.torque.order, values))

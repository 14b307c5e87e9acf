"""Frozen poses: a tracker that has lost the robot repeats its last pose under new stamps.

Such rows are no measurements. A robot at rest repeats its pose as well, and so does a slow one whose pose is
rounded. The motion before (``repeats``), the tracker's habit and the wheels tell them apart.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.align.batch import SampleBatch
from wmr_replay.align.repeats import Part, PartRules, Repeats, held, held_ns
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.status import Status

POSITION = PartRules(braking=10.0)
"""The friction of rubber on dry ground, 1 g."""
YAW = PartRules(braking=30.0)
"""1 g at the wheels of a robot of .3 m half track."""
RESTING_RADPS = 0.05
"""Both wheels slower than that stand: 5 mm/s at a wheel of 10 cm."""
TURNING_RADPS = 0.3
"""A wheel that is faster turns: 3 cm/s, beyond encoder noise."""
MOVED = 10.0
"""A last step of so many resolutions: the robot was not at rest."""
TURNED_RAD, TURNED_RADPS = 0.1, 0.05
"""Wheels that turned by so much, and so much for each second, have driven: 1 cm, above encoder noise."""
FINE_M = 3e-5
"""A position with a coarser resolution may stand while the wheels spin on the spot; a finer one creeps."""


class FrozenPose:
    """Stage: measured rows → the same rows, those that repeat a frozen pose marked ``GAP`` in ``repair``.

    No row depends on a later one, and none on the batches. ``n`` rows were marked so far; in ``n_position``
    and ``n_yaw`` of them the position or the yaw alone was frozen.
    """

    def __init__(self) -> None:
        self.n = self.n_position = self.n_yaw = 0
        self._position, self._yaw = Part(POSITION), Part(YAW)
        self._wheels = Wheels()

    def push(self, rows: SampleBatch) -> SampleBatch:
        """The same rows with ``repair`` filled in."""
        frozen = self.frozen(rows.t_ns, rows.pose_raw, rows.inputs[2:])
        if not frozen.any():
            return rows
        return replace(rows, repair=np.where(frozen, Status.GAP, rows.repair).astype(np.int8))

    def frozen(self, t_ns: I64, pose: F64, wheels_radps: F64) -> Bool:
        """Which rows (n,) repeat a frozen pose; ``pose`` (3, n), ``wheels_radps`` (2, n), NaN if unknown."""
        if not len(t_ns):
            return np.zeros(0, bool)
        if self._position.moves(pose[:2]) and self._yaw.moves(pose[2:]):
            self._position.skip(t_ns, pose[:2])
            self._yaw.skip(t_ns, pose[2:])
            self._wheels.skip(t_ns, wheels_radps)
            return np.zeros(len(t_ns), bool)
        position, yaw = self._position.push(t_ns, pose[:2]), self._yaw.push(t_ns, pose[2:])
        whole = position.repeated & yaw.repeated
        wheels = self._wheels.push(t_ns, wheels_radps, whole, position.repeated)
        by_motion = (position.impossible | yaw.impossible) & ~wheels.rest
        was_moving = (position.step > MOVED * position.grid) | (yaw.step > MOVED * yaw.grid)
        by_wheels = (wheels.turned & (position.grid < FINE_M)) | (wheels.turn & was_moving)
        frozen = whole & (by_motion | by_wheels | position.habitual | yaw.habitual)
        fine = (position.grid < FINE_M) | (position.step > MOVED * position.grid)
        of_position = ~whole & (alone(position) | (position.repeated & wheels.advanced & fine))
        of_yaw = ~whole & alone(yaw)
        self.n_position += int(np.count_nonzero(of_position))
        self.n_yaw += int(np.count_nonzero(of_yaw))
        frozen |= of_position | of_yaw
        self.n += int(np.count_nonzero(frozen))
        return np.asarray(frozen)


def alone(part: Repeats) -> Bool:
    """Whether a part that stands while the other moves is frozen (n,): only a rough one can be.

    A smooth one may stand: a simulated robot that drives straight on after a turn has a constant yaw.
    """
    return np.asarray((part.impossible | part.habitual) & part.rough)


class Rolling(NamedTuple):
    """By row (n,), False where unknown: whether the wheels rest, having turned before; whether one of them
    turns; whether one of them has turned since the pose stands; and whether both together have advanced
    since the position stands, which they do not while a robot turns on the spot.
    """

    rest: Bool
    turn: Bool
    turned: Bool
    advanced: Bool


class Wheels:
    """Stage: wheel speeds → whether the wheels rest, and whether they have driven while the pose stood."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._angle, self._angle_then = np.zeros(2), np.zeros(2)
        self._then_ns = 0
        self._mean_then, self._mean_then_ns = 0.0, 0
        self._ever_turned = False

    def push(self, t_ns: I64, radps: F64, stands: Bool, position_stands: Bool) -> Rolling:
        """Rows of wheel speeds (2, n), NaN if unknown, and whether pose and position stand (n,)."""
        known = np.asarray(np.isfinite(radps).all(axis=0))
        fast = known & (np.abs(radps) > RESTING_RADPS).any(axis=0)
        ever = np.logical_or.accumulate(np.concatenate([[self._ever_turned], fast]))[1:]
        angle = self._angles(t_ns, radps, known)
        then = np.stack([held(a, ~stands, b) for a, b in zip(angle, self._angle_then, strict=True)])
        then_ns = held_ns(t_ns, ~stands, self._then_ns)
        stood_s = (t_ns - then_ns) / NS_PER_S
        turned = stands & (np.abs(angle - then) > TURNED_RAD + TURNED_RADPS * stood_s).any(axis=0)
        advanced = self._advanced(t_ns, angle.mean(axis=0), position_stands)
        self._ever_turned = bool(ever[-1])
        self._angle_then, self._then_ns = then[:, -1], int(then_ns[-1])
        turn = known & (np.abs(radps) > TURNING_RADPS).any(axis=0)
        return Rolling(known & ~fast & ever, np.asarray(turn), np.asarray(turned), advanced)

    def skip(self, t_ns: I64, radps: F64) -> None:
        """Take in rows on which neither pose nor position stands."""
        known = np.asarray(np.isfinite(radps).all(axis=0))
        fast = known & (np.abs(radps) > RESTING_RADPS).any(axis=0)
        self._ever_turned |= bool(fast.any())
        self._angle_then = self._angles(t_ns, radps, known)[:, -1]
        self._mean_then = float(self._angle_then.mean())
        self._then_ns = self._mean_then_ns = int(t_ns[-1])

    def _angles(self, t_ns: I64, radps: F64, known: Bool) -> F64:
        """Angles (2, n) by which the wheels have turned so far."""
        last_ns = int(t_ns[0]) if self._last_ns is None else self._last_ns
        step_s = np.diff(t_ns, prepend=last_ns) / NS_PER_S
        steps = np.where(known, radps * step_s, 0.0)
        angle = np.cumsum(np.concatenate([self._angle[:, None], steps], axis=1), axis=1)[:, 1:]
        self._last_ns, self._angle = int(t_ns[-1]), angle[:, -1]
        return angle

    def _advanced(self, t_ns: I64, mean_rad: F64, stands: Bool) -> Bool:
        """Whether the wheels' mean angle (n,) has advanced since the position stands."""
        then, then_ns = held(mean_rad, ~stands, self._mean_then), held_ns(t_ns, ~stands, self._mean_then_ns)
        stood_s = (t_ns - then_ns) / NS_PER_S
        self._mean_then, self._mean_then_ns = float(then[-1]), int(then_ns[-1])
        return np.asarray(stands & (np.abs(mean_rad - then) > TURNED_RAD + TURNED_RADPS * stood_s))

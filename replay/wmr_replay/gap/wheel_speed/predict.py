"""The unrolled path that a model predicts, beside the measured one."""

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.settings.wheel_speed import WheelSpeedSettings
from wmr_replay.gap.wheel_speed.bins import Bins
from wmr_replay.gap.wheel_speed.declared import DECLARED
from wmr_replay.gap.wheel_speed.drive import Chassis, Values
from wmr_replay.gap.wheel_speed.record import Record
from wmr_replay.gap.wheel_speed.rolling import motion
from wmr_schemas.arrays import F64, Bool

__all__ = ["CHANNELS", "DECLARED", "Parameter", "Problem"]
CHANNELS = ("longitudinal", "lateral", "yaw")


MOST_KEPT = 300
"""Predictions that a problem keeps: scans ask for the same ones."""


class Parameter(NamedTuple):
    """One parameter of one effect."""

    effect: str
    key: str

    @property
    def step(self) -> float:
        """Step of a difference quotient."""
        return DECLARED[self.effect].parameters[self.key].step

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of a fit."""
        declared = DECLARED[self.effect].parameters[self.key]
        return declared.least, declared.most


@dataclass(frozen=True, eq=False)
class Problem:
    """A record with its bins, the robot, the base model's effects, and the bins that are fitted (n,).

    ``bins`` leave out slip; ``whole`` are those with it, in which effects in a time or a place are looked
    for.
    """

    record: Record
    bins: Bins
    chassis: Chassis
    base: Values
    fitted: Bool
    settings: WheelSpeedSettings = field(default_factory=WheelSpeedSettings)
    whole: Bins | None = None
    memory: dict[Hashable, F64] = field(default_factory=dict)
    """Predictions by bin; those of one record share them."""
    base_sd: Values = field(default_factory=dict)
    """Standard deviations of the base model's effects, where a calibration says them."""
    slips_to: float = 1.0
    """The loss that a slip has to exceed by far to be a finding: that of the calibration logs, where modes
    are identified, on the ground of one world; else all of it."""

    @property
    def with_slip(self) -> "Problem":
        """The problem with the moments of slip."""
        return self if self.whole is None else replace(self, bins=self.whole, whole=None)

    @property
    def smooth_rows(self) -> int:
        """Rows of the grid over which speeds are taken before they are multiplied; odd."""
        rows = round(self.settings.layout.smooth_s / self.record.step_s)
        return max(1, rows + (rows + 1) % 2)

    @property
    def measured(self) -> F64:
        """The measured unrolled path by bin, (3, n)."""
        return self.bins.mean(self.record.measured)

    def predicted_at_poses(self, values: Values) -> F64:
        """The predicted unrolled path at each pose, (3, N), from an arbitrary start."""
        record = self.record
        effects = summed(self.base, values)
        moved = np.stack(motion(record, self.chassis, effects, self.smooth_rows)) * record.step_s
        way = np.concatenate([np.zeros((3, 1)), np.cumsum(moved, axis=1)], axis=1)
        delay_s = effects.get("pose_delay", {}).get("delay_s", 0.0)
        at = record.at - delay_s / record.step_s
        whole = np.clip(np.floor(at), 0, way.shape[1] - 2).astype(np.int64)
        share = at - whole
        return np.asarray((1 - share) * way[:, whole] + share * way[:, whole + 1])

    def predicted(self, values: Values) -> F64:
        """The predicted unrolled path by bin, (3, n)."""
        key = frozen(self.base), frozen(values)
        if key not in self.memory:
            if len(self.memory) >= MOST_KEPT:
                self.memory.clear()
            self.memory[key] = self.bins.mean(self.predicted_at_poses(values))
        return self.memory[key]

    def errors(self, values: Values) -> F64:
        """Measured − predicted in blocks, (3, K, B); each block from its own start."""
        return from_start(self.bins.blocks(self.measured - self.predicted(values)), self.bins)

    def column(self, values: Values, which: Parameter) -> F64:
        """D predicted / d parameter in blocks, (3, K, B); one-sided where the bound is near."""
        step, at = which.step, values.get(which.effect, {}).get(which.key, 0.0)
        low, high = which.bounds
        up, down = min(at + step, high), max(at - step, low)
        base = dict(summed(self.base, values).get(which.effect, {}))
        total = base.get(which.key, 0.0)
        if total - step < low:
            down = at
        if up <= down:
            return np.zeros((3, *self.bins.table.shape))
        change = self.predicted(replaced(values, which, up)) - self.predicted(replaced(values, which, down))
        return from_start(self.bins.blocks(change / (up - down)), self.bins)


def frozen(values: Values) -> Hashable:
    """Values as a key."""
    return tuple(sorted((name, tuple(sorted(own.items()))) for name, own in values.items()))


def from_start(blocks: F64, bins: Bins) -> F64:
    """Blocks less their first value; 0 behind their end."""
    return np.where(bins.inside, blocks - blocks[..., :1], 0.0)


def replaced(values: Values, which: Parameter, value: float) -> Values:
    """The values with one parameter in another's place; the effect's others are 0 where it is new."""
    own = dict.fromkeys(DECLARED[which.effect].parameters, 0.0) | dict(values.get(which.effect, {}))
    return {**values, which.effect: {**own, which.key: value}}


def summed(base: Values, values: Values) -> Values:
    """The base model's effects and further ones; ratios of one effect multiply, other parameters add up."""
    if not base:
        return values
    out = {name: dict(own) for name, own in base.items()}
    for name, own in values.items():
        old = out.get(name, {})
        out[name] = {key: composed(name, key, old.get(key), value) for key, value in own.items()}
    return out


FACTORS = ("wheel_scale", "effective_track", "drive_gain", "turn_gain")
"""Effects whose ratio changes a factor of the model."""


def composed(name: str, key: str, before: float | None, value: float) -> float:
    """A parameter of two effects of a name: (1 + a)(1 + b) − 1 of factors, the lower limit, else the sum."""
    if before is None:
        return value
    if name in FACTORS:
        return (1 + before) * (1 + value) - 1
    return min(before, value) if key.startswith("limit") else before + value

"""Replaying signals that are in memory already: the same engine, no file."""

from dataclasses import replace

import numpy as np

from wmr_replay.pipeline.columns import Columns
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import F64, I64
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.signals import Log, WheelSpeedTrack


def as_batch(log: Log) -> RawBatch:
    """A log's signals in the order in which a recorder would have written them: by stamp, the pose first."""
    pose = np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad])
    signals: list[tuple[I64, F64]] = [(log.pose.t_ns, pose), inputs_of(log)]
    if log.mode is None:
        signals.append((np.empty(0, np.int64), np.empty((1, 0))))
    else:
        signals.append((log.mode.t_ns, log.mode.mode[None].astype(np.float64)))
    if beside := wheels_apart(log):
        signals.append((beside.t_ns, np.stack([beside.left_radps, beside.right_radps])))
    stamps = np.concatenate([t_ns for t_ns, _ in signals])
    order = np.empty(len(stamps), np.int64)
    order[np.argsort(stamps, kind="stable")] = np.arange(len(stamps))
    orders = np.split(order, np.cumsum([len(t_ns) for t_ns, _ in signals])[:-1])
    rows = [Rows(t_ns, o, values) for (t_ns, values), o in zip(signals, orders, strict=True)]
    return RawBatch(*rows[:3], wheels=rows[3]) if len(rows) > 3 else RawBatch(*rows)


def wheels_apart(log: Log) -> WheelSpeedTrack | None:
    """Wheel speeds beside torques that have none of their own."""
    if log.torque is None or np.isfinite(log.torque.left_radps).any():
        return None
    return log.wheels


def has_wheels_alone(log: Log) -> bool:
    """Whether a log holds wheel speeds and no torques."""
    return log.wheels is not None and log.torque is None


def inputs_of(log: Log) -> tuple[I64, F64]:
    """Stamps and rows (4, n) of torques and wheel speeds; of wheel speeds alone where no torque is known."""
    if log.torque is not None:
        t = log.torque
        return t.t_ns, np.stack([t.left_nm, t.right_nm, t.left_radps, t.right_radps])
    if log.wheels is None:
        return np.empty(0, np.int64), np.empty((4, 0))
    unknown = np.full(len(log.wheels), np.nan)
    return log.wheels.t_ns, np.stack([unknown, unknown, log.wheels.left_radps, log.wheels.right_radps])


def replay_columns(
    log: Log, settings: Settings | None = None, model: ReplayModel | None = None
) -> list[Columns]:
    """Columns of the samples table of a log in memory, by ``model`` or its own nominal parameters."""
    engine = Engine(replace(settings or Settings(), hindsight=False), model or ReplayModel(log.robot))
    return [*engine.push(as_batch(log)), *engine.finish()]


def hindsight_columns(
    log: Log, settings: Settings | None = None, model: ReplayModel | None = None
) -> list[Columns]:
    """Columns of the hindsight table of a log in memory; those of the samples table where the log is too
    short for a second pass.
    """
    engine = Engine(settings or Settings(), model or ReplayModel(log.robot))
    causal = [*engine.push(as_batch(log)), *engine.finish()]
    return list(engine.hindsight()) or causal

"""The forms that a base model's held resistances may have on another drive.

A calibration log shows how much a robot is braked there. Where the points lie that brake it, and how the
resistance grows with the speed, one drive hardly shows: a skid plate is a dry friction of the wheels in
``stop-go``. So the resistance that the base model holds is known in size, not in form. On the drive of
another log each other form is as large as the least squares of the held ones say. How much of a form is held
is no doubt about that form. Two dry frictions brake the way ahead alike, but for supports in turns, which
push across.

A drive that never reverses shows a friction as a bias of the torques: a held bias may be none on another log.

A point that slides at a distance a from the axle with the friction F acts against its velocity,
(v, a·yaw_rate):

    l·dyaw_rate/dt = −(l a²/I) F·yaw_rate/√(v² + a²·yaw_rate²)

With a ≈ l, F = m c and α_yaw/α = l² m/I this is −(α_yaw/α) c·l·yaw_rate/√(v² + l²·yaw_rate²), a yaw damping.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.model.extension import Extension, Parameters
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import PoseTrack

SUPPORTS = "support_friction"
POWERS = {
    "rolling_resistance": 0,
    "wheel_coulomb": 0,
    "viscous_drag": 1,
    "wheel_viscous": 1,
    "aerodynamic_drag": 2,
}
"""With which power of the speed a resistance ahead grows."""


class Speeds(NamedTuple):
    """Mean speeds (n,) over short windows of a log in which the robot moves: m/s, back below 0, and rad/s."""

    ahead_mps: F64
    yaw_rate_radps: F64


def with_other_forms(extension: Extension, pose: PoseTrack, own: MisfitSettings) -> Extension:
    """The extension, its misfit widened by the other forms of the held resistances on the log of ``pose``.

    Unchanged where the base model has no misfit: a model that was not calibrated on a log.
    """
    speeds = speeds_of(pose, own)
    if not extension.misfit or not len(speeds.ahead_mps):
        return extension
    found = dict(other_forms(extension, speeds, own))
    wider = {name: max(size, found.get(name, 0.0)) for name, size in extension.misfit.items()}
    return replace(extension, misfit=wider)


def other_forms(extension: Extension, speeds: Speeds, own: MisfitSettings) -> Iterator[tuple[str, float]]:
    """Sizes of the resistances ahead, of a bias and of what brakes turns that do on this drive what the held
    ones do, as far as they can.
    """
    yield from forms_ahead(extension, speeds, own)
    yield from forms_turning(extension, speeds, own)


def forms_ahead(extension: Extension, speeds: Speeds, own: MisfitSettings) -> Iterator[tuple[str, float]]:
    """Those of the resistances ahead and of a bias; also as far as the calibration left a resistance open."""
    v, bias_nm = np.abs(speeds.ahead_mps), abs(held_size("torque_bias_common", extension))
    per_nm = 2 * extension.base.alpha
    dragging, straight = dragging_mps2(extension, speeds)
    for name, power in POWERS.items():
        others = held_mps2(extension, v, without=power) + open_mps2(extension, v, without=name)
        others += dragging if power else straight - dragging
        others = np.minimum(others + per_nm * bias_nm, own.most_in_form_mps2)
        yield name, least_squares(v**power, others) / unit_mps2(name, extension)
    held = np.minimum(held_mps2(extension, v) + dragging, own.most_in_form_mps2)
    yield "torque_bias_common", bias_nm + abs(float(np.mean(np.sign(speeds.ahead_mps) * held))) / per_nm


def forms_turning(extension: Extension, speeds: Speeds, own: MisfitSettings) -> Iterator[tuple[str, float]]:
    """Those of a yaw damping and of a centre of mass: at one speed the two are the same, and what slides
    along is a damping. A centre of mass behind the axle, or one ahead in reverse, helps turns: no damping is
    like it.
    """
    v, q, base = np.abs(speeds.ahead_mps), np.abs(speeds.yaw_rate_radps), extension.base
    turning = base.half_track_m * q
    by_arm = speeds.ahead_mps * q * base.alpha_yaw / (base.alpha * base.half_track_m)
    held, across = np.minimum(held_mps2(extension, v), own.most_in_form_mps2), np.hypot(v, turning)
    sliding = np.divide(held * turning, across, out=np.zeros_like(held), where=across > 0)
    moved = max(least_squares(turning, by_arm * held_size("com_offset", extension)), 0.0)
    yield "yaw_damping", moved + least_squares(turning, sliding * base.alpha_yaw / base.alpha)
    yield "com_offset", abs(least_squares(by_arm, turning * held_size("yaw_damping", extension)))


def held_size(name: str, extension: Extension) -> float:
    """The size of an effect that the base model holds, with its sign; 0 of one that it does not."""
    return sum(size_of(parameters) for held, parameters in extension.known if held == name)


def open_mps2(extension: Extension, speed_mps: F64, without: str) -> F64:
    """What the calibration leaves open of one of the other resistances at the speeds (n,), the largest."""
    each = [
        size * unit_mps2(name, extension) * speed_mps ** POWERS[name]
        for name, size in extension.misfit.items()
        if name in POWERS and name != without
    ]
    return np.asarray(np.max(each, axis=0) if each else np.zeros_like(speed_mps))


def held_mps2(extension: Extension, speed_mps: F64, without: int | None = None) -> F64:
    """What the base model's resistances, but for those that grow with one power of the speed, brake at the
    speeds (n,), in m/s².
    """
    names = {name for name, power in POWERS.items() if power != without}
    held = [(name, size_of(parameters)) for name, parameters in extension.known if name in names]
    each = (size * unit_mps2(name, extension) * speed_mps ** POWERS[name] for name, size in held)
    return np.asarray(sum(each, np.zeros_like(speed_mps)))


def dragging_mps2(extension: Extension, speeds: Speeds) -> tuple[F64, float]:
    """What the base model's supports that drag take ahead at the speeds (n,), and where it drives straight
    on, in m/s².
    """
    size = sum(sizes["p0_mps2"] for name, sizes in extension.known if name == SUPPORTS)
    v, w = speeds.ahead_mps, extension.base.half_track_m * speeds.yaw_rate_radps
    return np.asarray(size * np.abs(v) / np.hypot(v, w)), size


def size_of(parameters: Parameters) -> float:
    """The first parameter of a resistance: its size ahead."""
    return next(iter(parameters.values()))


def unit_mps2(name: str, extension: Extension) -> float:
    """The deceleration of a resistance of size 1 at 1 m/s."""
    if not name.startswith("wheel_"):
        return 1.0
    per_nm = 2 * extension.base.alpha
    return per_nm / extension.wheel_radius_m if POWERS[name] else per_nm


def speeds_of(pose: PoseTrack, own: MisfitSettings) -> Speeds:
    """Mean speeds over windows of the log, of those in which the robot moves."""
    step = own.window_s * NS_PER_S
    rows = np.searchsorted(pose.t_ns, np.arange(pose.t_ns[0], pose.t_ns[-1], step))
    rows = np.unique(rows)
    elapsed_s = np.diff(pose.t_ns[rows]) / NS_PER_S
    yaw_rad = np.unwrap(pose.yaw_rad)
    heading = (yaw_rad[rows[1:]] + yaw_rad[rows[:-1]]) / 2
    moved = np.diff(pose.x_m[rows]) * np.cos(heading) + np.diff(pose.y_m[rows]) * np.sin(heading)
    ahead, turned = moved / elapsed_s, np.diff(yaw_rad[rows]) / elapsed_s
    moves = np.abs(ahead) > own.least_speed_mps
    return Speeds(ahead[moves], turned[moves])


def root_mean_square(x: F64) -> float:
    """√(mean x²) of x (n,)."""
    return float(np.sqrt(np.mean(x * x)))


def least_squares(x: F64, y: F64) -> float:
    """The y = k x of least squares; 0 where x is 0 throughout."""
    return float(x @ y / max(float(x @ x), np.finfo(float).tiny))

"""Logs with wrong signs and units: how many are found, and what is made of them.

    python bench/quality_units.py [--logs 54] [--fault torque_reversed] [--without wheels]

Robots, drives, rates and noises are those of ``quality_logs``. Each row of the table is a fault: the share of
logs in which a finding names it, and the median of the seconds until then.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from quality_logs import FAMILIES, clean_log, replayed

from wmr_replay.jobs.replay import Replay
from wmr_schemas.signals import Log

Fault = Callable[[Log, np.random.Generator], Log]


def torque(log: Log, left: float = 1.0, right: float = 1.0, *, swap: bool = False) -> Log:
    """Efforts times factors, or left and right exchanged."""
    track = log.torque
    assert track is not None
    sides = (track.right_nm, track.left_nm) if swap else (track.left_nm, track.right_nm)
    return replace(log, torque=replace(track, left_nm=left * sides[0], right_nm=right * sides[1]))


def wheels(log: Log, left: float = 1.0, right: float = 1.0, *, swap: bool = False) -> Log:
    """Wheel speeds times factors, or left and right exchanged."""
    track = log.torque
    assert track is not None
    sides = (track.right_radps, track.left_radps) if swap else (track.left_radps, track.right_radps)
    return replace(log, torque=replace(track, left_radps=left * sides[0], right_radps=right * sides[1]))


def position(log: Log, factor: float, *, mirrored: bool = False) -> Log:
    """Positions times a factor; mirrored: y to the right and yaw clockwise, as in NED."""
    pose, side = log.pose, -1.0 if mirrored else 1.0
    track = replace(pose, x_m=factor * pose.x_m, y_m=side * factor * pose.y_m, yaw_rad=side * pose.yaw_rad)
    return replace(log, pose=track)


def yaw(log: Log, factor: float) -> Log:
    """Yaw times a factor, as a quaternion holds it."""
    angle = np.remainder(factor * log.pose.yaw_rad + np.pi, 2 * np.pi) - np.pi
    return replace(log, pose=replace(log.pose, yaw_rad=angle))


def parameters(log: Log, **factors: float) -> Log:
    """The robot's parameters times factors."""
    known = log.robot.known()
    changed = {name: float(known[name]) * factor for name, factor in factors.items()}
    return replace(log, robot=replace(log.robot, **changed))


def radius_of(log: Log) -> float:
    """The wheel radius in m."""
    return float(log.robot.wheel_radius_m or 1.0)


RPM = 30 / np.pi
FAULTS: Mapping[str, tuple[Fault, str]] = MappingProxyType(
    {
        "torque_reversed": (lambda log, _: torque(log, -1, -1), "torque_sign"),
        "left_torque_reversed": (lambda log, _: torque(log, -1, 1), "torque_sign"),
        "right_torque_reversed": (lambda log, _: torque(log, 1, -1), "torque_sign"),
        "torques_swapped": (lambda log, _: torque(log, swap=True), "sides_swapped torque_sign"),
        "wheels_swapped": (lambda log, _: wheels(log, swap=True), "sides_swapped"),
        "y_to_the_right": (lambda log, _: position(log, 1.0, mirrored=True), "sides_swapped"),
        "wheels_reversed": (lambda log, _: wheels(log, -1, -1), "wheel_speed_sign"),
        "left_wheel_reversed": (lambda log, _: wheels(log, -1, 1), "wheel_speed_sign"),
        "millimetres": (lambda log, _: position(log, 1000.0), "position_unit"),
        "centimetres": (lambda log, _: position(log, 100.0), "position_unit"),
        "yaw_degrees": (lambda log, _: yaw(log, 180 / np.pi), "yaw_unit"),
        "yaw_clockwise": (lambda log, _: yaw(log, -1.0), "yaw_unit"),
        "rpm": (lambda log, _: wheels(log, RPM, RPM), "wheel_speed_unit"),
        "erpm": (lambda log, _: wheels(log, 7 * RPM, 7 * RPM), "wheel_speed_unit"),
        "wheel_m_per_s": (lambda log, _: wheels(log, radius_of(log), radius_of(log)), "wheel_speed_unit"),
        "ticks": (lambda log, _: wheels(log, 651.9, 651.9), "wheel_speed_unit"),
        "radius_x1000": (lambda log, _: parameters(log, wheel_radius_m=1000.0), "wheel_speed_unit"),
        "half_track_x1000": (lambda log, _: parameters(log, half_track_m=1000.0), "half_track"),
        "full_track": (lambda log, _: parameters(log, half_track_m=2.0), "half_track"),
        "torque_nmm": (lambda log, _: torque(log, 1e3, 1e3), "torque_unit"),
        "motor_torque": (lambda log, rng: torque(log, *(2 * [1 / rng.uniform(15, 60)])), "torque_unit"),
    }
)
"""Each fault, and the codes of the findings that may name it."""


def found_at_s(replay: Replay, code: str) -> float:
    """Seconds until rows are barred, 0 for a warning, NaN where the code is not found."""
    found = [f for f in replay.engine.findings if f.code in code]
    return np.nan if not found else found[0].where[0][0] if found[0].where else 0.0


def measure(name: str, n_logs: int, first_seed: int, duration_s: float) -> tuple[float, float, Counter[str]]:
    """Share of logs in which the fault is found, median of the seconds until then, and other findings."""
    fault, code = FAULTS[name]
    times, others = [], Counter[str]()
    for k in range(n_logs):
        seed, family = first_seed + k // len(FAMILIES), list(FAMILIES)[k % len(FAMILIES)]
        log = fault(clean_log(family, seed, duration_s=duration_s), np.random.default_rng([seed, k]))
        replay = replayed(log)
        times.append(found_at_s(replay, code))
        others.update(f.code for f in replay.engine.findings if f.code not in code)
        if np.isnan(times[-1]):
            others[f"missed: {family} {log.pose.t_ns.size / duration_s:.0f} Hz seed {seed}"] += 1
    found = np.isfinite(times)
    return float(found.mean()), float(np.median(np.array(times)[found])) if found.any() else np.nan, others


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=54)
    parser.add_argument("--fault", choices=FAULTS, nargs="*")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--duration", type=float, default=60.0)
    options = parser.parse_args()
    print(f"{'fault':<22}{'finding':<18}{'found':>6}{'after':>8}  other findings")
    for name in options.fault or FAULTS:
        share, after_s, others = measure(name, options.logs, options.seed, options.duration)
        print(
            f"{name:<22}{FAULTS[name][1].split()[0]:<18}{share:>6.0%}{after_s:>6.1f} s  {dict(others)}",
            flush=True,
        )


if __name__ == "__main__":
    main()

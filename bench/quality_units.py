"""Logs with wrong signs and units: how many are found, and what is made of them.

    python bench/quality_units.py [--logs 54] [--fault torque_reversed] [--without wheels]

Robots, drives, rates and noises are those of ``quality_logs``. Each row of the table is a fault: the share of
logs in which a finding names it, and the median of the seconds until then.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from quality_logs import FAMILIES, clean_log, replayed

from wmr_replay.pipeline.settings import Settings
from wmr_schemas.findings import Finding
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
        "wheels_reversed": (
            lambda log, _: wheels(log, -1, -1),
            "wheel_speed_sign heading_not_along_path",
        ),
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


@dataclass
class Row:
    """What was found of one fault: seconds until then (NaN: missed), and other findings."""

    at_s: list[float] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)

    def add(self, codes: str, findings: list[Finding], log: str) -> None:
        """One more log."""
        ours = [f for f in findings if f.code in codes]
        self.others.update(f.code for f in findings if f.code not in codes)
        if not ours:
            self.others[f"missed: {log}"] += 1
        self.at_s.append(np.nan if not ours else ours[0].where[0][0] if ours[0].where else 0.0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=54)
    parser.add_argument("--fault", choices=FAULTS, nargs="*")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--duration", type=float, default=60.0)
    options = parser.parse_args()
    rows = {name: Row() for name in options.fault or FAULTS}
    for k in range(options.logs):
        seed, family = options.seed + k // len(FAMILIES), list(FAMILIES)[k % len(FAMILIES)]
        clean = clean_log(family, seed, duration_s=options.duration)
        name = f"{family} {len(clean.pose) / options.duration:.0f} Hz {seed}"
        for fault, row in rows.items():
            make, codes = FAULTS[fault]
            log = make(clean, np.random.default_rng([seed, k]))
            row.add(codes, replayed(log, settings=Settings(identifier="paper")).engine.findings, name)
    print(f"{'fault':<22}{'finding':<18}{'logs':>5}{'found':>7}{'after':>8}  other findings")
    for name, row in rows.items():
        found = np.isfinite(row.at_s)
        after = f"{np.median(np.array(row.at_s)[found]):.1f} s" if found.any() else "–"
        code = FAULTS[name][1].split()[0]
        print(f"{name:<22}{code:<18}{len(found):>5}{found.mean():>7.0%}{after:>8}  {dict(row.others)}")


if __name__ == "__main__":
    main()

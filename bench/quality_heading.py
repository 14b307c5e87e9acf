"""Made-up logs whose heading is unusable, whose robot moves sideways, or whose noise is coloured.

    python bench/quality_heading.py [--logs 50]

The table counts, for every fault and size, the logs in which the finding is made, and after how many metres.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from quality_logs import FAMILIES, RATES_HZ, clean_log, replayed

from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth.sensors import NOISE_LEVELS

WINDING = ("patrol", "stop-go", "square-wave", "teleoperated", "friction-limit")
"""Families whose paths turn."""
Fault = Callable[[int], Log]


def with_pose(log: Log, **columns: F64) -> Log:
    """The log with other columns of the pose."""
    return replace(log, pose=replace(log.pose, **columns))


def winding_log(seed: int, **wishes: object) -> Log:
    """A clean log of one of the winding families."""
    return clean_log(WINDING[seed % len(WINDING)], seed, **wishes)  # type: ignore[arg-type]


def identity(seed: int) -> Log:
    """An orientation that was never filled in."""
    log = winding_log(seed)
    return with_pose(log, yaw_rad=np.full(len(log.pose), 0.0))


def held(seed: int) -> Log:
    """An orientation that stays what it was after 20 s."""
    log = winding_log(seed)
    since = int(np.searchsorted(log.pose.t_ns, log.pose.t_ns[0] + 20 * 10**9))
    yaw = log.pose.yaw_rad.copy()
    yaw[since:] = yaw[since]
    return with_pose(log, yaw_rad=yaw)


def steady(seed: int) -> Log:
    """An orientation that does not turn with the robot, with the noise of a compass or a filter."""
    log, rng = winding_log(seed), np.random.default_rng(seed)
    sd = rng.uniform(0.001, 0.03)
    return with_pose(log, yaw_rad=rng.uniform(-3, 3) + sd * rng.standard_normal(len(log.pose)))


def unrelated(seed: int) -> Log:
    """The orientation of another robot."""
    log, other = winding_log(seed, rate_hz=50.0), winding_log(seed + 1000, rate_hz=50.0)
    return with_pose(log, yaw_rad=other.pose.yaw_rad[: len(log.pose)])


def mirrored(seed: int) -> Log:
    """An orientation that counts the other way."""
    log = winding_log(seed)
    return with_pose(log, yaw_rad=-log.pose.yaw_rad)


def turned(offset_deg: float) -> Fault:
    """A heading that is turned by a constant angle."""

    def log_of(seed: int) -> Log:
        log = clean_log(list(FAMILIES)[seed % 6], seed)
        return with_pose(log, yaw_rad=log.pose.yaw_rad + np.radians(offset_deg))

    return log_of


def wandering(n: int, rng: np.random.Generator, step_s: float, time_s: float) -> F64:
    """A smooth random signal (n,) of standard deviation 1."""
    knots = np.arange(int(n * step_s / time_s) + 3)
    values = rng.standard_normal(len(knots))
    at = np.arange(n) * step_s / time_s
    k = at.astype(int)
    blend = 0.5 - 0.5 * np.cos(np.pi * (at - k))
    return values[k] * (1 - blend) + values[k + 1] * blend


def moved(
    body: tuple[F64, F64, F64], step_s: float, rng: np.random.Generator, noise: str
) -> tuple[F64, F64, F64]:
    """Noisy x, y, yaw of body velocities v_long, v_lat and yaw rate."""
    v, w, rate = body
    yaw = rng.uniform(-3, 3) + np.cumsum(rate) * step_s
    x = np.cumsum(v * np.cos(yaw) - w * np.sin(yaw)) * step_s
    y = np.cumsum(v * np.sin(yaw) + w * np.cos(yaw)) * step_s
    sd_m, sd_rad = NOISE_LEVELS[noise]
    n = len(v)
    return (
        x + sd_m * rng.standard_normal(n),
        y + sd_m * rng.standard_normal(n),
        yaw + sd_rad * rng.standard_normal(n),
    )


def kinematic(
    seed: int,
    body: Callable[[int, float, np.random.Generator], tuple[F64, F64, F64]],
    duration_s: float = 60.0,
) -> Log:
    """A log without torques, of body velocities; rate and noise are drawn."""
    rng = np.random.default_rng([seed, 7])
    rate, noise = float(rng.choice(RATES_HZ)), str(rng.choice(list(NOISE_LEVELS)))
    step_s = 1 / max(rate, 100.0)
    n = int(duration_s / step_s)
    x, y, yaw = moved(body(n, step_s, rng), step_s, rng, noise)
    every = round(1 / rate / step_s)
    t_ns = (np.arange(n) * round(step_s * 1e9))[::every]
    return Log(PoseTrack(t_ns, x[::every], y[::every], yaw[::every]), None, None, RobotParameters())


def legs(n: int, step_s: float, rng: np.random.Generator, kinds: F64) -> tuple[F64, F64, F64]:
    """Drives of 2 to 5 s from rest to rest; ``kinds`` (3, k) are the body velocities to draw from."""
    body = np.zeros((3, n))
    at = 0
    while at < n:
        wait, length = round(rng.uniform(0.3, 1.0) / step_s), round(rng.uniform(2.0, 5.0) / step_s)
        shape = np.sin(np.linspace(0, np.pi, length)) ** 0.5
        wanted = kinds[:, rng.integers(kinds.shape[1])] * rng.uniform(0.7, 1.2) * rng.choice([-1, 1])
        room = body[:, at + wait : at + wait + length]
        room += (wanted[:, None] * shape)[:, : room.shape[1]]
        at += wait + length
    return body[0], body[1], body[2]


def strafing(seed: int) -> Log:
    """A mecanum base: ahead, sideways, diagonally and on the spot, from rest to rest."""
    kinds = np.array([[0.5, 0, 0], [0, 0.5, 0], [0.35, 0.35, 0], [0, 0, 0.7]]).T
    return kinematic(seed, lambda n, step_s, rng: legs(n, step_s, rng, kinds), 120.0)


def gliding(seed: int) -> Log:
    """An omnidirectional base that follows a curve in any direction and turns as it likes."""

    def body(n: int, step_s: float, rng: np.random.Generator) -> tuple[F64, F64, F64]:
        course, rate = 3 * wandering(n, rng, step_s, 4.0), 0.4 * wandering(n, rng, step_s, 3.0)
        return 0.6 * np.cos(course), 0.6 * np.sin(course), rate

    return kinematic(seed, body)


def drifting(seed: int) -> Log:
    """A car that drifts either way with a sideslip of 15 to 65 degrees for 1 to 4 s: a clean log."""

    def body(n: int, step_s: float, rng: np.random.Generator) -> tuple[F64, F64, F64]:
        side = np.tanh(3 * wandering(n, rng, step_s, 2.5))
        depth = np.radians(rng.uniform(15, 65)) * np.clip(1.5 * np.abs(wandering(n, rng, step_s, 3.0)), 0, 1)
        slip = -side * depth
        speed = rng.uniform(1.0, 4.0)
        course_rate = side * rng.uniform(0.8, 2.0)
        return speed * np.cos(slip), speed * np.sin(slip), course_rate - np.gradient(slip, step_s)

    return kinematic(seed, body)


def swinging(seed: int) -> Log:
    """A car that drifts from side to side, 15 to 70 degrees, in 2 to 6 s each: a clean log."""
    draws = np.random.default_rng([seed, 9])
    depth, period_s = np.radians(draws.uniform(15, 70)), draws.uniform(4, 12)
    speed, course_rate = draws.uniform(1, 5), draws.uniform(0.8, 2)

    def body(n: int, step_s: float, rng: np.random.Generator) -> tuple[F64, F64, F64]:
        side = np.tanh(3 * np.sin(2 * np.pi * np.arange(n) * step_s / period_s + seed))
        slip = -depth * side
        return speed * np.cos(slip), speed * np.sin(slip), course_rate * side - np.gradient(slip, step_s)

    return kinematic(seed, body)


def off_axle(seed: int) -> Log:
    """The pose of a point .1 to .4 m off the axle's middle, on a base that turns on the spot: a clean log."""
    rng = np.random.default_rng([seed, 8])
    arm, at = rng.uniform(0.1, 0.4), rng.uniform(-np.pi, np.pi)
    kinds = np.array([[0.5, 0, 0], [0.5, 0, 0.4], [0, 0, 0.7]]).T

    def body(n: int, step_s: float, rng: np.random.Generator) -> tuple[F64, F64, F64]:
        v, w, rate = legs(n, step_s, rng, kinds)
        return v - rate * arm * np.sin(at), w + rate * arm * np.cos(at), rate

    return kinematic(seed, body)


FAULTS: dict[str, tuple[Fault, tuple[str, ...]]] = {
    "identity": (identity, ("no_heading",)),
    "held from 20 s on": (held, ("no_heading",)),
    "steady": (steady, ("no_heading", "heading_not_along_path")),
    "unrelated": (unrelated, ("heading_not_along_path",)),
    "mirrored": (mirrored, ("heading_not_along_path", "yaw_unit")),
    "turned by 90°": (turned(90), ("heading_not_along_path",)),
    "turned by -90°": (turned(-90), ("heading_not_along_path",)),
    "turned by 30°": (turned(30), ("heading_not_along_path",)),
    "turned by 15°": (turned(15), ("heading_not_along_path",)),
    "strafing": (strafing, ("drives_sideways", "heading_not_along_path", "no_heading")),
    "gliding": (gliding, ("drives_sideways", "heading_not_along_path")),
}
SOUND: dict[str, Fault] = {"drifting": drifting, "swinging drifts": swinging, "off axle": off_axle}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=50, help="per fault")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.logs)
    print(f"{'fault':<22}{'logs':>5}{'found':>7}  codes that bar")
    for name, (fault, codes) in FAULTS.items():
        found = [barring(fault(seed)) for seed in seeds]
        hits = sum(bool(set(codes) & set(each)) for each in found)
        print(
            f"{name:<22}{len(found):>5}{hits:>7}  {sorted({c for each in found for c in each})}", flush=True
        )
    for name, fault in SOUND.items():
        found = [barring(fault(seed)) for seed in seeds]
        print(f"{name:<22}{len(found):>5}{sum(map(bool, found)):>7}  (clean: none is wanted)", flush=True)


def barring(log: Log) -> list[str]:
    """Codes of the findings that bar rows of the log."""
    return [f.code for f in replayed(log).engine.findings if f.severity == "bars"]


if __name__ == "__main__":
    main()

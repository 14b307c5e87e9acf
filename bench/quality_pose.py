"""Poses that are no wheeled robot's, and noise that is not white: how many are found, and in clean logs.

    python bench/quality_pose.py [--logs 54] [--seed 0]

``pose_not_planar``: roll, pitch and height are added to the path of a clean log, and it is read from a file.
``coloured_noise``: noise with a time constant is added to the white noise of a clean log.
"""

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from quality_logs import FAMILIES, clean_log, replayed
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

import wmr_replay as wr
from wmr_replay.pipeline.settings import NO_IDENTIFIER, Settings
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth.recorder import channels_of, find_codec, register
from wmr_synth.sensors import NOISE_LEVELS

Attitude = Callable[[Log, np.random.Generator], F64]
"""Roll and pitch in rad and height in m, (3, n)."""
LENGTH_S = 40.0


def wave(t_s: F64, rng: np.random.Generator, shortest_s: float, longest_s: float) -> F64:
    """A smooth aperiodic signal of rms 1, (n,)."""
    periods, phases = rng.uniform(shortest_s, longest_s, (6, 1)), rng.uniform(0, 2 * np.pi, (6, 1))
    return np.asarray(np.sin(2 * np.pi * t_s / periods + phases).sum(axis=0) / np.sqrt(3.0))


def seconds(log: Log) -> F64:
    """Times of the poses since the first, in s."""
    return (log.pose.t_ns - log.pose.t_ns[0]) / NS_PER_S


def in_a_hand(log: Log, rng: np.random.Generator) -> F64:
    """Roll and pitch of 20° to 45° rms together, height of .3 m."""
    t_s, size = seconds(log), np.radians(rng.uniform(20, 45)) / np.sqrt(2)
    return np.stack([size * wave(t_s, rng, 2, 6), size * wave(t_s, rng, 2, 6), 0.3 * wave(t_s, rng, 2, 8)])


def in_flight(log: Log, rng: np.random.Generator) -> F64:
    """Climbs and descends as quickly as it moves along."""
    t_s = seconds(log)
    speed = max(float(np.median(driven(log))), 0.2)
    climb = rng.uniform(1.0, 2.0) * speed * wave(t_s, rng, 4, 10)
    return np.stack([0.05 * wave(t_s, rng, 2, 5), 0.05 * wave(t_s, rng, 2, 5), np.cumsum(climb) * t_s[1]])


def driven(log: Log) -> F64:
    """Metres within each second."""
    step = len(log.pose) // int(LENGTH_S)
    x_m, y_m = log.pose.x_m[::step], log.pose.y_m[::step]
    return np.hypot(np.diff(x_m), np.diff(y_m))


def on_ramps(log: Log, rng: np.random.Generator) -> F64:
    """Slopes of 3° to 12° up and down, every 10 s."""
    t_s, step = seconds(log), len(log.pose) // int(LENGTH_S)
    slope = np.radians(rng.uniform(3, 12)) * np.sign(np.sin(2 * np.pi * t_s / 20))
    speed = np.interp(t_s, t_s[::step][1 : 1 + len(driven(log))], driven(log))
    return np.stack([0 * t_s, -slope, np.cumsum(speed * np.tan(slope)) * t_s[1]])


def on_rough_ground(log: Log, rng: np.random.Generator) -> F64:
    """Roll and pitch of 6° rms, 2 cm of height."""
    t_s = seconds(log)
    return np.stack([0.1 * wave(t_s, rng, 1, 3), 0.1 * wave(t_s, rng, 1, 3), 0.02 * wave(t_s, rng, 1, 3)])


def askew(log: Log, rng: np.random.Generator) -> F64:
    """A tracker that is mounted with a constant tilt of up to 60°."""
    tilt = rng.uniform(-1, 1, (2, 1)) * np.ones(len(log.pose))
    return np.concatenate([tilt, 0.5 * np.ones((1, len(log.pose)))])


CARRIERS: dict[str, Attitude] = {
    "camera in a hand": in_a_hand,
    "flying tracker": in_flight,
    "clean, ramps": on_ramps,
    "clean, rough ground": on_rough_ground,
    "clean, mounted askew": askew,
}


def written(log: Log, attitude: F64, path: Path) -> Path:
    """The log as a file with roll, pitch and height."""
    codec, turns = find_codec("ros2"), np.stack([log.pose.yaw_rad, attitude[1], attitude[0]], axis=1)
    quaternion = Rotation.from_euler("ZYX", turns).as_quat()
    poses = np.concatenate([np.stack([log.pose.x_m, log.pose.y_m, attitude[2]], axis=1), quaternion], axis=1)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(codec.profile, "made up")
        entries = []
        for channel in channels_of(log, codec, None):
            messages = channel.messages(slice(0, len(channel.t_ns)))
            if channel.topic == "/pose":
                messages = [m[:-56] + p.tobytes() for m, p in zip(messages, poses, strict=True)]
            number = register(writer, codec, channel)
            entries += [(t, number, m) for t, m in zip(channel.t_ns.tolist(), messages, strict=True)]
        for t_ns, number, message in sorted(entries):
            writer.add_message(number, t_ns, message, t_ns)
        writer.finish()
    return path


def is_not_planar(seed: int, attitude: Attitude, folder: Path) -> bool:
    """Whether a log of that carrier is found not to be planar."""
    rng = np.random.default_rng([seed, 21])
    family, rate = list(FAMILIES)[seed % len(FAMILIES)], float(rng.choice([20.0, 50.0, 100.0]))
    log = clean_log(family, seed, rate_hz=rate, duration_s=LENGTH_S)
    path = written(log, attitude(log, rng), folder / "log.mcap")
    return any(found["code"] == "pose_not_planar" for found in wr.open_log(path).info().findings)


def is_coloured(seed: int, times: float) -> bool:
    """Whether noise over 20 to 100 ms of ``times`` the white noise's deviation is found, from 100 Hz on."""
    rng = np.random.default_rng([seed, 22])
    noise, rate = str(rng.choice(list(NOISE_LEVELS))), float(rng.choice([100.0, 200.0, 1000.0]))
    log = clean_log(list(FAMILIES)[seed % len(FAMILIES)], seed, noise=noise, rate_hz=rate)
    kept = float(np.exp(-1 / (rate * rng.uniform(0.02, 0.1))))
    sd = times * np.array(NOISE_LEVELS[noise])[[0, 0, 1], None]
    p = log.pose
    added = sd * lfilter([np.sqrt(1 - kept**2)], [1, -kept], rng.standard_normal((3, len(p))), axis=1)
    columns = np.stack([p.x_m, p.y_m, p.yaw_rad]) + added
    coloured = replace(log, pose=PoseTrack(p.t_ns, *columns))
    found = replayed(coloured, settings=Settings(identifier=NO_IDENTIFIER)).engine.findings
    return any(f.code == "coloured_noise" for f in found)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=54)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.logs)
    print(f"{'case':<36}{'logs':>5}{'found':>7}")
    with tempfile.TemporaryDirectory() as folder:
        for name, attitude in CARRIERS.items():
            n = sum(is_not_planar(seed, attitude, Path(folder)) for seed in seeds)
            print(f"{name:<36}{options.logs:>5}{n:>7}", flush=True)
    for times in (2.0, 3.0, 0.0):
        n = sum(is_coloured(seed, times) for seed in seeds)
        print(f"{f'coloured noise, {times:g} × white':<36}{options.logs:>5}{n:>7}", flush=True)


if __name__ == "__main__":
    main()

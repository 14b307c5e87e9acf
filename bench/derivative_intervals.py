"""Do the 95 % intervals of the derivatives hold, whatever the colour of the pose's noise?

    python bench/derivative_intervals.py [--split develop|report] [--rates 100,1000] [--seconds 60]

A robot drives as a teleoperator or a patrol steers it (ideal rolling and a few skids and slips), and its pose
is measured with white noise alone, or with a third or all of its variance as a wobble: a first-order process
of a correlation time, or a drift that never returns (a random walk, of the level's size within a second). The
table holds the share of rows whose 95 % interval holds the truth at the described instant, for the samples
table and the hindsight table; rows within .4 s of a switch of mode are left out (a window over a switch is
biased, not noisy).
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from quality_logs import FAMILIES as PLANS

from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth import Disturbance, Sensors, SimulatedLog, synthesise
from wmr_synth.driving.patrol import small_robot
from wmr_synth.hidden.disturbance import unit_ou
from wmr_synth.hidden.world import World
from wmr_synth.scenarios import Scenario

NAMES = ("v_long_mps", "v_lat_mps", "yaw_rate_radps", "a_long_mps2", "yaw_acc_radps2")
LEVELS = {"mocap": (0.001, 0.002), "rtk": (0.01, 0.005), "poor": (0.05, 0.02)}
WALK = 1e4
"""A correlation time so long that the wobble walks."""
PARTS: dict[str, dict[str, Any]] = {
    "develop": {"families": ("patrol",), "times_s": (0.02, 0.1, 0.5, 2.0), "shares": (1.0, 0.33), "seed": 0},
    "report": {
        "families": ("teleoperated", "stop-go"),
        "times_s": (0.04, 0.2, 1.0, WALK),
        "shares": (0.7, 0.2),
        "seed": 100_000,
    },
}
"""Which colours and drivers were tuned on, and which were not."""
ACCELERATION = Disturbance(0.1, 0.4)
CLOSE_TO_SWITCH_S = 0.4
Row = dict[str, Any]


@dataclass(frozen=True)
class Colour:
    """A pose noise: level, share of its variance that wobbles, correlation time."""

    noise: str
    share: float
    time_s: float

    @property
    def label(self) -> str:
        """As the table states it."""
        if not self.share:
            return "white"
        return "walk" if self.time_s == WALK else f"{self.time_s:g} s, share {self.share:g}"


def colours(part: Row, noise: str) -> Iterator[Colour]:
    """White noise, and every wobble."""
    yield Colour(noise, 0.0, 1.0)
    for time_s, share in product(part["times_s"], part["shares"]):
        if time_s != WALK or share == part["shares"][0]:
            yield Colour(noise, share, time_s)


def driven(family: str, seed: int, rate_hz: float, seconds: float) -> SimulatedLog:
    """A drive with an exact pose and coloured accelerations."""
    robot = small_robot()
    scenario = Scenario(
        family,
        family,
        seconds,
        PLANS[family],
        Sensors(rate_hz, max(rate_hz, 50.0), 0.0, 0.0),
        robot,
        disturbed=True,
    )
    return synthesise(scenario, seed=seed, world=World(disturbance=ACCELERATION))


def measured(exact: Log, colour: Colour, seed: int) -> Log:
    """The log with this noise on its pose."""
    rng = np.random.default_rng([seed, 77])
    pose, n = exact.pose, len(exact.pose.t_ns)
    seconds = np.diff(pose.t_ns) / NS_PER_S
    wobble = unit_ou(seconds / colour.time_s, rng).T
    if colour.time_s == WALK:
        wobble = (wobble - wobble[:, :1]) * np.sqrt(WALK / 2)
    white = rng.normal(0.0, 1.0, (3, n))
    xy, yaw = LEVELS[colour.noise]
    noise = np.array([[xy], [xy], [yaw]]) * (
        np.sqrt(1 - colour.share) * white + np.sqrt(colour.share) * wobble
    )
    return replace(
        exact, pose=PoseTrack(pose.t_ns, pose.x_m + noise[0], pose.y_m + noise[1], pose.yaw_rad + noise[2])
    )


def truth_of(made: SimulatedLog) -> dict[str, F64]:
    """Columns of the noise-free motion at its stamps; accelerations by differences over 10 ms."""
    motion, t_s = made.truth, made.truth.t_ns / NS_PER_S
    found = {name: np.asarray(getattr(motion, name)) for name in NAMES[:3]}
    for name, of in (("a_long_mps2", "v_long_mps"), ("yaw_acc_radps2", "yaw_rate_radps")):
        later, earlier = (np.interp(t_s + shift, t_s, found[of]) for shift in (0.005, -0.005))
        found[name] = (later - earlier) / 0.01
    return found | {"t_s": t_s, "mode": np.asarray(motion.mode)}


def held(table: pl.DataFrame, about_s: F64, truth: dict[str, F64]) -> Row:
    """Share of rows inside their interval, and root mean square of error over sd, by quantity."""
    switches = truth["t_s"][1:][np.diff(truth["mode"]) != 0]
    away = np.full(len(about_s), np.inf)
    if len(switches):
        away = np.abs(about_s[:, None] - switches).min(axis=1)
    found = {}
    for name in NAMES:
        value, sd = table[name].to_numpy().astype(float), table[f"{name}_sd"].to_numpy().astype(float)
        off = value - np.interp(about_s, truth["t_s"], truth[name])
        known = np.isfinite(off) & np.isfinite(sd) & (away > CLOSE_TO_SWITCH_S)
        inside = np.abs(off[known]) <= 1.96 * sd[known]
        found[name] = [float(inside.mean()), float(np.sqrt(np.mean((off[known] / sd[known]) ** 2)))]
        found[name].append(float(np.median(sd[known])))
    return found


def judged(log: Log, truth: dict[str, F64]) -> Row:
    """Both tables of one log."""
    replay = Replay(MemorySource(log, "log"), Engine(Settings(), ReplayModel(log.robot)))
    samples, later = pl.concat(list(replay.samples())), pl.concat(list(replay.hindsight()))
    start_ns = int(log.pose.t_ns[0])
    shown_s = (samples["t_ns"].to_numpy() - start_ns) / NS_PER_S - samples["delay_s"].to_numpy()
    return {
        "samples": held(samples, shown_s, truth),
        "hindsight": held(later, (later["t_ns"].to_numpy() - start_ns) / NS_PER_S, truth),
    }


def table(rows: list[Row]) -> str:
    """Coverage by rate, noise and colour: of samples / of hindsight."""
    lines = [f"| rate | noise | colour | {' | '.join(NAMES)} |", "|" + " --- |" * (3 + len(NAMES))]
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault((f"{row['rate']:g} Hz", row["noise"], row["colour"]), []).append(row)
    for key, group in groups.items():
        cells = []
        for name in NAMES:
            both = [np.mean([row[kind][name][0] for row in group]) for kind in ("samples", "hindsight")]
            cells.append(f"{both[0]:.3f} / {both[1]:.3f}")
        lines.append(f"| {' | '.join((*key, *cells))} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--split", choices=tuple(PARTS), default="develop")
    parser.add_argument("--rates", default="100,1000")
    parser.add_argument("--noises", default=",".join(LEVELS))
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    part, rows = PARTS[asked.split], []
    for rate in map(float, asked.rates.split(",")):
        for family in part["families"]:
            made = driven(family, part["seed"], rate, asked.seconds)
            truth = truth_of(made)
            for noise in asked.noises.split(","):
                for colour in colours(part, noise):
                    row: Row = {"rate": rate, "noise": noise, "colour": colour.label, "family": family}
                    rows.append(row | judged(measured(made.log, colour, part["seed"]), truth))
                    if asked.out:
                        with asked.out.open("a", encoding="utf-8") as file:
                            file.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()

"""Modes from wheel speeds, by driver family and noise: causal, in hindsight, and a yardstick told the robot.

    python bench/encoder_modes.py [--part develop|report] [--logs 2] [--first-seed S]

Half of the robots are skid-steer; wheel radius and track are up to 3 % off, the encoders have 2048 ticks at
100 Hz. False slips are counted on dry ground. The table's rows are means over the logs of a family and noise.
"""

import argparse

import numpy as np
from encoders.logs import made
from encoders.split import part
from encoders.yardstick import modes_told

import wmr_replay as wr
from wmr_schemas.arrays import F64, I8
from wmr_synth import SimulatedLog
from wmr_synth.sensors import NOISE_LEVELS

WARM_S = 1.0
BINS = 10


def calibration_error(posterior: F64, true: I8) -> float:
    """Expected calibration error of the most probable mode, ten bins."""
    confidence, right = posterior.max(axis=0), posterior.argmax(axis=0) == true
    place = np.minimum((confidence * BINS).astype(int), BINS - 1)
    parts = [place == k for k in range(BINS)]
    return float(sum(abs(confidence[p].mean() - right[p].mean()) * p.mean() for p in parts if p.any()))


def yardstick(simulated: SimulatedLog, noise: str) -> tuple[float, float]:
    """Accuracy and calibration error of the filter that is told the robot."""
    log, rolling = simulated.log, simulated.facts["true_robot"]
    assert log.wheels is not None
    scale = rolling["wheel_radius_m"]
    wheels = np.stack([log.wheels.left_radps, log.wheels.right_radps]) * scale
    rows = np.searchsorted(log.wheels.t_ns, log.pose.t_ns, side="right") - 1
    wheels = wheels[:, np.maximum(rows, 0)]
    pose = np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad])
    robot = np.array([rolling["half_track_m"], rolling["icr_offset_m"], rolling["lateral_slip_s"]])
    step_s = float(np.median(np.diff(log.pose.t_ns))) * 1e-9
    posterior = modes_told(wheels, pose, NOISE_LEVELS[noise], step_s, robot)
    warm = (log.pose.t_ns - log.pose.t_ns[0]) * 1e-9 > WARM_S
    posterior, true = posterior[:, warm], true_modes(simulated)[warm]
    return float((posterior.argmax(axis=0) == true).mean()), calibration_error(posterior, true)


def true_modes(simulated: SimulatedLog) -> I8:
    """The true mode (n,) at every pose."""
    mode = simulated.log.mode
    assert mode is not None
    rows = np.searchsorted(mode.t_ns, simulated.log.pose.t_ns, side="right") - 1
    return mode.mode[np.maximum(rows, 0)]


def false_slips_an_hour(family: str, chassis: str, noise: str, seed: int) -> float:
    """Slips told on dry ground, an hour, behind the warm-up."""
    simulated = made(family, chassis, noise, seed, slippery=False)
    told = wr.replay(simulated.log, hindsight=False).samples.collect()
    slips = told["mode"].is_in(["slipping", "skidding_slipping"]).to_numpy()
    slips &= ~np.isin(true_modes(simulated), (2, 3))
    begins = int((np.diff(slips.astype(int)) > 0).sum())
    return begins / (told["t_s"][-1] / 3600)


def scores(family: str, chassis: str, noise: str, seed: int) -> list[float]:
    """Of one log: yardstick, causal, hindsight; their calibration errors; false slips an hour."""
    simulated = made(family, chassis, noise, seed)
    known, known_ece = yardstick(simulated, noise)
    row = wr.replay(simulated.log).summary.to_dicts()[0]
    accuracies = [known, row["accuracy"], row["hindsight_accuracy"]]
    errors = [known_ece, row["ece"], row["hindsight_ece"]]
    return [*accuracies, *errors, false_slips_an_hour(family, chassis, noise, seed)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=("develop", "report"), default="develop")
    parser.add_argument("--logs", type=int, default=2, help="of each chassis")
    parser.add_argument("--first-seed", type=int)
    options = parser.parse_args()
    chosen = part(options.part)
    first = chosen.first_seed if options.first_seed is None else options.first_seed
    print("| family | noise | logs | told the robot | causal | hindsight | ece | ece | ece | false slips/h |")
    print("| --- " * 10 + "|")
    for family in chosen.families:
        for noise in NOISE_LEVELS:
            rows = [
                scores(family, chassis, noise, first + seed)
                for chassis in ("differential", "skid-steer")
                for seed in range(options.logs)
            ]
            cells = " | ".join(f"{value:.3f}" for value in np.mean(rows, axis=0))
            print(f"| {family} | {noise} | {len(rows)} | {cells} |", flush=True)


if __name__ == "__main__":
    main()

"""Modes from wheel speeds, by driver family and noise: causal, in hindsight, and two yardsticks.

    python bench/encoder_modes.py [--part develop|report] [--logs 2] [--first-seed S]

Half of the robots are skid-steer; wheel radius and track are up to 3 % off, the encoders have 2048 ticks at
100 Hz. Both yardsticks are told the robot's true dimensions: an ordinary filter that shares nothing with the
analysis (``encoders/yardstick.py``), and the analysis's own bank. False slips are counted on dry ground. The
table's rows are means over the logs of a family and noise.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from encoders.logs import made
from encoders.split import part
from encoders.yardstick import modes_told

import wmr_replay as wr
from wmr_replay.identify.filter_bank.bank import Bank, BankSettings
from wmr_replay.identify.filter_bank.bins import into_bins, open_bin
from wmr_replay.identify.wheel_bank.model import WheelModel
from wmr_replay.identify.wheel_bank.states import WheelPrior
from wmr_schemas.arrays import F64, I8, I64, Bool
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


@dataclass(frozen=True, eq=False)
class Aligned:
    """A log with its wheel speeds (2, n) in m/s at its poses (3, n), by the true radius."""

    t_ns: I64
    pose: F64
    wheels_mps: F64
    robot: F64
    """Effective half track in m, x_icr in m, lateral slip in s."""
    noise_sd: tuple[float, float]
    true: I8

    @property
    def warm(self) -> Bool:
        """Rows that are scored."""
        return np.asarray((self.t_ns - self.t_ns[0]) * 1e-9 > WARM_S)

    def score(self, posterior: F64) -> tuple[float, float]:
        """Accuracy and calibration error of a posterior (4, n)."""
        chosen, true = posterior[:, self.warm], self.true[self.warm]
        return float((chosen.argmax(axis=0) == true).mean()), calibration_error(chosen, true)


def aligned(simulated: SimulatedLog, noise: str) -> Aligned:
    """What both yardsticks are told."""
    log, true = simulated.log, simulated.facts["true_robot"]
    assert log.wheels is not None
    rows = np.searchsorted(log.wheels.t_ns, log.pose.t_ns, side="right") - 1
    speeds = np.stack([log.wheels.left_radps, log.wheels.right_radps])[:, np.maximum(rows, 0)]
    return Aligned(
        log.pose.t_ns,
        np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad]),
        speeds * true["wheel_radius_m"],
        np.array([true["half_track_m"], true["icr_offset_m"], true["lateral_slip_s"]]),
        NOISE_LEVELS[noise],
        true_modes(simulated),
    )


def bank_told(log: Aligned) -> F64:
    """The posterior (4, n) of the analysis's bank whose robot is known."""
    half_track, icr, lateral = log.robot
    prior = WheelPrior(np.array([0.0, np.log(half_track), icr, lateral, 0.0, 0.005]), np.full(6, 1e-4))
    n, step_s = len(log.t_ns), float(np.median(np.diff(log.t_ns))) * 1e-9
    bank = Bank(WheelModel(prior, np.zeros(6)), step_s, BankSettings(), 4)
    variances = np.tile(np.array(log.noise_sd)[:, None] ** 2, (1, n))
    known = log.t_ns, log.pose, log.wheels_mps, variances, np.zeros(n, bool)
    bins, done = into_bins(*known, bank.rows_per_bin, open_bin())
    unknown = np.full(n, np.nan)
    said = bank.push(bins, unknown, unknown, done)[:4]
    return np.concatenate([np.full((4, 1), 0.25), said], axis=1)[:, done]


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
    """Of one log: both yardsticks, causal, hindsight; calibration errors of these; false slips an hour."""
    simulated = made(family, chassis, noise, seed)
    log = aligned(simulated, noise)
    step_s = float(np.median(np.diff(log.t_ns))) * 1e-9
    filtered, _ = log.score(modes_told(log.wheels_mps, log.pose, log.noise_sd, step_s, log.robot))
    told, _ = log.score(bank_told(log))
    row = wr.replay(simulated.log).summary.to_dicts()[0]
    accuracies = [filtered, told, row["accuracy"], row["hindsight_accuracy"]]
    errors = [row["ece"], row["hindsight_ece"]]
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
    heads = "filter told | bank told | causal | hindsight | causal ece | hindsight ece | false slips/h"
    print(f"| family | noise | logs | {heads} |")
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

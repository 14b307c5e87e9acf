"""Modes from wheel speeds, by driver family and noise: causal, in hindsight, and the yardsticks of both.

    python bench/encoder_modes.py [--part develop|report|late] [--logs 2] [--colour eccentric]

Half of the robots are skid-steer; wheel radius and track are up to 3 % off, the encoders have 2048 ticks at
100 Hz. A filter and a smoother that share nothing with the analysis (``encoders/yardstick.py``) are told the
robot, and so is the analysis's own bank. False slips are counted on dry ground. The table's rows are means
over the logs of a family and noise. ``--converged`` prints instead how far twice the yardstick's hypotheses
and trajectories move its accuracies.
"""

import argparse
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from encoders.colours import COLOURS, coloured
from encoders.logs import made
from encoders.split import part
from encoders.yardstick import N_DRAWN, ROOM, Told, modes_told, rates_of

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
TICKS = 2048


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
    told: Told
    true: I8

    @property
    def step_s(self) -> float:
        """From pose to pose."""
        return float(np.median(np.diff(self.t_ns))) * 1e-9

    @property
    def warm(self) -> Bool:
        """Rows that are scored."""
        return np.asarray((self.t_ns - self.t_ns[0]) * 1e-9 > WARM_S)

    def score(self, posterior: F64) -> tuple[float, float]:
        """Accuracy and calibration error of a posterior (4, n)."""
        chosen, true = posterior[:, self.warm], self.true[self.warm]
        return float((chosen.argmax(axis=0) == true).mean()), calibration_error(chosen, true)


def aligned(simulated: SimulatedLog, noise: str) -> Aligned:
    """What the yardsticks are told."""
    log, true = simulated.log, cast(dict[str, float], simulated.facts["true_robot"])
    assert log.wheels is not None
    rows = np.searchsorted(log.wheels.t_ns, log.pose.t_ns, side="right") - 1
    speeds = np.stack([log.wheels.left_radps, log.wheels.right_radps])[:, np.maximum(rows, 0)]
    modes = true_modes(simulated)
    told = Told(
        robot=np.array([true["half_track_m"], true["icr_offset_m"], true["lateral_slip_s"]]),
        noise_sd=NOISE_LEVELS[noise],
        tick_m=2 * np.pi / TICKS * true["wheel_radius_m"],
        rates_per_s=rates_of(modes.astype(np.int64), float(np.median(np.diff(log.pose.t_ns))) * 1e-9),
    )
    pose = np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad])
    return Aligned(log.pose.t_ns, pose, speeds * true["wheel_radius_m"], told, modes)


def bank_told(log: Aligned) -> F64:
    """The posterior (4, n) of the analysis's bank whose robot is known."""
    half_track, icr, lateral = log.told.robot
    prior = WheelPrior(np.array([0.0, np.log(half_track), icr, lateral, 0.0, 0.0]), np.full(6, 1e-4))
    n, step_s = len(log.t_ns), log.step_s
    bank = Bank(WheelModel(prior, np.zeros((3, 6))), step_s, BankSettings(), 4)
    variances = np.tile(np.array(log.told.noise_sd)[:, None] ** 2, (1, n))
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


@dataclass(frozen=True)
class Cell:
    """A driver, a noise of the pose, and a colour of the encoders' noise."""

    family: str
    noise: str
    colour: str | None = None

    def made(self, chassis: str, seed: int, *, slippery: bool = True) -> SimulatedLog:
        """A log of the cell."""
        simulated = made(self.family, chassis, self.noise, seed, slippery=slippery)
        if self.colour is None:
            return simulated
        return replace(simulated, log=coloured(simulated.log, self.colour, seed))


def false_slips_an_hour(cell: Cell, chassis: str, seed: int) -> float:
    """Slips told on dry ground, an hour, behind the warm-up."""
    simulated = cell.made(chassis, seed, slippery=False)
    told = wr.replay(simulated.log, hindsight=False).samples.collect()
    slips = told["mode"].is_in(["slipping", "skidding_slipping"]).to_numpy()
    slips &= ~np.isin(true_modes(simulated), (2, 3))
    begins = int((np.diff(slips.astype(int)) > 0).sum())
    return begins / float(told["t_s"][-1] / 3600)


def yardsticks(log: Aligned, times: int = 1) -> list[float]:
    """Accuracies of filter and smoother with ``times`` their hypotheses and trajectories."""
    sizes = {"room": times * ROOM, "drawn": times * N_DRAWN}
    both = modes_told(log.wheels_mps, log.pose, log.step_s, log.told, **sizes)
    return [log.score(posterior)[0] for posterior in both]


def scores(cell: Cell, chassis: str, seed: int) -> list[float]:
    """Of one log: filter, smoother and bank that are told the robot, causal, hindsight; calibration errors of
    these; false slips an hour.
    """
    simulated = cell.made(chassis, seed)
    log = aligned(simulated, cell.noise)
    row = wr.replay(simulated.log).summary.to_dicts()[0]
    accuracies = [*yardsticks(log), log.score(bank_told(log))[0], row["accuracy"], row["hindsight_accuracy"]]
    errors = [row["ece"], row["hindsight_ece"]]
    return [*accuracies, *errors, false_slips_an_hour(cell, chassis, seed)]


def moved(cell: Cell, chassis: str, seed: int) -> list[float]:
    """Of one log: accuracies of the yardsticks, and how far twice their size moves them."""
    log = aligned(cell.made(chassis, seed), cell.noise)
    once, twice = yardsticks(log), yardsticks(log, 2)
    return [*once, twice[0] - once[0], twice[1] - once[1]]


HEADS = "filter told | smoother told | bank told | causal | hindsight | ece | hindsight ece | false slips/h"
MOVED = "filter told | smoother told | filter moved by | smoother moved by"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=("develop", "report", "late"), default="develop")
    parser.add_argument("--logs", type=int, default=2, help="of each chassis")
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--colour", choices=tuple(COLOURS), help="of the encoders' noise")
    parser.add_argument("--converged", action="store_true", help="twice the yardsticks' size")
    options = parser.parse_args()
    chosen, measure = part(options.part), moved if options.converged else scores
    first = chosen.first_seed if options.first_seed is None else options.first_seed
    heads = MOVED if options.converged else HEADS
    print(f"| family | noise | logs | {heads} |")
    print("| --- " * (4 + heads.count("|")) + "|")
    for family in chosen.families:
        for noise in NOISE_LEVELS:
            rows = [
                measure(Cell(family, noise, options.colour), chassis, first + seed)
                for chassis in ("differential", "skid-steer")
                for seed in range(options.logs)
            ]
            cells = " | ".join(f"{value:.3f}" for value in np.mean(rows, axis=0))
            print(f"| {family} | {noise} | {len(rows)} | {cells} |", flush=True)


if __name__ == "__main__":
    main()

"""Modes from torques and wheel speeds: by torques alone, wheel speeds alone, and both.

    python bench/joint_modes.py [--part develop|report] [--logs 2] [--first-seed S]

The logs are those of ``encoder_modes.py`` with torques in them: mass up to 20 % and the wheels' inertia up to
30 % off, resistance to rolling of 0 to 3 % of the weight, of which the identifiers are not told. The table's
rows are means over the logs of a family and noise: accuracy causal and in hindsight, calibration error, and
false slips an hour on dry ground; then errors of what both learn of α and of the wheels' scale.
"""

import argparse

import numpy as np
from encoder_modes import true_modes
from encoders.logs import made
from encoders.split import part

import wmr_replay as wr
from wmr_synth import SimulatedLog
from wmr_synth.sensors import NOISE_LEVELS

EVIDENCE = ("torques", "wheel-speeds", "both")
SLIPS = ("slipping", "skidding_slipping")


def false_slips_an_hour(simulated: SimulatedLog, evidence: str) -> float:
    """Slips told on dry ground, an hour."""
    told = wr.replay(simulated.log, hindsight=False, evidence=evidence).samples.collect()
    slips = told["mode"].is_in(SLIPS).to_numpy() & ~np.isin(true_modes(simulated), (2, 3))
    return float((np.diff(slips.astype(int)) > 0).sum() / (told["t_s"][-1] / 3600))


def scores(family: str, chassis: str, noise: str, seed: int) -> list[float]:
    """Of one log, by each evidence: accuracies, calibration errors, false slips an hour; then errors of α in
    per cent and of the wheels' scale in per mille.
    """
    simulated, found = made(family, chassis, noise, seed, torques="together"), list[float]()
    dry = made(family, chassis, noise, seed, torques="together", slippery=False)
    for evidence in EVIDENCE:
        result = wr.replay(simulated.log, evidence=evidence)
        row = result.summary.row(0, named=True)
        found += [row["accuracy"], row["hindsight_accuracy"], row["ece"], row["hindsight_ece"]]
        found.append(false_slips_an_hour(dry, evidence) if evidence != "torques" else np.nan)
    alpha = result.samples.collect()["alpha"][-1]
    robot, drivetrain = simulated.facts["true_robot"], simulated.facts["drivetrain"]
    scale = robot["wheel_radius_m"] / robot["stated_radius_m"]
    return [*found, 100 * abs(alpha / drivetrain["alpha"] - 1), 1e3 * abs(row["wheel_scale"] / scale - 1)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=("develop", "report"), default="develop")
    parser.add_argument("--logs", type=int, default=2, help="of each chassis")
    parser.add_argument("--first-seed", type=int)
    options = parser.parse_args()
    chosen = part(options.part)
    first = chosen.first_seed if options.first_seed is None else options.first_seed
    heads = " | ".join(f"{e}: causal | hindsight | ece | ece, hindsight | false slips/h" for e in EVIDENCE)
    print(f"| family | noise | logs | {heads} | α, % | scale, ‰ |")
    print("| --- " * 20 + "|")
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

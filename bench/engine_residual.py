"""What a calibrated base model leaves on its own calibration log of the engine: size, spectrum, dependence.

    python bench/engine_residual.py --robot courier --family stop-go

The residual is the disturbance that the filter sees: dv_long/dt and l·dyaw_rate/dt in m/s², and the lateral
velocity in m/s. Printed are its root mean square, the share of its power below 0.5 Hz, and the shares of its
variance that single quantities explain; seen with the identifier's contact modes, and with those of ``gap``.
"""

import argparse
from dataclasses import replace

import numpy as np
from engine.case import FAMILIES, Case
from engine.logs import logged

from wmr_replay.gap import GapOptions, calibrate
from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified, identified_modes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.dynamics import D_LONG, D_YAW, V_LAT
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64

SLOW_HZ = 0.5
CHANNELS = {"longitudinal": D_LONG, "lateral": V_LAT, "yaw": D_YAW}


def quantities(problem: Problem) -> dict[str, F64]:
    """What a residual may depend on (n,)."""
    c = columns_of(problem.binned)
    v, w, effort = c["v"], c["yaw_rate"], c["effort_sum"]
    return {
        "v": v,
        "sgn v": np.tanh(v / 0.02),
        "v|v|": v * np.abs(v),
        "w": w,
        "sgn w": np.tanh(w / 0.02),
        "w²": w * w,
        "vw": v * w,
        "Σu": effort,
        "Δu": c["effort_diff"],
        "1": np.ones_like(v),
    }


def explained(residual: F64, column: F64) -> float:
    """Share of the residual's mean square along a column."""
    return float((residual @ column) ** 2 / max((residual @ residual) * (column @ column), 1e-30))


def slow_share(residual: F64, step_s: float) -> float:
    """Share of the power below ``SLOW_HZ``."""
    power = np.abs(np.fft.rfft(residual)) ** 2
    return float(power[np.fft.rfftfreq(len(residual), step_s) < SLOW_HZ].sum() / power.sum())


def described(problem: Problem, extension: Extension) -> None:
    """Print the three channels."""
    noise = fit_diffusion(problem, extension)
    states = problem.filtered(extension, noise, keep=True).states
    step_s, against = float(np.median(problem.binned.step_s[1:])), quantities(problem)
    print(f"  skidding {np.mean(problem.binned.skids):.0%}, slipping {np.mean(problem.binned.slips):.0%}")
    for name, state in CHANNELS.items():
        residual = states[:, state]
        shares = {key: explained(residual, column) for key, column in against.items()}
        best = sorted(shares, key=lambda key: -shares[key])[:3]
        said = ", ".join(f"{key} {shares[key]:.0%}" for key in best)
        rms = float(np.sqrt(np.mean(residual**2)))
        print(f"  {name:13s} rms {rms:.4f}  below {SLOW_HZ} Hz {slow_share(residual, step_s):.0%}  {said}")


def main() -> None:
    """Print a robot's residuals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", choices=("courier", "cart"), default="courier")
    parser.add_argument("--family", choices=tuple(FAMILIES), default="stop-go")
    parser.add_argument("--noise", default="mocap")
    parser.add_argument("--seed", type=int, default=7)
    asked = parser.parse_args()
    log = logged(Case(asked.robot, asked.family, asked.noise, "", asked.seed)).log
    robot, gates = calibrate(log, log.robot).robot, GapOptions().gates
    log, extension = replace(log, robot=robot), Extension(base_of(robot))
    for modes in (identified_modes, likely_modes):
        print(f"{asked.robot}, {asked.family}, {asked.noise}: {modes.__name__}")
        track = modes(log, extension, gates)
        described(Problem.of(bin_identified(log, track, gates)).all_fitted(), extension)


if __name__ == "__main__":
    main()

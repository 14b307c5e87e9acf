"""A drive split into what is fitted and what is held out, and the likelihood of an extended model on it."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.binned_log import BIN_S, Drive, drive_of
from wmr_replay.gap.estimation.filter import Data, Diffusion, Passed, filter_pass
from wmr_replay.gap.estimation.sensitivity import NOTHING, Wanted
from wmr_replay.gap.model.dynamics import N_STATE, V, W
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.model_file import NoiseModel
from wmr_schemas.signals import ModeTrack

PERIOD_S, HELD_OUT_S = 12.0, 4.0
LEAST, MOST = np.log([1e-4, 0.05, 1e-4, 0.05, 1e-5]), np.log([5.0, 10.0, 5.0, 10.0, 0.5])
START = np.log([0.05, 0.4, 0.05, 0.4, 0.01])
CALM = np.log([0.02, 0.4, 0.02, 0.4, 0.002])
PRIOR_SD = 3.0
LARGE = 5.0
DIFFERENCE, LONGEST_MOVE, ENOUGH = 1e-3, 2.0, 0.2
LAT_TAU_S = 0.2


@dataclass(frozen=True, eq=False)
class Problem:
    """``train`` (n,) marks the rows that are fitted: all but the last 4 s of every 12 s."""

    drive: Drive
    train: Bool
    first: F64
    shift_s: float = 0.0

    @classmethod
    def of(cls, drive: Drive, shift_s: float = 0.0) -> "Problem":
        """Split at fixed times, ``shift_s`` later."""
        phase = (drive.t_s - shift_s) % PERIOD_S
        return cls(drive, phase < PERIOD_S - HELD_OUT_S, first_state(drive), shift_s)

    def finer(self) -> "Problem":
        """The same split over bins of half the length."""
        return Problem.of(self.drive.finer(), self.shift_s)

    def labelled(self, track: ModeTrack) -> "Problem":
        """The same split with other contact modes, known as well as these."""
        drive = self.drive
        margin_s = drive.margin * BIN_S
        return Problem.of(drive_of(drive.log, track, margin_s=margin_s), self.shift_s)

    @property
    def variances(self) -> F64:
        """Measurement variance of each bin (n, 3), from the data alone and before anything is fitted."""
        return self.drive.variances

    def passed(
        self, extension: Extension, noise: Diffusion, wanted: Wanted = NOTHING, *, keep: bool = False
    ) -> Passed:
        """The filter over the whole drive, held-out rows included: those are left out of sums only."""
        first = self.first.copy()
        first[W] *= extension.base.half_track_m
        data = Data(extension.rows(self.drive), extension.poses(self.drive), self.variances, first)
        return filter_pass(data, extension.theta(), extension.base, noise, wanted, keep)

    def deviance(self, extension: Extension, noise: Diffusion) -> float:
        """−2 log likelihood of the fitted rows."""
        return float(self.passed(extension, noise).deviance[self.train].sum())


def first_state(drive: Drive) -> F64:
    """Pose of the first bin, and speeds by least squares over the first .4 s (w still as yaw rate)."""
    head = drive.t_s <= drive.t_s[0] + 0.4
    slopes = np.polyfit(drive.t_s[head] - drive.t_s[0], drive.pose[head], 1)
    z = np.zeros(N_STATE)
    z[:3] = slopes[1]
    z[V] = slopes[0, 0] * np.cos(z[2]) + slopes[0, 1] * np.sin(z[2])
    z[W] = slopes[0, 2]
    return z


def diffusion_of(logs: F64) -> Diffusion:
    """From logarithms of the two standard deviations and times, and the lateral standard deviation."""
    a, b, c, d, e = np.exp(np.clip(logs, LEAST, MOST))
    return Diffusion(float(a), float(b), float(c), float(d), float(e), LAT_TAU_S)


def logs_of(noise: Diffusion) -> F64:
    """The inverse of :func:`diffusion_of`."""
    return np.asarray(np.log(noise[:5]))


def noise_model(drive: Drive, noise: Diffusion) -> NoiseModel:
    """Pose noise and disturbances as a model file holds them; the one ahead acts sideways too."""
    long, yaw = noise.densities_mps2_rthz
    return NoiseModel(float(drive.noise_sd[0]), float(drive.noise_sd[2]), long, long, yaw)


def fit_noise(
    problem: Problem, extension: Extension, start: Diffusion | None = None, iterations: int = 5
) -> tuple[Diffusion, float]:
    """The diffusion of the greatest likelihood, and its deviance; a wide prior keeps what is not seen.

    Fisher's scoring on the logarithms: with slopes of the innovations e and of their log variances by
    differences, the gradient of the deviance is exact and ½ Σ (∂log s)² + Σ (∂e)² its expected curvature. It
    begins where the likelihood is best of ``start``, the same with calmer disturbances on either channel, and
    a calm one.
    """
    train = problem.train

    def passed(logs: F64) -> tuple[Passed, float]:
        new = problem.passed(extension, diffusion_of(logs))
        return new, float(new.deviance[train].sum() + np.sum(((logs - START) / PRIOR_SD) ** 2))

    logs, (at, cost) = min(((x, passed(x)) for x in beginnings(start)), key=lambda pair: pair[1][1])
    damping = 1e-2
    for _ in range(iterations):
        gradient, curvature = slopes_of(problem, extension, logs, at)
        gradient += 2 * (logs - START) / PRIOR_SD**2
        curvature += np.eye(len(logs)) / PRIOR_SD**2
        move = -np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), gradient / 2)
        tried = np.clip(logs + np.clip(move, -LONGEST_MOVE, LONGEST_MOVE), LEAST, MOST)
        new, new_cost = passed(tried)
        if new_cost >= cost:
            damping *= 30
            if damping > 10:
                break
            continue
        gained, logs, at, cost, damping = cost - new_cost, tried, new, new_cost, damping / 3
        if gained < ENOUGH:
            break
    return diffusion_of(logs), cost


def slopes_of(problem: Problem, extension: Extension, logs: F64, at: Passed) -> tuple[F64, F64]:
    """Gradient (5,) and half the expected curvature (5, 5) of the deviance in the logarithms."""
    train, k = problem.train, len(logs)
    gradient, spread = np.zeros(k), np.zeros((int(train.sum()) * 3, k))
    errors = np.zeros_like(spread)
    for j in range(k):
        moved = logs.copy()
        moved[j] += DIFFERENCE if logs[j] + DIFFERENCE <= MOST[j] else -DIFFERENCE
        size = moved[j] - logs[j]
        new = problem.passed(extension, diffusion_of(moved))
        gradient[j] = (new.deviance - at.deviance)[train].sum() / size
        spread[:, j] = ((new.log_variances - at.log_variances)[train] / size).ravel()
        errors[:, j] = ((new.innovations - at.innovations)[train] / size).ravel()
    return gradient, np.asarray(0.5 * spread.T @ spread + errors.T @ errors)


def beginnings(start: Diffusion | None) -> list[F64]:
    """Where a search for the diffusion may begin."""
    if start is None:
        return [START]
    logs = logs_of(start)
    calm = np.minimum(logs, CALM)
    return [logs, np.concatenate([calm[:2], logs[2:]]), np.concatenate([logs[:2], calm[2:4], logs[4:]]), calm]


def calmed(noise: Diffusion, large: float = LARGE) -> Diffusion | None:
    """The diffusion with disturbances that are large or slow made calm, None where there are none: with a
    density at low frequency of ``large`` times that of calm ones.
    """
    long_sd, long_tau, yaw_sd, yaw_tau, _ = np.exp(CALM)
    long = noise.long_sd_mps2**2 * noise.long_tau_s > large * long_sd**2 * long_tau
    yaw = noise.yaw_sd_mps2**2 * noise.yaw_tau_s > large * yaw_sd**2 * yaw_tau
    if long:
        noise = noise._replace(long_sd_mps2=float(long_sd), long_tau_s=float(long_tau))
    if yaw:
        noise = noise._replace(yaw_sd_mps2=float(yaw_sd), yaw_tau_s=float(yaw_tau))
    return noise if long or yaw else None

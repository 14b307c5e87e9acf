"""The disturbances' diffusion at the greatest likelihood, with a wide prior.

Fisher's scoring on the logarithms of the five parameters, or of seven where those of a caster's swing are
fitted too (``DiffusionSettings.with_free_swings``): with slopes of the innovations e and of their log
variances by differences, the gradient of the deviance is exact, and ½ Σ (∂log s)² + Σ (∂e)² is its expected
curvature. Source: Kristensen, Madsen, Jørgensen, Automatica 40 (2004) 225.
"""

import numpy as np

from wmr_replay.gap.estimation.filter import FilterOutput
from wmr_replay.gap.estimation.problem import Problem, identity_of
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings.filter import DiffusionSettings
from wmr_schemas.arrays import F64
from wmr_schemas.model_file import NoiseModel

N_FREE = 5


def diffusion_of(logs: F64, settings: DiffusionSettings) -> Diffusion:
    """From logarithms (5,) of sd and time ahead, sd and time in yaw, and the lateral sd; of seven numbers the
    last two are those of a swing, which are the settings' else.
    """
    a, b, c, d, e, *free = np.exp(np.clip(logs, *settings.bounds_log)).tolist()
    long, yaw = free or settings.swings
    return Diffusion(a, b, c, d, e, settings.lateral_tau_s, long, yaw)


def logs_of(noise: Diffusion, settings: DiffusionSettings) -> F64:
    """The inverse of :func:`diffusion_of`: as many logarithms as the settings have numbers."""
    free = (*noise[:N_FREE], *noise.swings_mps2_rthz)
    return np.asarray(np.log(free[: len(settings.start)]))


def noise_model(binned: BinnedLog, noise: Diffusion) -> NoiseModel:
    """Pose noise and disturbances as a model file holds them; the one ahead acts sideways too."""
    long, yaw = noise.densities_mps2_rthz
    ahead, turning = (q or None for q in noise.swings_mps2_rthz)
    return NoiseModel(
        float(binned.noise_sd[0]),
        float(binned.noise_sd[2]),
        long,
        long,
        yaw,
        swing_longitudinal_mps2_rthz=ahead,
        swing_yaw_mps2_rthz=turning,
    )


def fit_diffusion(
    problem: Problem, extension: Extension, start: Diffusion | None = None, iterations: int | None = None
) -> Diffusion:
    """The diffusion of the greatest penalised likelihood on the fitted rows.

    Starts where the likelihood is best of ``start``, the same with calmer disturbances on either channel, and
    a calm one; without ``start``, at the prior's median. Takes up to ``iterations`` (default: the settings').
    On a long log, a part from its middle says where the whole log begins.
    """
    iterations = iterations or problem.settings.budget.diffusion
    of = "diffusion", identity_of(extension), start, iterations
    return problem.fitted_once(of, lambda: likeliest(problem, extension, start, iterations))


def likeliest(problem: Problem, extension: Extension, start: Diffusion | None, iterations: int) -> Diffusion:
    """:func:`fit_diffusion` where its answer is not known."""
    own = problem.settings.diffusion
    starts = starting_points(start, own)
    if len(problem.binned) >= 2 * own.part_rows:
        rough = search(problem.middle(own.part_rows), extension, starts, iterations)
        starts, iterations = [rough, starts[0]], own.whole_iterations
    return diffusion_of(search(problem, extension, starts, iterations), own)


def search(problem: Problem, extension: Extension, starts: list[F64], iterations: int) -> F64:
    """Logarithms (5,) of the diffusion, by Fisher's scoring from the best of ``starts``."""
    fitted, own = problem.fitted, problem.settings.diffusion

    def evaluated(each: list[F64]) -> list[tuple[FilterOutput, float]]:
        outputs = problem.filtered_each([(extension, diffusion_of(logs, own)) for logs in each])
        penalties = [np.sum(((logs - own.start_log) / own.prior_sd) ** 2) for logs in each]
        costs = [float(o.deviance[fitted].sum() + more) for o, more in zip(outputs, penalties, strict=True)]
        return list(zip(outputs, costs, strict=True))

    tried_first = zip(starts, evaluated(starts), strict=True)
    logs, (at, cost) = min(tried_first, key=lambda pair: pair[1][1])
    damping, slopes = own.first_damping, None
    for _ in range(iterations):
        slopes = slopes or with_prior(slopes_of(problem, extension, logs, at), logs, own)
        gradient, curvature = slopes
        step = -np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), gradient / 2)
        tried = np.clip(logs + np.clip(step, -own.longest_step, own.longest_step), *own.bounds_log)
        new, new_cost = evaluated([tried])[0]
        if new_cost >= cost:
            damping *= own.damping_up
            if damping > own.most_damping:
                break
            continue
        gained, logs, at, cost, damping = cost - new_cost, tried, new, new_cost, damping / own.damping_down
        slopes = None
        if gained < own.enough:
            break
    return logs


def slopes_of(problem: Problem, extension: Extension, logs: F64, at: FilterOutput) -> tuple[F64, F64]:
    """Gradient (5,) and half the expected curvature (5, 5) of the deviance in the logarithms."""
    fitted, k, own = problem.fitted, len(logs), problem.settings.diffusion
    gradient, spread = np.zeros(k), np.zeros((int(problem.train.sum()) * 3, k))
    errors = np.zeros_like(spread)
    _, most = own.bounds_log
    moved = np.tile(logs, (k, 1))
    for j in range(k):
        moved[j, j] += own.difference if logs[j] + own.difference <= most[j] else -own.difference
    outputs = problem.filtered_each([(extension, diffusion_of(one, own)) for one in moved])
    for j, new in enumerate(outputs):
        size = moved[j, j] - logs[j]
        gradient[j] = (new.deviance - at.deviance)[fitted].sum() / size
        spread[:, j] = ((new.log_variances - at.log_variances)[fitted] / size).ravel()
        errors[:, j] = ((new.innovations - at.innovations)[fitted] / size).ravel()
    return gradient, np.asarray(0.5 * spread.T @ spread + errors.T @ errors)


def with_prior(slopes: tuple[F64, F64], logs: F64, own: DiffusionSettings) -> tuple[F64, F64]:
    """Gradient and half the curvature of the deviance, and of the prior's −2 log besides."""
    gradient, curvature = slopes
    gradient = gradient + 2 * (logs - own.start_log) / own.prior_sd**2
    return gradient, curvature + np.eye(len(logs)) / own.prior_sd**2


def starting_points(start: Diffusion | None, settings: DiffusionSettings) -> list[F64]:
    """Logarithms (5,) at which a search for the diffusion may start."""
    if start is None:
        return [settings.start_log]
    logs = logs_of(start, settings)
    calm = np.minimum(logs, settings.calm_log)
    calm_ahead = np.concatenate([calm[:2], logs[2:]])
    calm_in_yaw = np.concatenate([logs[:2], calm[2:4], logs[4:]])
    return [logs, calm_ahead, calm_in_yaw, calm]


def calmed(noise: Diffusion, settings: DiffusionSettings, large: float | None = None) -> Diffusion | None:
    """The diffusion with large or slow disturbances replaced by calm ones; None where none is large.

    Large is a density at low frequency, s² τ, of ``large`` times the calm one's (default: the settings').
    """
    large = large or settings.large
    long_sd, long_tau, yaw_sd, yaw_tau = np.exp(settings.calm_log[:4])
    long = noise.long_sd_mps2**2 * noise.long_tau_s > large * long_sd**2 * long_tau
    yaw = noise.yaw_sd_mps2**2 * noise.yaw_tau_s > large * yaw_sd**2 * yaw_tau
    if long:
        noise = noise._replace(long_sd_mps2=float(long_sd), long_tau_s=float(long_tau))
    if yaw:
        noise = noise._replace(yaw_sd_mps2=float(yaw_sd), yaw_tau_s=float(yaw_tau))
    return noise if long or yaw else None


def no_more_than_calm(noise: Diffusion, settings: DiffusionSettings) -> Diffusion:
    """The diffusion with each disturbance of the speeds no larger and no slower than a calm one."""
    calm = diffusion_of(settings.calm_log, settings)
    return noise._replace(
        long_sd_mps2=min(noise.long_sd_mps2, calm.long_sd_mps2),
        long_tau_s=min(noise.long_tau_s, calm.long_tau_s),
        yaw_sd_mps2=min(noise.yaw_sd_mps2, calm.yaw_sd_mps2),
        yaw_tau_s=min(noise.yaw_tau_s, calm.yaw_tau_s),
    )


def calm_or_same(noise: Diffusion, settings: DiffusionSettings) -> Diffusion:
    """:func:`calmed`, or ``noise`` itself where it is calm already."""
    return calmed(noise, settings) or noise


def with_calm_lateral(noise: Diffusion, settings: DiffusionSettings) -> Diffusion:
    """The diffusion with a calm lateral velocity."""
    return noise._replace(lat_sd_mps=float(np.exp(settings.calm_log[N_FREE - 1])))

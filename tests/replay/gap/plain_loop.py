"""A plain loop that drives a robot, and fits with constructed innovations: what tests of the gates share."""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack
from wmr_schemas.terms import parse_term

SETTINGS = GateSettings()
ROBOT = RobotParameters(alpha=0.28, alpha_yaw=0.34, half_track_m=0.25)
BASE = Base(0.28, 0.34, 0.25, 8.0, 0.0, 0.5, 0.5, 0.0, 5.0)
NOISE = Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)
SD = (0.004, 0.004, 0.003)
FURROWS_FROM_MPS = 0.3
GUSTS_RADPS = 1.3
FAST_MPS, FAST_WITHIN_MPS = 0.7, 0.15
LAWN_M, LAWN_WITHIN_M = -4.0, 0.3
DISTURBANCE_MPS2, KEPT = 0.015, float(np.exp(-0.01 / 0.4))


def made_log(
    seed: int,
    *,
    drag_per_s: float = 0.0,
    cubic_s_per_m2: float = 0.0,
    even_per_s: float = 0.0,
    furrows_mps2: float = 0.0,
    fast_mps2: float = 0.0,
    gusts_mps2: float = 0.0,
    lawn_per_m: float = 0.0,
    forwards: bool = False,
    seconds: float = 40.0,
    lively: bool = True,
    load: tuple[float, float] = (0.0, 0.0),
) -> Log:
    """A drive of a plain loop at 100 Hz with a drag, viscous or cubic, what acts backwards whichever way the
    robot rolls or from ``FAST_MPS`` ahead on, furrows along x that turn a rolling robot, or gusts along y
    that turn it, most where it faces them, or a drag that grows with v|v| beyond ``LAWN_M`` along x: speeds
    held for 1.5 s under a disturbance, or a constant torque straight ahead. ``load`` is a mass ratio, and
    when it comes, s.
    """
    rng = np.random.default_rng(seed)
    n, dt, l = int(100 * seconds), 0.01, BASE.half_track_m
    wanted = np.repeat(rng.uniform(-1.5, 1.5, (n // 150 + 1, 2)), 150, axis=0)[:n] * [1.0, 0.15]
    wanted[:, 0] = 0.3 + np.abs(wanted[:, 0]) if forwards else wanted[:, 0]
    z, d, path, sent = np.zeros(5), np.zeros(2), np.zeros((n, 3)), np.zeros((n, 2))
    for k in range(n):
        path[k] = z[:3]
        total, difference = 2 * (wanted[k] - z[3:]) / [BASE.alpha, BASE.alpha_yaw] if lively else (0.5, 0.0)
        sent[k] = (total - difference) / 2, (total + difference) / 2
        ahead = BASE.alpha * total / (1 + load[0] * (k * dt >= load[1]))
        drag = drag_per_s * z[3] + cubic_s_per_m2 * z[3] ** 3 + even_per_s * abs(z[3])
        drag += fast_mps2 / (1 + np.exp(-2 * (z[3] - FAST_MPS) / FAST_WITHIN_MPS))
        on_lawn = (1 + np.tanh((z[0] - LAWN_M) / LAWN_WITHIN_M)) / 2
        drag += lawn_per_m * z[3] * abs(z[3]) * on_lawn
        guided = furrows_mps2 * np.sin(2 * z[2]) * np.tanh(abs(z[3]) / FURROWS_FROM_MPS)
        gust = gusts_mps2 * np.sin(GUSTS_RADPS * k * dt) * np.sin(z[2]) ** 2
        acc = np.array([ahead - drag, BASE.alpha_yaw * difference - guided + gust]) + d
        d = KEPT * d + DISTURBANCE_MPS2 * np.sqrt(1 - KEPT**2) * rng.normal(size=2) * lively
        v, yaw = z[3] + acc[0] * dt / 2, z[2] + z[4] / l * dt / 2
        z += dt * np.array([v * np.cos(yaw), v * np.sin(yaw), (z[4] + acc[1] * dt / 2) / l, *acc])
    t_ns = np.arange(n, dtype=np.int64) * 10_000_000
    pose = path + rng.normal(size=(n, 3)) * SD
    torque = TorqueTrack(t_ns, *sent.T.copy(), *np.full((2, n), np.nan))
    return Log(PoseTrack(t_ns, *pose.T.copy()), torque, None, ROBOT)


def problem_of(log: Log, *, margin_s: float | None = None) -> Problem:
    return Problem.of(bin_log(log, SETTINGS, margin_s=margin_s))


def with_drag() -> tuple[Problem, Fit, Fit]:
    """40 s of the base model with a drag of 0.1 1/s; the model without it and the model with it."""
    problem = problem_of(made_log(1, drag_per_s=0.1))
    without = fit_model(problem, Extension(BASE))
    with_it = fit_model(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.0}}), without.noise)
    return problem, without, with_it


def made_fit(problem: Problem, extension: Extension, e, psi=None) -> Fit:
    """A fit with constructed innovations (n, 3) and sensitivities (n, 3, q)."""
    fit = Fit(problem, extension, NOISE, float((e[problem.train] ** 2).sum()), e, (e**2).sum(axis=1))
    if psi is not None:
        vars(fit)["psi"] = psi
    return fit


def term(text: str):
    """The term of a text without its prefix."""
    return parse_term(f"unnamed:{text}")


def formula_of(problem, *groups: Group) -> Formula:
    """The groups, fitted."""
    base = fit_model(problem, Extension(BASE))
    extension = base.extension
    for name in (name for group in groups for name in group.names):
        extension = extension.with_effect(name, {"coefficient": 0.0})
    return Formula(base, fit_model(problem, extension, base.noise), groups)


def candidate(
    name: str, gain: float, *, score: float = 1.0, p: float = 1e-6, fit: Fit | None = None, size: float = 0.1
) -> FittedCandidate:
    """A fitted candidate that lowers the deviance by ``gain``."""
    return FittedCandidate(ScoredCandidate(name, {"size": size}, gain, 1), fit, gain, score, p)  # type: ignore[arg-type]


def seen_precisely(poses, torques, rng, robot):
    """The log at 100 Hz of poses (3, n), seen to 1 mm and 1 mrad, and torques (2, n), left and right."""
    n = poses.shape[1]
    none, t_ns = np.full(n, np.nan), np.arange(n, dtype=np.int64) * 10_000_000
    seen = poses + 1e-3 * rng.normal(size=poses.shape)
    return Log(PoseTrack(t_ns, *seen), TorqueTrack(t_ns, *torques, none, none), None, robot)

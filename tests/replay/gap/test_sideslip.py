"""Elastic sideslip of tyres that grip; the oracle is the kinematics that makes the path."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.estimation.sideslip import creeping, with_sideslip
from wmr_replay.gap.evidence.significance import wald_p
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import N_ROW, N_STATE, V_LAT, Base, Row, V, W, step
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.eliminate import is_creep, shown_part
from wmr_replay.gap.search.modes_and_effects import find_effects
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

BASE = Base(0.3, 0.3, 0.25, 5.0, 0.0, 0.5, 0.5, 0.0, 5.0)
SPEED_MPS, STEP_S, N = 1.0, 0.01, 4000


def integral(values):
    """By the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(values[1:] + values[:-1])]) * STEP_S / 2


def cornering(compliance_s: float, arm_m: float = 0.0, sd_m: float = 5e-4, swing_mps: float = 0.0) -> Problem:
    """A weave at 1 m/s, which swings by ``swing_mps``, whose tyres creep by ``compliance_s`` times the
    lateral acceleration; the pose is ``arm_m`` ahead of the axle.
    """
    rng = np.random.default_rng(4)
    t_s = STEP_S * np.arange(N)
    rate = 0.8 * np.sin(2 * np.pi * t_s / 5.0)
    yaw = integral(rate)
    v = SPEED_MPS + swing_mps * np.sin(2 * np.pi * t_s / 7.0)
    aside = -compliance_s * v * rate
    x = integral(v * np.cos(yaw) - aside * np.sin(yaw)) + arm_m * np.cos(yaw)
    y = integral(v * np.sin(yaw) + aside * np.cos(yaw)) + arm_m * np.sin(yaw)
    pose = np.stack([x, y, yaw]) + np.array([[sd_m], [sd_m], [2 * sd_m]]) * rng.normal(size=(3, N))
    turn = np.gradient(rate, STEP_S) * BASE.half_track_m / BASE.alpha_yaw
    push = np.gradient(v, STEP_S) / BASE.alpha
    none, t_ns = np.full(N, np.nan), np.arange(N, dtype=np.int64) * 10_000_000
    torque = TorqueTrack(t_ns, (push - turn) / 2, (push + turn) / 2, none, none)
    robot = RobotParameters(alpha=0.3, alpha_yaw=0.3, half_track_m=0.25)
    return Problem.of(bin_log(Log(PoseTrack(t_ns, *pose), torque, None, robot), GateSettings()))


def test_the_sideslip_of_a_log_becomes_known():
    known = dict(with_sideslip(cornering(0.004), Extension(BASE)).known)
    compliance_s = SPEED_MPS / (BASE.skid_decay_mps2 * known["undeclared_skid"]["stiffness_ratio"])
    assert compliance_s == pytest.approx(0.004, rel=0.3)


def test_no_sideslip_changes_nothing():
    bare = Extension(BASE)
    assert with_sideslip(cornering(0.0), bare) is bare


def test_a_pose_far_behind_the_axle_is_no_sideslip():
    """It moves sideways as tyres that creep by 4 cm at 1 m/s² would."""
    bare = Extension(BASE)
    assert with_sideslip(cornering(0.0, arm_m=-0.04), bare) is bare


@pytest.mark.parametrize(
    ("compliance_s", "arm_m", "arm_shows"),
    [(0.004, 0.0, False), (0.0, -0.004, False), (0.0, -0.04, True), (0.0, 0.004, True)],
)
def test_an_arm_shows_where_no_sideslip_is_as_large(compliance_s, arm_m, arm_shows):
    """At one speed an arm of 4 mm and tyres that creep by 4 mm/s at 1 m/s² move the pose alike."""
    arm = Extension(BASE, {"pose_lever_arm": {"x_m": 0.0, "y_m": 0.0}})
    fit = fit_model(cornering(compliance_s, arm_m, 4e-3), arm)
    x_m = fit.extension.effects["pose_lever_arm"]["x_m"]
    assert x_m == pytest.approx(arm_m - compliance_s * SPEED_MPS, rel=0.3)
    assert (wald_p(fit.problem, fit, "pose_lever_arm") < 1e-3) is arm_shows


def test_what_is_known_of_the_sideslip_counts_once():
    """A creep that is known already leaves an arm as it is."""
    problem = cornering(0.004, -0.04)
    extension = creeping(Extension(BASE), 0.02).with_effect("pose_lever_arm", {"x_m": 0.0, "y_m": 0.0})
    fit = fit_model(problem, extension)
    assert fit.extension.effects["pose_lever_arm"]["x_m"] == pytest.approx(-0.04, rel=0.1)
    assert wald_p(problem, fit, "pose_lever_arm") < 1e-3


def settled_v_lat(mode: ContactMode, compliance_s: float) -> float:
    """v_lat at 1 m/s and .8 rad/s after two seconds of a known creep, with no torques."""
    ratio = SPEED_MPS / (BASE.skid_decay_mps2 * compliance_s)
    theta = replace(Extension(BASE), known=(("undeclared_skid", {"stiffness_ratio": ratio}),)).theta()
    row, z, ahead = np.zeros(N_ROW), np.zeros(N_STATE), np.zeros(N_STATE)
    row[Row.DT], row[Row.MODE], z[V], z[W] = 0.04, mode, SPEED_MPS, 0.8 * BASE.half_track_m
    for _ in range(50):
        step(z, row, theta, BASE._replace(speed_mps=SPEED_MPS), ahead)
        z[:] = ahead
    return float(z[V_LAT])


@pytest.mark.parametrize("mode", [ContactMode.IDEAL, ContactMode.SLIPPING])
def test_tyres_creep_sideways_whether_they_slip_ahead_or_not(mode):
    """−compliance·v·yaw_rate, by hand."""
    assert settled_v_lat(mode, 0.004) == pytest.approx(-0.004 * SPEED_MPS * 0.8, rel=0.02)


@pytest.mark.parametrize(("compliance_s", "known"), [(0.008, True), (0.012, False)])
def test_tyres_that_creep_are_no_undeclared_skid(compliance_s, known):
    """At speeds that change, where no pose off the axle looks the same. What is too much for a sideslip that
    is taken as known is no skid either.
    """
    log = cornering(compliance_s, swing_mps=0.6).binned.log
    given = replace(log, mode=ModeTrack(log.pose.t_ns, np.zeros(N, dtype=np.int8)))
    _, selection = find_effects(given, Extension(BASE), GapOptions(modes="given"), lambda *_: None)
    assert [effect.name for effect in selection.found] == []
    assert ("undeclared_skid" in dict(selection.fit.extension.known)) is known


SLOW, QUICK = 5.0, 16.0
"""How fast tyres stop to skid, m/s²."""


@pytest.mark.parametrize(
    ("decay_mps2", "ratio", "creeps"),
    [
        *((SLOW, 0.4, False), (SLOW, 9.0, False), (SLOW, 10.0, True), (SLOW, 60.0, True)),
        *((QUICK, 7.0, False), (QUICK, 9.0, True)),
    ],
)
def test_from_a_stiffness_on_a_skid_is_a_creep(decay_mps2, ratio, creeps):
    """From 10 times the skid's on, or where it moves by less than 8 mm/s at 1 m/s²: v/(decay·ratio)."""
    base = BASE._replace(skid_decay_mps2=decay_mps2)
    extension = Extension(base, {"undeclared_skid": {"stiffness_ratio": ratio}})
    problem = cornering(0.004)
    assert is_creep("undeclared_skid", problem, extension) is creeps
    assert not is_creep("cornering_stiffness", problem, extension)


def test_an_arm_moves_the_path_by_those_components_that_the_log_shows():
    """4 cm behind the axle, and nothing beside it."""
    problem = cornering(0.0, arm_m=-0.04)
    fit = fit_model(problem, Extension(BASE, {"pose_lever_arm": {"x_m": 0.0, "y_m": 0.0}}))
    beside_m = fit.extension.effects["pose_lever_arm"]["y_m"]
    assert 0 < abs(beside_m) < 0.01
    assert shown_part(problem, fit, "pose_lever_arm").extension.effects["pose_lever_arm"] == {
        "x_m": fit.extension.effects["pose_lever_arm"]["x_m"],
        "y_m": 0.0,
    }


def test_an_effect_of_one_size_is_shown_whole():
    problem = cornering(0.0)
    fit = fit_model(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.0}}))
    assert shown_part(problem, fit, "viscous_drag") is fit

"""Designed drives: what they keep to, what they prefer, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.excite import Bounds, Question, design
from wmr_replay.excite.bounds import Area, Limits
from wmr_replay.excite.confounded import drivable
from wmr_replay.excite.design import NotSeparable
from wmr_replay.excite.information import Columns, gram, separations
from wmr_replay.excite.manoeuvres import FAMILIES, library
from wmr_replay.excite.profile import Profile, Reached, joined
from wmr_replay.excite.settings import ExciteSettings
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters
from wmr_synth import Sensors, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.scenarios import Scenario

EXTENSION = Extension(base_of(SMALL_ROBOT), {}, SMALL_ROBOT.wheel_radius_m)
NOISE = Diffusion(0.02, 0.4, 0.02, 0.4, 0.01, 0.2)
OWN = ExciteSettings()


def asks(*names: str, **changes: object) -> Question:
    return replace(Question(EXTENSION, names, NOISE, (0.001, 0.001, 0.002)), **changes)


def path_of(profile: Profile, step_s: float = 0.001) -> tuple[np.ndarray, ...]:
    """Speeds and path by Euler's rule at a millisecond, and mean slopes: another way than the code's own."""
    t = np.arange(0.0, profile.duration_s, step_s)
    v, w = np.interp(t, profile.t_s, profile.v_mps), np.interp(t, profile.t_s, profile.yaw_rate_radps)
    yaw = np.cumsum(w) * step_s
    return v, w, np.cumsum(v * np.cos(yaw)) * step_s, np.cumsum(v * np.sin(yaw)) * step_s, yaw


def torques_of(profile: Profile, robot: RobotParameters) -> np.ndarray:
    """Torques of both wheels by the slopes of the knots."""
    lengths = np.diff(profile.t_s)
    total = np.diff(profile.v_mps) / lengths / robot.alpha
    difference = robot.half_track_m * np.diff(profile.yaw_rate_radps) / lengths / robot.alpha_yaw
    return np.abs(np.stack([total - difference, total + difference]) / 2)


@st.composite
def drawn_bounds(draw: st.DrawFn) -> Bounds:
    size = st.floats(0.8, 9.0)
    area = Area(draw(size)) if draw(st.booleans()) else Area(box_m=(draw(size), draw(size)))
    speed, turning, torque = draw(st.floats(0.2, 3.0)), draw(st.floats(0.2, 3.0)), draw(st.floats(0.3, 6.0))
    return Bounds(speed, turning, torque, area, draw(st.booleans()))


@given(drawn_bounds(), st.floats(0.05, 0.6), st.floats(0.3, 3.0), st.floats(0.15, 0.5))
@settings(max_examples=12, deadline=None)
def test_every_manoeuvre_keeps_to_the_bounds_and_ends_where_it_began(bounds, alpha, ratio, half_track):
    robot = RobotParameters(alpha=alpha, alpha_yaw=alpha * ratio, half_track_m=half_track)
    for one in library(Limits(bounds, base_of(robot), OWN)):
        v, w, x, y, yaw = path_of(one.profile)
        assert np.max(np.abs(v)) <= bounds.speed_mps + 1e-9
        assert np.max(np.abs(w)) <= bounds.yaw_rate_radps + 1e-9
        assert np.max(torques_of(one.profile, robot)) <= bounds.torque_nm
        assert bounds.reverse or v.min() > -1e-9
        assert bounds.area.holds(x, y)
        assert np.hypot(x[-1], y[-1]) < 0.02
        assert abs(np.remainder(yaw[-1] + np.pi, 2 * np.pi) - np.pi) < 0.02
        ends = one.profile.v_mps[[0, -1]], one.profile.yaw_rate_radps[[0, -1]]
        assert np.allclose(ends, 0.0)


def test_every_family_has_something_to_drive_within_usual_bounds():
    offered = {one.family for one in library(Limits(Bounds(), EXTENSION.base, OWN))}
    assert offered == set(FAMILIES)


def test_signatures_add_up_over_manoeuvres_that_begin_and_end_at_rest():
    offered = library(Limits(Bounds(), EXTENSION.base, OWN))
    pieces = [next(m.profile for m in offered if m.family == f) for f in ("spins", "reversals")]
    question = asks("payload", "wheel_viscous")
    columns = Columns.of(question.names, question, OWN)
    parts = sum(gram(piece, question, columns, OWN) for piece in pieces)
    whole = gram(joined(pieces), question, columns, OWN)
    assert np.allclose(np.diag(whole), np.diag(parts), rtol=0.1)


@pytest.mark.parametrize(
    ("missing", "rival"), [("viscous_drag", "wheel_viscous"), ("input_delay", "actuator_lag")]
)
def test_what_a_rival_leaves_is_what_its_own_fit_leaves(missing, rival):
    """A log of the model with the effect, and the rival fitted to it by the analysis."""
    question = asks(missing, rival)
    columns = Columns.of(question.names, question, OWN)
    drive = design(question, duration_s=30.0).profile
    D = separations(gram(drive, question, columns, OWN), columns)[0, 1]
    truth = EXTENSION.with_effect(missing, columns.columns[columns.truths[missing][0]].parameters)
    log = moved_by(truth, drive)
    gates = GateSettings()
    binned = replace(bin_log(log, gates), noise_sd=np.array(question.pose_sd))
    problem = Problem.of(binned).all_fitted()
    start = columns.columns[columns.truths[rival][0]].parameters
    fitted = gauss_newton(problem, EXTENSION.with_effect(rival, start), NOISE, 8)
    best = gauss_newton(problem, truth, NOISE, 0)
    assert fitted.deviance - best.deviance == pytest.approx(D, rel=0.35)


def moved_by(extension: Extension, drive: Profile):
    """The log of a robot with an effect: torques of the base model, poses of the filter's own model."""
    from wmr_replay.gap.estimation.path_error import Window, residuals
    from wmr_replay.gap.model.dynamics import N_STATE

    log = Reached.of(drive, 0.01).log(EXTENSION.base)
    fine = bin_log(log, GateSettings(), bin_s=0.01)
    rows = extension.rows(fine)
    nothing, minus = np.zeros((len(rows), 3)), -np.ones((len(rows), 3))
    window = Window(rows, nothing, minus, extension.theta(), extension.base)
    out = np.zeros(3 * len(rows))
    residuals(np.zeros(N_STATE), window, np.zeros(N_STATE), np.zeros(N_STATE), out)
    x, y, yaw = out.reshape(-1, 3).T.copy()
    return replace(log, pose=replace(log.pose, x_m=x, y_m=y, yaw_rad=yaw))


def test_fast_torque_changes_are_preferred_where_a_lag_and_a_delay_are_to_be_told_apart():
    found = design(asks("actuator_lag", "input_delay"), duration_s=30.0)
    families = {one.manoeuvre.family for one in found.chosen}
    assert families & {"wiggles", "reversals", "chirps"}
    rates = {one.manoeuvre.words: next(iter(one.contribution.values())) for one in found.chosen}
    gentle = next(m for m in library(found.limits) if "gently, and back" in m.words)
    columns = Columns.of(("actuator_lag", "input_delay"), asks("actuator_lag", "input_delay"), OWN)
    D = separations(gram(gentle.profile, asks("actuator_lag", "input_delay"), columns, OWN), columns)
    assert max(rates.values()) > 5 * D[1, 0]


def test_a_slope_and_a_bias_need_other_headings():
    found = design(asks("slope", "torque_bias_common"), duration_s=40.0)
    straight = next(m for m in library(found.limits) if "hard, and back in reverse" in m.words)
    question = asks("slope", "torque_bias_common")
    columns = Columns.of(question.names, question, OWN)
    D = separations(gram(straight.profile, question, columns, OWN), columns)
    assert D[1, 0] < 1e-3 * D[1, 1]
    assert found.weakest.expected_bic > OWN.wanted_bic
    yaw = Reached.of(found.profile, 0.01).yaw_rad
    assert np.ptp(np.remainder(yaw, 2 * np.pi)) > np.pi / 2


def test_more_time_separates_more_and_no_drive_is_longer_than_asked(in_a_box):
    short = design(asks("viscous_drag", "wheel_viscous"), in_a_box.limits.bounds, 25.0)
    assert short.profile.duration_s <= 25.0
    assert in_a_box.profile.duration_s <= 60.0
    assert in_a_box.weakest.expected_bic > short.weakest.expected_bic
    assert short.weakest.seconds_needed > 25.0 or short.weakest.expected_bic > OWN.wanted_bic
    starts = [one.start_s for one in in_a_box.chosen]
    assert starts == sorted(starts)
    assert starts[0] == 0.0


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (("wheel_radius", "drive_gain"), "same in any motion.*measure the wheels"),
        (("load_step", "payload"), "one stretch of time"),
        (("low_friction_patch", "slip_interval"), "one place.*cross the same place a second time"),
        (("cornering_stiffness", "payload"), "skid"),
        (("wheel_scale", "payload"), "wheel speeds drive"),
        (("unnamed:longitudinal:v", "payload"), "terms"),
        (("payload", "payload"), "twice"),
        (("nonsense", "payload"), "no effect 'nonsense'; known are payload"),
    ],
)
def test_what_no_drive_separates_is_refused_with_what_would(names, reason):
    with pytest.raises(InvalidSetting, match=reason):
        design(asks(*names))


def test_effects_that_are_the_same_beside_a_known_one_are_refused():
    beside = EXTENSION.with_effect("yaw_damping", {"d1_per_s": 0.5})
    with pytest.raises(NotSeparable, match=r"while the model also has yaw_damping.*lifted"):
        design(asks("viscous_drag", "wheel_viscous", extension=beside))
    with pytest.raises(NotSeparable, match=r"calibrated on the log itself.*weigh the robot"):
        design(asks("payload", "drive_gain", nuisance=("payload", "yaw_inertia")))


def test_bounds_that_leave_nothing_to_see_are_refused_with_the_time_needed():
    weak = Bounds(speed_mps=0.05, yaw_rate_radps=0.05, torque_nm=0.01, area=Area(0.5))
    with pytest.raises(InvalidSetting, match=r"Allow more speed|allow more area"):
        design(asks("viscous_drag", "aerodynamic_drag", pose_sd=(0.05, 0.05, 0.02)), weak, 20.0)
    with pytest.raises(InvalidSetting, match="no manoeuvre fits"):
        design(asks("payload", "drive_gain"), Bounds(), 2.0)


def test_without_names_the_whole_library_is_looked_at():
    found = design(asks(library=True), duration_s=45.0)
    assert {one.missing for one in found.separations} == set(drivable())
    assert len({one.manoeuvre.family for one in found.chosen}) >= 3


@pytest.fixture(scope="module")
def in_a_box():
    """A drive of a minute in 7 m by 5 m."""
    return design(asks("viscous_drag", "wheel_viscous"), Bounds(area=Area(box_m=(7.0, 5.0))), 60.0)


def played(drive, hidden):
    """The drive played by a robot in which an effect is hidden."""
    from wmr_synth.driving.played import played_plan
    from wmr_synth.hidden import DEFAULT_DISTURBANCE
    from wmr_synth.hidden.world import drawn_world

    world = drawn_world((hidden,), 5, SMALL_ROBOT, 60.0, DEFAULT_DISTURBANCE)
    scenario = Scenario("x", "", drive.duration_s, played_plan(drive), robot=SMALL_ROBOT)
    return synthesise(scenario, seed=5, sensors=Sensors(100.0, 100.0), world=world)


STRONG = ["viscous_drag", "slope", "actuator_lag", "torque_bias_differential", "torque_imbalance", "payload"]


@pytest.mark.parametrize("hidden", STRONG)
def test_a_played_drive_stays_in_its_area_and_below_its_torque(hidden, in_a_box):
    from wmr_replay.jobs.excite_document import drive_of

    made = played(drive_of(in_a_box, asks("viscous_drag", "wheel_viscous"), SMALL_ROBOT), hidden)
    assert Area(box_m=(7.0, 5.0)).holds(made.truth.x_m, made.truth.y_m)
    torques = np.abs([made.log.torque.left_nm, made.log.torque.right_nm])
    assert np.max(torques) <= in_a_box.limits.torque_nm + 1e-9


@pytest.mark.parametrize("hidden", ["slope", "torque_imbalance"])
def test_a_controller_that_knows_the_pose_keeps_to_the_path(hidden, in_a_box):
    """The planned path is that of the profile on a fine grid, by a sum of its own."""
    from wmr_replay.jobs.excite_document import drive_of

    drive = drive_of(in_a_box, asks("viscous_drag", "wheel_viscous"), SMALL_ROBOT)
    x, y = path_of(in_a_box.profile)[2:4]
    blind = replace(drive.controller, ahead_per_s=0.0, across_per_m2=0.0, heading_per_s=0.0)
    away_m = []
    for controller in (drive.controller, blind):
        truth = played(replace(drive, controller=controller), hidden).truth
        at = np.minimum(np.rint(truth.t_ns / 1e6).astype(int), len(x) - 1)
        away_m.append(np.max(np.hypot(truth.x_m - x[at], truth.y_m - y[at])))
    assert away_m[0] < 0.3
    assert away_m[1] > 0.3

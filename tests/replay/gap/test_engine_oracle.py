"""The oracle of engine logs: what it must say where the answer is known from the physics."""

import numpy as np
import pytest

pytest.importorskip("mujoco")
SECONDS = 20.0


@pytest.fixture(scope="module")
def driven(engine):
    """``driven(robot, effect)``: a case and its log, on the same drive."""
    made = {}

    def one(robot, effect, noise="mocap"):
        if (robot, effect, noise) not in made:
            case = engine("case").Case(robot, "stop-go", noise, effect, 7, SECONDS)
            made[robot, effect, noise] = case, engine("logs").logged(case)
        return made[robot, effect, noise]

    return one


@pytest.mark.parametrize("robot", ["courier", "courier-wheels", "rover"])
def test_nothing_hidden_has_no_trace_and_may_be_refused(engine, driven, robot):
    word = engine("oracle").judged(*driven(robot, ""))
    assert word.own == pytest.approx(0.0, abs=1e-3)
    assert word.may_refuse


def test_a_weight_slows_the_response_by_its_share(engine, driven):
    _, found = driven("courier", "payload")
    trace = engine("oracle").by_torques(found).acceleration
    ratio = found.hidden.sizes["mass_ratio"]
    robot, motion = found.robot, found.motion
    expected = robot.alpha * (motion.left_nm + motion.right_nm) * (1 / (1 + ratio) - 1)
    apart = (trace[0] - expected)[200:].reshape(-1, 50).mean(axis=1)
    assert np.sqrt(np.mean(apart**2)) < 0.15 * np.sqrt(np.mean(expected**2))
    assert np.abs(trace[2]).max() < 0.1 * np.abs(expected).max()


def test_a_moved_site_is_seen_and_less_in_more_noise(engine, driven):
    clear = engine("oracle").judged(*driven("courier", "site_moved"))
    poor = engine("oracle").judged(*driven("courier", "site_moved", "poor"))
    assert not clear.may_refuse
    assert clear.own > 100 * poor.own > 0


def test_a_limit_that_is_never_reached_may_be_refused(engine, driven):
    case, found = driven("courier", "force_range")
    reached = max(np.abs(found.motion.left_nm).max(), np.abs(found.motion.right_nm).max())
    word = engine("oracle").judged(case, found)
    assert word.may_refuse == (reached <= found.hidden.sizes["limit_nm"])


@pytest.mark.parametrize("robot", ["courier-wheels", "rover"])
def test_wheels_of_another_size_are_what_the_speeds_leave(engine, driven, robot):
    case, found = driven(robot, "wheel_size")
    trace = engine("oracle").by_wheels(case, found).acceleration
    ratio, moving = found.hidden.sizes["ratio"], np.abs(found.motion.v_long_mps) > 0.3
    share = np.median(trace[0][moving] / found.motion.v_long_mps[moving])
    assert share == pytest.approx(ratio / (1 + ratio), rel=0.1)


def test_a_rival_of_the_same_mechanism_leaves_nothing_and_another_does(engine, driven):
    case, found = driven("courier", "payload")
    left = engine("rivals").left_by_rivals(case, found, {"payload", "torque_bias_common", "slope"})
    own = engine("oracle").judged(case, found).own
    assert left["payload"] < 0.01 * own
    assert 0.1 * own < left["torque_bias_common"] <= own
    assert left["slope"] is None


def test_a_lag_is_told_from_a_delay_by_precise_poses_alone(engine, driven):
    clear, poor = (
        engine("rivals").left_by_rivals(*driven("courier", "delay", noise), {"actuator_lag"})["actuator_lag"]
        for noise in ("mocap", "poor")
    )
    assert poor < 33 < clear


def test_a_robot_that_falls_without_the_effect_is_stood_up_again(engine):
    """Without friction the same torques throw it over: its trace is no larger than what friction takes."""
    case = engine("case").Case("porter", "square-wave", "rtk", "friction_loss", 3300137, SECONDS)
    found = engine("logs").logged(case)
    trace = engine("oracle").by_torques(found).acceleration
    taken = 2 * found.robot.alpha * found.hidden.sizes["torque_nm"]
    assert np.quantile(np.abs(trace[0][500:]), 0.9) < 2 * taken


def test_a_patch_wants_two_crossings(engine):
    judgement = engine("oracle").Judgement
    assert judgement(1000.0, 1.0, 1).may_refuse
    assert not judgement(1000.0, 1.0, 2).may_refuse
    assert judgement(20.0, 1.0).may_refuse
    assert judgement(1000.0, 0.001).may_refuse

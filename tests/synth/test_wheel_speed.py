"""Robots that wheel speeds drive: friction, truth, encoders, messages, scenarios."""

import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters
from wmr_synth import SCENARIOS, Scenario, record, synthesise, truth_frame
from wmr_synth.wheel_speed.chassis import CHASSIS, DIFFERENTIAL, SKID_STEER, Chassis
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import DRY, Floor
from wmr_synth.wheel_speed.plan import RollingPlan

G = 9.81
NOMINAL, STIFFNESS = DIFFERENTIAL.nominal, 30.0
EXACT = EncoderSensors(noise_xy_sd_m=0.0, noise_yaw_sd_rad=0.0, encoder_ticks=0.0)
EVENLY = replace(EXACT, rate_hz=1000.0, command_rate_hz=1000.0)
MODES = {0: (False, False), 1: (True, False), 2: (False, True), 3: (True, True)}


class Smooth(Chassis):
    """A textbook robot, but for wheels of a stiffness, on ground that holds what friction does."""

    stiffness = np.inf

    def drawn(self, rng, nominal, **_):
        return replace(self.exact(nominal), slip_stiffness=self.stiffness)


class Elastic(Smooth):
    stiffness = STIFFNESS


SMOOTH = Smooth("differential", NOMINAL)


def steady(v_mps, yaw_rate_radps=0.0, ramp_s=0.0):
    """A driver who asks for one speed and yaw rate, reached on a ramp."""

    def driver(_duration_s, _rng):
        def profile(t_s):
            share = np.minimum(t_s / ramp_s, 1.0) if ramp_s else np.ones_like(t_s)
            return v_mps * share, yaw_rate_radps * share

        return profile

    return driver


def driven(driver, *, chassis=SMOOTH, floor=DRY, sensors=EVENLY, duration_s=6.0):
    plan = RollingPlan(chassis, driver, floor, nominal_error=0.0)
    return synthesise(Scenario("a test", "", duration_s, plan, sensors, chassis.nominal))


def even(mu):
    """A floor of one coefficient of friction."""
    return replace(DRY, dry=(mu, mu))


@pytest.fixture(scope="module", params=["encoders", "skid-steer"])
def lively(request):
    """A scenario at 1 kHz without noise."""
    return synthesise(request.param, seed=2, duration_s=40.0, sensors=EVENLY)


def test_the_pose_is_the_integral_of_the_true_velocities(lively):
    t = truth_frame(lively)
    v, lat, yaw, rate = (t[n].to_numpy() for n in ("v_long_mps", "v_lat_mps", "yaw_rad", "yaw_rate_radps"))
    for name, velocity in (
        ("x_m", v * np.cos(yaw) - lat * np.sin(yaw)),
        ("y_m", v * np.sin(yaw) + lat * np.cos(yaw)),
        ("yaw_rad", rate),
    ):
        path = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2)]) * 1e-3
        assert np.abs(path - t[name].to_numpy()).max() < 2e-3, name


def test_accelerations_are_the_velocities_slopes(lively):
    t = truth_frame(lively)
    for velocity, acceleration in (("v_long_mps", "a_long_mps2"), ("yaw_rate_radps", "yaw_acc_radps2")):
        slope = np.diff(t[velocity].to_numpy()) * 1e3
        apart = np.abs(slope - t[acceleration].to_numpy()[1:])
        assert np.quantile(apart, 0.95) < 5e-3, velocity  # a command may act between two rows


def test_slip_velocities_are_what_the_wheels_turn_more_than_the_ground_passes(lively):
    robot, t = lively.facts["true_robot"], lively.truth
    right, left = (robot["wheel_radius_m"] * w for w in (t.right_radps, t.left_radps))
    turn = robot["half_track_m"] * t.yaw_rate_radps
    slip_right, slip_left = right - (t.v_long_mps + turn), left - (t.v_long_mps - turn)
    assert np.abs(t.sigma_sum_mps - (slip_right + slip_left) / 3).max() < 1e-9
    assert np.abs(t.sigma_diff_mps - (slip_right - slip_left) / 3).max() < 1e-9


def test_the_true_mode_is_the_scored_one(lively):
    robot, t = lively.facts["true_robot"], truth_frame(lively)
    v, lat, rate = (t[name].to_numpy() for name in ("v_long_mps", "v_lat_mps", "yaw_rate_radps"))
    skid = lat + robot["icr_offset_m"] * rate + robot["lateral_slip_s"] * v * rate
    total, difference = 1.5 * t["sigma_sum_mps"].to_numpy(), 1.5 * t["sigma_diff_mps"].to_numpy()
    slip = np.maximum(np.abs(total + difference), np.abs(total - difference))
    skids, slips = np.abs(skid) > 0.03, slip > np.maximum(0.05, 0.03 * np.abs(v))
    said = np.array([MODES[mode] for mode in t["mode"].to_list()])
    unsure = 2.5e-3 * np.abs(rate)  # a tyre's lateral slip builds up with the step's own yaw rate
    assert np.mean((said[:, 0] != skids) & (np.abs(np.abs(skid) - 0.03) > unsure)) == 0
    assert np.array_equal(said[:, 1], slips)


def test_no_motion_is_faster_than_friction_allows(lively):
    """The acceleration over the ground stays below μ g times the carried share of the weight."""
    t, robot = truth_frame(lively), lively.facts["true_robot"]
    seconds = t["t_ns"].to_numpy() / 1e9 - lively.facts["start_ns"] / 1e9
    rows = lively.facts["friction"]
    held = np.searchsorted([row["t_s"] for row in rows], seconds, side="right") - 1
    most = np.array([max(row["left"], row["right"]) for row in rows])[held] * G * robot["carried"]
    yaw, v, lat = (t[name].to_numpy() for name in ("yaw_rad", "v_long_mps", "v_lat_mps"))
    world = v * np.exp(1j * yaw) + 1j * lat * np.exp(1j * yaw)
    acceleration = np.abs(world[50:] - world[:-50]) / 0.05
    calm = most[50:] == most[:-50]
    own = 1.0 if robot["kind"] == "skid-steer" else 0.15  # its own sideways motion is no friction's
    assert np.all(acceleration[calm] < most[50:][calm] + own)


def test_all_four_modes_come_from_friction_and_none_on_dry_ground():
    for name in ("encoders", "skid-steer"):
        made = synthesise(name, seed=2, duration_s=60.0)
        assert set(made.truth.mode.tolist()) == {0, 1, 2, 3}
        assert 0.6 < np.mean(made.truth.mode == 0) < 0.97
        scenario = SCENARIOS[name]
        dry = synthesise(replace(scenario, plan=replace(scenario.plan, floor=DRY)), seed=2, duration_s=60.0)
        assert set(dry.truth.mode.tolist()) == {0}


def test_a_start_on_ice_accelerates_at_what_friction_carries():
    made = driven(steady(2.0), floor=even(0.05), duration_s=3.0)
    t_s, carried = made.truth.t_ns / 1e9, 0.05 * G * 0.75
    assert made.truth.v_long_mps[50:] == pytest.approx(carried * t_s[50:], rel=0.02)
    assert set(made.truth.mode[200:].tolist()) == {2}
    rim = made.truth.right_radps * DIFFERENTIAL.nominal.wheel_radius_m
    assert 1.5 * made.truth.sigma_sum_mps == pytest.approx(rim - made.truth.v_long_mps, abs=1e-9)


def test_a_turn_skids_outwards_where_the_ground_holds_less_than_the_curve_asks():
    """A curve of v·yaw_rate = .8 m/s² needs μ e g·.75 of that sideways; ahead the ellipse still holds."""
    for grip, skids in ((0.8 * 1.3, False), (0.8 * 0.8, True)):
        mu = 0.5
        sideways = grip / (mu * G * 0.75)
        floor = Floor((1e-3, 2e-3), (1e3, 2e3), (mu, mu), (mu, mu), (sideways, sideways), one_side=0.0)
        made = driven(steady(1.0, 0.8, ramp_s=2.0), floor=floor, duration_s=5.0)
        assert (1 in made.truth.mode.tolist()) == skids
        assert not {2} & set(made.truth.mode.tolist())
        if skids:
            assert made.truth.v_lat_mps.min() < -0.03
            assert made.truth.v_lat_mps.max() < 0.01


def test_elastic_slip_is_some_per_mille_of_the_speed():
    """s/v = a/(2 c₀ C) with 2 c₀ = .75 g and C = 30, while accelerating; none at a steady speed."""
    made = driven(steady(2.0, ramp_s=2.0), duration_s=4.0, chassis=Elastic("differential", NOMINAL))
    t = made.truth
    slip = 1.5 * t.sigma_sum_mps / np.maximum(t.v_long_mps, 1e-9)
    expected = 1.0 / (0.75 * G * STIFFNESS)
    assert np.mean(slip[1200:2000]) == pytest.approx(expected, rel=0.02)
    assert 0.003 < expected < 0.006
    assert abs(np.mean(slip[3200:])) < 0.01 * expected


@pytest.mark.parametrize("ticks", [64, 2048])
def test_positions_are_whole_counts_and_speeds_their_differences(ticks):
    made = synthesise("encoders", seed=1, duration_s=6.0, sensors=EncoderSensors(encoder_ticks=ticks))
    wheels, step = made.log.wheels, 2 * np.pi / ticks
    exact = synthesise("encoders", seed=1, duration_s=6.0, sensors=EncoderSensors(encoder_ticks=0))
    for position, true, speed in zip(
        made.wheel_angles_rad, exact.wheel_angles_rad, (wheels.left_radps, wheels.right_radps), strict=True
    ):
        counts = np.rint(position / step)
        assert position == pytest.approx(counts * step, abs=1e-9)
        late = true - position
        assert late.min() > -1e-9
        assert late.max() < step * (1 + 1e-9)
        assert speed[1:] == pytest.approx(np.diff(counts) * step * 100.0, abs=1e-9)
    assert np.all(np.diff(wheels.t_ns) == 10_000_000)
    assert wheels.t_ns[0] == made.facts["start_ns"] + 10_000_000


def test_an_encoders_speed_belongs_to_the_middle_of_its_interval():
    made = driven(steady(2.0, ramp_s=2.0), duration_s=2.0, sensors=replace(EVENLY, wheel_rate_hz=20.0))
    wheels, truth = made.log.wheels, made.truth
    middle = (wheels.t_ns - made.facts["start_ns"]) / 1e9 - 0.025
    true = np.interp(middle, truth.t_ns / 1e9, truth.left_radps)
    assert wheels.left_radps[4:-4] == pytest.approx(true[4:-4], rel=0.01)


def test_stated_lengths_are_wrong_by_up_to_three_per_cent_and_a_skid_steers_track_by_far():
    ratios = []
    for seed in range(40):
        for kind, chassis in CHASSIS.items():
            robot = chassis.drawn(np.random.default_rng(seed), chassis.nominal)
            assert robot.nominal == chassis.nominal
            assert abs(robot.wheel_radius_m / robot.stated_radius_m - 1) <= 0.03
            ratios.append((kind, robot.half_track_m / robot.stated_half_track_m))
    plain = [ratio for kind, ratio in ratios if kind == "differential"]
    skid = [ratio for kind, ratio in ratios if kind == "skid-steer"]
    assert 0.97 <= min(plain) < 0.99
    assert 1.01 < max(plain) <= 1.03
    assert 1.3 < min(skid) < 1.6
    assert 2.0 < max(skid) < 2.3


def test_the_log_holds_the_stated_lengths_and_the_truth_the_true_ones(tmp_path):
    made = synthesise("skid-steer", seed=5, duration_s=2.0)
    record(made, tmp_path / "a.mcap")
    assert made.log.robot == SKID_STEER.nominal
    facts = json.loads((tmp_path / "a.truth.json").read_text(encoding="utf-8"))
    robot = facts["true_robot"]
    scale = robot["wheel_radius_m"] / SKID_STEER.nominal.wheel_radius_m
    assert facts["calibration"]["wheel_scale"]["ratio"] == pytest.approx(scale - 1)
    assert facts["base_model"] == "wheel_speed"
    with (tmp_path / "a.mcap").open("rb") as file:
        (found,) = [r.metadata for r in make_reader(file).iter_metadata()]
    assert found == {"wheel_radius_m": "0.165", "half_track_m": "0.28"}


def messages(path, *decoders):
    with path.open("rb") as file:
        for _, channel, _, message in make_reader(file, decoder_factories=decoders).iter_decoded_messages():
            yield channel.topic, message


@pytest.mark.parametrize("commands", ["wheels", "twist", "none"])
def test_ros2_messages_are_read_back_with_equal_values(tmp_path, commands):
    made = synthesise("encoders", seed=3, duration_s=2.0, commands_as=commands)
    record(made, tmp_path / "a.mcap")
    read: dict[str, list] = {}
    for topic, message in messages(tmp_path / "a.mcap", Ros2Decoder()):
        read.setdefault(topic, []).append(message)
    named = {"wheels": {"/wheel_commands"}, "twist": {"/cmd_vel"}, "none": set()}[commands]
    assert set(read) == {"/pose", "/wheel_speeds", "/ground_truth/mode"} | named
    wheels = made.log.wheels
    assert [list(m.velocity) for m in read["/wheel_speeds"]] == np.stack(
        [wheels.left_radps, wheels.right_radps], axis=1
    ).tolist()
    assert [list(m.position) for m in read["/wheel_speeds"]] == np.stack(
        made.wheel_angles_rad, axis=1
    ).tolist()
    assert all(len(m.effort) == 0 for m in read["/wheel_speeds"])
    if commands == "wheels":
        assert [list(m.velocity) for m in read["/wheel_commands"]] == np.stack(
            [made.log.commands.left_radps, made.log.commands.right_radps], axis=1
        ).tolist()
    if commands == "twist":
        v = np.array([m.twist.linear.x for m in read["/cmd_vel"]])
        rate = np.array([m.twist.angular.z for m in read["/cmd_vel"]])
        r, l = made.log.robot.wheel_radius_m, made.log.robot.half_track_m
        assert (v + l * rate) / r == pytest.approx(made.log.commands.right_radps, abs=1e-9)
        assert (v - l * rate) / r == pytest.approx(made.log.commands.left_radps, abs=1e-9)


def test_protobuf_and_json_hold_the_same(tmp_path):
    made = synthesise("encoders", seed=3, duration_s=1.0, commands_as="twist")
    for encoding in ("protobuf", "json"):
        record(made, tmp_path / f"{encoding}.mcap", encoding=encoding)
    decoded = messages(tmp_path / "protobuf.mcap", ProtobufDecoder())
    of_protobuf = [message for topic, message in decoded if topic == "/cmd_vel"]
    with (tmp_path / "json.mcap").open("rb") as file:
        of_json = [json.loads(raw.data) for _, _, raw in make_reader(file).iter_messages(topics=["/cmd_vel"])]
    assert len(of_json) == len(made.log.commands)
    assert [m.twist.linear.x for m in of_protobuf] == [m["twist"]["linear"]["x"] for m in of_json]
    assert [m.twist.angular.z for m in of_protobuf] == [m["twist"]["angular"]["z"] for m in of_json]


@pytest.mark.parametrize("name", ["encoders", "skid-steer", "warehouse"])
def test_one_seed_is_one_file(name, tmp_path):
    files = []
    for place in ("a", "b"):
        (tmp_path / place).mkdir()
        made = synthesise(name, seed=9, duration_s=4.0, wrong_modes=0.05)
        files.append([path.read_bytes() for path in record(made, tmp_path / place / "x.mcap")])
    assert files[0] == files[1]
    other = synthesise(name, seed=10, duration_s=4.0)
    assert not np.array_equal(other.log.pose.x_m, made.log.pose.x_m)


def test_a_warehouse_robot_keeps_to_its_hall_and_stops_there():
    made = synthesise("warehouse", seed=1, duration_s=600.0)
    truth = made.truth
    assert -8 < truth.x_m.min() < 0
    assert 20 < truth.x_m.max() < 32
    assert np.ptp(truth.y_m) < 35
    assert 0.1 < np.mean(np.abs(truth.v_long_mps) < 1e-3) < 0.6
    assert truth.v_long_mps.min() < -0.2
    assert np.mean(truth.mode == 0) > 0.98


def test_what_a_robot_by_wheel_speeds_has_not_is_refused():
    with pytest.raises(InvalidSetting, match="patrol is driven by torques"):
        synthesise("patrol", duration_s=1.0, nominal_error=0.0)
    with pytest.raises(InvalidSetting, match="needs wheel_radius_m"):
        synthesise("encoders", duration_s=1.0, robot=RobotParameters(half_track_m=0.3))
    with pytest.raises(InvalidSetting, match="a share from 0 to"):
        synthesise("encoders", duration_s=1.0, nominal_error=0.7)
    with pytest.raises(InvalidSetting, match="encoder_ticks is a whole number"):
        EncoderSensors(encoder_ticks=10.5)


def test_slippery_ground_is_drawn_within_its_bounds():
    floor = Floor()
    ground = floor.drawn(500.0, np.random.default_rng(1))
    lower = np.minimum(ground.left, ground.right)[1::2]
    assert floor.slippery[0] <= lower.min() < lower.max() <= floor.slippery[1]
    assert np.all(ground.left[::2] == ground.right[::2])
    assert np.mean(ground.left[1::2] != ground.right[1::2]) == pytest.approx(floor.one_side, abs=0.15)


def test_torques_obey_newtons_law_for_the_whole_robot():
    """Σ torque / r is what the robot, its wheels and their resistance to rolling take, in every mode."""
    plain = synthesise("encoders", seed=3, duration_s=12.0, sensors=EVENLY)
    made = synthesise("encoders", seed=3, duration_s=12.0, sensors=EVENLY, torques_as="together")
    assert np.array_equal(plain.log.pose.x_m, made.log.pose.x_m)
    robot, drive, truth = made.facts["true_robot"], made.facts["drivetrain"], made.truth
    torque, radius = made.log.torque, robot["wheel_radius_m"]
    t_s = (torque.t_ns - torque.t_ns[0]) * 1e-9
    rows = np.searchsorted(truth.t_ns, torque.t_ns - made.log.pose.t_ns[0])
    speeds = np.stack([made.log.wheels.left_radps, made.log.wheels.right_radps])
    spins = np.gradient(speeds, t_s, axis=1).sum(axis=0)
    traction = truth.a_long_mps2[rows] - truth.v_lat_mps[rows] * truth.yaw_rate_radps[rows]
    load = drive["resistance"] * G * robot["carried"] / 2
    resisted = load * np.tanh(speeds * radius / 0.02).sum(axis=0)
    wanted = radius * drive["mass_kg"] * (traction + resisted) + drive["wheel_inertia_kgm2"] * spins
    found = torque.left_nm + torque.right_nm
    off = np.abs(found - wanted)[20:-20]
    assert np.median(off) < 0.03 * np.std(found)
    assert np.any(truth.mode[rows] == 2) or np.any(truth.mode[rows] == 3)


def test_torques_stand_with_the_wheel_speeds_or_apart(tmp_path):
    for torques_as, topics in (
        ("together", {"/wheel_torques"}),
        ("apart", {"/wheel_torques", "/wheel_speeds"}),
    ):
        made = synthesise("skid-steer", seed=1, duration_s=1.0, torques_as=torques_as)
        (file, *_) = record(made, tmp_path / f"{torques_as}.mcap")
        with file.open("rb") as stream:
            names = {c.topic for c in make_reader(stream).get_summary().channels.values()}
        assert topics <= names
        assert ("/wheel_speeds" in names) == (torques_as == "apart")
        assert np.isfinite(made.log.torque.left_nm).all()
    assert synthesise("encoders", duration_s=1.0).log.torque is None
    with pytest.raises(InvalidSetting, match="driven by torques"):
        synthesise("patrol", duration_s=1.0, torques_as="apart")

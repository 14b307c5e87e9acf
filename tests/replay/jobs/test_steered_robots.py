"""A steered car's skids are told; slipping and alpha are not, since its efforts are left aside."""

import json

import numpy as np
import pytest
from mcap.writer import Writer

import wmr_replay as wr
from wmr_replay.cli.printing.run import print_result

N, STEP_NS = 3000, 10_000_000


def drive():
    """A drive whose second half slides with 30° of sideslip: x, y, yaw (3, n)."""
    t = np.arange(N) / 100
    rng = np.random.default_rng(1)
    slip = np.radians(-30) * (np.sin(2 * np.pi * t / 10) < -0.3)
    rate = 0.8 * np.sign(np.sin(2 * np.pi * t / 10 + np.pi)) * (t > 1)
    yaw = np.cumsum(rate) / 100
    place = np.cumsum([1.5 * np.cos(yaw + slip), 1.5 * np.sin(yaw + slip)], axis=1) / 100
    return np.stack([*place, yaw]) + np.array([[1e-3], [1e-3], [2e-3]]) * rng.standard_normal((3, N))


def write_log(path, joints):
    """The drive with joint states of these names, in JSON."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        pose, torque = (
            writer.register_channel(topic, "json", writer.register_schema(name, "jsonschema", b"{}"))
            for topic, name in (
                ("/pose", "geometry_msgs/PoseStamped"),
                ("/joint_states", "sensor_msgs/JointState"),
            )
        )
        for k, (x, y, yaw) in enumerate(drive().T.tolist()):
            t_ns = 10**18 + k * STEP_NS
            header = {"stamp": {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}}
            turn = {"x": 0.0, "y": 0.0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)}
            at = {"header": header, "pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turn}}
            efforts = [float(np.sin(k / 40)) for _ in joints]
            wheels = {"header": header, "name": joints, "effort": efforts, "velocity": [15.0 for _ in joints]}
            writer.add_message(pose, t_ns, json.dumps(at).encode(), t_ns)
            writer.add_message(torque, t_ns, json.dumps(wheels).encode(), t_ns)
        writer.finish()
    return path


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steered")
    joints = ["rear_left_wheel", "rear_right_wheel", "front_left_steering_joint"]
    return wr.run(write_log(folder / "car.mcap", joints), out=folder / "out")


def test_it_is_said_and_bars_nothing(result, capsys):
    print_result(result, as_json=False)
    said = capsys.readouterr().out
    assert "warning   steered: the robot seems to be steered (front_left_steering_joint)" in said
    assert not any(f["severity"] == "bars" for f in result.findings)


def test_skids_are_told_and_slipping_is_not(result):
    row = result.summary.row(0, named=True)
    assert row["share_skidding"] > 0.2
    assert not row["share_slipping"]
    assert not row["share_ideal"]
    assert result.samples.collect()["alpha"].is_null().all()


def test_a_column_of_steering_is_carried_and_fit_and_gap_say_why_they_refuse(tmp_path, command):
    x, y, yaw = drive()
    poses = enumerate(zip(x, y, yaw, strict=True))
    rows = [f"{k / 100},{a},{b},{c},{np.sin(k / 90)}" for k, (a, b, c) in poses]
    (tmp_path / "car.csv").write_text("\n".join(["t,x,y,yaw,steer", *rows]))
    names = "\n".join(f'{key} = "{key}"' for key in ("x", "y", "yaw"))
    (tmp_path / "columns.toml").write_text(f'[columns]\ntime = "t"\nsteering = "steer"\n{names}\n')
    log = tmp_path / "car.mcap"
    command("convert", tmp_path / "car.csv", "--map", tmp_path / "columns.toml", "--out", log)

    assert "steered" in command("info", log).stdout
    for call in (("fit",), ("gap",), ("gap", "--base", "both"), ("gap", "--input", "commands")):
        said = command(call[0], log, *call[1:], "--out", tmp_path, code=3).stderr
        assert "steered: the robot seems to be steered (/steering, steering_joint)" in said
        assert "its yaw rate follows from the steering" in said

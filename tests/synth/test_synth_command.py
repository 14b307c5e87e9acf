"""``wmr-replay synth`` from the command line."""

import json
from pathlib import Path

import pytest
from mcap.reader import make_reader

from wmr_synth import SCENARIOS

QUICK = ("--duration", "2", "--rate", "50")


def test_list_names_and_describes_every_scenario(synth):
    code, out, _ = synth("--list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(SCENARIOS)
    assert all(scenario.description in out for scenario in SCENARIOS.values())


def test_list_speaks_json_to_machines(synth):
    code, out, _ = synth("--list", "--json")
    assert code == 0
    assert [row["name"] for row in json.loads(out)] == list(SCENARIOS)


def test_writes_the_log_and_says_what_comes_next(synth, tmp_path):
    path = tmp_path / "demo.mcap"
    code, out, err = synth("paper-acceleration", "--out", path, *QUICK)
    assert (code, err) == (0, "")
    assert f"wmr-replay run {path}" in out
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "demo.mcap",
        "demo.truth.json",
        "demo.truth.parquet",
    ]


def test_options_reach_the_truth_file(synth, tmp_path):
    path = tmp_path / "a.mcap"
    options = (
        "--seed",
        3,
        "--noise-variance",
        0.04,
        "--jitter",
        0.001,
        "--dropout",
        0.1,
        "--clock-offset",
        -0.02,
    )
    code, out, _ = synth("random", "--out", path, *QUICK, *options, "--encoding", "json", "--json")
    assert code == 0
    facts = json.loads((tmp_path / "a.truth.json").read_text(encoding="utf-8"))
    assert facts["seed"] == 3
    assert facts["sensors"]["noise_xy_sd_m"] == facts["sensors"]["noise_yaw_sd_rad"] == pytest.approx(0.2)
    assert facts["sensors"]["clock_offset_s"] == -0.02
    assert facts["sensors"]["rate_hz"] == 50
    assert json.loads(out)["files"][0] == str(path)


def test_no_truth_removes_what_an_earlier_log_left(synth, tmp_path):
    path = tmp_path / "a.mcap"
    assert synth("random", "--out", path, *QUICK)[0] == 0
    assert synth("random", "--out", path, *QUICK, "--no-truth")[0] == 0
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert {channel.topic for channel in summary.channels.values()} == {"/pose", "/wheel_torques"}


def test_a_robot_file_replaces_the_papers_robot(synth, tmp_path):
    robot = tmp_path / "robot.toml"
    robot.write_text(
        "[robot]\nalpha = 0.2\nalpha_sd = 0.01\nhalf_track_m = 0.3\nwheel_radius_m = 0.1\nmass_kg = 20\n"
        "wheel_inertia_kgm2 = 0.01\nyaw_inertia_kgm2 = 1.0\ncornering_stiffness_over_epsilon = 200\n"
        'longitudinal_stiffness_over_epsilon = 500\naverage_speed_mps = "auto"\n',
        encoding="utf-8",
    )
    assert synth("figure-eight", "--out", tmp_path / "a.mcap", *QUICK, "--robot", robot)[0] == 0
    facts = json.loads((tmp_path / "a.truth.json").read_text(encoding="utf-8"))
    assert facts["robot"]["alpha"] == 0.2
    assert "alpha_sd" not in facts["robot"]


def robot_file(folder: Path, text: str) -> Path:
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[robot]\nalpha = 0.1\n", "half_track_m"),
        ("[robot]\nalpha = -1\n", "alpha"),
        ("[robot]\nalfa = 1\n", "alfa"),
        ("[noise]\n", "[robot]"),
    ],
)
def test_a_robot_file_that_cannot_be_used_is_a_usage_error_naming_the_key(synth, tmp_path, text, message):
    code, _, err = synth("random", "--out", tmp_path / "a.mcap", "--robot", robot_file(tmp_path, text))
    assert code == 2
    assert message in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "--list"),
        (("paper-accelaration", "--out", "a.mcap"), "did you mean paper-acceleration"),
        (("random",), "--out random.mcap"),
        (("random", "--out", "no/such/folder/a.mcap"), "create it first"),
        (("random", "--out", "a.mcap", "--duration", "-1"), "duration"),
        (("random", "--out", "a.mcap", "--encoding", "xml"), "encoding"),
        (("random", "--out", "a.mcap", "--noise-variance", "1", "--noise-xy-sd", "1"), "--noise-variance"),
        (("random", "--out", "a.mcap", "--duration", "1e12"), "shorten"),
    ],
)
def test_bad_usage_exits_with_2_and_says_what_to_try(synth, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, _, err = synth(*arguments)
    assert code == 2
    assert message in err
    assert list(tmp_path.iterdir()) == []


def test_help_shows_examples(synth):
    code, out, _ = synth("--help")
    assert code == 0
    assert "wmr-replay synth paper-acceleration --out demo.mcap" in out


def test_options_of_encoders_and_commands_reach_the_log(synth, tmp_path):
    options = ("--encoder-ticks", 512, "--wheel-rate", 40, "--commands", "twist", "--command-rate", 20)
    path = tmp_path / "a.mcap"
    assert synth("skid-steer", "--out", path, *QUICK, *options, "--nominal-error", 0)[0] == 0
    facts = json.loads((tmp_path / "a.truth.json").read_text(encoding="utf-8"))
    assert facts["sensors"]["encoder_ticks"] == 512
    assert "torque_rate_hz" not in facts["sensors"]
    assert facts["calibration"]["wheel_scale"]["ratio"] == 0
    with path.open("rb") as file:
        counts = make_reader(file).get_summary().statistics.channel_message_counts
    with path.open("rb") as file:
        topics = {channel.id: channel.topic for channel in make_reader(file).get_summary().channels.values()}
    assert {topics[key]: n for key, n in counts.items() if topics[key] != "/ground_truth/mode"} == {
        "/pose": 101,
        "/wheel_speeds": 80,
        "/cmd_vel": 41,
    }


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("encoders", "--torque-rate", "5"), "records no torques"),
        (("encoders", "--hide", "payload"), "robots that wheel torques drive"),
        (("patrol", "--hide", "wheel_scale"), "robots that wheel speeds drive"),
        (("patrol", "--wheel-rate", "5"), "no sensor option"),
        (("patrol", "--commands", "twist"), "driven by torques"),
    ],
)
def test_options_of_the_other_kind_of_robot_are_refused(synth, tmp_path, arguments, says):
    code, _, err = synth(*arguments, "--duration", "1", "--out", tmp_path / "x.mcap")
    assert code == 2
    assert says in err
    assert list(tmp_path.iterdir()) == []

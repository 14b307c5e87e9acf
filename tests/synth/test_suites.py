"""Suites: the same bytes on every run, complete or absent, with a reliable manifest."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_synth.suites import (
    MANIFEST,
    SUITES,
    LogSpec,
    Suite,
    find_suite,
    read_manifest,
    read_suite,
    write_suite,
)
from wmr_synth.suites.damage import DAMAGES
from wmr_synth.suites.writer import STAGING

BINARY = Path(sys.executable).with_name("wmr-replay")
SMALL = """
name = "small"
version = 3

[[logs]]
name = "slow"
scenario = "stop-and-go"
seed = 2
duration_s = 4
rate_hz = 25

[[logs]]
scenario = "random"
seeds = [5, 6]
duration_s = 3
noise_variance = 1e-4
encoding = "json"

[[logs]]
name = "blind"
scenario = "figure-eight"
duration_s = 3
dropout = 0.2
truth = false
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("own") / "small.toml"
    path.write_text(SMALL)
    return path


def contents(directory: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in directory.iterdir()}


def test_processes_threads_and_jobs_change_no_byte(small, tmp_path):
    """Two processes, with one thread and one job, and with four threads and two jobs."""
    for name, threads, jobs in (("one", 1, 1), ("many", 4, 2)):
        counts = dict.fromkeys(("POLARS_MAX_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), str(threads))
        arguments = [BINARY, "suite", small, "--out", tmp_path / name, "--jobs", str(jobs)]
        subprocess.run(arguments, env=os.environ | counts, check=True, capture_output=True)
    one, many = contents(tmp_path / "one"), contents(tmp_path / "many")
    assert one == many
    assert len(one) == 1 + 3 * 3 + 1


def test_a_seed_changes_every_log_and_its_manifest_says_so(small, tmp_path):
    suite = read_suite(small)
    first = write_suite(suite, tmp_path / "a")
    second = write_suite(suite, tmp_path / "b", seed=1)
    assert [log.seed for log in first.suite.logs] == [2, 5, 6, 0]
    assert [log.seed for log in second.suite.logs] == [3, 6, 7, 1]
    for log in suite.logs:
        assert first.files[log.name][f"{log.name}.mcap"] != second.files[log.name][f"{log.name}.mcap"]
    assert first.files["random-s6"]["random-s6.mcap"] == second.files["random-s5"]["random-s5.mcap"]


def test_the_manifest_says_what_every_file_is(small, tmp_path):
    write_suite(read_suite(small), tmp_path)
    manifest = json.loads((tmp_path / MANIFEST).read_text())
    assert (manifest["suite"], manifest["version"], manifest["seed"]) == ("small", 3, 0)
    assert manifest["generator"].startswith("wmr-replay ")
    listed = {name: sha256 for log in manifest["logs"] for name, sha256 in log["files"].items()}
    assert listed == {name: sha for name, sha in contents(tmp_path).items() if name != MANIFEST}
    slow, five, _, blind = manifest["logs"]
    assert (slow["scenario"], slow["seed"], slow["duration_s"]) == ("stop-and-go", 2, 4.0)
    assert slow["sensors"]["rate_hz"] == 25.0
    assert five["sensors"]["noise_xy_sd_m"] == pytest.approx(0.01)
    assert five["parameters"]["encoding"] == "json"
    assert list(blind["files"]) == ["blind.mcap"]


def test_what_is_whole_is_kept_and_what_was_changed_is_written_again(small, tmp_path):
    suite = read_suite(small)
    write_suite(suite, tmp_path)
    before, stamps = contents(tmp_path), {p.name: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    (tmp_path / "slow.mcap").write_bytes(b"changed")
    kept: dict[str, bool] = {}
    write_suite(suite, tmp_path, announce=lambda log, was_there: kept.update({log.name: was_there}))
    assert contents(tmp_path) == before
    assert kept == {"slow": False, "random-s5": True, "random-s6": True, "blind": True}
    assert (tmp_path / "blind.mcap").stat().st_mtime_ns == stamps["blind.mcap"]


def test_another_version_replaces_its_files_and_another_suite_is_refused(small, tmp_path):
    suite = read_suite(small)
    write_suite(suite, tmp_path)
    shorter = Suite("small", 4, "", suite.logs[:1])
    write_suite(shorter, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        MANIFEST,
        "slow.mcap",
        "slow.truth.json",
        "slow.truth.parquet",
    ]
    with pytest.raises(InvalidSetting, match="holds the suite small"):
        write_suite(Suite("other", 1, "", suite.logs), tmp_path)


def test_an_error_half_way_leaves_the_directory_as_it_was(small, tmp_path):
    suite = read_suite(small)

    def full_disk(log, _):
        if log.name == "random-s5":
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        write_suite(suite, tmp_path / "new", announce=full_disk)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_leaves_nothing_that_looks_whole(tmp_path, jobs):
    long = tmp_path / "long.toml"
    rows = [
        f'[[logs]]\nname = "l{k}"\nscenario = "random"\nseed = {k}\nduration_s = 1200\n' for k in range(6)
    ]
    long.write_text("\n".join(rows))
    out = tmp_path / "out"
    arguments = [BINARY, "suite", str(long), "--out", str(out), "--jobs", str(jobs)]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not list(out.glob(f"{STAGING}/.*.part")):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert errors.strip() == "error: interrupted; nothing half-written was left"
    assert not out.exists()


def test_a_kill_leaves_no_manifest_and_the_next_run_clears_up(small, tmp_path):
    """What SIGKILL leaves behind is a staging directory and no manifest."""
    (tmp_path / STAGING).mkdir()
    (tmp_path / STAGING / "slow.mcap").write_bytes(b"half of it")
    assert read_manifest(tmp_path) is None
    write_suite(read_suite(small), tmp_path)
    assert not (tmp_path / STAGING).exists()
    assert read_manifest(tmp_path) is not None


def test_every_suite_is_listed_with_what_it_holds(command):
    listed = {row["name"]: row for row in json.loads(command("suite", "--list", "--json").stdout)}
    asked = "paper noise-sweep rates dropouts hidden-effects encodings damaged long".split()
    assert set(asked) <= set(listed) == set(SUITES)
    for name in asked:
        assert listed[name]["logs"] == [log.name for log in SUITES[name].logs]
        assert name in command("suite", "--list").stdout


def test_the_encodings_hold_the_same_values(tmp_path):
    suite = find_suite("encodings")
    write_suite(Suite("encodings", 1, "", tuple(shortened(log) for log in suite.logs)), tmp_path)
    stamps = {}
    for path in tmp_path.glob("*.mcap"):
        with path.open("rb") as file:
            reader = make_reader(file)
            profile = reader.get_header().profile
            stamps[path.stem] = [(c.topic, m.log_time) for _, c, m in reader.iter_messages()]
            assert (profile == "ros2") == (path.stem == "drive-ros2")
    assert stamps["drive-ros2"] == stamps["drive-protobuf"] == stamps["drive-json"]
    assert len(stamps["drive-ros2"]) > 500


def test_hidden_effects_stand_in_the_truth_and_nowhere_in_the_log(tmp_path):
    suite = find_suite("hidden-effects")
    chosen = {"hidden-viscous-drag", "hidden-payload-and-slope", "hidden-nothing"}
    logs = tuple(shortened(log) for log in suite.logs if log.name in chosen)
    write_suite(Suite("hidden-effects", 1, "", logs), tmp_path)
    effects = {}
    for log in logs:
        facts = json.loads((tmp_path / f"{log.name}.truth.json").read_text())
        effects[log.name] = [effect["name"] for effect in facts["effects"]]
        with (tmp_path / f"{log.name}.mcap").open("rb") as file:
            channels = make_reader(file).get_summary().channels.values()
        assert sorted(channel.topic for channel in channels) == ["/pose", "/wheel_torques"]
    assert effects == {
        "hidden-viscous-drag": ["viscous_drag"],
        "hidden-payload-and-slope": ["payload", "slope"],
        "hidden-nothing": [],
    }


def test_a_file_of_ones_own_takes_the_robot_noise_and_effects_of_synth(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        "[[logs]]\nname = 'heavy'\nscenario = 'patrol'\nduration_s = 2\nnoise = 'poor'\nrate_hz = 40\n"
        "hide = 'payload:mass_ratio=0.3'\ndisturbance = 'none'\n"
        "robot = {alpha = 0.1, alpha_yaw = 0.2, half_track_m = 0.3, wheel_radius_m = 0.1, mass_kg = 40,"
        " yaw_inertia_kgm2 = 2, wheel_inertia_kgm2 = 0.03,"
        " cornering_stiffness_over_epsilon = 160, longitudinal_stiffness_over_epsilon = 400}\n"
    )
    write_suite(read_suite(path), tmp_path / "logs")
    facts = json.loads((tmp_path / "logs" / "heavy.truth.json").read_text())
    assert facts["effects"][0]["parameters"] == {"mass_ratio": 0.3}
    assert facts["robot"]["mass_kg"] == 40.0
    assert facts["sensors"]["rate_hz"] == 40.0
    assert facts["sensors"]["noise_xy_sd_m"] == 0.05


def shortened(log: LogSpec) -> LogSpec:
    return LogSpec(log.name, log.scenario, log.seed, {**log.parameters, "duration_s": 3.0}, log.damage)


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> bytes:
    directory = tmp_path_factory.mktemp("good")
    parameters = {"duration_s": 20.0, "chunk_bytes": 65_536}
    write_suite(Suite("one", 1, "", (LogSpec("log", "stop-and-go", 1, parameters),)), directory)
    return (directory / "log.mcap").read_bytes()


@pytest.mark.parametrize("name", [name for name in DAMAGES if name != "none"])
def test_each_damage_changes_the_file_and_always_in_the_same_way(good, name):
    damage = DAMAGES[name]
    broken = damage.apply(good, np.random.default_rng(3))
    assert broken != good
    assert broken == damage.apply(good, np.random.default_rng(3))


def test_damage_strikes_where_it_says(good, tmp_path):
    """An independent reader finds just the checksum wrong, just three chunks changed, no message."""

    def chunks(data: bytes, **options) -> list:
        path = tmp_path / "x.mcap"
        path.write_bytes(data)
        with path.open("rb") as file:
            records = list(StreamReader(file, emit_chunks=True, **options).records)
        return [record for record in records if type(record).__name__ == "Chunk"]

    def broken(name: str) -> bytes:
        return DAMAGES[name].apply(good, np.random.default_rng(1))

    before = chunks(good)
    after = chunks(broken("crc-flipped"))
    assert [a.uncompressed_crc ^ b.uncompressed_crc for a, b in zip(before, after, strict=True)].count(0) == (
        len(before) - 1
    )
    assert [a.data for a in before] == [b.data for b in after]
    flipped = zip(before, chunks(broken("bit-flips")), strict=True)
    assert sum(a.data != b.data for a, b in flipped) == 3
    assert not chunks(broken("no-messages"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'x'", "logs: expected [[logs]]"),
        ("[[logs]]\nseed = 1", "[[logs]] #1 scenario: missing"),
        ("[[logs]]\nscenario = 'randon'", "did you mean random"),
        (
            "[[logs]]\nscenario = 'random'\nnoises = 1",
            "[[logs]] #1 noises: unknown key; known are name, scenario",
        ),
        ("[[logs]]\nscenario = 'random'\nrate_hz = 'x'", "[[logs]] #1 rate_hz: expected a finite number"),
        ("[[logs]]\nscenario = 'random'\nrate_hz = -1", "rate_hz must be a number not below 0"),
        ("[[logs]]\nscenario = 'random'\nseed = -1", "expected a whole number, not below 0"),
        ("[[logs]]\nscenario = 'random'\nseed = 1\nseeds = [1]", "no `seed` beside it"),
        ("[[logs]]\nscenario = 'random'\nencoding = 'xml'", "no encoding 'xml'"),
        ("[[logs]]\nscenario = 'random'\nname = '../x'", "expected letters, digits"),
        ("[[logs]]\nscenario = 'random'\n[[logs]]\nscenario = 'random'", "two logs are called 'random'"),
        ("[[logs]]\nscenario = 'random'\nnoise = 'loud'", "no noise 'loud'; known are mocap"),
        ("[[logs]]\nscenario = 'random'\nhide = 'paylod'", "did you mean payload"),
        ("[[logs]]\nscenario = 'random'\ntruth = 1", "expected true or false"),
        ("[[logs]]\nscenario = 'random'\nrobot = {alfa = 1}", "alfa: unknown key; known are alpha"),
        ("version = 'one'\n[[logs]]\nscenario = 'random'", "version: expected a whole number"),
    ],
)
def test_a_wrong_file_is_refused_with_the_place(tmp_path, text, message):
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(InvalidFile) as refused:
        read_suite(path)
    assert message in str(refused.value)


def test_the_command_says_what_to_do(command, tmp_path):
    assert "did you mean noise-sweep" in command("suite", "noise-swep", "--out", tmp_path, code=2).stderr
    assert "wmr-replay suite paper --out logs/paper" in command("suite", "paper", code=2).stderr
    assert "--list" in command("suite", code=2).stderr
    assert "there is no manifest.json" in command("suite", "--verify", tmp_path, code=2).stderr


def test_verify_tells_same_bytes_from_changed_ones(command, small, tmp_path):
    command("suite", small, "--out", tmp_path / "logs", "--jobs", 1)
    outcome = json.loads(command("suite", "--verify", tmp_path / "logs", "--jobs", 1, "--json").stdout)
    assert set(outcome["logs"].values()) == {"same bytes"}
    shutil.copy(tmp_path / "logs" / "random-s5.mcap", tmp_path / "logs" / "random-s6.mcap")
    done = command("suite", "--verify", tmp_path / "logs", "--jobs", 1, code=1)
    assert "random-s6: changed" in done.stdout
    assert "3 of 4 logs" in done.stdout

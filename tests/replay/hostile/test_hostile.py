"""Hostile logs under limits of memory and time, damaged ones, and the stored inputs of fuzzing."""

import json
import subprocess
import sys
import time
from pathlib import Path

import fuzz
import hostile_files as made
import mutations
import numpy as np
import pytest
import targets
from container import T0_NS, chunk, log, message, metadata
from worker import run

from wmr_replay.identify.filter_bank.long_steps import FREE_S, LONGEST_S, SPARE_S, LongSteps
from wmr_replay.ingest import open_log
from wmr_replay.ingest.budgets import BUDGETS, ReadBudgets, read_budgets
from wmr_replay.ingest.own_parameters import own_parameters
from wmr_schemas.absurd import without_absurd
from wmr_schemas.errors import InvalidSetting

HERE = Path(__file__).parent
MOST_MIB = 1024
MOST_LOOPS = 60
"""Most processor time of a command, in times of :func:`loop_s`: 10 s where that is a sixth of one."""
NAMES = sorted(set(made.CASES) - {"clean"})
N_TOGETHER = 16
"""Logs that one process reads: its memory grows a little with each."""
BATCHES = [NAMES[start : start + N_TOGETHER] for start in range(0, len(NAMES), N_TOGETHER)]


def loop_s() -> float:
    """Processor time of a million plain steps: how fast this machine is today."""
    begun, counted = time.process_time(), dict[str, int]()
    for k in range(1_000_000):
        name = str(k % 1000)
        counted[name] = counted.get(name, 0) + k
    return time.process_time() - begun


@pytest.mark.slow
@pytest.mark.parametrize("names", BATCHES, ids=lambda names: f"{names[0]}-to-{names[-1]}")
def test_a_hostile_log_is_read_or_refused_within_memory_and_time(tmp_path, names):
    files = [tmp_path / f"{name}.mcap" for name in ("clean", *names)]  # the first one compiles
    for path in files:
        path.write_bytes(made.CASES[path.stem]())
    worker = [sys.executable, HERE / "worker.py", tmp_path / "out", "--seconds", "400", *files]
    done = subprocess.run(worker, capture_output=True, text=True, check=False)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["file"] for line in lines] == [path.stem for path in files], done.stderr[-2000:]
    most_s = MOST_LOOPS * loop_s()
    for line in lines[1:]:
        for command in line["commands"]:
            assert command["code"] in {0, 3}, (line["file"], command)
            assert command["cpu_s"] <= most_s, (line["file"], command)
            assert command["peak_mib"] <= MOST_MIB, (line["file"], command)


def read(tmp_path, content: bytes):
    """A log that was read to its end, and the number of its poses with a position."""
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    reader = open_log(path)
    poses = [batch.pose for batch in reader.batches()]
    return reader, sum(int(np.isfinite(without_absurd(rows.values)).all(axis=0).sum()) for rows in poses)


REFUSED = {
    "laughing_20_10": "fit its schema",
    "empty_structs_cdr": "more than 65,536 fields",
    "empty_structs_ros1": "more than 65,536 fields",
    "million_poses": "no message of at most 4,194,304 bytes",
    "million_poses_in_part": "more than 65,536 fields",
    "nested_900": "nested more than 64 deep",
    "nested_20000": "bytes",
    "definition_of_many_types": "131,072 are read at most",
    "protobuf_packed_numbers": "more than 65,536 fields",
    "protobuf_varints": "no message of at most",
    "protobuf_texts": "more than 65,536 fields",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_channel_beyond_a_budget_is_refused_with_a_sentence_and_the_rest_is_read(tmp_path, name):
    reader, n_poses = read(tmp_path, made.CASES[name]())
    hostile = next(c for c in reader.candidates if c.channel.topic == "/hostile_pose")
    assert REFUSED[name] in reader.plan.why_not[hostile.channel.id]
    assert n_poses == made.N


LOST = {
    "zeros_256_mib_zstd": "unfold",
    "message_of_256_mib": "unfold",
    "empty_messages_in_use": "1,000,000 messages are left out",
    "undecodable_messages": "1,000,000 messages are left out",
}


@pytest.mark.parametrize("name", LOST)
def test_a_chunk_beyond_a_budget_is_a_counted_loss_and_the_rest_is_read(tmp_path, name):
    reader, n_poses = read(tmp_path, made.CASES[name]())
    assert any(LOST[name] in note for note in reader.losses.notes)
    assert reader.losses.n_chunks_damaged == 1
    assert n_poses == made.N


@pytest.mark.parametrize("name", ["records_of_no_type", "records_of_indexes"])
def test_records_beyond_the_budget_end_the_file_with_a_sentence(tmp_path, name):
    reader, n_poses = read(tmp_path, made.CASES[name]())
    assert any("records, which are read at most" in note for note in reader.losses.notes)
    assert reader.losses.truncated
    assert n_poses == made.N


@pytest.mark.parametrize(
    ("name", "n"), [("json_text_not_utf8", 2), ("json_key_not_utf8", 1), ("json_nested", 3)]
)
def test_text_that_is_none_is_a_counted_loss(tmp_path, name, n):
    reader, n_poses = read(tmp_path, made.CASES[name]())
    assert reader.losses.n_undecodable == n
    assert n_poses == made.N - n


@pytest.mark.parametrize("value", [1.1e12, -1e200, 1.7e308, float("inf")])
def test_numbers_that_no_robot_can_measure_are_unknown_and_said(tmp_path, value):
    reader, n_poses = read(
        tmp_path, log(*made.signals(poses={7: made.pose(7, value)}, states={9: made.joints(9, value)}))
    )
    assert n_poses == made.N - 1
    assert [remark for remark in reader.remarks if "beyond 1e+12" in remark] == [
        f"{topic}: 1 messages hold numbers beyond 1e+12, which are taken as unknown"
        for topic in ("/pose", "/wheel_torques")
    ]


def test_stamps_that_are_no_times_are_left_out_and_counted(tmp_path):
    t_ns = T0_NS + made.N * made.STEP_NS
    far = made.json_pose(1).replace(b'"sec": 17', b'"sec": 917')
    records = made.schema(7, made.POSE, "", b"") + made.channel(7, 7, "/pose", "json")
    records += b"".join(message(7, t_ns + k, made.json_pose(k)) for k in range(30)) + message(
        7, t_ns + 30, far
    )
    reader, n_poses = read(tmp_path, log(metadata("x", {}), chunk(records)))
    assert n_poses == 30
    assert "/pose: 1 messages carry no stamp and are left out" in reader.remarks


def test_a_parameter_that_makes_no_sense_is_left_aside_alone_and_said():
    record = {
        "alpha": "1e-200",
        "half_track_m": "0.5",
        "mass_kg": "heavy",
        "wheel_radius_m": "inf",
        "other": "x",
    }
    robot, findings = own_parameters(record)
    assert robot.known() == {"half_track_m": 0.5}
    assert [found.text.split(": ")[1] for found in findings] == ["alpha", "wheel_radius_m", "mass_kg"]
    assert {found.code for found in findings} == {"parameter_without_sense"}


def test_budgets_can_be_set():
    assert read_budgets("") == ReadBudgets() == BUDGETS
    assert read_budgets("most_depth=100, most_expansion=1e3") == ReadBudgets(
        most_depth=100, most_expansion=1000.0
    )
    for text in ("most_depth", "most_depth=-1", "most_depth=x", "depth=3"):
        with pytest.raises(InvalidSetting, match="depth"):
            read_budgets(text)


# Long steps ----------------------------------------


def test_usual_steps_stay_what_they_are_to_the_bit():
    seconds = np.cumsum(np.random.default_rng(0).uniform(0, FREE_S, 500))
    shortened, state = LongSteps().shorten(seconds)
    assert shortened.tobytes() == seconds.tobytes()
    assert state == LongSteps(last_s=float(seconds[-1]))


def test_long_steps_are_shortened_and_later_times_keep_their_distance():
    shortened, state = LongSteps().shorten(np.array([0.1, 1000.1, 1000.2]))
    np.testing.assert_allclose(np.diff(shortened), [LONGEST_S, 0.1])
    later, _ = state.shorten(np.array([1000.4]))
    np.testing.assert_allclose(later - shortened[-1], 0.2)


def test_long_steps_end_when_the_spare_time_is_spent_however_the_bins_are_divided():
    seconds = np.cumsum(np.full(1000, 30.0))
    shortened, _ = LongSteps().shorten(seconds)
    assert len(shortened) == int(SPARE_S // (30 - FREE_S))
    pieces, state = [], LongSteps()
    for part in np.split(seconds, 50):
        piece, state = state.shorten(part)
        pieces.append(piece)
    np.testing.assert_array_equal(np.concatenate(pieces), shortened)


# Damaged logs and fuzzing ----------------------------------------


@pytest.mark.parametrize("kind", mutations.KINDS, ids="-".join)
def test_the_intact_logs_that_are_damaged_are_read_without_a_loss(tmp_path, kind):
    reader, n_poses = read(tmp_path, mutations.intact(kind))
    assert n_poses == mutations.N
    assert not reader.losses.any()
    assert set(reader.plan.uses) == {"pose", "torque", "truth"}


@pytest.mark.parametrize("start", range(0, 192, 48))
def test_damaged_logs_give_an_answer_or_an_error_of_our_own(tmp_path, start):
    for seed in range(start, start + 48):
        damaged = mutations.damaged(seed)
        path = tmp_path / "a.mcap"
        path.write_bytes(damaged.content)
        for command in (["info", path], ["run", path, "--out", tmp_path / "out"]):
            code, text = run(command)
            assert code in {0, 3}, (seed, damaged.story, text)


@pytest.fixture(scope="module")
def compiled():
    """Compile first what every log needs, so that no input is charged with it."""
    targets.warm_up()


CORPUS = sorted(path for path in fuzz.CORPUS.iterdir() if path.is_file())


def test_the_corpus_has_inputs_for_every_target():
    assert {path.name.partition("-")[0] for path in CORPUS} == targets.TARGETS.keys()


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.name)
@pytest.mark.usefixtures("compiled")
def test_stored_inputs_of_fuzzing_find_nothing(path):
    targets.try_out(path.name.partition("-")[0], path.read_bytes())

"""Replay as a regression test: a planted change is found, unchanged results pass, empty comparisons fail."""

import json
import math
import re
import shlex
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.settings import Settings
from wmr_replay.regress.criteria import Criterion, criteria_for, read_criteria
from wmr_replay.regress.differences import compare_tables
from wmr_replay.regress.replayed import Asked, replay, stored_request
from wmr_replay.regress.results import Results, read_results, round_mantissa, write_reference
from wmr_replay.regress.tolerance import TABLES, Tolerance, Tolerances, read_tolerances
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_synth import Sensors, record, synthesise
from wmr_synth.suites import LogSpec, Suite, read_manifest, write_suite
from wmr_synth.suites.damage import DAMAGES

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
TOLERANCES = Tolerances()


@pytest.fixture(scope="module")
def stored(results, tmp_path_factory) -> Path:
    """The reference of ``log``; tests that change it copy it."""
    directory = tmp_path_factory.mktemp("references")
    write_reference(directory, "drive", results, TOLERANCES)
    return directory


@pytest.fixture
def references(stored, tmp_path) -> Path:
    return Path(shutil.copytree(stored, tmp_path / "references"))


def compare(table: str, reference: pl.DataFrame, new: pl.DataFrame):
    return compare_tables(table, reference, new, TOLERANCES.tables[table])


# --- tables ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", TABLES)
def test_no_change_passes(results, table):
    frame = results.table(table)
    same = compare(table, frame, frame.clone())
    assert same.passed
    assert same.n_values == len(frame) * sum(not TOLERANCES.of(table, c).ignore for c in frame.columns)
    assert not len(same.differences)


def planted(frame: pl.DataFrame, column: str, row: int) -> tuple[pl.DataFrame, object]:
    """``frame`` with another value in one place: the smallest change that the documentation calls one."""
    before, dtype = frame[column][row], frame.schema[column]
    if dtype == pl.Float64:
        value = 1.0 if before is None else before + 2.1e-6 * max(1.0, abs(before))
    elif dtype == pl.Boolean:
        value = not before
    elif dtype == pl.String:
        value = f"{before}?"
    elif dtype.is_integer():
        value = 1 if before is None else before + 1
    else:
        value = "gap" if before != "gap" else "ok"
    changed = frame[column].to_list()
    changed[row] = value
    return frame.with_columns(pl.Series(column, changed, dtype=dtype)), value


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_a_planted_change_of_one_column_in_one_row_fails_and_is_named(results, data):
    table = data.draw(st.sampled_from(list(TABLES)), label="table")
    frame = results.table(table)
    columns = [name for name in frame.columns if not TOLERANCES.of(table, name).ignore]
    column = data.draw(st.sampled_from(columns), label="column")
    row = data.draw(st.integers(0, len(frame) - 1), label="row")
    changed, _ = planted(frame, column, row)
    found = compare(table, frame, changed)
    assert not found.passed
    assert found.differences.select("column", "row").rows() == [(column, row)]
    assert [(c.column, c.n, c.first_row) for c in found.columns] == [(column, 1, row)]


VALUES = st.one_of(st.none(), st.floats(allow_nan=True, allow_infinity=True, width=64))


@given(st.lists(st.tuples(VALUES, VALUES), min_size=1, max_size=8), st.floats(0, 10), st.floats(0, 0.1))
@settings(max_examples=200, deadline=None)
def test_the_tolerance_is_as_documented_for_every_pair_of_values(pairs, absolute, relative):
    """Null equals null, NaN equals NaN, infinities equal themselves; else |b − a| ≤ max(abs, rel·|a|)."""

    def close(a: float | None, b: float | None) -> bool:
        if a is None or b is None:
            return a is b
        if math.isnan(a) or math.isnan(b):
            return math.isnan(a) and math.isnan(b)
        if math.isinf(a) or math.isinf(b):
            return a == b
        return a == b or abs(b - a) <= max(absolute, relative * abs(a))

    before, after = (
        pl.DataFrame({"v": pl.Series(side, dtype=pl.Float64)}) for side in zip(*pairs, strict=True)
    )
    found = compare_tables("t", before, after, {"v": Tolerance(absolute, relative)})
    expected = [row for row, (a, b) in enumerate(pairs) if not close(a, b)]
    assert found.differences["row"].to_list() == expected
    assert found.passed == (not expected)


def test_whole_numbers_are_compared_exactly_however_large():
    t_ns = 1_700_000_000_000_000_001
    before, after = pl.DataFrame({"t_ns": [t_ns]}), pl.DataFrame({"t_ns": [t_ns + 1]})
    assert not compare_tables("t", before, after, {}).passed
    assert compare_tables("t", before, after, {"t_ns": Tolerance(absolute=1.0)}).passed


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda t: t.with_columns(pl.col("alpha").cast(pl.Float32)), "column alpha is Float32, not Float64"),
        (lambda t: t.drop("alpha"), "column alpha is gone"),
        (lambda t: t.with_columns(beta=pl.lit(1.0)), "column beta is new"),
        (lambda t: t.select(reversed(t.columns)), "the columns are in another order"),
        (lambda t: t[:-1], "rows, not"),
        (lambda t: pl.concat([t, t[-1:]]), "rows, not"),
    ],
)
def test_types_and_counts_come_first(results, change, problem):
    changed = change(results.samples).with_columns(x_m=pl.lit(0.0))  # a difference of values, unsaid
    if "order" in problem:
        changed = changed.select(reversed(results.samples.columns))
    (said,) = compare("samples", results.samples, changed).problems
    assert problem in said


def test_nothing_compared_is_a_failure(results):
    for frame in (results.samples[:0], results.samples.select("alpha")):
        ignored = {"alpha": Tolerance(ignore=True)} if frame.width == 1 else {}
        nothing = compare_tables("samples", frame, frame, ignored)
        assert not nothing.passed
        assert nothing.problems == ("nothing was compared",)


def test_some_rows_of_a_column_may_differ_when_the_tolerance_says_so(results):
    mode = results.samples["mode"].to_list()
    mode[40], mode[70] = 3, 3
    changed = results.samples.with_columns(pl.Series("mode", mode, dtype=pl.Int8))
    for rows, passed in ((1, False), (2, True)):
        tolerances = TOLERANCES.tables["samples"] | {"mode": Tolerance(rows=rows)}
        assert compare_tables("samples", results.samples, changed, tolerances).passed is passed


def test_the_references_own_tolerances_stand_above_the_defaults(tmp_path):
    (tmp_path / "tolerances.toml").write_text(
        "[samples.alpha]\nabs = 0.5\n[samples.mode]\nrows = 3\n[summary.verdict]\nignore = true\n"
    )
    tolerances = read_tolerances(tmp_path)
    assert tolerances.of("samples", "alpha") == Tolerance(0.5, TOLERANCES.of("samples", "alpha").relative)
    assert tolerances.of("samples", "mode").rows == 3
    assert tolerances.of("summary", "verdict").ignore
    assert tolerances.of("samples", "x_m") == TOLERANCES.of("samples", "x_m")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[sample.alpha]\nabs = 1", "sample: unknown key; known are samples, segments, summary"),
        ("[samples.beta]\nabs = 1", "[samples] beta: unknown key"),
        ("[samples.alpha]\nabsolute = 1", "[samples.alpha] absolute: unknown key; known are abs, rel"),
        ("[samples.alpha]\nrel = -1", "[samples.alpha] rel: expected a number not below 0"),
        ("[samples.alpha]\nignore = 1", "expected true or false"),
    ],
)
def test_wrong_tolerances_are_refused_with_the_place(tmp_path, text, message):
    (tmp_path / "tolerances.toml").write_text(text)
    with pytest.raises(InvalidFile, match=re.escape(message)):
        read_tolerances(tmp_path)


# --- references --------------------------------------------------------------------------------------------


@given(hnp.arrays(np.float64, st.integers(1, 30), elements=st.floats(allow_nan=True, allow_infinity=True)))
@settings(max_examples=100, deadline=None)
def test_rounding_moves_a_number_by_less_than_4e_8_of_it(values):
    values = np.where(np.abs(values) < 1e300, values, np.inf)
    kept = round_mantissa(pl.Series(values)).to_numpy()
    finite = np.isfinite(values) & (np.abs(values) > 1e-300)
    assert np.all(np.abs(kept[finite] - values[finite]) <= 4e-8 * np.abs(values[finite]))
    assert np.array_equal(kept[np.isnan(values)], values[np.isnan(values)], equal_nan=True)
    assert np.all(np.isinf(kept) == np.isinf(values))


def test_a_stored_reference_passes_and_is_half_the_size(log, results, stored, tmp_path):
    back = read_results(stored, "drive")
    for table in TABLES:
        assert compare(table, back.table(table), results.table(table)).passed
    full = run_log(log, tmp_path, timeline=False).files["samples"]
    assert (stored / "drive.samples.parquet").stat().st_size < 0.6 * full.stat().st_size


def test_a_column_with_a_tight_tolerance_is_stored_exactly(results, tmp_path):
    (tmp_path / "tolerances.toml").write_text("[samples.a_long_mps2]\nrel = 1e-12\nabs = 0\n")
    write_reference(tmp_path, "drive", results, read_tolerances(tmp_path))
    back = read_results(tmp_path, "drive").samples
    assert back["a_long_mps2"].equals(results.samples["a_long_mps2"])
    assert not back["v_long_mps"].equals(results.samples["v_long_mps"])


def test_a_reference_without_samples_is_not_stored(results, tmp_path):
    empty = Results(results.samples[:0], results.segments, results.summary)
    with pytest.raises(InvalidSetting, match="would let everything pass"):
        write_reference(tmp_path, "drive", empty, TOLERANCES)


def test_a_replay_is_asked_for_what_the_stored_result_was_asked_for(log, tmp_path):
    """Settings, mapping and model travel in ``summary.settings``, and give the same tables again."""
    robot = RobotParameters(alpha=0.02, half_track_m=1.0, wheel_radius_m=0.35)
    asked = Asked(
        Settings(identifier="paper", window_s=0.9, threshold_sd=2.5),
        LogMapping(pose_topic="/pose", robot=robot),
        None,
        Model(effects=(Effect("payload", {"mass_ratio": 0.25}),)),
    )
    first = replay(log, asked)
    again = stored_request(first, tmp_path)
    assert again.settings == asked.settings
    assert again.mapping == asked.mapping
    assert again.model == asked.model
    second = replay(log, again)
    for table in TABLES:
        assert compare_tables(table, first.table(table), second.table(table), {}).passed, table


# --- criteria ----------------------------------------------------------------------------------------------


def test_the_last_pattern_that_matches_a_log_decides(tmp_path):
    path = tmp_path / "criteria.toml"
    path.write_text(
        'accuracy = ">= .93"\nn_gaps = ["> 0", "<= 1e1"]\n'
        '[logs."noise-*"]\naccuracy = ">= .8"\n[logs.noise-3]\naccuracy = ">.5"\n'
    )
    criteria = read_criteria(path)
    assert {str(c) for c in criteria_for("drive", criteria)} == {
        "accuracy >= 0.93",
        "n_gaps > 0",
        "n_gaps <= 10",
    }
    assert {str(c) for c in criteria_for("noise-1", criteria) if c.column == "accuracy"} == {
        "accuracy >= 0.8"
    }
    assert {str(c) for c in criteria_for("noise-3", criteria) if c.column == "accuracy"} == {"accuracy > 0.5"}


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_a_criterion_says_what_its_signs_say(value, bound):
    expected = {">=": value >= bound, ">": value > bound, "<=": value <= bound, "<": value < bound}
    expected |= {"==": value == bound, "!=": value != bound}
    for comparison, holds in expected.items():
        assert Criterion("accuracy", comparison, bound).holds(value) is holds
        assert not Criterion("accuracy", comparison, bound).holds(None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('acuracy = ">= .9"', "acuracy: is no number of the summary; these are: duration_s"),
        ('verdict = ">= .9"', "verdict: is no number of the summary"),
        ("accuracy = 0.9", "accuracy: expected a comparison and a number"),
        ('accuracy = "=> .9"', "accuracy: expected a comparison and a number"),
        ('[logs.x]\naccuracy = "high"', '[logs."x"] accuracy: expected a comparison and a number'),
        ("", "holds no criterion"),
    ],
)
def test_wrong_criteria_are_usage_errors_that_name_the_key(command, log, tmp_path, text, message):
    (tmp_path / "criteria.toml").write_text(text)
    assert message in command("check", "--criteria", tmp_path / "criteria.toml", log, code=2).stderr


# --- the command -------------------------------------------------------------------------------------------


def plant(references: Path, column: str, row: int) -> None:
    path = references / "drive.samples.parquet"
    changed, _ = planted(pl.read_parquet(path), column, row)
    changed.write_parquet(path)


def test_a_planted_change_fails_is_reported_everywhere_and_can_be_accepted(
    command, log, references, tmp_path
):
    plant(references, "c_d_mps2", 200)
    before = {path: path.read_bytes() for path in references.iterdir()}
    files = ("--diff", tmp_path / "diff.parquet", "--junit", tmp_path / "report.xml")
    done = command("check", references, log, *files, code=1)
    assert "drive: DIFFERS" in done.stdout
    assert "samples: c_d_mps2: 1 of 601 values, first in row 200" in done.stdout
    assert "0 of 1 logs passed" in done.stdout
    assert {path: path.read_bytes() for path in references.iterdir()} == before
    (row,) = pl.read_parquet(tmp_path / "diff.parquet").iter_rows(named=True)
    assert (row["log"], row["table"], row["column"], row["row"]) == ("drive", "samples", "c_d_mps2", 200)
    assert row["t_s"] == pytest.approx(4.0)
    assert float(row["new"]) - float(row["reference"]) == pytest.approx(row["difference"])

    accept = done.stdout.splitlines()[-1].strip()
    suite = ET.parse(tmp_path / "report.xml").getroot().find("testsuite")
    assert {case.get("name"): len(case) for case in suite} == {"samples": 1, "segments": 0, "summary": 0}
    assert accept in suite.find("testcase/failure").text
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("3", "1", "0")

    program, *arguments = shlex.split(accept)
    assert program == "wmr-replay"
    assert "stored as the new reference" in command(*arguments).stdout
    assert "drive: same" in command("check", references, log).stdout


def test_no_change_passes_and_an_update_then_touches_nothing(command, log, references):
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in references.iterdir()}
    assert "drive: same (601 samples" in command("check", references, log).stdout
    command("check", references, log, "--update")
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in references.iterdir()} == before


def test_the_outcome_as_json(command, log, references):
    plant(references, "alpha", 300)
    outcome = json.loads(command("check", references, log, "--json", code=1).stdout)
    assert outcome["passed"] is False
    (found,) = outcome["logs"]
    assert found["tables"]["samples"]["columns"][0]["column"] == "alpha"
    assert found["tables"]["segments"] == {
        "passed": True, "problems": [], "columns": [], "rows": found["tables"]["segments"]["rows"],
        "values": found["tables"]["segments"]["values"],
    }  # fmt: skip
    assert shlex.split(outcome["accept"])[-1] == "--update"


def test_other_settings_are_another_answer_and_the_accepting_command_repeats_them(command, log, references):
    done = command("check", references, log, "--window", "0.9", "--diff", references / "diff.txt", code=1)
    assert "delay_s" in (references / "diff.txt").read_text()
    accept = shlex.split(done.stdout.splitlines()[-1])
    assert accept[-2:] == ["--window", "0.9"]
    command(*accept[1:])
    assert "drive: same" in command("check", references, log).stdout
    assert json.loads(read_results(references, "drive").summary["settings"][0])["window_s"] == 0.9


def test_a_thinned_reference_is_smaller_compares_its_rows_and_stays_thin(command, log, tmp_path, stored):
    references = tmp_path / "thin"
    command("check", references, log, "--update", "--every", 4)
    sizes = [(d / "drive.samples.parquet").stat().st_size for d in (references, stored)]
    assert sizes[0] < 0.5 * sizes[1]
    assert "drive: same (151 samples" in command("check", references, log).stdout
    plant(references, "v_long_mps", 100)
    assert "v_long_mps: 1 of 151 values" in command("check", references, log, code=1).stdout
    command("check", references, log, "--update")
    assert len(read_results(references, "drive").samples) == 151


def test_what_lacks_its_counterpart_is_said(command, log, references, tmp_path):
    other = Path(shutil.copy(log, tmp_path / "other.mcap"))
    done = command("check", references, other, "--junit", tmp_path / "report.xml", code=1)
    assert "other: FAILED: it has no reference" in done.stdout
    assert "drive: not checked, its log was not given" in done.stdout
    suite = ET.parse(tmp_path / "report.xml").getroot().find("testsuite")
    assert [(case.get("classname"), case[0].tag) for case in suite] == [
        ("other", "failure"),
        ("drive", "skipped"),
    ]
    assert shlex.split(done.stdout.splitlines()[-1])[1:] == ["check", str(references), str(other), "--update"]


def test_criteria_decide_with_and_without_references(command, log, references, tmp_path):
    criteria = tmp_path / "criteria.toml"
    criteria.write_text('accuracy = ">= .5"\n')
    assert "met: accuracy >= 0.5" in command("check", "--criteria", criteria, log).stdout
    assert "drive: same" in command("check", references, log, "--criteria", criteria).stdout
    criteria.write_text('accuracy = ">= .5"\np95_detection_delay_s = "< 0"\n')
    assert (
        "NOT MET: p95_detection_delay_s < 0"
        in command("check", references, log, "--criteria", criteria, code=1).stdout
    )
    criteria.write_text('[logs.elsewhere]\naccuracy = ">= .5"\n')
    assert "no criterion applies" in command("check", "--criteria", criteria, log, code=1).stdout


def test_an_unknown_value_meets_no_criterion(command, tmp_path):
    blind = tmp_path / "blind.mcap"
    record(synthesise("random", seed=5, duration_s=4, sensors=SENSORS), blind, truth=False)
    (tmp_path / "criteria.toml").write_text('accuracy = ">= 0"\n')
    done = command("check", "--criteria", tmp_path / "criteria.toml", blind, code=1)
    assert "NOT MET: accuracy >= 0 (is unknown)" in done.stdout


def test_a_log_beyond_use_fails_with_its_own_code_and_does_not_stop_the_rest(
    command, log, references, tmp_path
):
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"")
    done = command("check", references, bad, log, "--junit", tmp_path / "report.xml", code=3)
    assert "bad: FAILED" in done.stdout
    assert "drive: same" in done.stdout
    assert "--update" not in done.stdout
    assert ET.parse(tmp_path / "report.xml").getroot().find("testsuite").get("errors") == "1"
    plant(references, "alpha", 300)
    command("check", references, bad, log, code=1)


def test_wrong_usage_says_what_is_right(command, log, references, tmp_path):
    (tmp_path / "none").mkdir()
    assert "which logs?" in command("check", code=2).stderr
    assert "taken for the directory of the references" in command("check", references, code=2).stderr
    assert "is no directory of references" in command("check", log, log, code=2).stderr
    assert "there is no such directory" in command("check", tmp_path / "no", log, code=2).stderr
    assert "holds no log" in command("check", references, tmp_path / "none", code=2).stderr
    assert "two logs are called drive" in command("check", references, log, log, code=2).stderr
    broken = references / "drive.segments.parquet"
    broken.write_bytes(b"x")
    assert f"{broken}: cannot be read as Parquet" in command("check", references, log, code=2).stderr


# --- damaged logs ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def damaged(tmp_path_factory) -> Path:
    directory = tmp_path_factory.mktemp("damaged")
    parameters = {"duration_s": 20.0, "chunk_bytes": 65_536}
    logs = [LogSpec(name, "stop-and-go", 1, parameters, name) for name in DAMAGES]
    write_suite(Suite("damaged", 1, "", tuple(logs)), directory)
    return directory


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_log_gives_what_the_manifest_says(damaged, tmp_path, name):
    entries = json.loads((damaged / "manifest.json").read_text())["logs"]
    assert read_manifest(damaged).suite.logs[0].damage == "none"
    expected = next(entry["expected"] for entry in entries if entry["name"] == name)
    for strict, key in ((False, "exit_code"), (True, "exit_code_strict")):
        found = outcome(damaged / f"{name}.mcap", tmp_path / key, strict)
        assert (found is None) == (expected[key] == 3)
    summary = outcome(damaged / f"{name}.mcap", tmp_path / "again", strict=False)
    for column, value in expected["summary"].items():
        if isinstance(value, str):
            assert summary[column] >= float(value.removeprefix(">= "))
        else:
            assert summary[column] == value


def outcome(log: Path, directory: Path, strict: bool) -> dict | None:
    """The summary; None where the log is refused."""
    from wmr_schemas.errors import LogUnusable

    try:
        return run_log(log, directory, timeline=False, strict=strict).summary
    except LogUnusable:
        return None


def test_processes_give_what_one_after_another_gives(tmp_path, command, command_line):
    for seed in (1, 2):
        log = tmp_path / "logs" / f"drive{seed}.mcap"
        log.parent.mkdir(exist_ok=True)
        command("synth", "patrol", "--duration", 4, "--rate", 50, "--seed", seed, "--out", log)
    options = ("--identifier", "paper", "--no-hindsight", "--jobs", 2)
    refs, logs = tmp_path / "refs", tmp_path / "logs"
    assert "2 of 2 logs passed" in command("check", refs, logs, "--update", *options).stdout
    required = ("--require", "n_pose >= 2", "--require", "share_undecided>1")
    (logs / "drive3.mcap").write_bytes(b"no log")
    one, two = (
        command_line("check", refs, logs, *required, *options[:3], *jobs) for jobs in ((), ("--jobs", 2))
    )
    assert one == two
    assert one.code == 1
    assert "share_undecided > 1" in one.stdout
    assert "drive3" in one.stdout


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("acuracy >= .9", "did you mean accuracy or accuracy_decided?"),
        ("accuracy", "expected a comparison"),
        ("accuracy >= much", "expected a comparison and a number"),
    ],
)
def test_a_requirement_with_a_mistake_is_named(command_line, tmp_path, text, said):
    (tmp_path / "a.mcap").write_bytes(b"")
    done = command_line("check", "--require", text, tmp_path / "a.mcap")
    assert done.code == 2
    assert said in done.stderr

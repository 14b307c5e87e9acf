"""Comparison of two results: the differences, their size, and both results in one recording."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from rerun.chunk import RrdReader

from wmr_replay.api.compare import Comparison
from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.settings import Settings
from wmr_replay.regress.replayed import Asked, replay
from wmr_replay.regress.results import Results
from wmr_replay.regress.sides import compare_sides


def test_planted_differences_are_measured(results):
    """The largest and the rms difference of a column, the share of another mode, the summary's delta."""
    rng, n = np.random.default_rng(1), len(results.samples)
    shift = rng.normal(0, 0.1, n)
    mode = results.samples["mode"].to_numpy().copy()
    mode[100:130] = 3
    samples = results.samples.with_columns(x_m=pl.col("x_m") + pl.Series(shift), mode=pl.Series(mode))
    summary = results.summary.with_columns(n_gaps=pl.col("n_gaps") + 2)
    found = compare_sides(results, Results(samples, results.segments, summary))
    assert found.other_mode_share == pytest.approx(30 / n)
    assert found.other_mode["differs"].arg_true().to_list() == list(range(100, 130))
    row = {r["column"]: r for r in found.columns.iter_rows(named=True)}
    assert row["x_m"]["rms"] == pytest.approx(np.sqrt(np.mean(shift**2)))
    assert abs(row["x_m"]["max"]) == pytest.approx(np.abs(shift).max())
    assert row["x_m"]["at_s"] == results.samples["t_s"][int(np.abs(shift).argmax())]
    assert {r["column"] for r in row.values() if r["rms"] > 0} == {"x_m"}
    assert found.summary.rows() == [("n_gaps", 0.0, 2.0, 2.0)]


def test_logs_of_other_days_are_matched_by_the_time_since_their_start(results):
    later = results.samples.with_columns(pl.col("t_ns") + 86_400_000_000_000 + 3, pl.col("t_s") + 3e-9)
    found = compare_sides(results, Results(later, results.segments, results.summary))
    assert not found.by_stamp
    assert found.n_common == len(results.samples)
    assert found.other_mode_share == 0.0
    away = later.with_columns(pl.col("t_s") + 1e4)
    assert compare_sides(results, Results(away, results.segments, results.summary)).other_mode_share is None


def test_two_drives_are_told_from_one_that_was_repeated(results):
    """Positions that stay together belong to one drive; 5 m of some 20 m apart they do not."""
    repeated = results.samples.with_columns(pl.col("x_m", "y_m") + 0.02)
    assert compare_sides(results, Results(repeated, results.segments, results.summary)).unrelated is None
    other = results.samples.with_columns(pl.col("x_m") + 1e3)
    found = compare_sides(results, Results(other, results.segments, results.summary))
    assert found.unrelated.startswith("in the median their positions are 1e+03 m apart")
    assert found.as_dict()["unrelated"] == found.unrelated
    lines = Comparison(
        "drive", "one", "other", (results, Results(other, results.segments, results.summary))
    ).lines()
    assert any(line.startswith("warning: a and b look like two different drives") for line in lines)
    away = results.samples.with_columns(pl.col("t_ns") + 3, pl.col("t_s") + 1e4)
    assert (
        "no time in common"
        in compare_sides(results, Results(away, results.segments, results.summary)).unrelated
    )


def test_one_log_with_two_settings(command, log, tmp_path):
    done = command("compare", log, "--set-b", "identifier=paper", "--out", tmp_path)
    document = json.loads((tmp_path / "drive.compare.json").read_text())
    one, other = (replay(log, Asked(Settings(identifier=name))) for name in ("bank", "paper"))
    share = float((one.samples["mode"] != other.samples["mode"]).mean())
    assert 0 < share < 1
    assert document["other_mode_share"] == pytest.approx(share)
    deltas = {row["field"]: row["delta"] for row in document["summary"]}
    assert deltas["accuracy"] == pytest.approx(other.summary["accuracy"][0] - one.summary["accuracy"][0])
    assert f"another mode in {share:.2%}" in done.stdout
    assert "drive.compare.rrd" in done.stdout
    store = RrdReader(tmp_path / "drive.compare.rrd").recordings()
    assert len(store) == 1


def test_both_timelines_lie_in_one_recording(command, log, tmp_path):
    command("compare", log, "--set-b", "window_s=.9", "--out", tmp_path)
    (recording,) = RrdReader(tmp_path / "drive.compare.rrd").recordings()
    entities = {str(chunk.entity_path) for chunk in RrdReader(tmp_path / "drive.compare.rrd").stream()}
    for folder in ("/mode", "/status", "/both/v_long_mps", "/both/alpha", "/path"):
        assert {f"{folder}/a", f"{folder}/b"} <= entities
    assert {"/mode/differs", "/difference/v_long_mps", "/difference/position_m", "/description"} <= entities
    assert recording is not None


def test_a_result_does_not_differ_from_itself(command, log, tmp_path):
    for name in ("one", "two"):
        run_log(log, tmp_path / name, timeline=False)
    done = command("compare", tmp_path / "one", tmp_path / "two", "--out", tmp_path / "out", "--no-rrd")
    assert "another mode in 0.00% of them" in done.stdout
    assert "no difference" in done.stdout
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["drive.compare.json"]


def test_directories_of_results_are_paired_by_name(command, log, tmp_path):
    for name, stems in (("one", ("x", "y")), ("two", ("y", "z"))):
        for stem in stems:
            copy = tmp_path / f"{stem}.mcap"
            copy.write_bytes(log.read_bytes())
            run_log(copy, tmp_path / name, timeline=False)
    done = command(
        "compare", tmp_path / "one", tmp_path / "two", "--out", tmp_path / "out", "--no-rrd", "--json"
    )
    assert [Path(pair["a"]).name for pair in json.loads(done.stdout)] == ["y"]
    assert done.stderr.splitlines() == ["x: only on one side", "z: only on one side"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("{log}",), "compare with what?"),
        (("{log}", "--set-b", "identifer=paper"), "is no NAME=VALUE of a setting; the settings are window_s"),
        (("{log}", "--set-b", "identifier=best"), "no identifier 'best'"),
        (("{results}", "--set-b", "degree=3"), "holds results; settings are for logs"),
    ],
)
def test_wrong_usage_says_what_is_right(command, log, tmp_path_factory, tmp_path, arguments, message):
    results = tmp_path_factory.getbasetemp() / "compared"
    run_log(log, results, timeline=False)
    given = [text.format(log=log, results=results) for text in arguments]
    done = command("compare", *given, "--out", tmp_path / "out", code=2)
    assert message in done.stderr
    assert not list(tmp_path.rglob("*.json"))

"""Tables as users read them: modes by name, segments in seconds, and tables from before these existed."""

import polars as pl
import pytest

from wmr_replay.regress.check import compare_results
from wmr_replay.regress.results import read_results, table_path, write_reference
from wmr_replay.regress.tolerance import Tolerances
from wmr_replay.tables import MODE_DTYPE, with_names, with_seconds
from wmr_schemas.tables import SEGMENTS, polars_schema

SECONDS = ["start_s", "end_s"]


def numbered():
    return pl.DataFrame(
        {"t_ns": [1, 2, 3, 4], "mode": [-1, 0, 3, 1], "mode_true": [None, 0, 2, 1]},
        schema={"t_ns": pl.Int64, "mode": pl.Int8, "mode_true": pl.Int8},
    )


@pytest.mark.parametrize("lazy", [False, True])
def test_modes_are_shown_by_name_and_everything_else_stays(lazy):
    named = with_names(numbered().lazy()).collect() if lazy else with_names(numbered())
    assert named["mode"].to_list() == ["undecided", "ideal", "skidding_slipping", "skidding"]
    assert named["mode_true"].to_list() == [None, "ideal", "slipping", "skidding"]
    assert named.schema == {"t_ns": pl.Int64, "mode": MODE_DTYPE, "mode_true": MODE_DTYPE}


def test_names_are_given_once_and_only_where_there_are_modes():
    assert with_names(with_names(numbered())).equals(with_names(numbered()))
    assert with_names(numbered().drop("mode", "mode_true")).columns == ["t_ns"]


def test_a_number_that_is_no_mode_is_refused():
    with pytest.raises(pl.exceptions.PolarsError):
        with_names(pl.DataFrame({"mode": pl.Series([7], dtype=pl.Int8)}))


def test_a_replays_segments_stand_in_seconds_of_the_samples_clock(results):
    segments, samples = results.segments, results.samples
    assert segments.schema == polars_schema(SEGMENTS)
    clock = dict(samples.select("t_ns", "t_s").iter_rows())
    assert segments["start_s"].to_list() == [clock[t_ns] for t_ns in segments["start_ns"]]
    assert segments["end_s"].to_list() == [clock[t_ns] for t_ns in segments["end_ns"]]
    duration_s = (segments["end_s"] - segments["start_s"]).to_list()
    assert duration_s == pytest.approx(segments["duration_s"].to_list())


def test_results_from_before_the_seconds_are_read_and_compare_equal(results, tmp_path):
    write_reference(tmp_path, "drive", results, Tolerances(), every=7)
    path = table_path(tmp_path, "drive", "segments")
    pl.read_parquet(path).drop(SECONDS).write_parquet(path)
    older = read_results(tmp_path, "drive")
    assert older.segments.equals(results.segments)
    assert all(table.passed for table in compare_results(older, results, Tolerances()))


def test_segments_that_have_their_seconds_keep_them(results):
    assert with_seconds(results.segments) is results.segments

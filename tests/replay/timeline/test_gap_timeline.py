"""The Rerun recording of a gap analysis: its content. The result is made up."""

import numpy as np
import pytest
from rerun.chunk import RrdReader

from wmr_replay.timeline.gap.path import cut
from wmr_replay.timeline.gap.text import gap_text
from wmr_replay.timeline.gap.writer import write_gap_timeline


@pytest.fixture(scope="module")
def recording(made_up_gap, tmp_path_factory):
    path = tmp_path_factory.mktemp("gap") / "drive.gap.rrd"
    write_gap_timeline(path, made_up_gap.gap_result(), "drive.mcap", "drive")
    return path


@pytest.fixture(scope="module")
def rows(recording):
    """Temporal rows by entity."""
    return rows_of(recording)


def rows_of(recording):
    found = {}
    for chunk in RrdReader(recording).stream():
        if not chunk.is_static:
            n_rows = chunk.to_record_batch().num_rows
            found[chunk.entity_path] = found.get(chunk.entity_path, 0) + n_rows
    return found


def test_every_part_of_the_answer_is_there(rows):
    models = ("base", "extended")
    expected = {"/mode", "/part", "/path/measured", "/path/held_out", "/path/regions", "/path/robot"}
    expected |= {f"/path/{model}" for model in models}
    expected |= {f"/residual/{c}/{m}" for c in ("longitudinal", "lateral", "yaw") for m in models}
    expected |= {f"/gap/{kind}/{model}" for kind in ("position", "yaw") for model in models}
    assert expected <= set(rows)


def test_lanes_change_where_the_traces_do(made_up_gap, rows):
    traces = made_up_gap.traces()
    for entity, track in (("/mode", traces.mode), ("/part", traces.held_out)):
        assert rows[entity] == 1 + np.count_nonzero(np.diff(track))


def test_simulated_windows_neither_join_nor_overlap(made_up_gap, rows):
    traces = made_up_gap.traces()
    windows = cut(traces)
    assert rows["/path/base"] == rows["/path/extended"] == len(windows)
    covered = np.concatenate([np.arange(a, b) for a, b in windows])
    np.testing.assert_array_equal(covered, np.flatnonzero(np.isfinite(traces.base_path[:, 0])))
    for a, b in windows:
        assert traces.t_s[b - 1] - traces.t_s[a] < 4.0
        assert len(set(traces.held_out[a:b])) == 1


def test_a_result_without_effects_or_regions_is_drawn_too(made_up_gap, tmp_path, rows):
    path = tmp_path / "drive.gap.rrd"
    bare = made_up_gap.gap_result(verdict="nothing_missing", effects=(), where=made_up_gap.Where())
    write_gap_timeline(path, bare, "drive.mcap", "drive")
    bare_rows = rows_of(path)
    assert "/path/regions" not in bare_rows
    assert {"/mode", "/path/measured", "/path/base", "/path/extended", "/gap/position/base"} <= set(bare_rows)
    assert bare_rows["/path/base"] == rows["/path/base"]


def test_the_text_holds_verdict_effects_and_gaps(made_up_gap):
    text = gap_text(made_up_gap.gap_result(), "drive.mcap")
    assert "**The base model lacks viscous_drag" in text
    assert "| viscous_drag | c1_per_s = 0.203 1/s | 0.196 … 0.21 |" in text
    assert "| position | 24 mm | 5.2 mm | 4.9 mm |" in text
    assert "| yaw | 2.4 mrad | 0.52 mrad | 0.49 mrad |" in text

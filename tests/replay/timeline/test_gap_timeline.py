"""The Rerun recording of a gap analysis: its content. The result is made up."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from rerun.chunk import RrdReader

from wmr_replay.timeline import colours
from wmr_replay.timeline.gap.path import Errors, add_key, cut
from wmr_replay.timeline.gap.speed import speed
from wmr_replay.timeline.gap.text import gap_text
from wmr_replay.timeline.gap.writer import write_gap_timeline
from wmr_replay.timeline.path import SMALL_VIEW, Frame
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_schemas.findings import Severity, finding


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


@pytest.fixture(scope="module")
def static(recording):
    """What does not change with time, by entity and component."""
    return static_of(recording)


def static_of(recording):
    found = {}
    for chunk in RrdReader(recording).stream():
        if chunk.is_static:
            batch = chunk.to_record_batch()
            columns = {name: batch.column(name).to_pylist()[-1] for name in batch.schema.names}
            found.setdefault(chunk.entity_path, {}).update(columns)
    return found


def test_every_part_of_the_answer_is_there(rows, static):
    models = ("base", "extended")
    expected = {"/mode", "/part", "/path/robot", "/speed/actual"}
    expected |= {f"/residual/{c}/{m}" for c in ("longitudinal", "lateral", "yaw") for m in models}
    expected |= {f"/{kind}/{model}" for kind in ("gap/position", "gap/yaw", "speed") for model in models}
    assert expected <= set(rows)
    paths = {f"/path/{model}/{part}" for model in models for part in ("error", "vectors")}
    assert paths | {"/path/held_out", "/path/regions", "/path/key", "/how_to_read"} <= set(static)


def test_the_held_out_part_lies_beneath_the_paths_at_any_time(static):
    """Whole and in one order: what was drawn at a stamp once lay above what had been drawn before."""
    (beneath,), (above,) = (
        static[entity]["LineStrips2D:draw_order"] for entity in ("/path/held_out", "/path/base/error")
    )
    assert beneath < above


def test_the_path_is_cut_and_coloured_by_the_error(made_up_gap, static):
    traces = made_up_gap.traces()
    drawn = static["/path/base/error"]
    strips = [np.array(strip) for strip in drawn["LineStrips2D:strips"]]
    for before, after in pairwise(strips):
        np.testing.assert_array_equal(before[-1], after[0])
    sizes = np.hypot(*(traces.base_path - traces.measured)[:, :2].T)
    colour_of = {tuple(np.float32(xy)): colour for xy, colour in each_point(strips, drawn)}
    shades = [colour_of[tuple(np.float32(xy))] for xy in traces.measured[:-1, :2]]
    assert len(shades) == len(traces.t_s) - 1
    known = np.isfinite(sizes[:-1])
    small, large = shades[np.nanargmin(sizes)], shades[np.nanargmax(sizes[:-1])]
    assert (small, large) == (rgba(colours.ERRORS[0]), rgba(colours.ERRORS[-1]))
    assert {shade for shade, is_known in zip(shades, known, strict=True) if not is_known} == {
        rgba(colours.NOT_SIMULATED)
    }


def each_point(strips, drawn):
    """Points with the colour of the step that begins there."""
    for strip, colour in zip(strips, drawn["LineStrips2D:colors"], strict=True):
        yield from ((xy, colour) for xy in strip[:-1])


def rgba(colour):
    red, green, blue = colour
    return (red << 24) | (green << 16) | (blue << 8) | 255


def test_vectors_are_the_error_times_the_stated_factor(made_up_gap, static):
    traces = made_up_gap.traces()
    text = static["/how_to_read"]["TextDocument:text"][0]
    factor = float(re.search(r"magnified ([\d.e+]+) times", text.replace("\n", " ")).group(1))
    assert factor > 1
    drawn = static["/path/base/vectors"]
    origins, vectors = (np.array(drawn[f"Arrows2D:{name}"]) for name in ("origins", "vectors"))
    assert len(origins) > 5
    for origin, vector in zip(origins, vectors, strict=True):
        row = np.argmin(np.hypot(*(traces.measured[:, :2] - origin).T))
        error = (traces.base_path - traces.measured)[row, :2]
        np.testing.assert_allclose(vector, factor * error, rtol=1e-4)


def test_speed_is_that_of_the_path():
    """A circle of 2 m at 0.3 rad/s, backwards: chords of 0.4 s are shorter by a thousandth."""
    t_s = np.arange(0, 20, 0.04)
    angle = 0.3 * t_s
    pose = np.stack([2 * np.cos(angle), 2 * np.sin(angle), angle + np.pi / 2 + np.pi], axis=1)
    found = speed(t_s, pose, [(0, 250), (250, 500)])
    edges = np.concatenate([np.arange(5), np.arange(245, 255), np.arange(495, 500)])
    assert np.isnan(found[edges]).all()
    np.testing.assert_allclose(np.delete(found, edges), -0.6, rtol=2e-3)


def test_lanes_change_where_the_traces_do(made_up_gap, rows):
    traces = made_up_gap.traces()
    for entity, track in (("/mode", traces.mode), ("/part", traces.held_out)):
        assert rows[entity] == 1 + np.count_nonzero(np.diff(track))


def test_simulated_windows_neither_join_nor_overlap(made_up_gap):
    traces = made_up_gap.traces()
    windows = cut(traces)
    covered = np.concatenate([np.arange(a, b) for a, b in windows])
    np.testing.assert_array_equal(covered, np.flatnonzero(np.isfinite(traces.base_path[:, 0])))
    for a, b in windows:
        assert traces.t_s[b - 1] - traces.t_s[a] < 4.0
        assert len(set(traces.held_out[a:b])) == 1


def test_of_a_model_that_lacks_nothing_no_extended_one_is_drawn(made_up_gap, tmp_path):
    path = tmp_path / "drive.gap.rrd"
    bare = made_up_gap.gap_result(verdict="nothing_missing", effects=(), where=made_up_gap.Where())
    write_gap_timeline(path, bare, "drive.mcap", "drive")
    entities = {*rows_of(path), *static_of(path)}
    assert "/path/regions" not in entities
    assert not [entity for entity in entities if entity.endswith("extended") or "/extended/" in entity]
    assert {"/mode", "/path/base/error", "/gap/position/base"} <= entities


def test_findings_on_the_data_are_there(made_up_gap, tmp_path):
    path = tmp_path / "drive.gap.rrd"
    found = finding("coloured_noise", Severity.WARNING, "a correlation time of .3 s").as_dict()
    write_gap_timeline(path, made_up_gap.gap_result(), "drive.mcap", "drive", [found])
    assert rows_of(path)["/findings"] == 1


def test_the_text_holds_verdict_effects_and_gaps(made_up_gap):
    text = gap_text(made_up_gap.gap_result(), "drive.mcap")
    assert text.startswith("**The base model lacks viscous_drag")
    assert "| viscous_drag | c1_per_s = 0.203 1/s | 0.196 … 0.21 |" in text
    assert "| position | 24 mm | 5.2 mm | 4.9 mm |" in text
    found = finding("coloured_noise", Severity.WARNING, "a correlation time of .3 s").as_dict()
    assert "- **coloured_noise** (warning): a" in gap_text(made_up_gap.gap_result(), "drive.mcap", [found])
    assert "| yaw | 2.4 mrad | 0.52 mrad | 0.49 mrad |" in text


def test_by_wheel_speeds_no_lane_tells_a_mode(made_up_gap, tmp_path):
    path = tmp_path / "wheels.gap.rrd"
    result = replace(made_up_gap.gap_result(), base_model="wheel_speed")
    write_gap_timeline(path, result, "drive.mcap", "wheels")
    assert "/mode" not in rows_of(path)
    assert "/part" in rows_of(path)


@pytest.mark.parametrize("corner", [(2.0, 20.0), (20.0, 2.0)])
def test_the_words_of_the_key_stand_apart_above_narrow_and_wide_paths(corner, tmp_path):
    """By half of the height, which a view that is twice as wide as high shows in any case."""
    frame = Frame(SMALL_VIEW)
    frame.include(np.array([[0.0, 0.0], corner]))
    (left, bottom), (right, top) = frame.with_margin()
    sink = Sink(recording_into(tmp_path / "key.rrd", "key"))
    add_key(sink, frame, Errors({}, 0.1, 1.0, 0.01))
    sink.close()
    x_m = [point[0] for point in static_of(tmp_path / "key.rrd")["/path/key"]["Points2D:positions"]]
    assert np.diff(x_m).min() > 0.4 * (top - bottom)
    assert x_m[1] == pytest.approx((left + right) / 2)

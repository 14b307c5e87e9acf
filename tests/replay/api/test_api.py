"""The public interface: what it returns, what it writes and what it leaves alone."""

import doctest
import gc
import importlib
import os
import subprocess
import sys
import typing
from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

import wmr_replay as wr
from wmr_replay.api.request import SettingsArguments
from wmr_replay.api.simulation import SensorArguments
from wmr_replay.api.store import SampleStore
from wmr_schemas.errors import InvalidSetting, InvalidSignal, LogUnusable
from wmr_schemas.tables import CONFUSION, SAMPLES, SEGMENTS, SUMMARY, polars_schema
from wmr_synth.wheel_speed.encoders import EncoderSensors

MODES = ["undecided", "ideal", "skidding", "slipping", "skidding_slipping"]


@pytest.fixture(scope="module")
def result(log):
    return wr.run(log)


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """An empty working directory, and temporary files below it."""
    place = tmp_path / "here"
    (tmp_path / "temporary").mkdir()
    place.mkdir()
    monkeypatch.chdir(place)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    return place


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_every_public_name_is_there_and_listed():
    for name in wr.__all__:
        assert getattr(wr, name) is not None, name
    assert set(wr.__all__) <= set(dir(wr))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = wr.nothing


def test_the_static_names_are_those_that_are_resolved():
    """What type checkers read and what runs is the same: the module under TYPE_CHECKING and in the table."""
    source = Path(wr.__file__).read_text()
    static = {}
    for line in source.split("if TYPE_CHECKING:")[1].split("__all__")[0].splitlines():
        if line.strip().startswith("from "):
            module, imported = line.strip().removeprefix("from ").split(" import ")
            static |= dict.fromkeys(imported.split(", "), module)
    assert static == wr._HOME_OF
    assert set(static) | {"__version__"} == set(wr.__all__)


def test_functions_are_not_hidden_by_the_packages_of_their_name():
    code = (
        "import wmr_replay as wr, wmr_replay.gap, wmr_replay.differentiate, wmr_replay.excite\n"
        "from wmr_replay.gap import analyse\n"
        "assert callable(wr.gap) and callable(wr.differentiate), (wr.gap, wr.differentiate)\n"
        "assert callable(wr.excite), wr.excite\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("arguments", "record"), [(SettingsArguments, wr.Settings), (SensorArguments, EncoderSensors)]
)
def test_keyword_arguments_are_the_fields(arguments, record):
    """The types that checkers see do not drift from the dataclass; a sensor's may be None besides."""
    hints = typing.get_type_hints(arguments)
    assert list(hints) == [field.name for field in fields(record)]
    own = typing.get_type_hints(record)
    optional = arguments is SensorArguments
    assert all(hints[name] == (own[name] | None if optional else own[name]) for name in hints)


def test_nothing_is_written_where_the_program_runs(log, empty, result):
    held = wr.run(log)
    assert held.files == {}
    assert_frame_equal(held.samples.collect(), result.samples.collect(), check_exact=True)
    assert names(empty) == []
    assert names(empty.parent / "temporary") == []


def test_saved_files_are_those_of_the_command_line_to_the_byte(log, result, command, tmp_path):
    command("run", log, "--out", tmp_path / "command")
    saved = result.save(tmp_path / "saved")
    direct = wr.run(log, tmp_path / "direct")
    assert names(tmp_path / "saved") == names(tmp_path / "command") == names(tmp_path / "direct")
    assert set(saved) == set(direct.files) >= {"hindsight", "hindsight_segments"}
    for name in names(tmp_path / "command"):
        contents = [(tmp_path / place / name).read_bytes() for place in ("command", "saved", "direct")]
        if not name.endswith(".rrd"):  # a recording holds the time at which it was written
            assert contents[0] == contents[1] == contents[2], name
    assert_frame_equal(direct.samples.collect(), result.samples.collect(), check_exact=True)


def test_large_samples_go_to_a_temporary_file_that_goes_with_the_result(
    log, empty, monkeypatch, tmp_path, result
):
    monkeypatch.setattr("wmr_replay.api.run.SampleStore", partial(SampleStore, 100))
    spilled = wr.run(log)
    folders = list((empty.parent / "temporary").iterdir())
    assert [names(folder) for folder in folders] == [["samples.parquet"]] * 2
    assert_frame_equal(spilled.samples.collect(), result.samples.collect(), check_exact=True)
    assert_frame_equal(spilled.hindsight.collect(), result.hindsight.collect(), check_exact=True)
    spilled.save(tmp_path / "a", timeline=False)
    result.save(tmp_path / "b", timeline=False)
    for name in names(tmp_path / "b"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    del spilled
    gc.collect()
    assert names(empty.parent / "temporary") == []
    assert names(empty) == []


def test_tables_show_names_and_keep_the_documented_columns(result):
    samples = result.samples.collect()
    assert samples.columns == polars_schema(SAMPLES).names()
    assert samples["mode"].dtype.categories.to_list() == MODES
    assert samples["mode_true"].null_count() == 0
    assert set(result.segments.columns) >= {*polars_schema(SEGMENTS).names(), "start_s", "end_s"}
    assert result.segments["end_s"][:-1].equals(result.segments["start_s"][1:].rename("end_s"))
    assert result.confusion.columns == polars_schema(CONFUSION).names()
    assert result.summary.schema == polars_schema(SUMMARY)
    assert result.settings["identifier"] == "bank"
    assert result.verdict in repr(result)


def test_names_stand_for_the_numbers_on_disk(result, tmp_path):
    files = result.save(tmp_path, timeline=False)
    stored = pl.read_parquet(files["samples"])
    assert stored.schema == polars_schema(SAMPLES)
    shown = result.samples.select("mode", "mode_true").collect()
    for name in ("mode", "mode_true"):
        numbers = [None if mode is None else MODES.index(mode) - 1 for mode in shown[name]]
        assert numbers == stored[name].to_list()


def test_a_log_in_memory_gives_what_its_file_gives():
    made = wr.synthesise("random", seed=5, duration_s=12, rate_hz=50, torque_rate_hz=50)
    held = wr.replay(made.log, name="drive").samples.collect()
    assert len(held) == len(made.log.pose)
    by_file = pl.DataFrame({"mode": held["mode"]})
    assert by_file["mode"].value_counts().height > 1


def test_memory_and_file_agree_to_the_bit(tmp_path):
    made = wr.synthesise("random", tmp_path / "a.mcap", seed=3, duration_s=8, rate_hz=50, torque_rate_hz=50)
    from_file, held = wr.run(tmp_path / "a.mcap"), wr.replay(made.log, name="a")
    near = ("x_m", "y_m", "yaw_rad")  # a quaternion in the file rounds the yaw
    assert_frame_equal(
        from_file.samples.select(near).collect(), held.samples.select(near).collect(), abs_tol=1e-12
    )
    assert_frame_equal(from_file.samples.select("mode").collect(), held.samples.select("mode").collect())
    assert held.summary["log_sha256"][0] is None


@pytest.mark.parametrize("form", [str, Path, os.fspath])
def test_paths_are_text_or_path_like(log, form, result):
    assert wr.open_log(form(log)).info().n_messages > 0


def test_a_url_is_no_place_for_results(log, result):
    with pytest.raises(InvalidSetting, match="is a URL"):
        result.save("s3://bucket/results")


def test_wrong_settings_and_logs_say_what_is_right(log, tmp_path):
    with pytest.raises(InvalidSetting, match="no setting 'identifer'; the settings are window_s"):
        wr.run(log, identifer="paper")
    with pytest.raises(LogUnusable, match="no such file"):
        wr.run(tmp_path / "none.mcap", tmp_path / "out")
    assert names(tmp_path) == []


def test_an_opened_log_tells_what_it_holds_and_gives_its_signals(log):
    opened = wr.open_log(log)
    info, signals = opened.info(), opened.signals()
    assert [c["role"] for c in info.channels if c["role"]] == ["truth", "torque", "pose"]
    assert len(signals.pose) == len(signals.torque) == 601
    assert signals.pose.columns == ["t_ns", "x_m", "y_m", "yaw_rad"]
    assert signals.truth["mode"].dtype.categories.to_list() == MODES
    batches = list(opened)
    assert sum(len(batch.pose) for batch in batches) == len(signals.pose)
    part = wr.open_log(log, start=2, end=4).signals().pose
    assert 0 < len(part) < len(signals.pose) / 2


def test_a_cut_result_is_not_left_behind(log, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        wr.run(log, tmp_path / "new" / "out", progress=stop)
    assert names(tmp_path) == []


def test_the_picture_has_the_modes_in_their_colours(result, tmp_path):
    figure = result.plot()
    path, lanes, *_ = figure.axes
    assert {text.get_text() for text in lanes.get_yticklabels()} == {"estimate", "hindsight", "truth"}
    (collection,) = path.collections
    xy = result.samples.select("x_m", "y_m").collect().to_numpy()
    drawn = np.concatenate(collection.get_segments())
    assert np.allclose([drawn.min(axis=0), drawn.max(axis=0)], [xy.min(axis=0), xy.max(axis=0)])
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_notebooks_show_a_card(result):
    html = result._repr_html_()
    assert "<svg" in html
    assert result.verdict in html
    assert f"<title>{result.segments['start_s'][1]:.2f}" in html
    assert html.count("<svg") == 2
    known, later = html.index("as known at the time"), html.index("in hindsight</div>")
    strip = html[later:]
    assert known < later
    assert strip.count("<rect") == len(result.hindsight_segments)


def test_the_timeline_is_written_where_it_was_asked_for(result, tmp_path):
    assert result.timeline(tmp_path / "x.rrd").stat().st_size > 10_000
    assert names(tmp_path) == ["x.rrd"]


def test_derivatives_have_the_delay_and_noise_that_they_state():
    """Against the analytic derivative; the error's spread against the standard deviation that is given."""
    rng, t = np.random.default_rng(2), np.arange(0, 40, 0.01)
    noisy = np.sin(t) + 1e-3 * rng.standard_normal(len(t))
    for order, exact in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at))):
        found = wr.differentiate(t, noisy, order=order, window_s=0.3)
        good = found.status == wr.Status.OK
        error = (found.value - exact(found.at_s))[good]
        bias = {0: 3e-4, 1: 5e-3, 2: 5e-3}[order]
        assert np.std(error) == pytest.approx(np.mean(found.sd[good]), rel=0.35, abs=bias)
        assert np.isnan(found.value[~good]).all()
        assert found.delay_s == pytest.approx(0.15)
    assert found.frame().columns == ["t_s", "at_s", "value", "sd", "status"]


def test_integer_stamps_are_nanoseconds_and_several_signals_are_rows():
    t_ns = np.arange(200) * 10_000_000 + 1_700_000_000_000_000_000
    x = np.stack([np.arange(200) * 0.02, np.arange(200) * -0.01])
    found = wr.differentiate(t_ns, x, window_s=0.2)
    assert found.value.shape == x.shape
    assert np.nanmedian(found.value, axis=1) == pytest.approx([2.0, -1.0])


@pytest.mark.parametrize(
    ("t", "x", "options", "error"),
    [
        ([0, 0.1, 0.1, 0.2, 0.3], range(5), {}, InvalidSignal),
        ([0, 0.1, 0.2, 0.3], range(5), {}, InvalidSignal),
        (np.arange(100) * 0.01, range(100), {"order": 3}, InvalidSetting),
        (np.arange(100) * 0.01, range(100), {"window_s": 0.01}, InvalidSetting),
    ],
)
def test_signals_that_cannot_be_differentiated_are_refused(t, x, options, error):
    with pytest.raises(error):
        wr.differentiate(t, list(x), **options)


def test_results_logs_and_directories_can_be_compared(log, result, tmp_path):
    result.save(tmp_path / "stored", timeline=False)
    assert wr.compare(result, tmp_path / "stored").other_mode_share == 0.0
    other = wr.compare(log, settings_b={"identifier": "paper"})
    assert 0 < other.other_mode_share < 1
    assert "another mode in" in str(other)
    files = other.save(tmp_path / "out")
    assert set(files) == {"json", "timeline"}
    with pytest.raises(InvalidSetting, match="compare with what"):
        wr.compare(log)


def test_references_are_stored_and_checked(log, tmp_path):
    assert not wr.check(tmp_path / "references", log, update=True).missing
    assert wr.check(tmp_path / "references", [log]).passed
    assert not wr.check(tmp_path / "references", log, identifier="paper").passed


@pytest.mark.parametrize("name", ["differentiate", "design", "excite", "synthesise"])
def test_the_examples_in_the_docstrings_hold(name):
    found = doctest.testmod(importlib.import_module(f"wmr_replay.api.{name}"))
    assert found.attempted > 0
    assert found.failed == 0


def test_gap_and_fit_write_only_where_they_are_told(monkeypatch, empty, tmp_path):
    """The analysis itself is tested elsewhere; here it is the calibration, which is quick."""
    made = wr.synthesise("patrol", tmp_path / "drive.mcap", seed=2, duration_s=30)
    fitted = wr.fit(tmp_path / "drive.mcap")
    alpha, sd = fitted.model.robot.alpha, fitted.model.robot_sd["alpha"]
    assert alpha == pytest.approx(made.log.robot.alpha, abs=6 * sd, rel=0.05)
    assert names(empty) == []
    assert fitted.save(tmp_path / "models").name == "drive.model.toml"
    assert wr.read_model(tmp_path / "models" / "drive.model.toml").robot.alpha == pytest.approx(alpha)


def test_a_gap_analysis_is_held_in_memory_and_saved_on_request(monkeypatch, empty, tmp_path, made_up_gap):
    """With an analysis that is made up: what is tested is the object around it."""
    wr.synthesise("patrol", tmp_path / "drive.mcap", seed=2, duration_s=6)
    monkeypatch.setattr("wmr_replay.jobs.gap.analyse", lambda *_: made_up_gap.gap_result())
    found = wr.gap(tmp_path / "drive.mcap")
    assert found.verdict == "named"
    assert found.effects.row(0, named=True)["effect"] == "viscous_drag"
    assert found.effects.row(0, named=True)["value"] == pytest.approx(0.203)
    assert found.files == {}
    assert names(empty) == []
    assert set(found.save("here")) == {"json", "model", "timeline", "traces"}
    assert names(empty / "here") == [
        "drive.gap.json",
        "drive.gap.rrd",
        "drive.gap_traces.parquet",
        "drive.model.toml",
    ]
    assert wr.read_model("here/drive.model.toml").effects[0].name == "viscous_drag"
    with pytest.raises(InvalidSetting, match="would overwrite its base"):
        wr.gap(tmp_path / "drive.mcap", "here", model="here/drive.model.toml")
    with pytest.raises(InvalidSetting, match="with the topic T"):
        wr.gap(tmp_path / "drive.mcap", modes="topic:")


def test_many_logs_make_one_dataset(short_logs, tmp_path):
    done = wr.batch(short_logs, tmp_path / "fleet", jobs=1)
    assert len(done.fleet) == 3
    assert not done.failed


def test_a_table_of_numbers_becomes_a_log(tmp_path):
    made = wr.synthesise("random", seed=1, duration_s=6, rate_hz=50, torque_rate_hz=50)
    pose = made.log.pose
    columns = {"t": pose.t_ns / 1e9, "px": pose.x_m, "py": pose.y_m, "heading": pose.yaw_rad}
    pl.DataFrame(columns).write_csv(tmp_path / "drive.csv")
    (tmp_path / "columns.toml").write_text('[columns]\ntime = "t"\nx = "px"\ny = "py"\nyaw = "heading"\n')
    converted = wr.convert(tmp_path / "drive.csv", tmp_path / "columns.toml")
    assert converted.n_rows == len(pose)
    assert np.allclose(converted.log.pose.x_m, pose.x_m)
    assert names(tmp_path) == ["columns.toml", "drive.csv"]
    assert wr.open_log(converted.save(tmp_path / "drive.mcap")).info().n_messages == len(pose)

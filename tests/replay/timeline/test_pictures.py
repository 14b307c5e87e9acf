"""Pictures of every layout, without a screen: no view is blank, and the colours that matter are where they
should be. Skipped where there is no Vulkan driver.
"""

import io
import sys

import numpy as np
import pytest
from PIL import Image

import wmr_replay as wr
from wmr_replay.api.compare import Comparison
from wmr_replay.regress.replayed import Asked, replay
from wmr_replay.timeline import colours, picture
from wmr_replay.timeline.colours import MODE_COLOURS
from wmr_replay.timeline.gap.writer import write_gap_timeline
from wmr_replay.timeline.picture import HEIGHT, WIDTH, headless_viewer, settled, take_picture
from wmr_replay.timeline.viewer import ViewerUnavailable
from wmr_replay.timeline.writer import Timeline
from wmr_schemas.findings import Severity, finding
from wmr_schemas.modes import ContactMode
from wmr_synth import Sensors, record, synthesise

SIZE = (1000, 600)
SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.02, noise_yaw_sd_rad=0.005)
NAMED = (ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING)
BLANK_SHARE = 0.01
"""Less of a view's pixels than this, apart from its background, is an empty view."""


@pytest.fixture(scope="module")
def viewer():
    """One viewer for all pictures of this module."""
    try:
        with headless_viewer(*SIZE) as running:
            yield running
    except ViewerUnavailable as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A minute in which ideal rolling, skidding and slipping take turns of 10 s."""
    path = tmp_path_factory.mktemp("pictures") / "drive.mcap"
    record(synthesise("paper-acceleration", seed=0, sensors=SENSORS), path)
    return path


@pytest.fixture(scope="module")
def recording(log, tmp_path_factory):
    return wr.run(log, tmp_path_factory.mktemp("run")).files["timeline"]


def views_of(viewer, recording):
    """Open a recording; its views' pixels by name, once the axes rest, and the whole window's."""
    viewer.open(str(recording))
    viewer.set_time("log_t", duration=0.0, play_state="paused")
    whole = np.asarray(settled(viewer), int)
    found = {}
    for view in viewer.get_state().views:
        assert not view.reports, (view.name, view.reports)
        try:
            shot = viewer.take_screenshot(view.view_id)
        except ConnectionError:
            continue  # not found: it is behind another tab
        else:
            with Image.open(io.BytesIO(shot)) as pixels:
                found[view.name] = np.asarray(pixels.convert("RGB"), int)
    return found, whole


def share_of(pixels, colour, within=14):
    """Share of the pixels that are of a colour."""
    return float((np.abs(pixels - colour).max(axis=2) < within).mean())


def in_lanes(colour):
    """A colour as lanes show it: they dim it."""
    return np.round(0.79 * np.array(colour))


def assert_none_is_blank(views):
    for name, pixels in views.items():
        background = np.median(pixels.reshape(-1, 3), axis=0)
        drawn = (np.abs(pixels - background).max(axis=2) > 40).mean()
        assert drawn > BLANK_SHARE, f"{name} is blank"


def test_a_run_opens_on_all_of_its_modes(viewer, recording):
    """The log ends slipping: in the lanes' and the path's colours both ends are there."""
    views, whole = views_of(viewer, recording)
    assert whole.shape == (SIZE[1], SIZE[0], 3)
    assert_none_is_blank(views)
    assert set(views) == {
        "Path [m] by mode, true in white",
        "Verdict",
        "Contact mode and status",
        "Probability of each mode",
        "C_k [m/s]",
        "C_d [m/s²]",
        "α [(m/s²)/(N·m)]",
    }
    path, lanes = views["Path [m] by mode, true in white"], views["Contact mode and status"]
    for mode in NAMED:
        assert share_of(path, MODE_COLOURS[mode]) > 0.001, mode
        assert share_of(views["Probability of each mode"], MODE_COLOURS[mode], 40) > 0.001, mode
        assert share_of(lanes, in_lanes(MODE_COLOURS[mode])) > 0.02, mode
    width = lanes.shape[1]
    first, last = lanes[:, int(0.19 * width) : int(0.27 * width)], lanes[:, int(0.92 * width) :]
    assert share_of(first, in_lanes(MODE_COLOURS[ContactMode.IDEAL])) > 0.1
    assert share_of(last, in_lanes(MODE_COLOURS[ContactMode.SLIPPING])) > 0.1
    assert share_of(last, in_lanes(MODE_COLOURS[ContactMode.SKIDDING])) == 0
    assert share_of(path, colours.ROBOT) > 0.0005
    for name, colour in (("C_k [m/s]", ContactMode.SKIDDING), ("C_d [m/s²]", ContactMode.SLIPPING)):
        assert share_of(views[name], colours.ESTIMATE, 40) > 0.003
        assert share_of(views[name], MODE_COLOURS[colour], 40) > 0.001


def test_a_gap_shows_where_the_base_errs_and_that_the_extended_model_does_not(viewer, made_up_gap, tmp_path):
    path = tmp_path / "drive.gap.rrd"
    found = finding("coloured_noise", Severity.WARNING, "a correlation time of .3 s").as_dict()
    write_gap_timeline(path, made_up_gap.gap_result(), "drive.mcap", "gap", [found])
    views, _ = views_of(viewer, path)
    assert_none_is_blank(views)
    (base,), (extended,) = (
        [pixels for name, pixels in views.items() if name.startswith(start)] for start in ("Base", "Extended")
    )
    worst = colours.ERRORS[-1]
    assert share_of(base, worst) > 0.001
    assert share_of(base, worst) > 3 * share_of(extended, worst)
    assert share_of(extended, colours.ERRORS[0]) > 0.003
    assert share_of(views["Gap in position [mm]"], colours.BASE, 40) > 0.003
    assert share_of(views["Speed [m/s]"], colours.TRUE_PATH, 30) > 0.001


def test_a_comparison_shows_where_the_modes_differ(viewer, log, tmp_path):
    one, other = (replay(log, Asked().changed({"identifier": name})) for name in ("bank", "paper"))
    recording = Comparison("drive", "bank", "paper", (one, other)).timeline(tmp_path / "drive.compare.rrd")
    views, _ = views_of(viewer, recording)
    assert_none_is_blank(views)
    assert {"Path [m]: a, b, another mode", "What differs", "Δ α [1/(kg·m)]"} <= set(views)
    assert share_of(views["Path [m]: a, b, another mode"], colours.TRUTH, 25) > 0.0005
    assert share_of(views["Contact mode and status"], in_lanes(colours.TRUTH)) > 0.002
    assert share_of(views["Δ α [1/(kg·m)]"], colours.DIFFERENCE, 40) > 0.002


def test_rows_are_shown_while_they_come_and_a_closed_viewer_costs_none(log, tmp_path):
    """The viewer knows half of the rows when half of them are written; then it is closed."""
    table = replay(log, Asked()).samples
    options = {"log_name": "drive.mcap", "alpha_nominal": None, "rate_hz": 50.0, "recording_id": "live"}
    try:
        with headless_viewer(*SIZE) as viewer:
            timeline = Timeline(tmp_path / "live.rrd", live=viewer.url, **options)
            timeline.push(pl_repeated(table, 3)[:4096])
            pixels = np.asarray(settled(viewer), int)
            (shown,) = viewer.get_state().recordings
    except ViewerUnavailable as reason:
        pytest.skip(str(reason))
    (seconds,) = (line.end / 1e9 for line in shown.timelines if line.name == "log_t")
    assert seconds == pytest.approx(4095 / 50.0)
    assert share_of(pixels, MODE_COLOURS[ContactMode.SLIPPING]) > 0.005
    timeline.push(pl_repeated(table, 3)[4096:])
    timeline.finish("done")
    assert (tmp_path / "live.rrd").stat().st_size > 100_000


def pl_repeated(table, times):
    """The drive again and again, one after the other."""
    step_ns = int(table["t_ns"][-1] - table["t_ns"][0]) + 20_000_000
    parts = [table.with_columns(table["t_ns"] + k * step_ns) for k in range(times)]
    return parts[0].vstack(parts[1]).vstack(parts[2])


def test_the_command_line_takes_a_picture(viewer, command, log, tmp_path):
    command("run", log, "--out", tmp_path, "--screenshot", tmp_path / "drive.png")
    with Image.open(tmp_path / "drive.png") as taken:
        assert taken.size == (WIDTH, HEIGHT)
        assert share_of(np.asarray(taken, int), MODE_COLOURS[ContactMode.SLIPPING]) > 0.001


def test_a_viewer_without_graphics_is_unavailable_and_says_what_helps(tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "RERUN_WITH_US", (sys.executable, "-c", "raise SystemExit(102)"))
    with pytest.raises(ViewerUnavailable, match="mesa-vulkan-drivers"):
        take_picture(tmp_path / "drive.rrd", tmp_path / "drive.png")

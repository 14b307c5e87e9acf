"""Parts of the recording: path, grid, and the command that opens the viewer."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from wmr_replay.timeline.description import verdict_text
from wmr_replay.timeline.path import SMALL_VIEW, Frame, LabelRoom, grid, grid_step_m, strips_by_mode
from wmr_replay.timeline.robot import Scales
from wmr_replay.timeline.sink import application_of
from wmr_replay.timeline.viewer import ViewerUnavailable, open_viewer, viewer_command
from wmr_schemas.findings import Severity, finding


def test_strips_join_and_have_the_mode_of_their_first_row() -> None:
    xy = np.stack([np.arange(6.0), np.zeros(6)], axis=1)
    strips = strips_by_mode(xy, np.array([0, 0, 1, 1, 2, 0], np.int8))
    assert [points[:, 0].tolist() for points in strips.points] == [[0, 1, 2], [2, 3, 4], [4, 5]]
    assert (strips.modes.tolist(), strips.first_rows.tolist()) == ([0, 1, 2], [0, 2, 4])


@pytest.mark.parametrize(("side", "step"), [(100.0, 50.0), (7.0, 2.0), (0.4, 0.1), (1200.0, 500.0)])
def test_grid_steps_are_round(side: float, step: float) -> None:
    assert grid_step_m(side) == pytest.approx(step)


def test_a_straight_path_gets_a_frame_with_some_width() -> None:
    frame = Frame()
    frame.include(np.array([[0.0, 2.0], [80.0, 2.0]]))
    low, high = frame.with_margin()
    assert low[0] < 0.0
    assert high[0] > 80.0
    assert high[1] - low[1] >= 10


@pytest.mark.parametrize("labels", [LabelRoom(), SMALL_VIEW])
@pytest.mark.parametrize("size", [(12.0, 9.0), (80.0, 0.0), (0.3, 7.0)])
def test_labels_stand_below_and_left_of_the_path_and_apart(
    labels: LabelRoom, size: tuple[float, float]
) -> None:
    frame = Frame(labels)
    frame.include(np.array([[-7.1, -3.3], [size[0] - 7.1, size[1] - 3.3]]))
    low, _ = frame.with_margin()
    _, places, texts = grid(frame)
    side = float(frame.sides().max())
    assert len(texts) >= 2
    for (x, y), text in zip(places, texts, strict=True):
        if text.startswith("x"):
            assert low[1] + 0.07 * side < y < frame.low[1] - 0.05 * side
        else:
            assert low[0] + 0.07 * side < x < frame.low[0] - 0.05 * side
    apart = np.abs(places[:, None] - places) / side + np.eye(len(places))[:, :, None]
    assert np.all((apart[:, :, 0] > 0.15) | (apart[:, :, 1] > 0.09))


def test_viewer_command_quotes_the_file() -> None:
    program, _, file = viewer_command(Path("my drive.rrd")).partition(" ")
    assert (Path(program).name, file) == ("rerun", "'my drive.rrd'")


def test_every_recording_is_an_application_of_its_own_with_a_name_that_is_allowed() -> None:
    """Another log, another layout; the viewer would warn of other characters and change them."""
    names = ["drive-0a1b", "drive-0a1c", "compare-a/b.mcap", "compare-a.b/mcap", "Fahrt über Öl", "x" * 500]
    found = {application_of(name) for name in names}
    assert len(found) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9_-]+", name) for name in found)
    assert application_of("drive-0a1b") == "wmr_replay-drive-0a1b"


def test_the_text_names_every_finding_with_its_advice() -> None:
    found = finding("clock_offset", Severity.WARNING, "0.25 s apart").as_dict()
    text = verdict_text("drive.mcap", "all ideal", [found])
    assert "- **clock_offset** (warning): 0.25 s apart." in text
    assert found["advice"][:20] in text.replace("\\", "")


def test_arrows_and_body_fit_the_frame() -> None:
    frame = Frame()
    frame.include(np.array([[0.0, 0.0], [100.0, 50.0]]))
    scales = Scales.of(frame, fastest_mps=8.0)
    assert scales.body_m == pytest.approx(5.0)
    assert scales.arrow_s == pytest.approx(2.0)  # 16 m for 8 m/s
    assert Scales.of(frame, fastest_mps=0.0).arrow_s > 0


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux says so beforehand")
def test_without_a_screen_the_viewer_is_unavailable(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerUnavailable, match="no screen"):
        open_viewer(Path("drive.rrd"))

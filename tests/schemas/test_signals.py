"""Signals reject invalid input at construction and name the faulty row."""

from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from wmr_schemas import (
    CommandTrack,
    ContactMode,
    Log,
    ModeTrack,
    PoseTrack,
    RobotParameters,
    TorqueTrack,
    WheelSpeedTrack,
)
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.signals import first_true

T_NS = np.array([0, 10, 20], np.int64)
ROW = np.array([1.0, 2.0, 3.0])


def pose(**changes: Any) -> PoseTrack:
    return PoseTrack(**{"t_ns": T_NS, "x_m": ROW, "y_m": ROW, "yaw_rad": ROW, **changes})


def torque(**changes: Any) -> TorqueTrack:
    columns = dict.fromkeys(("left_nm", "right_nm", "left_radps", "right_radps"), ROW)
    return TorqueTrack(**{"t_ns": T_NS, **columns, **changes})


def with_value(value: float, row: int) -> np.ndarray:
    column = ROW.copy()
    column[row] = value
    return column


def test_a_good_track_keeps_its_arrays_and_has_a_length() -> None:
    track = pose()
    assert len(track) == 3
    assert track.x_m is ROW


def test_tracks_are_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        pose().x_m = ROW  # type: ignore[misc]


def test_an_empty_track_is_valid() -> None:
    nothing = np.empty(0)
    empty = PoseTrack(np.empty(0, np.int64), nothing, nothing, nothing)
    assert len(empty) == 0


@pytest.mark.parametrize("stamps", [[0, 20, 10], [0, 20, 20]], ids=["backwards", "repeated"])
def test_stamps_must_increase_and_the_row_is_named(stamps: list[int]) -> None:
    with pytest.raises(InvalidSignal, match=r"^pose: t_ns not increasing at row 2$") as caught:
        pose(t_ns=np.array(stamps, np.int64))
    assert (caught.value.signal, caught.value.problem, caught.value.row) == ("pose", "t_ns not increasing", 2)


def test_stamps_must_be_int64() -> None:
    with pytest.raises(
        InvalidSignal, match=r"^torque: t_ns must be int64 of shape \(n,\), not float64 of shape \(3,\)$"
    ):
        torque(t_ns=T_NS.astype(float))


def test_stamps_must_be_one_dimensional() -> None:
    with pytest.raises(InvalidSignal, match=r"not int64 of shape \(1, 3\)$"):
        pose(t_ns=T_NS[None, :])


def test_columns_must_be_as_long_as_the_stamps() -> None:
    with pytest.raises(
        InvalidSignal, match=r"^pose: y_m must be float64 of shape \(3,\), not float64 of shape \(2,\)$"
    ):
        pose(y_m=ROW[:2])


def test_columns_must_be_float64() -> None:
    with pytest.raises(InvalidSignal, match=r"^pose: x_m must be float64 of shape \(3,\), not float32"):
        pose(x_m=ROW.astype(np.float32))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_pose_must_be_finite(value: float) -> None:
    with pytest.raises(InvalidSignal, match=rf"^pose: yaw_rad is {value} at row 1$"):
        pose(yaw_rad=with_value(value, 1))


def test_an_unknown_wheel_speed_may_be_nan_but_not_infinite() -> None:
    assert np.isnan(torque(left_radps=with_value(np.nan, 0)).left_radps[0])
    with pytest.raises(InvalidSignal, match=r"^torque: right_nm is inf at row 2$"):
        torque(right_nm=with_value(np.inf, 2))


@pytest.mark.parametrize(("track", "name"), [(WheelSpeedTrack, "wheel speed"), (CommandTrack, "command")])
def test_tracks_of_wheel_speeds_are_checked_and_may_be_unknown(track: Any, name: str) -> None:
    good = track(T_NS, with_value(np.nan, 0), ROW)
    assert (len(good), repr(good)) == (3, f"<{track.__name__}: 3 rows, 2e-08 s>")
    with pytest.raises(InvalidSignal, match=rf"^{name}: right_radps is inf at row 1$"):
        track(T_NS, ROW, with_value(np.inf, 1))
    with pytest.raises(InvalidSignal, match=rf"^{name}: t_ns not increasing at row 1$"):
        track(T_NS[::-1].copy(), ROW, ROW)


def test_a_batch_has_no_commands_unless_given() -> None:
    assert RawBatch(Rows.empty(3), Rows.empty(4), Rows.empty(1)).command.values.shape == (2, 0)


@pytest.mark.parametrize("value", [-1, 4])
def test_a_true_mode_is_one_of_four(value: int) -> None:
    with pytest.raises(InvalidSignal, match=rf"^mode: {value} is no contact mode \(0 to 3\) at row 1$"):
        ModeTrack(T_NS, np.array([0, value, 2], np.int8))


def test_modes_must_be_int8() -> None:
    with pytest.raises(InvalidSignal, match=r"^mode: mode must be int8 of shape \(3,\)$"):
        ModeTrack(T_NS, np.array([0, 1, 2], np.int64))


def test_every_contact_mode_is_a_valid_truth() -> None:
    modes = np.array([mode for mode in ContactMode if mode >= 0], np.int8)
    assert len(ModeTrack(np.arange(4, dtype=np.int64), modes)) == 4


def test_a_log_needs_a_pose_alone_and_knows_no_robot_by_default() -> None:
    log = Log(pose())
    assert (log.torque, log.mode, log.robot) == (None, None, RobotParameters())
    assert (log.wheels, log.commands) == (None, None)
    assert log.robot.known() == {}


@pytest.mark.parametrize(
    ("mask", "index"), [([], None), ([False], None), ([True, False], 0), ([False, True, True], 1)]
)
def test_first_true_is_the_first_index_or_none(mask: list[bool], index: int | None) -> None:
    assert first_true(np.array(mask, bool)) == index


def test_a_track_shows_its_size_and_not_its_arrays():
    t_ns = np.array([0, 500_000_000, 2_000_000_000])
    assert repr(ModeTrack(t_ns, np.zeros(3, np.int8))) == "<ModeTrack: 3 rows, 2 s>"
    assert repr(ModeTrack(t_ns[:0], np.zeros(0, np.int8))) == "<ModeTrack: 0 rows, 0 s>"

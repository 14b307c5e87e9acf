"""Torques that a log records less often than the controller gave them.

The oracle is a plain loop at 1 kHz whose torques change all the time, or in steps of the log's period.
"""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap import analyse
from wmr_replay.gap.estimation.joined_torques import joined, with_likelier_torques
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.inputs import TorqueHistory
from wmr_replay.gap.options import GapOptions
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

ROBOT = RobotParameters(alpha=0.28, alpha_yaw=0.34, half_track_m=0.25)
STEP_S, EVERY, POSE_EVERY = 0.001, 50, 10
OPTIONS = GapOptions(modes="ideal")


def log_of(*, held: bool, drag_per_s: float = 0.0, seconds: float = 60.0) -> Log:
    """Torques are sines with a stamp every 50 ms; ``held``: they act in steps from stamp to stamp."""
    n, l = round(seconds / STEP_S), 0.25
    t_s = STEP_S * np.arange(n)
    ahead = 0.9 * np.sin(2.1 * t_s) + 0.3 * np.sin(5.0 * t_s + 1)
    turn = 0.5 * np.sin(1.7 * t_s + 2) + 0.2 * np.sin(6.0 * t_s)
    sent = np.stack([ahead / 0.28 - turn / 0.34, ahead / 0.28 + turn / 0.34]) / 2
    acting = np.stack([ahead, turn])
    if held:
        acting = np.repeat(acting[:, ::EVERY], EVERY, axis=1)[:, :n]
    v, w, path = 0.9, 0.0, np.zeros((n, 3))
    for k in range(n - 1):
        faster, rounder = acting[0, k] - drag_per_s * v, acting[1, k]
        middle, turning = v + faster * STEP_S / 2, (w + rounder * STEP_S / 2) / l
        yaw = path[k, 2] + turning * STEP_S / 2
        path[k + 1] = path[k] + STEP_S * np.array([middle * np.cos(yaw), middle * np.sin(yaw), turning])
        v, w = v + STEP_S * faster, w + STEP_S * rounder
    rows, t_ns = slice(None, None, POSE_EVERY), np.round(1e9 * t_s).astype(np.int64)
    seen = path[rows] + np.random.default_rng(3).normal(size=path[rows].shape) * [0.001, 0.001, 0.002]
    unknown = np.full((2, len(t_ns[::EVERY])), np.nan)
    torque = TorqueTrack(t_ns[::EVERY], *sent[:, ::EVERY].copy(), *unknown)
    return Log(PoseTrack(t_ns[rows], *seen.T.copy()), torque, robot=ROBOT)


def chosen(log: Log) -> tuple[Log, str]:
    return with_likelier_torques(log, Extension(base_of(ROBOT)), OPTIONS)


def test_torques_that_change_between_their_stamps_are_joined():
    log, note = chosen(log_of(held=False))
    assert "every 50 ms" in note
    assert len(log.torque) == 5 * (len(log_of(held=False).torque) - 1) + 1


def test_torques_that_are_held_stay_held():
    log = log_of(held=True)
    assert chosen(log) == (log, "")


def test_torques_that_come_often_are_not_asked():
    log = log_of(held=False)
    often = replace(log, torque=replace(log.torque, t_ns=log.torque.t_ns // 4))
    assert chosen(often) == (often, "")


def test_without_an_effect_nothing_is_named_and_a_drag_is_found_at_its_size():
    nothing = analyse(log_of(held=False), None, OPTIONS)
    assert nothing.verdict == "nothing_missing"
    assert any("taken as lines" in note for note in nothing.notes)
    found = analyse(log_of(held=False, drag_per_s=0.1), None, OPTIONS)
    assert [effect.name for effect in found.effects] == ["viscous_drag"]
    assert found.effects[0].parameters["c1_per_s"].value == pytest.approx(0.1, rel=0.05)


def test_the_integral_of_lines_is_the_trapezoids_and_holes_stay_held():
    t_s = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 1.0, 1.05])
    left = np.array([1.0, 3.0, np.nan, 2.0, 0.0, 4.0, 4.0])
    unknown = np.full(7, np.nan)
    track = TorqueTrack(np.round(1e9 * t_s).astype(np.int64), left, -left, unknown, unknown)
    lines = TorqueHistory.of(joined(track, OPTIONS.gates.torque), 0)
    areas = np.append(np.diff(lines.t_s), 0.0) * lines.efforts_nm
    known = np.isfinite(left)
    here, values = t_s[known], left[known]
    trapezoids = np.diff(here) * (values[1:] + values[:-1]) / 2
    trapezoids[3] = 0.8 * values[3]
    np.testing.assert_allclose(areas.sum(axis=1), [trapezoids.sum(), -trapezoids.sum()], atol=1e-7)

"""The quick look of ``info`` finds what a replay finds, compiles nothing, and leaves clean logs alone."""

import os
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from wmr_replay.identify.motion import Derived, motion_of
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.quick_look import PIECE_ROWS, QuickLook, body_motion, held_means, noise_sd
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.signals import PoseTrack
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.005, noise_yaw_sd_rad=0.003)


@pytest.fixture(scope="module", params=["patrol", "stop-and-go", "figure-eight"])
def log(request):
    return synthesise(request.param, seed=5, duration_s=60.0, sensors=SENSORS).log


def looked(log, **wishes):
    look = QuickLook(log.robot, **wishes)
    look.push(as_batch(log))
    look.end_stretch()
    return look


def with_pose(log, **columns):
    return replace(log, pose=replace(log.pose, **columns))


def with_torque(log, **columns):
    return replace(log, torque=replace(log.torque, **columns))


def frozen(pose):
    """Every eighth second the tracker repeats its last pose for half a second."""
    last = np.arange(len(pose))
    for start in range(200, len(pose) - 25, 400):
        last[start : start + 25] = start - 1
    return {name: getattr(pose, name)[last] for name in ("x_m", "y_m", "yaw_rad")}


FAULTS = {
    "identity": lambda log: with_pose(log, yaw_rad=np.zeros(len(log.pose))),
    "degrees": lambda log: with_pose(log, yaw_rad=np.remainder(57.3 * log.pose.yaw_rad + np.pi, 2 * np.pi)),
    "clockwise": lambda log: with_pose(log, yaw_rad=-log.pose.yaw_rad),
    "turned": lambda log: with_pose(log, yaw_rad=log.pose.yaw_rad + np.pi / 2),
    "millimetres": lambda log: with_pose(log, x_m=1e3 * log.pose.x_m, y_m=1e3 * log.pose.y_m),
    "torques reversed": lambda log: with_torque(
        log, left_nm=-log.torque.left_nm, right_nm=-log.torque.right_nm
    ),
    "torques exchanged": lambda log: with_torque(
        log, left_nm=log.torque.right_nm, right_nm=log.torque.left_nm
    ),
    "frozen": lambda log: with_pose(log, **frozen(log.pose)),
    "a pose a second": lambda log: replace(
        log, pose=PoseTrack(*(getattr(log.pose, f.name)[::50] for f in fields(log.pose)))
    ),
    "late by .8 s": lambda log: with_torque(log, t_ns=log.torque.t_ns + 800_000_000),
}


def test_nothing_is_found_in_a_clean_log(log):
    look = looked(log)
    assert (look.findings(), look.n_rows) == ([], len(log.pose))
    assert look.span_s == pytest.approx(60.0, abs=0.1)


@pytest.mark.parametrize("name", FAULTS)
def test_it_finds_what_a_replay_finds(log, name):
    faulty = FAULTS[name](log)
    engine = Engine(Settings(identifier="paper", tune=False, hindsight=False), ReplayModel(log.robot))
    engine.push(as_batch(faulty))
    engine.finish()
    found = {(f.code, f.severity) for f in engine.findings}
    assert found
    assert {(f.code, f.severity) for f in looked(faulty).findings()} == found


def test_the_formulas_of_the_motion_are_those_of_a_replay():
    rng = np.random.default_rng(0)
    estimates, root = rng.normal(size=(3, 3, 50)), rng.normal(size=(3, 3))
    gains, variances = root @ root.T, np.array([0.01, 0.02])
    each = np.repeat(gains[:, :, None], 50, axis=2), np.repeat(variances[:, None], 50, axis=1)
    np.testing.assert_allclose(
        body_motion(estimates, gains, variances), motion_of(Derived.of(estimates, *each)), rtol=1e-12
    )


def test_an_input_is_held_from_its_stamp_on_and_averaged_over_the_step():
    at_s, values = np.array([0.0, 0.25, np.nan, 1.0])[[0, 1, 3]], np.array([2.0, 4.0, 8.0])
    means = held_means(at_s, values, np.array([0.0, 0.5, 1.0, 1.5, 2.5, 3.5]), 0.5)
    np.testing.assert_allclose(means, [np.nan, 3.0, 4.0, 8.0, 8.0, np.nan])


def test_the_noise_is_that_of_the_third_differences_and_blind_to_motion():
    t = np.arange(4000) * 0.02
    noise = 0.003 * np.random.default_rng(1).standard_normal(len(t))
    assert noise_sd(np.sin(t) + noise) == pytest.approx(0.003, rel=0.05)
    assert noise_sd(np.zeros(3)) == 0.0


def test_a_stretch_is_looked_at_up_to_its_limit_and_without_one_to_its_end(log):
    assert looked(log, most_rows=700).n_rows == 700
    look = QuickLook(log.robot, most_rows=300)
    for part in range(3):
        pose = as_batch(log).pose
        rows = slice(part * 900, part * 900 + 600)
        look.push(
            RawBatch(
                Rows(pose.t_ns[rows], pose.order[rows], pose.values[:, rows]), Rows.empty(4), Rows.empty(1)
            )
        )
        look.end_stretch()
    assert look.n_rows == 900
    assert len(log.pose) < PIECE_ROWS  # more than that is worked through in pieces


@pytest.mark.parametrize(
    "values",
    [np.nan, 1e308, 0.0, -1e200],
    ids=str,
)
def test_values_and_stamps_of_any_kind_pass(values, log):
    stamps = [np.arange(500), np.zeros(500, np.int64), np.arange(500)[::-1] * 10**16, np.arange(500) * 10**8]
    for t_ns in stamps:
        rows = [Rows(t_ns.astype(np.int64), np.arange(500), np.full((k, 500), values)) for k in (3, 4, 1)]
        look = QuickLook(log.robot)
        look.push(RawBatch(*rows))
        look.end_stretch()
        assert {f.code for f in look.findings()} <= {"rate_too_low"}


def test_nothing_is_compiled(tmp_path):
    code = """
from wmr_schemas.compiled import on_compiling
import numpy as np
told = []
on_compiling(told.append)
from wmr_replay.pipeline.quick_look import QuickLook
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas import PAPER_ROBOT
t = np.arange(3000) * 20_000_000
angle = np.arange(3000) * 0.01
look = QuickLook(PAPER_ROBOT)
pose = Rows(t, np.arange(3000), np.stack([np.cos(angle), np.sin(angle), angle]))
look.push(RawBatch(pose, Rows(t, np.arange(3000), np.ones((4, 3000))), Rows.empty(1)))
look.end_stretch()
look.findings()
assert look.n_rows == 3000 and not told, told
"""
    empty = os.environ | {"WMR_REPLAY_CACHE_DIR": str(tmp_path)}  # else a kept kernel is read, not compiled
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120, env=empty)

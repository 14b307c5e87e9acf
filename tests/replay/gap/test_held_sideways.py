"""Whether a slope moves the robot sideways where it is said to skid.

The oracle is a plain loop of the written equations.
"""

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, ROBOT, SETTINGS

from wmr_replay.gap.estimation.held_sideways import with_likelier_skids
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

GRADE_X_MPS2, STEP_S, SECONDS = 0.3, 0.002, 40.0


def skidding_log(slides: bool) -> Log:
    """Bends under a slope, recorded at 100 Hz and labelled skidding; ``slides`` where it pulls sideways."""
    rng, z, rows, torques = np.random.default_rng(5), np.zeros(6), [], (0.0, 0.0)
    l = BASE.half_track_m
    for k in range(round(SECONDS / STEP_S)):
        x, y, yaw, v, w, v_lat = z
        if k % 5 == 0:
            total = (4 * (0.8 - v) - GRADE_X_MPS2 * np.cos(yaw)) / BASE.alpha
            difference = 4 * (0.4 * np.sin(0.05 * k * STEP_S * 2 * np.pi) * l - w) / BASE.alpha_yaw
            torques = (total - difference) / 2, (total + difference) / 2
            rows.append((x, y, yaw, *torques))
        rate = BASE.skid_decay_mps2 / max(np.sqrt(v**2 + v_lat**2 + w**2), 0.3)
        across = -GRADE_X_MPS2 * np.sin(yaw) * slides
        dv = BASE.alpha * (torques[0] + torques[1]) + GRADE_X_MPS2 * np.cos(yaw) + v_lat * w / l / 3
        dw = BASE.alpha_yaw * (torques[1] - torques[0])
        path = [v * np.cos(yaw) - v_lat * np.sin(yaw), v * np.sin(yaw) + v_lat * np.cos(yaw), w / l]
        z = z + STEP_S * np.array([*path, dv, dw, -rate * v_lat - v * w / l + across])
    x, y, yaw, left, right = np.array(rows).T
    t_ns = np.arange(len(x), dtype=np.int64) * 10_000_000
    pose = np.stack([x, y, yaw]) + rng.normal(size=(3, len(x))) * 0.001
    mode = ModeTrack(t_ns, np.full(len(x), ContactMode.SKIDDING, np.int8))
    torque = TorqueTrack(t_ns, left, right, *np.full((2, len(x)), np.nan))
    return Log(PoseTrack(t_ns, *pose), torque, mode, ROBOT)


@pytest.mark.parametrize("slides", [True, False])
def test_a_slope_pulls_sideways_only_where_the_log_shows_it(slides):
    log = skidding_log(slides)
    problem = Problem.of(bin_log(log, SETTINGS, log.mode)).all_fitted()
    usual = fit_model(problem, Extension(BASE, {"slope": {"grade_x_mps2": 0.2, "grade_y_mps2": 0.0}}))
    fit = with_likelier_skids(usual, "slope")
    assert fit.extension.held_sideways is not slides
    assert fit.values == pytest.approx([GRADE_X_MPS2, 0.0], abs=0.02)
    assert with_likelier_skids(usual, "viscous_drag") is usual

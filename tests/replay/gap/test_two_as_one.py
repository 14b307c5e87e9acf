"""Two of a gain, a payload and a yaw inertia in place of the third. The oracle is a robot of another α."""

from itertools import combinations

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.two_as_one import PARAMETER, stands_for, two_as_one
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

TRUE, STEP_S = Base(0.28, 0.34, 0.25, 8.0, 0.0, 0.5, 0.5, 0.0, 5.0), 0.01
RATIO = 0.4
WRONG = {"payload": (1.4, 1.0), "yaw_inertia": (1.0, 1.4), "drive_gain": (1.4, 1.4)}
"""By what the base's α and α_yaw are too large."""
SIZES = {"payload": RATIO, "yaw_inertia": RATIO, "drive_gain": 1 / (1 + RATIO) - 1}
FOUND = {
    "payload": {"drive_gain": SIZES["drive_gain"], "yaw_inertia": SIZES["drive_gain"]},
    "yaw_inertia": {"drive_gain": SIZES["drive_gain"], "payload": SIZES["drive_gain"]},
    "drive_gain": {"payload": RATIO, "yaw_inertia": RATIO},
}


def driven() -> Log:
    """60 s of torques that swing, and where they take a robot of the true α and α_yaw."""
    t_s = np.arange(0.0, 60.0, STEP_S)
    total, apart = np.sin(0.9 * t_s), 0.4 * np.sin(1.7 * t_s)
    v = np.cumsum(TRUE.alpha * total) * STEP_S
    yaw = np.cumsum(np.cumsum(TRUE.alpha_yaw * apart)) * STEP_S**2 / TRUE.half_track_m
    path = np.cumsum(v * np.exp(1j * yaw)) * STEP_S
    noise = np.random.default_rng(3).normal(size=(3, len(t_s))) * [[0.001], [0.001], [0.002]]
    pose = np.stack([path.real, path.imag, yaw]) + noise
    t_ns, unknown = np.round(t_s * 1e9).astype(np.int64), np.full_like(t_s, np.nan)
    torque = TorqueTrack(t_ns, (total - apart) / 2, (total + apart) / 2, unknown, unknown)
    robot = RobotParameters(alpha=TRUE.alpha, alpha_yaw=TRUE.alpha_yaw, half_track_m=TRUE.half_track_m)
    return Log(PoseTrack(t_ns, *pose), torque, None, robot)


def chosen(wrong, sizes):
    """The answer for a base whose α and α_yaw are ``wrong``, with effects of ``sizes`` found."""
    base = TRUE._replace(alpha=TRUE.alpha * wrong[0], alpha_yaw=TRUE.alpha_yaw * wrong[1])
    problem, extension = Problem.of(bin_log(driven(), GateSettings())).all_fitted(), Extension(base)
    for name, size in sizes.items():
        extension = extension.with_effect(name, {PARAMETER[name]: size})
    fit = fit_model(problem, extension)
    found = [
        FittedCandidate(ScoredCandidate(name, {PARAMETER[name]: size}, 100.0, 1.0), fit, 100.0, 90.0, 1e-9)
        for name, size in sizes.items()
    ]
    return two_as_one(problem, fit, found)


@pytest.mark.parametrize("third", PARAMETER)
def test_two_of_the_same_size_are_the_third(third):
    fit, found = chosen(WRONG[third], FOUND[third])
    assert [effect.name for effect in found] == [third]
    assert fit.extension.effects.keys() == {third}
    assert fit.extension.effects[third][PARAMETER[third]] == pytest.approx(SIZES[third], abs=0.02)


@pytest.mark.parametrize("names", [*combinations(PARAMETER, 2)])
def test_two_of_other_sizes_stay(names):
    sizes = {name: 0.3 * SIZES[name] if k else SIZES[name] for k, name in enumerate(names)}
    _, found = chosen((1.4, 1.12), sizes)
    assert [effect.name for effect in found] == [*names]


@pytest.mark.parametrize(
    ("names", "dropped", "same"),
    [
        (["drive_gain", "payload"], ["yaw_inertia"], True),
        (["drive_gain", "slope", "yaw_inertia"], ["payload"], True),
        (["drive_gain"], ["yaw_inertia"], False),
        (["drive_gain", "payload"], ["slope"], False),
        (["drive_gain", "payload"], [], False),
    ],
)
def test_two_stand_for_a_third_that_was_dropped(names, dropped, same):
    assert stands_for(names, dropped) is same

"""Effects and groups of terms that a log asks for whatever its contact modes are."""

import importlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.estimation.diffusion import diffusion_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate
from wmr_replay.gap.formula.modes import Start
from wmr_replay.gap.formula.other_modes import not_hopeless
from wmr_replay.gap.formula.unlabelled import unlabelled_starts
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import BY_NAME
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.whatever_modes import Point, all_rolling, climbed, likeliest_models
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack
from wmr_synth import hidden_log

BENCH = Path(__file__).parents[3] / "bench"
SETTINGS = GateSettings()
DRAG_PER_M = 0.15


def labelled(log: Log, mode: int | None):
    """The base model's fit to a log, all of it in one mode or with its own."""
    track = log.mode if mode is None else ModeTrack(log.pose.t_ns[:1], np.array([mode], np.int8))
    problem = Problem.of(bin_log(log, SETTINGS, track)).all_fitted()
    return problem, Extension(base_of(log.robot))


def models(log: Log, mode: int | None) -> list[dict]:
    """What is likeliest, found from labels of one mode."""
    problem, extension = labelled(log, mode)
    noise = diffusion_of(SETTINGS.diffusion.start_log, SETTINGS.diffusion)
    return [one.effects for one in likeliest_models(problem, evaluate(problem, extension, noise))]


@pytest.fixture(scope="module")
def dragged() -> Log:
    """A patrol on which air holds the robot back, besides skids and slips of its own."""
    return hidden_log("patrol", seed=90_130, hide=[f"aerodynamic_drag:c2_per_m={DRAG_PER_M}"], noise="rtk")[0]


def test_wrong_labels_change_nothing(dragged):
    slipping, own = (models(dragged, mode) for mode in (ContactMode.SLIPPING, None))
    assert slipping == own
    assert list(slipping[0]) == ["aerodynamic_drag"]
    assert slipping[0]["aerodynamic_drag"]["c2_per_m"] == pytest.approx(DRAG_PER_M, rel=0.15)


def test_nothing_is_looked_for_where_the_robot_rolls(dragged):
    assert models(dragged, ContactMode.IDEAL) == []


def test_nothing_is_found_where_nothing_is_missing():
    log, _ = hidden_log("patrol", seed=90_131, noise="rtk")
    assert models(log, ContactMode.SLIPPING) == []


@pytest.fixture(scope="module")
def bumpy() -> Log:
    """A patrol over ground that undulates along x, a hidden form of the benchmark."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(2, "patrol", "mocap", "", 4, 60.0)
        return importlib.import_module("formulas.plants").hidden_world("bumps_x", case).world.log


def starts(log: Log, mode: int | None) -> list[Start]:
    """What formulas begin with, found from labels of one mode."""
    problem, extension = labelled(log, mode)
    noise = diffusion_of(SETTINGS.diffusion.start_log, SETTINGS.diffusion)
    return unlabelled_starts(problem, evaluate(problem, extension, noise))


def test_wrong_labels_do_not_hide_bumpy_ground(bumpy):
    slipping, own = (starts(bumpy, mode) for mode in (ContactMode.SLIPPING, None))
    names = [[*start.fit.extension.effects] for start in slipping]
    assert names == [[*start.fit.extension.effects] for start in own]
    assert all("x)*cos(yaw)" in name for name in names[0])
    assert all(start.price > 0 for start in slipping)


def test_a_part_of_a_log_is_asked_alone(bumpy):
    problem, _ = labelled(bumpy, ContactMode.SLIPPING)
    whole, part = all_rolling(problem), all_rolling(problem.middle(500))
    assert len(whole.binned) == pytest.approx(len(problem.binned) / 2, abs=1)
    assert len(part.binned) == pytest.approx(250, abs=1)
    middle_s = problem.middle(500).binned.t_s
    assert middle_s[0] <= part.binned.t_s[0] <= part.binned.t_s[-1] <= middle_s[-1]


def test_no_group_is_asked_for_where_nothing_is_missing():
    log, _ = hidden_log("patrol", seed=90_131, noise="rtk")
    assert starts(log, ContactMode.SLIPPING) == []


class Line:
    """Rows y_k = θ_k·size with noise of 1: −2 log likelihood is a sum of squares."""

    def __init__(self, size: float, seed: int) -> None:
        self.slopes, draws = np.random.default_rng(seed).normal(size=(2, 4000))
        self.y = self.slopes * size + draws

    def __call__(self, extension: Extension) -> np.ndarray:
        size = extension.effects["viscous_drag"]["c1_per_s"]
        return np.square(self.y - self.slopes * size)


@pytest.mark.parametrize("size", [0.02, 1.5])
def test_a_climb_ends_at_the_least_squares(size):
    line, candidate = Line(size, seed=1), BY_NAME["viscous_drag"]
    robot = RobotParameters(alpha=0.3, alpha_yaw=0.3, half_track_m=0.25)
    extension = Extension(base_of(robot)).with_effect("viscous_drag", {"c1_per_s": 0.0})
    start = Point((candidate,), extension, line(extension), 0.0)
    own = replace(SETTINGS.unlabelled, enough=0.01)
    best = climbed(start, line, own).extension.effects["viscous_drag"]["c1_per_s"]
    assert best == pytest.approx(line.slopes @ line.y / (line.slopes @ line.slopes), abs=2e-3)


def test_a_formula_far_behind_what_is_named_is_not_identified_with(dragged):
    problem, extension = labelled(dragged, ContactMode.SLIPPING)
    noise = diffusion_of(SETTINGS.diffusion.start_log, SETTINGS.diffusion)
    drag = extension.with_effect("aerodynamic_drag", {"c2_per_m": DRAG_PER_M})
    same, other = (
        extension.with_effect(f"unnamed:{term}", {"coefficient": -DRAG_PER_M})
        for term in ("longitudinal:v*abs(v)", "yaw:yaw_rate*abs(yaw_rate)")
    )
    base, fit, *fits = (evaluate(problem, one, noise) for one in (extension, drag, same, other))
    starts = [Start(problem, one, extension) for one in fits]
    selection = SimpleNamespace(base=base, fit=fit, found=())
    assert not_hopeless(starts, problem, selection) == starts[:1]

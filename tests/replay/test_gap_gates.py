"""What the gap analysis does between a scan and a verdict: starts, modes taken anew, placebo, remainders."""

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.attempts import fitted
from wmr_replay.gap.drive import drive_of
from wmr_replay.gap.placebo import placebo_p
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.relabel import unlike_slipping, without_skid, without_slip
from wmr_replay.gap.scan import scan
from wmr_schemas.signals import Log, ModeTrack
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
SWITCH_S = 0.3
SLIPPING = 2


def problem_of(log: Log, *, margin_s: float = 0.04):
    """The log with its own labels, and its base model."""
    return Problem.of(drive_of(log, log.mode, margin_s=margin_s)), base_model(log, None, GIVEN).extension


def relabelled(log: Log, start_s: float, end_s: float, mode: int) -> Log:
    """The log with another mode between two times."""
    seconds = (log.mode.t_ns - log.pose.t_ns[0]) / 1e9
    inside = (seconds >= start_s) & (seconds < end_s)
    track = ModeTrack(log.mode.t_ns, np.where(inside, mode, log.mode.mode).astype(np.int8))
    return Log(log.pose, log.torque, track, log.robot)


@pytest.mark.parametrize(
    ("hide", "key", "share"),
    [
        ("wheel_viscous:nm_per_radps=.03", "nm_per_radps", 0.35),
        ("viscous_drag:c1_per_s=.2", "c1_per_s", 0.35),
        ("torque_imbalance:ratio=.1", "ratio", 0.2),
        ("undeclared_skid:stiffness_ratio=.8", "stiffness_ratio", 0.6),
    ],
)
def test_a_scan_promises_an_effect_at_about_its_size(hide, key, share):
    log, truth = hidden_log("patrol", seed=90_101, hide=[hide], noise="rtk")
    problem, extension = problem_of(log)
    fit = fitted(problem, extension)
    (effect,) = truth["effects"]
    (lead,) = (lead for lead in scan(problem, extension, fit.noise).leads if lead.name == effect["name"])
    assert lead.gain > 20
    assert lead.parameters[key] == pytest.approx(effect["parameters"][key], rel=share)


def test_a_placebo_explains_less_than_an_effect_and_more_than_none():
    log, _ = hidden_log("patrol", seed=90_102, hide=["viscous_drag:c1_per_s=.1"], noise="rtk")
    problem, extension = problem_of(log)
    rest = fitted(problem, extension)
    name, parameters = "viscous_drag", {"c1_per_s": 0.1}
    with_it = fitted(problem, extension.with_effect(name, parameters), rest.noise)
    assert placebo_p(problem, rest, with_it, name) == pytest.approx(0.01)
    beside = fitted(problem, with_it.extension.with_effect("payload", {"mass_ratio": 0.0}), with_it.noise)
    assert placebo_p(problem, with_it, beside, "payload") > 0.2


def test_a_placebo_is_drawn_by_the_seed():
    log, _ = hidden_log("patrol", seed=90_103, noise="poor")
    problem, extension = problem_of(log)
    rest = fitted(problem, extension)
    with_it = fitted(problem, extension.with_effect("payload", {"mass_ratio": 0.0}), rest.noise)
    shares = [placebo_p(problem, rest, with_it, "payload", seed) for seed in (1, 1, 2)]
    assert shares[0] == shares[1]
    assert all(0.01 <= share <= 1 for share in shares)


def test_slipping_that_leaves_other_traction_than_the_models_is_told_from_it():
    hide = ["slip_interval:start_s=30,end_s=39,loss=.4"]
    log, _ = hidden_log("patrol", seed=90_104, hide=hide, noise="rtk")
    called_so = relabelled(log, 30.0, 39.0, SLIPPING)
    problem, extension = problem_of(called_so, margin_s=SWITCH_S)
    rows = unlike_slipping(problem, fitted(problem, extension))
    t_s = problem.drive.t_s
    true_slip = (problem.drive.mode == SLIPPING) & ((t_s < 29.5) | (t_s > 39.5))
    assert rows[(t_s > 31) & (t_s < 38) & (problem.drive.mode == SLIPPING)].all()
    assert true_slip.any()
    assert not rows[true_slip].any()


def test_where_nothing_slips_nothing_is_unlike_slipping():
    log, _ = hidden_log("cruise", seed=90_105, noise="rtk")
    problem, extension = problem_of(log)
    assert not unlike_slipping(problem, fitted(problem, extension)).any()


def test_modes_without_slip_or_skid_keep_the_other():
    track = ModeTrack(np.arange(4, dtype=np.int64), np.array([0, 1, 2, 3], np.int8))
    assert without_slip(track).mode.tolist() == [0, 1, 0, 1]
    assert without_skid(track).mode.tolist() == [0, 0, 2, 2]

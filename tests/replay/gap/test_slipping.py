"""A loss of traction against the model's own slipping: how exactly a log slips, intervals that lose something
else, and the likeliest history of slipping.
"""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, made_log, problem_of

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import cost_of, evaluate, fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at
from wmr_replay.gap.estimation.slip_disturbance import with_slip_disturbance
from wmr_replay.gap.formula.modes import rolling_starts
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.undecided import as_said
from wmr_replay.gap.search.labellings import one_limit, same_place
from wmr_replay.gap.search.preliminary import doubted_slip, lasting_or_alone, no_slip
from wmr_replay.gap.search.slip_doubts import (
    Doubt,
    as_losses,
    in_place_of_slipping,
    slips_alike,
    slips_as_modelled,
    unlike_slipping,
)
from wmr_replay.gap.search.slip_test import (
    gain_unlabelled,
    least_excess,
    loses_as_slipping,
    may_be_slipping,
)
from wmr_replay.gap.search.slipping_history import (
    Pieces,
    changes_by_run,
    cost_of_history,
    likeliest_history,
)
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack, PoseTrack
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
SWITCH_S = 0.3


def exact(log: Log):
    """The log with its own labels, as an identifier would know them, with its own disturbance of slipping."""
    gates, extension = GateSettings(), base_model(log, None, GIVEN).extension
    problem = Problem.of(bin_log(log, gates, log.mode, margin_s=SWITCH_S))
    own = with_slip_disturbance(problem, extension)
    return Problem.of(bin_log(log, own, log.mode, margin_s=SWITCH_S)), extension


def relabelled(log: Log, start_s: float, end_s: float, mode: int) -> Log:
    """The log with another mode between two times."""
    t_ns = np.arange(log.pose.t_ns[0], log.pose.t_ns[-1], 10_000_000)
    held = np.maximum(np.searchsorted(log.mode.t_ns, t_ns, side="right") - 1, 0)
    seconds = (t_ns - log.pose.t_ns[0]) / 1e9
    inside = (seconds >= start_s) & (seconds < end_s)
    return replace(log, mode=ModeTrack(t_ns, np.where(inside, mode, log.mode.mode[held]).astype(np.int8)))


def test_slipping_that_follows_the_model_has_little_disturbance():
    log, _ = hidden_log("patrol", seed=90_104, noise="rtk")
    problem, extension = exact(log)
    assert np.mean(problem.binned.slips) > 0.03
    assert problem.settings.filter.slip_disturbance_mps2_rthz <= 0.05
    assert slips_as_modelled(problem, fit_model(problem, extension))


def test_slipping_that_never_follows_the_model_has_more():
    log, _ = hidden_log("patrol", seed=90_104, noise="rtk")
    heavier = replace(log, robot=replace(log.robot, wheel_inertia_kgm2=log.robot.wheel_inertia_kgm2 / 4))
    shares = [robot.slip_shares[0] for robot in (log.robot, heavier.robot)]
    assert abs(shares[0] - shares[1]) > 0.1
    q = [exact(one)[0].settings.filter.slip_disturbance_mps2_rthz for one in (log, heavier)]
    assert q[1] >= 2 * q[0]


def test_where_masses_are_unknown_only_a_small_loss_is_no_slipping():
    log, _ = hidden_log("patrol", seed=90_104, noise="rtk")
    bare = replace(log, robot=replace(log.robot, wheel_inertia_kgm2=None))
    problem, extension = exact(bare)
    assert (
        problem.settings.filter.slip_disturbance_mps2_rthz == GateSettings().filter.slip_disturbance_mps2_rthz
    )
    fit = fit_model(problem, extension)
    for loss, like in ((0.2, False), (0.5, True)):
        lost = {"start_s": 30.0, "end_s": 35.0, "loss": loss}
        beside = replace(fit, extension=extension.with_effect("slip_interval", lost))
        assert may_be_slipping(problem, beside, "slip_interval") is like


@pytest.mark.parametrize(("apart", "alike"), [(0.12, True), (-0.12, True), (0.2, False), (-0.2, False)])
def test_a_loss_as_large_as_slippings_must_explain_more_beyond_it(apart, alike):
    """Ahead; in turning, this robot's slipping loses about as much."""
    log, _ = hidden_log("patrol", seed=90_104, noise="rtk")
    problem, extension = exact(log)
    share, share_yaw = extension.base.slip_share, extension.base.slip_share_yaw
    assert abs(share - share_yaw) < 0.06
    lost = {"start_s": 30.0, "end_s": 35.0, "loss": 1 - (share + share_yaw) / 2 - apart}
    fit = evaluate(problem, extension.with_effect("slip_interval", lost), fit_model(problem, extension).noise)
    settings = problem.settings.slip
    assert loses_as_slipping(fit, "slip_interval", settings) is alike
    assert not loses_as_slipping(fit, "torque_saturation", settings)
    price = 3 * np.log(3 * len(problem.binned)) + 2 * np.log(len(problem.binned))
    margin = settings.separate_alike if alike else settings.separate
    assert least_excess(problem, fit, "slip_interval") == pytest.approx(price + margin)


@pytest.mark.parametrize("loss", [0.4, 0.95])
def test_an_interval_that_loses_more_or_less_than_slipping_is_doubted(loss):
    hide = [f"slip_interval:start_s=30,end_s=39,loss={loss}"]
    log, _ = hidden_log("patrol", seed=90_104, hide=hide, noise="rtk")
    problem, extension = exact(relabelled(log, 30.0, 39.0, ContactMode.SLIPPING))
    model = 1 - extension.base.slip_share
    assert abs(loss - model) > 0.05
    (first, *others) = unlike_slipping(problem, fit_model(problem, extension))
    t_s = problem.binned.t_s
    assert t_s[first.first] == pytest.approx(30.0, abs=1.0)
    assert t_s[first.last - 1] == pytest.approx(39.0, abs=1.0)
    assert first.loss == pytest.approx(loss, abs=0.05)
    assert others == []
    (time, place) = as_losses(problem.binned, first)
    assert time[1]["loss"] == place[1]["loss"] == first.loss
    assert place[1]["radius_m"] > 0


@pytest.mark.parametrize(("loss", "like"), [(0.4, False), (None, True)])
def test_a_loss_is_told_from_slipping_by_its_size(loss, like):
    """None hides nothing: the log's own slipping is taken for an effect."""
    hide = [] if loss is None else [f"slip_interval:start_s=30,end_s=40,loss={loss}"]
    log, truth = hidden_log("patrol", seed=90_106, hide=hide, noise="rtk")
    problem, extension = exact(log)
    lost = truth["effects"][0]["parameters"] if hide else longest_slip(problem)
    ideal = exact(relabelled(log, lost["start_s"] - 0.1, lost["end_s"] + 0.1, ContactMode.IDEAL))[0]
    size = loss or 1 - extension.base.slip_share
    fit = fit_model(ideal, extension.with_effect("slip_interval", {**lost, "loss": size}))
    assert may_be_slipping(ideal, fit, "slip_interval") is like
    least = least_excess(ideal, fit, "slip_interval")
    assert (gain_unlabelled(ideal, fit, "slip_interval") < least) is like
    given = Problem.of(bin_log(log, GateSettings(), log.mode))
    assert not may_be_slipping(given, fit, "slip_interval")


@pytest.mark.parametrize(("loss", "like"), [(0.6, False), (0.68, True)])
def test_a_loss_near_slipping_s_is_told_from_it_where_the_log_slips_elsewhere(loss, like):
    """The model's slipping loses .75 ahead and .69 in turning, and the log slips so twice."""
    lost = {"start_s": 55.0, "end_s": 70.0, "loss": loss}
    hide = ["slip_interval:" + ",".join(f"{key}={value}" for key, value in lost.items())]
    log, _ = hidden_log("patrol", seed=90_106, hide=hide, noise="rtk")
    problem, extension = exact(log)
    model = 1 - np.array([extension.base.slip_share, extension.base.slip_share_yaw])
    assert np.any(np.abs(loss - model) < problem.settings.slip.least_apart)
    fit = fit_model(problem, extension.with_effect("slip_interval", lost))
    assert may_be_slipping(problem, fit, "slip_interval") is like


@pytest.mark.parametrize(
    ("loss", "alone", "beside"), [(0.6, False, True), (0.7, True, True), (0.4, False, False)]
)
def test_beside_another_effect_a_loss_may_be_slipping_by_one_channel(loss, alone, beside):
    """Slipping loses .75 ahead and .65 in turning; the model may be wrong by .1."""
    base = BASE._replace(slip_share=0.25, slip_share_yaw=0.35)
    settings = GateSettings().slip
    assert slips_alike(base, loss, settings) is alone
    assert slips_alike(base, loss, settings, alone=False) is beside


def test_with_all_slipping_left_out_a_loss_is_a_hint_alone():
    loss, drag = {"slip_interval": {"loss": 0.5}}, {"viscous_drag": {"c1_per_s": 0.1}}
    assert lasting_or_alone(Extension(BASE, loss | drag)).effects == drag
    assert lasting_or_alone(Extension(BASE, loss)).effects == loss


@pytest.mark.parametrize(("seconds", "doubted"), [(30.0, True), (5.0, False)])
def test_slipping_for_much_of_a_log_is_left_out_beside_what_else_is_found(seconds, doubted):
    log, _ = hidden_log("patrol", seed=90_106, noise="rtk")
    log = relabelled(replace(log, mode=rolling(log)), 10.0, 10.0 + seconds, ContactMode.SLIPPING)
    problem, _ = exact(log)
    in_any_case, where_nothing_is_found = list(doubted_slip(problem)), list(no_slip(problem))
    assert (len(in_any_case), len(where_nothing_is_found)) == ((1, 0) if doubted else (0, 1))
    (labelling,) = (*in_any_case, *where_nothing_is_found)
    assert not np.any(labelling.problem.binned.slips)
    assert not labelling.may_be_answer


def rolling(log: Log) -> ModeTrack:
    """Ideal rolling throughout."""
    return ModeTrack(log.pose.t_ns[:1], np.array([ContactMode.IDEAL], np.int8))


def test_a_loss_beside_slipping_is_found_where_both_are_called_slipping():
    """The log slips from 38.4 to 42.8 s; a loss that follows at once is called one interval with it."""
    hide = ["slip_interval:start_s=42.8,end_s=51,loss=0.4"]
    log, _ = hidden_log("patrol", seed=90_106, hide=hide, noise="rtk")
    problem, extension = exact(relabelled(log, 42.8, 51.0, ContactMode.SLIPPING))
    base, t_s = fit_model(problem, extension), problem.binned.t_s
    (both, *_) = unlike_slipping(problem, base)
    assert t_s[both.first] == pytest.approx(38.4, abs=0.2)
    ((rows, ((name, found), *_)), *_) = in_place_of_slipping(problem, base)
    assert name == "slip_interval"
    assert found["loss"] == pytest.approx(0.4, abs=0.05)
    own = problem.binned.slips & ~rows
    assert np.mean(own[(t_s > 38.5) & (t_s < 41.0)]) > 0.9
    assert np.mean(rows[(t_s > 43.5) & (t_s < 50.0)]) > 0.9


def test_slipping_that_follows_the_model_is_no_loss_in_a_place():
    log, _ = hidden_log("patrol", seed=90_106, noise="rtk")
    problem, extension = exact(log)
    assert in_place_of_slipping(problem, fit_model(problem, extension)) == []


def longest_slip(problem: Problem) -> dict[str, float]:
    """Beginning and end of the longest slipping interval."""
    edges = np.flatnonzero(np.diff(problem.binned.slips, prepend=False, append=False)).reshape(-1, 2)
    a, b = max(edges.tolist(), key=lambda run: run[1] - run[0])
    return {"start_s": float(problem.binned.t_s[a]), "end_s": float(problem.binned.t_s[b - 1])}


def test_the_cost_counts_held_out_rows_and_changes_of_mode():
    log, _ = hidden_log("cruise", seed=90_105, noise="rtk")
    problem, extension = exact(log)
    fit = fit_model(problem, extension)
    changes = sum(a != b for a, b in pairwise(problem.binned.mode))
    assert cost_of(fit) == pytest.approx(fit.row_deviance.sum() + 9.4 * changes)


def drawn_pieces(rng: np.random.Generator, m: int, true: np.ndarray, noise: float) -> Pieces:
    """Innovations of a planted history, linear in the losses of each piece."""
    slipping, rolling = np.full((2, m), 0.5), np.zeros((2, m))
    psi = rng.normal(size=(200, 2, m)) * 2.0
    e = np.einsum("nac,ac->n", psi, np.where(true, slipping, rolling)) + noise * rng.normal(size=200)
    flat = psi.reshape(200, 2 * m)
    G = (flat.T @ flat).reshape(2, m, 2, m)
    return Pieces((flat.T @ e).reshape(2, m), G, rolling, slipping, np.zeros(m, bool), np.ones(m, bool))


def test_the_likeliest_history_is_the_best_of_all():
    rng = np.random.default_rng(3)
    for _ in range(10):
        true = np.repeat(rng.uniform(size=4) < 0.5, 2)
        pieces = drawn_pieces(rng, 8, true, noise=3.0)
        found = likeliest_history(pieces, 9.4)
        costs = [cost_of_history(pieces, np.array(b), 9.4) for b in product([False, True], repeat=8)]
        assert cost_of_history(pieces, found, 9.4) == pytest.approx(min(costs))


def test_pieces_that_are_not_free_stay():
    rng = np.random.default_rng(4)
    true = np.array([True, True, True, False, False, True])
    pieces = drawn_pieces(rng, 6, true, noise=0.1)
    free = np.array([True, True, False, True, True, True])
    found = likeliest_history(pieces._replace(free=free), 0.0)
    assert not found[2]


def test_changes_are_counted_as_they_are():
    rng = np.random.default_rng(5)
    for value in (False, True):
        slips = rng.uniform(size=9) < 0.5
        counted = changes_by_run(slips, value)
        for first in range(9):
            for last in range(first + 1, 10):
                changed = slips.copy()
                changed[first:last] = value
                more = np.sum(np.diff(changed) != 0) - np.sum(np.diff(slips) != 0)
                assert counted[first, last] == more


@pytest.fixture(scope="module")
def mislabelled():
    """A log that loses thrust in proportion to v, with most of its drive called slipping."""
    log, _ = hidden_log("patrol", hide=["viscous_drag:c1_per_s=0.4"], seed=90_104, noise="mocap")
    log = relabelled(log, 10.0, 80.0, ContactMode.SLIPPING)
    gates, extension = GateSettings(), base_model(log, None, GIVEN).extension
    problem = Problem.of(bin_log(log, gates, log.mode, margin_s=SWITCH_S))
    return problem, fit_model(problem, extension)


def test_a_term_that_false_slipping_hides_is_seen_where_all_rolls(mislabelled):
    problem, base = mislabelled
    seen = rolling_starts(problem, base)
    assert all(not np.any(start.problem.binned.slips) for start in seen)
    terms = {name for start in seen for name in start.fit.extension.effects}
    assert "unnamed:longitudinal:v" in terms


def test_an_interval_that_loses_nothing_is_said_not_to_slip(mislabelled):
    problem, base = mislabelled
    first, last = slipping_span(problem)
    assert "does not slip: 1% of the traction" in as_said(problem, base, Doubt(first, last, 0.01, 50.0))
    assert "slips, or a slip_interval" in as_said(problem, base, Doubt(first, last, 0.4, 50.0))


def slipping_span(problem: Problem) -> tuple[int, int]:
    """First and last row that is called slipping."""
    rows = np.flatnonzero(problem.binned.slips)
    return int(rows[0]), int(rows[-1])


@pytest.mark.parametrize("again_s", [(30.0, 30.3), (20.0, 20.3)])
def test_a_short_slip_in_the_place_of_a_doubtful_one_may_be_the_same_patch(again_s):
    """There and back: the robot is in the place at 10 and at 30 s, and elsewhere at 20 s."""
    log = made_log(3)
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    path = PoseTrack(log.pose.t_ns, np.where(t_s < 20.0, t_s, 40.0 - t_s), 0 * t_s, 0 * t_s)
    problem = problem_of(replace(log, pose=path)).all_fitted()
    binned = problem.binned
    slips = (abs(binned.t_s - 10.0) < 1.0) | ((binned.t_s > again_s[0]) & (binned.t_s < again_s[1]))
    slipping = problem.relabelled(with_mode_at(binned, slips, ContactMode.SLIPPING))
    first, last = np.flatnonzero(abs(binned.t_s - 10.0) < 1.0)[[0, -1]]
    found = list(same_place(slipping, [Doubt(int(first), int(last) + 1, 0.5, 100.0)]))
    assert [bool(np.any(one.problem.binned.slips)) for one in found] == (
        [False] if again_s[0] == 30.0 else []
    )


@pytest.mark.parametrize(("share", "tried"), [(0.02, True), (0.06, True), (0.15, False)])
def test_slipping_of_the_largest_torques_alone_may_be_a_limit(share, tried):
    """Half of the rows above a torque slip, ``share`` of all."""
    problem = problem_of(made_log(3, seconds=80.0)).all_fitted()
    extension, binned = Extension(BASE), problem.binned
    largest = np.max(np.abs(extension.mean_torques(binned)), axis=0)
    hardest = largest > np.quantile(largest, 1 - 2 * share)
    slips = hardest & (np.cumsum(hardest) <= np.sum(hardest) / 2)
    slipping = problem.relabelled(with_mode_at(binned, slips, ContactMode.SLIPPING))
    found = list(one_limit(slipping, extension))
    assert len(found) == tried
    for one in found:
        assert not np.any(one.problem.binned.slips)
        ((name, start),) = one.hints
        least_nm = largest[slipping.binned.slips].min()
        assert (name, start["limit_nm"]) == ("torque_saturation", pytest.approx(least_nm))


def test_no_limit_is_looked_for_where_nothing_slips_or_everything_does():
    problem = problem_of(made_log(3)).all_fitted()
    all_rows = np.ones(len(problem.binned), bool)
    slipping = problem.relabelled(with_mode_at(problem.binned, all_rows, ContactMode.SLIPPING))
    assert list(one_limit(problem, Extension(BASE))) == list(one_limit(slipping, Extension(BASE))) == []

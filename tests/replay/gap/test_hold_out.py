"""The hold-out gate on constructed gaps and innovations, and on short logs of a plain loop."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import binom
from tests.replay.gap.plain_loop import BASE, NOISE, SETTINGS, made_fit, made_log, problem_of, with_drag

from wmr_replay.gap.estimation.path_error import WindowErrors, error_growth, near, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at
from wmr_replay.gap.evidence.holdout import (
    Fold,
    GapChange,
    Prediction,
    change_where,
    clearly_larger,
    gap_change,
    held_out_deviance,
    is_placed,
    is_proven,
    path_change,
    prediction,
    prove,
    refitted,
    steady,
    unseen_losses,
)
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.modes import ContactMode

HOLD_OUT = SETTINGS.hold_out


def gaps(position_m, floor_m=0.0, n=9) -> WindowErrors:
    """Windows with the same gap in position and, scaled, in yaw."""
    position, floor = np.full(n, position_m, np.float64), np.full(n, float(floor_m))
    return WindowErrors(position, 0.1 * position, floor, 0.1 * floor, np.arange(float(n)))


@given(st.floats(0.0, 0.95))
def test_the_reduction_of_the_gap_is_known(reduction):
    assume(abs(reduction - HOLD_OUT.least_change) > 1e-9)
    change = gap_change(gaps(1.0), gaps(1.0 - reduction), gaps(reduction), HOLD_OUT)
    if reduction <= HOLD_OUT.least_change:
        assert change is None
        return
    assert change.reduction == pytest.approx(reduction, abs=1e-9)
    assert change.larger_p == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("reduction", "larger_p", "larger"),
    [(0.02, 0.04, False), (-0.02, 0.06, False), (-0.02, 0.009, True), (-0.5, 0.4, False)],
)
def test_a_gap_is_clearly_larger_over_all_and_in_most_windows(reduction, larger_p, larger):
    assert clearly_larger(GapChange(reduction, larger_p, 1.0, 1.0, 9), HOLD_OUT) is larger


def test_a_gap_that_grows_in_every_window_is_clearly_larger():
    assert clearly_larger(gap_change(gaps(1.0), gaps(1.1), gaps(0.1), HOLD_OUT), HOLD_OUT)


@pytest.mark.parametrize("left", [0.0, 2.0])
def test_what_an_effect_promises_is_what_the_simulations_are_apart(left):
    """Gaps b with the effect and, at right angles to them, d between the simulations: a² = b² + d²."""
    apart, n = 0.5, 9
    change = gap_change(gaps(np.hypot(left, apart)), gaps(left), gaps(apart), HOLD_OUT)
    assert change.promised == pytest.approx(change.reduction)
    scattered = gaps(np.hypot(left, apart) + 0.4 * (-1.0) ** np.arange(n), n=n)
    unsure = gap_change(scattered, gaps(left), gaps(apart), HOLD_OUT)
    assert unsure.promised < change.promised


@pytest.mark.parametrize(
    ("promised", "p_value", "placed", "proven"),
    [
        (0.02, 1e-5, False, True),
        (0.02, 1e-3, False, False),
        (0.02, 1e-5, True, False),
        (0.2, 1e-5, False, False),
    ],
)
def test_a_gap_that_the_true_effect_may_leave_as_it_is_leaves_the_word_to_the_prediction(
    promised, p_value, placed, proven
):
    change = GapChange(reduction=-0.01, larger_p=0.7, noise_share=0.1, promised=promised, n_windows=9)
    assert is_proven(Prediction(p_value, 0.0), change, 15, HOLD_OUT, placed=placed) is proven
    assert is_proven(Prediction(p_value, 0.0), change._replace(reduction=0.12), 15, HOLD_OUT, placed=placed)
    assert not is_proven(
        Prediction(p_value, 0.0), change._replace(larger_p=0.001), 15, HOLD_OUT, placed=placed
    )


@pytest.mark.parametrize(
    ("p_value", "gain", "proven"), [(0.005, 31.0, True), (0.02, 31.0, False), (0.005, 29.0, False)]
)
def test_blocks_that_gain_much_are_clear_at_a_usual_level(p_value, gain, proven):
    change = GapChange(reduction=0.01, larger_p=0.7, noise_share=0.1, promised=0.02, n_windows=9)
    assert is_proven(Prediction(p_value, gain), change, 15, HOLD_OUT, placed=False) is proven


@pytest.mark.parametrize(
    ("p_value", "beyond_one", "proven"), [(0.02, 31.0, True), (0.02, 29.0, False), (0.06, 31.0, False)]
)
@pytest.mark.parametrize("seen", [True, False])
def test_few_blocks_that_gain_much_are_clear_where_more_than_one_does(p_value, beyond_one, proven, seen):
    """Where windows of the gap show the effect, and where none does."""
    change = GapChange(reduction=0.01, larger_p=0.7, noise_share=0.1, promised=0.02, n_windows=9)
    predicted = Prediction(p_value, 100.0, beyond_one)
    assert is_proven(predicted, change if seen else None, 15, HOLD_OUT, placed=False) is proven


@pytest.mark.parametrize(("n_windows", "proven"), [(1, True), (3, True), (4, False)])
def test_the_gap_of_few_windows_does_not_overrule_a_clear_prediction(n_windows, proven):
    change = GapChange(reduction=-0.1, larger_p=0.5, noise_share=0.1, promised=0.3, n_windows=n_windows)
    for placed in (True, False):
        assert is_proven(Prediction(1e-5, 20.0), change, 15, HOLD_OUT, placed=placed) is proven
        assert not is_proven(Prediction(1e-3, 20.0), change, 15, HOLD_OUT, placed=placed)


@pytest.mark.parametrize(
    ("p_value", "beyond_one", "reduction", "proven"),
    [
        (1e-5, 31.0, 0.01, True),
        (1e-5, 31.0, -0.01, False),
        (1e-5, 29.0, 0.01, False),
        (1e-3, 31.0, 0.01, False),
        (1e-5, 29.0, 0.031, True),
    ],
)
def test_where_many_blocks_say_so_and_by_much_the_gap_need_but_shrink(p_value, beyond_one, reduction, proven):
    change = GapChange(reduction, larger_p=0.5, noise_share=0.1, promised=0.2, n_windows=9)
    predicted = Prediction(p_value, 100.0, beyond_one)
    assert is_proven(predicted, change, 15, HOLD_OUT, placed=False) is proven


def test_a_loss_in_an_interval_is_placed_and_a_drag_is_not():
    drive = problem_of(made_log(1, seconds=20.0))
    e = np.zeros((len(drive.binned), 3))
    base = made_fit(drive, Extension(BASE), e)
    drag = made_fit(drive, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}), e)
    slip = {"slip_interval": {"start_s": 10.0, "end_s": 20.0, "loss": 0.5}}
    assert not is_placed(base, drag)
    assert is_placed(base, made_fit(drive, Extension(BASE, slip), e))
    assert not is_placed(made_fit(drive, Extension(BASE, slip), e), made_fit(drive, Extension(BASE, slip), e))


@pytest.mark.parametrize(("start_s", "end_s", "kept"), [(8.1, 11.9, True), (4.0, 11.9, False)])
def test_a_loss_that_lies_among_held_out_rows_is_not_fitted_from_the_others(start_s, end_s, kept):
    """Rows from 8 to 12 s are held out: a loss in these alone is that of the whole log, and no other."""
    drive = problem_of(made_log(1, seconds=24.0))
    lost = {"slip_interval": {"start_s": start_s, "end_s": end_s, "loss": 0.5}}
    whole = evaluate(drive.all_fitted(), Extension(BASE, lost), NOISE)
    assert unseen_losses(drive, whole) == ([("slip_interval", "loss")] if kept else [])
    again = refitted(drive, whole).extension.effects["slip_interval"]
    assert (again["loss"] == 0.5) is kept
    assert (again["start_s"], again["end_s"]) == (start_s, end_s)


def folds_of(problem: Problem, gains) -> list[Fold]:
    """Two models whose deviances differ by ``gains`` (n,), and whose innovations differ everywhere."""
    e = np.zeros((len(problem.binned), 3))
    without = replace(made_fit(problem, Extension(BASE), e + 1), row_deviance=gains)
    return [Fold(problem, without, made_fit(problem, Extension(BASE), e))]


@pytest.fixture(scope="module")
def long_drive():
    """Five minutes at the noise of the others, for statistics over blocks."""
    return problem_of(made_log(6, seconds=300.0))


def test_equal_models_are_told_apart_no_more_often_than_the_level(long_drive):
    rng, draws = np.random.default_rng(7), 400
    p = [
        prediction(folds_of(long_drive, rng.normal(size=len(long_drive.binned)))).p_value
        for _ in range(draws)
    ]
    least, most = binom.ppf([0.001, 0.999], draws, 0.05)
    assert least <= np.sum(np.array(p) < 0.05) <= most


def test_a_better_prediction_is_seen_and_a_worse_one_is_not(long_drive):
    noise = np.random.default_rng(8).normal(size=len(long_drive.binned))
    assert prediction(folds_of(long_drive, noise + 0.3)).p_value < 1e-4
    assert prediction(folds_of(long_drive, noise - 0.3)).p_value > 0.999


def test_models_that_never_differ_prove_nothing(long_drive):
    (fold,) = folds_of(long_drive, np.ones(len(long_drive.binned)))
    same = replace(fold.without, row_deviance=np.zeros(len(long_drive.binned)))
    assert prediction([fold._replace(with_it=same)]) == (1.0, 0.0, 0.0)


def test_one_block_that_gains_all_is_left_out_of_what_others_gain(long_drive):
    held_out = np.flatnonzero(~long_drive.train)
    for rows, beyond in ((held_out[[0]], 0.0), (held_out[[0, -1]], 40.0)):
        gains = np.zeros(len(long_drive.binned))
        gains[rows] = np.array([40.0, 50.0])[: len(rows)]
        found = prediction(folds_of(long_drive, gains))
        assert (found.gain, found.beyond_one) == pytest.approx((gains.sum(), beyond))


def test_what_hindsight_says_of_held_out_blocks_does_not_count():
    """An identifier that calls every held-out row slipping changes the likelihood, and not the proof."""
    problem = problem_of(made_log(1, drag_per_s=0.1), margin_s=0.3).fold(0)
    held_out = ~problem.train
    slips = problem.relabelled(with_mode_at(problem.binned, held_out, ContactMode.SLIPPING))
    rolls, slipped = (evaluate(part, Extension(BASE), NOISE) for part in (problem, slips))
    assert np.abs(rolls.row_deviance - slipped.row_deviance)[held_out].sum() > 100
    causal = [held_out_deviance(*pair)[held_out] for pair in ((problem, rolls), (slips, slipped))]
    assert causal[1] == pytest.approx(causal[0], abs=0.5)


def test_a_drag_is_proven_and_an_effect_that_is_not_there_is_not():
    problem, without, with_it = with_drag()
    assert with_it.values[0] == pytest.approx(0.1, rel=0.1)
    proof = prove(problem, without, with_it)
    assert proof.holds
    assert proof.p_value < 1e-3
    assert np.mean(proof.after.position_m) < np.mean(proof.before.position_m) / 3
    beside = fit_model(problem, with_it.extension.with_effect("payload", {"mass_ratio": 0.0}), with_it.noise)
    assert not prove(problem, with_it, beside).holds
    assert not prove(problem, with_it, with_it).holds


@pytest.mark.parametrize("gain", [-0.2, 0.1])
def test_an_effect_moves_the_path_by_what_kinematics_say(gain):
    """A change Δa of the acceleration on a straight drive, each path fitted by a line. Of ½ Δa t² in n rows
    h apart, ½ |Δa| h² (n − 1)(n − 2)/6 is left at the ends, and less between them; from one start all of it.
    """
    problem = problem_of(made_log(9, seconds=20.0, lively=False))
    without = evaluate(problem, Extension(BASE), NOISE)
    with_it = evaluate(problem, Extension(BASE, {"drive_gain": {"ratio": gain}}), NOISE)
    for seconds in (2.0, 4.0):
        n, h = round(seconds / SETTINGS.bins.bin_s) - 1, SETTINGS.bins.bin_s
        expected = abs(gain) * BASE.alpha * 0.5 * h**2 * (n - 1) * (n - 2) / 12
        assert path_change(problem, without, with_it, seconds) == pytest.approx(expected, rel=0.05)
        whole = abs(gain) * BASE.alpha * 0.5 * (h * (n - 1)) ** 2 / 2
        moved = path_change(problem, without, with_it, seconds, same_start=True)
        assert moved == pytest.approx(whole, rel=0.05)
    assert path_change(problem, without, without, 4.0) == 0


def test_the_time_of_a_load_comes_from_all_rows():
    """It comes at 10 s, where 8 to 12 s are held out."""
    problem = problem_of(made_log(1, load=(0.5, 10.0)))
    start = Extension(BASE, {"load_step": {"mass_ratio": 0.4, "t0_s": 9.6}})
    fit, whole = (
        fit_model(part, start).extension.effects["load_step"] for part in (problem, problem.all_fitted())
    )
    assert not problem.train[np.searchsorted(problem.binned.t_s, 10.0)]
    assert fit["t0_s"] == whole["t0_s"] == pytest.approx(10.0, abs=0.3)
    assert fit["mass_ratio"] == pytest.approx(0.5, abs=0.1)


def test_a_simulation_that_runs_away_is_far_and_no_farther():
    whitened = np.array([0.5, -3.0, 1e150, -1e200, np.inf, -np.inf, np.nan])
    assert near(whitened, 1e6).tolist() == [0.5, -3.0, 1e6, -1e6, 1e6, -1e6, 1e6]


ARM_PER_M, BEHIND_M, TORQUE_NM = 4.0, 0.05, 0.5
"""k = l m/I, how far a centre of mass lies behind the axle, and the sum of a made log's torques."""


def grown_by_hand(start_s: float, end_s: float, offset_m: float) -> float:
    """∫ exp(∫ −k d v/l) dt over the window, by its length: dw/dt = −k d v w/l with v = α u t, from w = 1."""
    t_s = np.linspace(start_s, end_s, 4001)
    half_rate = -ARM_PER_M * offset_m * BASE.alpha * TORQUE_NM / BASE.half_track_m / 2
    return float(np.trapezoid(np.exp(half_rate * (t_s**2 - start_s**2)), t_s) / (end_s - start_s))


@pytest.mark.parametrize("offset_m", [0.0, -BEHIND_M, BEHIND_M])
def test_an_error_of_the_start_grows_where_the_centre_of_mass_lies_behind_the_axle(offset_m):
    binned = problem_of(made_log(1, lively=False, seconds=12.0)).binned
    base = BASE._replace(com_yaw_per_m=ARM_PER_M)
    extension = Extension(base).with_effect("com_offset", {"offset_m": offset_m})
    windows = windows_of(binned, np.ones(len(binned), bool))
    expected = [grown_by_hand(binned.t_s[a], binned.t_s[b - 1], offset_m) for a, b in windows]
    assert error_growth(binned, extension, windows) == pytest.approx(expected, rel=0.1)
    assert (max(expected) > HOLD_OUT.most_growth) is (offset_m < 0)


def test_windows_whose_simulation_is_unstable_are_no_proof():
    """The last window, in which an error grows most, is not counted; where most are not, no gap is."""
    problem = problem_of(made_log(1, lively=False, seconds=12.0)).fold(0)
    behind = Extension(BASE._replace(com_yaw_per_m=ARM_PER_M)).with_effect(
        "com_offset", {"offset_m": -BEHIND_M}
    )
    stable, unstable = (evaluate(problem, one, NOISE) for one in (Extension(BASE), behind))
    assert steady(Fold(problem, stable, stable)).all()
    fast = Fold(problem, stable, unstable)
    assert not steady(fast)[-1]
    assert not steady(Fold(problem, unstable, stable))[-1]
    worse = [gaps(1.0), gaps(np.array([0.5] * 8 + [90.0])), gaps(0.9)]
    counted = np.array([True] * 8 + [False])
    assert change_where(counted, worse, HOLD_OUT).reduction == pytest.approx(0.5)
    assert change_where(np.ones(9, bool), worse, HOLD_OUT).reduction < 0
    assert change_where(~counted, worse, HOLD_OUT) is None
    none = [gaps(1.0, n=0)] * 3
    assert change_where(np.zeros(0, bool), none, HOLD_OUT) is None

"""The gates on inputs whose answer is known: constructed innovations with and without an effect, and short
logs of a plain loop. The oracles are the statistics of Gaussian noise and the kinematics of a straight drive.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom
from tests.replay.gap.plain_loop import (
    BASE,
    NOISE,
    SETTINGS,
    candidate,
    made_fit,
    made_log,
    problem_of,
    with_drag,
)

from wmr_replay.gap.estimation.covariance import inverse_information, robust_covariance
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.evidence.excitation import (
    excitation_ratios,
    gain_in_manoeuvres,
    manoeuvres,
    times_the_disturbance,
    too_calm_for,
    torques_of,
)
from wmr_replay.gap.evidence.placebo import block_scores, placebo_p
from wmr_replay.gap.evidence.significance import correlation, wald_p
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.locate import marked, placed
from wmr_replay.gap.result.result import Where
from wmr_replay.gap.result.unexplained import unexplained
from wmr_replay.gap.search import select
from wmr_replay.gap.search.eliminate import margin_for, same_tyres, with_tyres_of_payload
from wmr_replay.gap.search.select import (
    confirm,
    first_tested,
    forward_selection,
    remainder,
    rest_as_likely,
)
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack


@pytest.fixture(scope="module")
def drive():
    """40 s of the base model."""
    return problem_of(made_log(1))


@pytest.fixture(scope="module")
def dragged():
    """The same with a drag of 0.1 1/s; the model without it and the model with it."""
    return with_drag()


def estimated(problem: Problem, rng, size: float, *, coloured: bool = False) -> Fit:
    """A drag estimated by least squares from white innovations, or innovations alike within each 2 s."""
    n = len(problem.binned)
    psi, e = rng.normal(size=(n, 3, 1)), rng.normal(size=(n, 3))
    if coloured:
        block = (problem.binned.t_s // 2).astype(int)
        psi = np.repeat(rng.normal(size=(block.max() + 1, 3, 1)), np.bincount(block), axis=0)
        e = (e + 2 * rng.normal(size=(block.max() + 1, 3))[block]) / np.sqrt(5)
    e = e + size * psi[:, :, 0]
    flat, y = psi[problem.train].reshape(-1, 1), e[problem.train].ravel()
    value = float(np.linalg.lstsq(flat, y, rcond=None)[0][0])
    extension = Extension(BASE, {"viscous_drag": {"c1_per_s": value}})
    return made_fit(problem, extension, e - value * psi[:, :, 0], psi)


# Significance: the Wald test


@pytest.mark.parametrize("coloured", [False, True])
def test_the_wald_test_keeps_its_level_on_noise(drive, coloured):
    rng, draws, level = np.random.default_rng(2), 400, 0.05
    p = [wald_p(drive, estimated(drive, rng, 0.0, coloured=coloured), "viscous_drag") for _ in range(draws)]
    most = binom.ppf(0.999, draws, level)
    assert 0 < np.sum(np.array(p) < level) <= most


def test_a_test_for_white_noise_would_not_keep_its_level_on_coloured_noise(drive):
    rng, p = np.random.default_rng(3), []
    for _ in range(200):
        fit = estimated(drive, rng, 0.0, coloured=True)
        plain = inverse_information(fit.psi[drive.train])
        p.append(abs(fit.values[0]) / np.sqrt(plain[0, 0]) > 1.96)
    assert np.mean(p) > 0.3


@pytest.mark.parametrize(("in_sd", "least", "most"), [(0.0, 1e-3, 1.0), (8.0, 0.0, 1e-4)])
def test_an_effect_of_known_size_is_significant_by_its_standard_deviations(drive, in_sd, least, most):
    sd = 1 / np.sqrt(3 * drive.train.sum())
    rng = np.random.default_rng(4)
    p = [wald_p(drive, estimated(drive, rng, in_sd * sd), "viscous_drag") for _ in range(20)]
    assert least <= np.median(p) <= most


def test_the_robust_covariance_is_the_spread_of_the_estimates(drive):
    rng = np.random.default_rng(5)
    fits = [estimated(drive, rng, 0.0, coloured=True) for _ in range(300)]
    spread = np.std([fit.values[0] for fit in fits])
    told = np.sqrt(np.mean([robust_covariance(drive, fit)[0][0, 0] for fit in fits]))
    assert told == pytest.approx(spread, rel=0.15)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 0.99), st.integers(0, 2**16))
def test_the_correlation_of_two_effects_is_r_squared(drive, r, seed):
    rng, n = np.random.default_rng(seed), len(drive.binned)
    flat = np.zeros((n, 3, 2))
    a, b = np.linalg.qr(rng.normal(size=(3 * int(drive.train.sum()), 2)))[0].T
    flat[drive.train] = np.column_stack([a, r * a + np.sqrt(1 - r**2) * b]).reshape(-1, 3, 2)
    effects = {"viscous_drag": {"c1_per_s": 0.1}, "rolling_resistance": {"c0_mps2": 0.1}}
    fit = made_fit(drive, Extension(BASE, effects), np.zeros((n, 3)), flat)
    for name in effects:
        assert correlation(drive, fit, name) == pytest.approx(r**2, abs=1e-9)


# Significance and remainder in the selection


@given(st.floats(0.0, 1.0), st.floats(-10.0, 10.0))
def test_a_candidate_is_significant_by_level_and_score(drive, p, score):
    extension = Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}})
    fit = made_fit(drive, extension, np.zeros((len(drive.binned), 3)))
    stage = (candidate("viscous_drag", 50.0, score=score, p=p, fit=fit),)
    (tested,) = first_tested(drive, fit, fit, stage, [])
    assert (tested.failed == "") == (p <= 0.01 and score > 0)


@pytest.mark.parametrize(
    ("term", "in_manoeuvres", "fails"),
    [("effort_diff*abs(effort_diff)", -0.1, True), ("effort_diff", 0.1, False), ("v*yaw_rate", -0.1, False)],
)
def test_a_term_of_efforts_must_not_make_manoeuvres_less_likely(drive, term, in_manoeuvres, fails):
    """It explains 1 a row where efforts are small, and a tenth of it, or less than nothing, elsewhere."""
    name, e = f"unnamed:yaw:{term}", np.zeros((len(drive.binned), 3))
    before = made_fit(drive, Extension(BASE), e)
    large = manoeuvres(drive, before, "yaw" if "effort" in term else "both")
    assert 50 < large.sum() < len(large) - 50
    after = made_fit(drive, Extension(BASE, {name: {"coefficient": 0.1}}), e)
    after = replace(after, row_deviance=np.where(large, -in_manoeuvres, -1.0))
    assert (gain_in_manoeuvres(before, after) < 0) is fails
    (tested,) = first_tested(drive, before, before, (candidate(name, 50.0, fit=after),), [])
    assert bool(tested.failed) is fails


@pytest.mark.parametrize(
    ("name", "sizes", "correlated", "least"),
    [
        ("viscous_drag", {"c1_per_s": 0.3}, 0.2, 0.0),
        ("viscous_drag", {"c1_per_s": 0.3}, 0.3, 15.0),
        ("viscous_drag", {"c1_per_s": 0.03}, 0.2, 15.0),
        ("pose_lever_arm", {"x_m": 0.03, "y_m": -0.03}, 0.2, 0.0),
        ("pose_lever_arm", {"x_m": 0.01, "y_m": -0.01}, 0.2, 15.0),
        ("actuator_lag", {"time_constant_s": 0.2}, 0.3, 50.0),
        ("actuator_lag", {"time_constant_s": 0.2}, 0.2, 0.0),
    ],
)
def test_a_remainder_is_a_share_of_what_was_explained_for_a_correlated_or_a_slight_effect(
    drive, name, sizes, correlated, least
):
    fit = made_fit(drive, Extension(BASE, {name: sizes}), np.zeros((len(drive.binned), 3)))
    found = [candidate("input_delay", 100.0, fit=fit)]
    tried = replace(candidate(name, 20.0, fit=fit), correlation=correlated)
    assert remainder(drive, fit, fit, tried, found) == pytest.approx(least)


def test_a_local_remainder_is_a_share_of_what_was_explained_there(drive):
    n = len(drive.binned)
    inside = (drive.binned.t_s > 10) & (drive.binned.t_s < 20)
    effects = {"slip_interval": {"start_s": 10.0, "end_s": 20.0, "loss": 0.5}}
    psi = np.zeros((n, 3, 3))
    psi[inside, :, 2] = 1.0
    fit = made_fit(drive, Extension(BASE, effects), np.zeros((n, 3)), psi)
    explained = np.where(inside, 2.0, 50.0)
    base, current = replace(fit, row_deviance=explained), replace(fit, row_deviance=np.zeros(n))
    told = remainder(drive, base, current, candidate("slip_interval", 9.0, fit=fit), [])
    assert told == pytest.approx(0.15 * 2.0 * np.sum(inside & drive.train))


# Placebo


def test_block_scores_add_up_to_the_score(drive):
    rng, n = np.random.default_rng(10), int(drive.train.sum())
    psi, e = rng.normal(size=(3 * n, 4)), rng.normal(size=(n, 3))
    scores = block_scores(drive, psi, e)
    np.testing.assert_allclose(scores.sum(axis=0), psi.T @ e.ravel())
    assert len(scores) == len(np.unique(drive.binned.t_s[drive.train] // 2))


def test_a_drag_explains_more_than_placebo_logs_and_nothing_does_not(dragged):
    problem, without, with_it = dragged
    assert placebo_p(problem, without, with_it, "viscous_drag") == pytest.approx(0.01)
    beside = fit_model(problem, with_it.extension.with_effect("payload", {"mass_ratio": 0.0}), with_it.noise)
    assert placebo_p(problem, with_it, beside, "payload") > 0.2


def test_a_limit_far_from_the_first_order_explains_what_its_fit_does():
    """Torques asked for that are five times a limit: the robot would spin, and its slopes say nothing."""
    log = made_log(2)
    largest = np.max(np.abs([log.torque.left_nm, log.torque.right_nm]), axis=0)
    limit_nm = float(np.quantile(largest, 0.97))
    held = np.clip([log.torque.left_nm, log.torque.right_nm], -limit_nm, limit_nm)
    asked = np.where(largest > limit_nm, 5.0 * held, held)
    problem = problem_of(replace(log, torque=replace(log.torque, left_nm=asked[0], right_nm=asked[1])))
    without = fit_model(problem, Extension(BASE))
    limited = without.extension.with_effect("torque_saturation", {"limit_nm": limit_nm})
    with_it = fit_model(problem, limited)
    assert with_it.deviance < without.deviance - 100
    assert placebo_p(problem, without, with_it, "torque_saturation") == pytest.approx(0.01)


# Rivals that are rests


@pytest.mark.parametrize(
    ("worse", "rests", "open_to"),
    [
        (5.0, {"yaw_damping"}, {"com_offset"}),
        (7.0, {"yaw_damping"}, set()),
        (5.0, {"scrub_torque"}, set()),
        (5.0, {"com_offset"}, set()),
    ],
)
def test_an_effect_is_open_where_a_rest_of_the_base_model_is_about_as_likely(
    drive, monkeypatch, worse, rests, open_to
):
    monkeypatch.setattr(select, "may_be_a_rest", lambda problem, fit, base, name, *, beside: name in rests)
    found = replace(candidate("com_offset", 90.0), alternatives=(("yaw_damping", worse),))
    stages = ((found, candidate("yaw_damping", 85.0), candidate("scrub_torque", 20.0)),)
    base = made_fit(drive, Extension(BASE), np.zeros((len(drive.binned), 3)))
    said = rest_as_likely(drive, base, [found], stages)
    assert said.keys() == open_to
    assert all("so would yaw_damping" in why for why in said.values())
    assert rest_as_likely(drive, base, [found, found], stages) == {}


def test_a_lag_that_is_a_rest_does_not_speak_against_a_delay(drive, monkeypatch):
    """They are two forms of one cause; a bias that is as likely, and a rest, does."""
    base = made_fit(drive, Extension(BASE), np.zeros((len(drive.binned), 3)))
    monkeypatch.setattr(select, "may_be_a_rest", lambda problem, fit, base, name, *, beside: True)
    for other, is_open in (("actuator_lag", False), ("torque_bias_common", True)):
        found = replace(candidate("input_delay", 90.0), alternatives=((other, 2.0),))
        stages = ((found, candidate(other, 88.0)),)
        assert bool(rest_as_likely(drive, base, [found], stages)) is is_open


# What nothing explains


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_disagreement_in_one_time_beyond_all_placebo_logs_has_its_place(loss):
    """Efforts are recorded that do not act: 30 % are lost from 25 to 31 s."""
    log = made_log(5)
    torque = log.torque
    share = np.where((torque.t_ns > 25e9) & (torque.t_ns < 31e9), 1 / (1 - loss), 1.0)
    recorded = replace(torque, left_nm=torque.left_nm * share, right_nm=torque.right_nm * share)
    problem = problem_of(replace(log, torque=recorded))
    selection = forward_selection(problem, Extension(BASE), GapOptions(modes="ideal"), terms=False)
    left = unexplained(problem, replace(selection, fit=selection.base, found=()), 0)
    if not loss:
        assert left is None
        return
    assert left.name == "slip_interval"
    assert left.parameters["start_s"] == pytest.approx(25, abs=1.5)
    assert left.parameters["end_s"] == pytest.approx(31, abs=1.5)
    for open_to, said in ((0.2, True), (0.5, False)):  # of the calibrated model's gain in turning
        known = replace(selection.base.extension, misfit={"drive_gain": 0.02, "yaw_inertia": open_to})
        base = replace(selection.base, extension=known)
        assert bool(unexplained(problem, replace(selection, base=base, fit=base, found=()), 0)) is said
    where = marked(Where(), left)
    assert where.intervals[0].start_s == left.parameters["start_s"]
    assert f"to {left.parameters['end_s']:.1f} s" in placed(left)


# Excitation


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 8.0), st.floats(0.5, 8.0))
def test_excitation_is_the_commanded_acceleration_over_the_disturbance(drive, ahead, turning):
    efforts = drive.binned.torque.means(drive.binned.t_s, Extension(BASE).input_effects())[:, drive.train]
    commanded = BASE.alpha * np.std(efforts.sum(axis=0)), BASE.alpha_yaw * np.std(efforts[1] - efforts[0])
    noise = NOISE._replace(long_sd_mps2=commanded[0] / ahead, yaw_sd_mps2=commanded[1] / turning)
    assert excitation_ratios(drive, Extension(BASE), noise) == pytest.approx((ahead, turning))


def rows_after_manoeuvres(problem: Problem):
    """By a loop: rows at most .5 s behind one that asks for 5 sd of the disturbance on either channel."""
    binned, rows, last_s = problem.binned, np.zeros(len(problem.binned), bool), -np.inf
    left, right = binned.torque.means(binned.t_s, Extension(BASE).input_effects())
    ahead, turning = BASE.alpha * (right + left), BASE.alpha_yaw * (right - left)
    for k, t_s in enumerate(binned.t_s):
        asked = abs(ahead[k] - np.median(ahead)), abs(turning[k] - np.median(turning))
        last_s = t_s if max(asked) > 5 * 0.05 else last_s
        rows[k] = t_s - last_s <= 0.5
    return rows


@pytest.mark.parametrize(
    ("name", "shows", "carried"),
    [
        ("drive_gain", "in manoeuvres", True),
        ("drive_gain", "elsewhere", False),
        ("viscous_drag", "in manoeuvres", True),
        ("viscous_drag", "elsewhere", False),
        ("heading_misalignment", "elsewhere", True),
    ],
)
def test_an_effect_must_be_seen_in_manoeuvres_unless_no_torque_shows_it(drive, name, shows, carried):
    """Efforts that answer a disturbance seem to show anything, and significantly so."""
    rng, n = np.random.default_rng(3), len(drive.binned)
    rows = rows_after_manoeuvres(drive)
    assert 0.2 < rows.mean() < 0.9
    seen = rows if shows == "in manoeuvres" else ~rows
    extension = Extension(BASE, {name: {candidate_of(name).free[0]: 0.1}})
    psi = 10 * rng.normal(size=(n, 3, 1)) * seen[:, None, None]
    fit = made_fit(drive, extension, rng.normal(size=(n, 3)), psi)
    assert wald_p(drive, fit, name) < 1e-3
    reason = too_calm_for(name, drive, fit)
    assert (reason == "") is carried
    assert carried or reason.startswith(f"{name} would explain part of it")


# The selection as a whole


@pytest.mark.parametrize(
    ("times", "turning", "both"), [(2.9, 1.0, (2.9, 2.9)), (3.1, 0.9, (2.79, 3.1)), (3.1, 1.1, (3.1, 3.41))]
)
def test_the_width_of_a_dead_zone_counts_in_units_of_the_disturbance(drive, times, turning, both):
    """The zone's ends ask for ``times`` the disturbance ahead, and ``turning`` times as much in yaw."""
    base = BASE._replace(alpha_yaw=turning * BASE.alpha)
    size = {"threshold_nm": times * 0.05 / (2 * base.alpha)}
    fit = made_fit(drive, Extension(base, {"torque_deadzone": size}), np.zeros((len(drive.binned), 3)))
    fit = replace(fit, noise=Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2))
    assert times_the_disturbance(fit) == pytest.approx(both)


@pytest.mark.parametrize(
    ("name", "ratio", "within"),
    [
        ("cornering_stiffness", 0.14, True),
        ("cornering_stiffness", -0.16, False),
        ("yaw_inertia", 0.14, False),
    ],
)
def test_a_stiffness_that_differs_little_is_the_same_tyres(name, ratio, within):
    extension = Extension(BASE, {name: {"ratio": ratio}})
    assert same_tyres(name, extension, SETTINGS.selection) is within


@pytest.mark.parametrize("drag_per_s", [0.0, 0.1])
def test_the_selection_finds_a_drag_and_nothing_else(drag_per_s):
    problem = problem_of(made_log(11, drag_per_s=drag_per_s))
    options = GapOptions(modes="ideal", max_effects=1)
    forward = forward_selection(problem, Extension(BASE), options)
    selection = confirm(problem, forward, options)
    assert [f.name for f in selection.found] == (["viscous_drag"] if drag_per_s else [])
    if drag_per_s:
        wide = replace(options, tolerance_m=1.0)
        assert not confirm(problem, forward, wide).found
        strict = replace(SETTINGS, significance=replace(SETTINGS.significance, level=1e-300))
        stricter = replace(problem, binned=replace(problem.binned, settings=strict))
        (stage,) = forward_selection(stricter, Extension(BASE), options, terms=False).stages
        assert stage[0].failed == "not significant"


def test_an_identifier_is_believed_less_near_a_switch():
    log = made_log(12, seconds=20.0)
    modes = np.full(2, ContactMode.IDEAL, np.int8)
    modes[1] = ContactMode.SKIDDING
    track = ModeTrack(np.array([0, 10_000_000_000]), modes)
    given, told = (bin_log(log, SETTINGS, track, margin_s=margin_s) for margin_s in (None, 0.3))
    assert (given.identified, told.identified) == (False, True)
    unsure = [binned.unsure(binned.skids).sum() * SETTINGS.bins.bin_s for binned in (given, told)]
    assert unsure == pytest.approx([3 * 0.04, 17 * 0.04])  # a bin either side, and 0.3 s in whole bins


def test_tyres_that_a_payload_softens_are_no_effect_of_their_own(drive):
    effects = {"payload": {"mass_ratio": 0.25}, "cornering_stiffness": {"ratio": -0.21}}
    fit = made_fit(drive, Extension(BASE, effects), np.zeros((len(drive.binned), 3)))
    both = [candidate(name, 100.0, fit=fit) for name in effects]
    current, left = with_tyres_of_payload(drive, fit, both)
    assert [one.name for one in left] == ["payload"]
    assert list(current.extension.effects) == ["payload"]
    assert current.extension.known == (("cornering_stiffness", {"ratio": -0.21}),)
    other = fit.extension.with_effect("cornering_stiffness", {"ratio": 0.3})
    assert with_tyres_of_payload(drive, replace(fit, extension=other), both)[1] == both


@pytest.mark.parametrize(
    ("name", "channel"),
    [
        ("payload", "longitudinal"),
        ("yaw_inertia", "yaw"),
        ("drive_gain", "both"),
        ("unnamed:longitudinal:effort_sum*abs(v)", "longitudinal"),
        ("unnamed:longitudinal:v*v*v", "both"),
        ("unnamed:yaw:effort_diff*abs(effort_sum)", "yaw"),
        ("unnamed:yaw:abs(effort_sum)*yaw_rate", "both"),
        ("unnamed:longitudinal:v*abs(effort_diff)", "both"),
        ("unnamed:lateral:v*yaw_rate", "both"),
        ("rolling_resistance", "both"),
    ],
)
def test_what_scales_with_torques_of_a_channel_needs_its_manoeuvres(name, channel):
    assert torques_of(name) == channel


TERM, DRAG = "unnamed:yaw:v*yaw_rate", "viscous_drag"


@pytest.mark.parametrize(
    ("name", "beside", "margin"), [(TERM, DRAG, 30.0), (TERM, "unnamed:yaw:1", 10.0), (DRAG, TERM, 10.0)]
)
def test_a_term_beside_a_named_effect_must_explain_more(drive, name, beside, margin):
    """What a formula is asked for there; beside other terms, and an effect beside terms, as any effect."""
    size = {TERM: {"coefficient": 0.1}, DRAG: {"c1_per_s": 0.1}, "unnamed:yaw:1": {"coefficient": 0.1}}
    e = np.zeros((len(drive.binned), 3))
    fit = made_fit(drive, Extension(BASE, {one: size[one] for one in (name, beside)}), e)
    assert margin_for(drive, fit, candidate(name, 50.0, fit=fit)) == margin
    alone = made_fit(drive, Extension(BASE, {name: size[name]}), e)
    assert margin_for(drive, alone, candidate(name, 50.0, fit=alone)) == 0.0

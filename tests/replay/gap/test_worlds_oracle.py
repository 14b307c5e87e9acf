"""What a log of the benchmark worlds can tell, by an oracle, and how an answer is scored."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from tests.replay.gap.bench_worlds import case_of


def test_the_oracle_separates_what_the_drive_separates(worlds):
    oracle, forms, seen = worlds("oracle"), worlds("oracle_forms"), worlds("oracle_filter")
    world = worlds("simulate").simulated(case_of(worlds))
    turning = forms.signals_of(world)
    both = 0.5 * (turning.left + turning.right)
    straight = replace(turning, left=both, right=both, q=0 * both, yaw=0 * both, w=0 * both)

    def left(s, first, second):
        traces = [forms.trace(name, sizes, s) for name, sizes in (first, second)]
        columns = seen.whitened(seen.steps_of(s, world.conditions, (0.001, 0.002)), traces)
        own = columns[:, 0] @ columns[:, 0]
        return oracle.left_over(columns[:, 0], columns[:, 1:], oracle.FREE) / own, own

    gain, load = ("drive_gain", {"ratio": 0.1}), ("payload", {"mass_ratio": 0.1})
    assert left(straight, load, gain)[0] < 1e-9
    assert left(turning, load, gain)[0] > 0.03
    assert left(turning, ("payload", {"mass_ratio": 0.1}), gain)[1] > oracle.SEEN
    assert left(turning, ("payload", {"mass_ratio": 1e-5}), gain)[1] < 1.0


def test_information_falls_with_noise(worlds):
    oracle, simulated = worlds("oracle"), worlds("simulate").simulated
    owns = [
        oracle.judged(simulated(case_of(worlds, effect="scrub_torque", noise=noise))).own
        for noise in ("mocap", "rtk", "poor")
    ]
    assert owns[0] > 1.1 * owns[1] > 1.3 * owns[2] > 0


def test_the_exponential_is_exact(worlds):
    from scipy.linalg import expm

    matrices = np.random.default_rng(1).normal(size=(3, 5, 5))
    found = worlds("oracle_filter").exponential(matrices)
    assert np.abs(found - np.array([expm(m) for m in matrices])).max() < 1e-10


def said(*names, verdict="named", alternatives=None, sentence="", effect="viscous_drag"):
    effects = [{"name": n, "class": [n], "alternatives": alternatives or {}, "parameters": {}} for n in names]
    return {"verdict": verdict, "effects": effects, "sentence": sentence, "notes": [], "effect": effect}


def test_outcomes(worlds):
    score, oracle = worlds("score"), worlds("oracle")
    clear = oracle.Judgement(500.0, 1.0, {"aerodynamic_drag": 12.0, "payload": 400.0})
    weak = oracle.Judgement(20.0, 1.0, {})
    silent = said(verdict="nothing_missing")
    assert score.outcome(said("viscous_drag"), clear) == "right"
    assert score.outcome(said("aerodynamic_drag"), clear) == "wrong"
    assert score.outcome(said("aerodynamic_drag", alternatives={"viscous_drag": 3.0}), clear) == "right"
    assert score.outcome(said("viscous_drag", alternatives={"payload": 3.0}), clear) == "wrong"
    assert score.outcome(said("viscous_drag", alternatives={"payload": 30.0}), clear) == "right"
    assert score.outcome(said("viscous_drag", "payload"), clear) == "wrong"
    beside = said("viscous_drag", "unnamed:longitudinal:v*v")
    assert score.outcome(beside | {"same_form": False}, clear) == "right"
    assert score.outcome(beside | {"same_form": True}, clear) == "wrong"
    assert score.outcome(silent, clear) == "refused"
    assert score.outcome(silent, weak) == "right"
    assert score.outcome(silent, None) == "silent"
    assert score.outcome(said("payload"), None) == "false"
    slips = oracle.Judgement(500.0, 1.0, {oracle.SLIPPING: 5.0})
    hint = said(verdict="nothing_missing", sentence="It may be slipping.", effect="slip_interval")
    assert score.outcome(hint, slips) == "right"
    assert score.outcome(hint, clear) == "refused"
    skids = oracle.Judgement(500.0, 1.0, {oracle.SKIDDING: 5.0})
    assert score.outcome(hint, skids) == "refused"
    assert score.outcome(hint | {"notes": ["skidding is identified for 3 s"]}, skids) == "right"


def test_slipping_in_its_nearest_history_is_the_best_of_all(worlds):
    modes, rng = worlds("oracle_modes"), np.random.default_rng(2)
    rows = np.arange(100)
    pieces = [rows // 10 == k for k in range(1, 9)]
    slips = (rows >= 40) & (rows < 70)
    for _ in range(5):
        columns, g = rng.normal(size=(60, 8)), 3.0 * rng.normal(size=60)
        histories = modes.Histories(pieces, slips)
        costs = []
        for toggled in product([False, True], repeat=8):
            b = np.array(toggled)
            state = slips.copy()
            state[10:90] = np.repeat(histories.true ^ b, 10)
            changes = np.sum(np.diff(state) != 0) - np.sum(np.diff(slips) != 0)
            costs.append(np.sum((g - columns @ b) ** 2) + modes.CHANGE_COST * changes)
        found = modes.nearest_slipping(g, columns, histories)
        assert min(costs) - 1e-9 <= found <= min(costs) + 0.05 * g @ g


def test_what_is_unknown_is_part_of_the_noise(worlds):
    seen, rng = worlds("oracle_filter"), np.random.default_rng(4)
    world = worlds("simulate").simulated(case_of(worlds))
    s = worlds("oracle_forms").signals_of(world)
    steps = seen.steps_of(s, world.conditions, (0.01, 0.005))
    unknown = worlds("oracle_modes").shifts_of_modes(s)
    known, columns = seen.whitened(steps, unknown), rng.normal(size=(len(steps.transition) * 3, 2))
    left = seen.beside_the_unsure(seen.unsure_of(steps, unknown), columns)
    covariance = np.eye(len(columns)) + known @ known.T
    np.testing.assert_allclose(left.T @ left, columns.T @ np.linalg.solve(covariance, columns), rtol=1e-8)


@pytest.mark.parametrize(
    ("rival", "sizes", "alike"),
    [("wheel_coulomb", {"torque_nm": 0.03}, True), ("viscous_drag", {"c1_per_s": 0.03}, False)],
)
def test_slipping_alone_does_not_tell_a_wheels_friction_from_the_bodys(worlds, rival, sizes, alike):
    """On a drive that never stops nor reverses; a drag is another matter."""
    modes, forms, seen = worlds("oracle_modes"), worlds("oracle_forms"), worlds("oracle_filter")
    case, oracle = worlds("case").Case(2, "sweeps", "poor", "rolling_resistance", 1_400_077), worlds("oracle")
    world = worlds("simulate").simulated(case)
    s = forms.signals_of(world)
    traces = [forms.trace("rolling_resistance", {"c0_mps2": 0.03}, s), forms.trace(rival, sizes, s)]
    sure = seen.steps_of(s, world.conditions, case.noise_sd)
    unsure = seen.unsure_of(sure, modes.shifts_of_modes(s))
    columns = [seen.whitened(steps, traces) for steps in (sure, unsure)]
    left = [oracle.left_over(two[:, 0], two[:, 1:], oracle.NONNEGATIVE) for two in columns]
    assert left[0] > oracle.SEPARATED
    assert (left[1] < oracle.SEPARATED) is alike


def test_a_patch_that_is_crossed_once_is_an_interval(worlds):
    """No grid of half seconds keeps them apart."""
    oracle, local, forms = worlds("oracle"), worlds("oracle_local"), worlds("oracle_forms")
    seen = worlds("oracle_filter")
    world = worlds("simulate").simulated(case_of(worlds))
    s = forms.signals_of(world)
    steps = seen.steps_of(s, world.conditions, (0.001, 0.002))
    k = int(np.argmax(np.abs(s.left + s.right)))
    patch = {"x_m": float(s.x[k]), "y_m": float(s.y[k]), "radius_m": 0.6, "loss": 0.5}
    lost = oracle.where_lost(s, "low_friction_patch", patch)
    first, last = np.flatnonzero(np.diff(lost, prepend=False, append=False))
    time = {"start_s": float(s.t_s[first]), "end_s": float(s.t_s[last - 1]) + 0.01, "loss": 0.5}
    hidden = seen.whitened(steps, [forms.trace("slip_interval", time, s)])[:, 0]
    off = patch | {"x_m": patch["x_m"] + 0.3, "radius_m": 0.9}
    on_grid = local.left_by(hidden, seen.whitened(steps, [forms.trace("low_friction_patch", off, s)]))[0]
    found = local.left_of_patch(s, steps, hidden, off)
    assert found < 0.2 * on_grid
    parts = local.pieces_by_block(s, steps, lost)
    coarse = oracle.nearest_interval(hidden, seen.whitened(steps, oracle.stretches(s, oracle.FINE_S)))
    assert min(oracle.nearest_interval(hidden, part) for part in parts) < 0.1 * coarse


def test_skids_that_begin_otherwise_take_part_of_a_stiffness(worlds):
    modes = worlds("oracle_modes")
    g, columns = np.array([3.0, 4.0]), np.array([[10.0], [0.0]])
    assert modes.nearest_skidding(g, columns) == pytest.approx(16.0 + 9.0 / (1 + 100 * modes.SHIFT_SD_S**2))


def test_the_nearest_interval_is_the_best_of_all(worlds):
    rng = np.random.default_rng(0)
    pieces = rng.normal(size=(50, 7))
    g = 0.6 * pieces[:, 2:5].sum(axis=1) + 0.5 * rng.normal(size=50)
    left = []
    for first in range(7):
        for end in range(first + 1, 8):
            column = pieces[:, first:end].sum(axis=1)
            size = np.clip(column @ g / (column @ column), 0.0, 1.0)
            left.append(np.sum((g - size * column) ** 2))
    assert worlds("oracle").nearest_interval(g, pieces) == pytest.approx(min(left))

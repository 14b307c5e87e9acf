"""The benchmark worlds: the split, the second plant's physics, the oracle's separations, the scores."""

import importlib
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).parents[3] / "bench"
SHORT_S = 20.0
IDEAL, SKIDDING = 0, 1


@pytest.fixture(scope="module")
def worlds():
    """``worlds(name)``: a module of bench/worlds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield lambda name: importlib.import_module(f"worlds.{name}")


@pytest.fixture(scope="module")
def eq(worlds):
    return worlds("plant_two.equations")


def case_of(worlds, **changes):
    kinds = {
        "plant": 2,
        "family": "stop-go",
        "noise": "mocap",
        "effect": "",
        "seed": 7,
        "duration_s": SHORT_S,
    }
    return worlds("case").Case(**({"duration_s": SHORT_S} | kinds | changes))


def robot_of(worlds, **changes):
    robot = worlds("plant_two.world").plant_robot(case_of(worlds).robot())
    return robot._replace(**changes)


def integrated(eq, robot, hidden, *, mode, start, torques, duration_s, h):
    """States at the steps of a motion under torques that are functions of time, held over a step."""
    state, work = np.zeros(eq.N_STATES), np.empty((5, eq.N_STATES))
    for name, value in start.items():
        state[getattr(eq, name)] = value
    calm, states = np.zeros((2, 3)), [state.copy()]
    for k in range(round(duration_s / h)):
        state[[eq.LEFT, eq.RIGHT]] = torques(k * h)
        eq.step(state, k * h, h, mode, np.zeros(2), calm, robot, hidden, work)
        states.append(state.copy())
    return np.array(states)


def test_no_log_is_in_both_parts_of_the_split(worlds):
    develop, report = (worlds("split").part(name) for name in ("develop", "report"))
    assert not set(develop.cells) & set(report.cells)
    families = worlds("drivers").FAMILIES
    assert {family for _, family in develop.cells} | {family for _, family in report.cells} == set(families)
    assert not {family for _, family in develop.cells} & {family for _, family in report.cells}
    assert {plant for plant, _ in report.cells} >= {plant for plant, _ in develop.cells}
    assert develop.last_seed < report.first_seed
    with pytest.raises(ValueError, match="seed 3"):
        report.check(2, "mail", 3)


def test_without_compliance_ideal_rolling_has_no_sideslip(worlds, eq):
    robot = robot_of(worlds, compliance_s=0.0)
    states = integrated(
        eq,
        robot,
        eq.Hidden(),
        mode=IDEAL,
        start={"V": 1.0, "Q": 0.5},
        torques=lambda t: (1.0, 2.0),
        duration_s=1.0,
        h=0.0025,
    )
    assert np.all(states[:, eq.W] == 0)
    along = np.cumsum(0.0025 * 0.5 * (states[1:, eq.V] + states[:-1, eq.V]))[-1]
    path = np.hypot(*np.diff(states[:, :2], axis=0).T).sum()
    assert path == pytest.approx(along, rel=1e-5)


def test_a_skid_without_decay_or_torque_keeps_its_energy(worlds, eq):
    """3v² + w² is constant: v̇ = wq/3 and ẇ = −vq."""
    robot = robot_of(worlds, skid_decay_mps2=0.0)
    states = integrated(
        eq,
        robot,
        eq.Hidden(),
        mode=SKIDDING,
        start={"V": 1.5, "W": 0.2, "Q": 0.8},
        torques=lambda t: (0.0, 0.0),
        duration_s=5.0,
        h=0.0025,
    )
    energy = 3 * states[:, eq.V] ** 2 + states[:, eq.W] ** 2
    assert np.ptp(energy) < 1e-9
    assert np.ptp(states[:, eq.V]) > 0.3


def test_resistance_takes_the_energy_that_the_motion_loses(worlds, eq):
    hidden = eq.Hidden(rolling_resistance=0.2, viscous_drag=0.1, aerodynamic_drag=0.1)
    states = integrated(
        eq,
        robot_of(worlds),
        hidden,
        mode=IDEAL,
        start={"V": 1.5},
        torques=lambda t: (0.0, 0.0),
        duration_s=2.0,
        h=0.0025,
    )
    v = states[:, eq.V]
    power = np.array([eq.resistance(speed, hidden) * speed for speed in v])
    work = 0.0025 * 0.5 * (power[1:] + power[:-1]).sum()
    assert work == pytest.approx(0.5 * (v[-1] ** 2 - v[0] ** 2), rel=1e-5)
    assert 0 < v[-1] < v[0]


def test_the_integrator_is_of_fourth_order(worlds, eq):
    robot, hidden = robot_of(worlds), eq.Hidden(viscous_drag=0.2)

    def end(h):
        return integrated(
            eq,
            robot,
            hidden,
            mode=SKIDDING,
            start={"V": 1.5, "Q": 0.8},
            torques=lambda t: (0.5, 1.0),
            duration_s=0.8,
            h=h,
        )[-1, : eq.LEFT]

    best = end(0.0025)
    coarse, fine = (np.abs(end(h) - best).max() for h in (0.08, 0.04))
    assert 12 < coarse / fine < 24


def test_both_plants_move_alike_where_their_forms_coincide(worlds, eq):
    """Ideal rolling, then a skid, with the first plant's torques."""
    from wmr_schemas.signals import ModeTrack
    from wmr_synth import Sensors, World, synthesise
    from wmr_synth.driving.drivers import ClosedLoop
    from wmr_synth.driving.plan import Plan
    from wmr_synth.scenarios import Scenario

    case = case_of(worlds)
    switches = ModeTrack(np.array([0, 3_000_000_000], np.int64), np.array([IDEAL, SKIDDING], np.int8))
    plan = Plan(ClosedLoop(case.drive().path), switches)
    exact = Sensors(noise_xy_sd_m=0.0, noise_yaw_sd_rad=0.0)
    scenario = Scenario("both", "both", 8.0, lambda *_: plan, exact, case.robot())
    log = synthesise(scenario, world=World()).log
    torques = np.stack([log.torque.left_nm, log.torque.right_nm], axis=1)
    robot, work, state = robot_of(worlds, compliance_s=0.0), np.empty((5, eq.N_STATES)), np.zeros(eq.N_STATES)
    path = []
    for k in range(len(log.pose)):
        path.append(state[:3].copy())
        state[[eq.LEFT, eq.RIGHT]] = torques[k]
        mode = IDEAL if k < 300 else SKIDDING
        for j in range(4):
            t = 0.01 * k + 0.0025 * j
            eq.step(state, t, 0.0025, mode, torques[k], np.zeros((2, 3)), robot, eq.Hidden(), work)
    measured = np.stack([log.pose.x_m, log.pose.y_m, np.unwrap(log.pose.yaw_rad)], axis=1)
    assert np.abs(np.array(path) - measured).max() < 1e-5
    assert np.ptp(measured[:, 0]) > 1.0


NOT_INSTANTANEOUS = ("actuator_lag", "input_delay", "heading_misalignment", "yaw_drift", "pose_lever_arm")


@pytest.mark.parametrize("number", [2, 3])
def test_a_plants_forms_come_close_to_the_declared_ones(worlds, number):
    """What an effect adds to the accelerations, in the plant and by the declared formula."""
    effects, forms, plant = worlds("plant_two.effects"), worlds("oracle_forms"), worlds("plant_two.world")
    case = case_of(worlds, plant=number, duration_s=90.0)
    eq, none = plant.equations_of(case), worlds("plant_two.equations").Hidden()
    s = forms.signals_of(plant.world_of(case))
    robot, calm = robot_of(worlds), np.zeros(3)
    rows = np.flatnonzero(~s.slips)[::7]

    def added(name, hidden):
        out = np.zeros((3, len(rows)))
        for k, row in enumerate(rows):
            state = np.zeros(eq.N_STATES)
            state[: eq.SLIP] = [c[row] for c in (s.x, s.y, s.yaw, s.v, s.w, s.q, s.left, s.right)]
            out[::2, k] = np.subtract(
                eq.accelerations(state, s.t_s[row], calm, robot, hidden),
                eq.accelerations(state, s.t_s[row], calm, robot, none),
            )
        return out

    for name in effects.EFFECTS:
        if name in (*NOT_INSTANTANEOUS, "cornering_stiffness"):
            continue
        sizes = effects.drawn(name, case.robot(), 90.0, np.random.default_rng(3))
        sizes |= {"x_m": s.x[rows[200]], "y_m": s.y[rows[200]]} if name == "low_friction_patch" else {}
        declared = forms.trace(name, sizes, s).acceleration[:, rows]
        declared[1] = 0.0
        found = added(name, effects.hidden_of(name, sizes))
        size = (found * declared).sum() / (declared**2).sum()
        assert size == pytest.approx(1.0, abs=0.15), name
        assert ((found - size * declared) ** 2).sum() < 0.12 * (found**2).sum(), name


def test_a_case_gives_one_log_and_noise_leaves_the_truth_alone(worlds):
    simulated = worlds("simulate").simulated
    for plant in (1, 2, 3):
        case = case_of(worlds, plant=plant)
        first, again, poor = simulated(case), simulated(case), simulated(replace(case, noise="poor"))
        assert np.array_equal(first.log.pose.x_m, again.log.pose.x_m)
        assert np.array_equal(first.truth.x_m, poor.truth.x_m)
        assert np.std(poor.log.pose.x_m - poor.truth.x_m) == pytest.approx(0.05, rel=0.15)


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


def test_cases_of_a_run_stay_in_their_part_and_mix_noise_and_effect(worlds):
    import argparse

    worlds("case")
    run = importlib.import_module("gap_worlds")
    options = argparse.Namespace(
        split="report", n=864, first_seed=None, effect="all", family=None, plant=None, noise=None, mixed=True
    )
    cases = list(run.cases(options))
    assert len({case.seed for case in cases}) == 864
    assert min(case.seed for case in cases) >= 2_400_000
    nothing = [case.noise for case in cases if not case.effect]
    assert len(nothing) == 288
    assert {nothing.count(noise) for noise in ("mocap", "rtk", "poor")} == {96}
    families = [case.family for case in cases if case.effect]
    assert min(families.count(family) for family in set(families)) >= 60
    assert {case.effect for case in cases} == {"", *worlds("plant_two.effects").EFFECTS}


def fitted(worlds, plant, effect):
    simulate = worlds("simulate")
    world = simulate.simulated(case_of(worlds, plant=plant, effect=effect))
    return world.sizes, worlds("best_fit").fitted_sizes(world, simulate.SAME_FORM[plant])


@pytest.mark.parametrize("plant", [1, 2, 3])
def test_another_form_is_fitted_near_the_size_that_was_drawn(worlds, plant):
    for effect in ("rolling_resistance", "torque_deadzone", "slope", "actuator_lag", "slip_interval"):
        drawn, found = fitted(worlds, plant, effect)
        assert found.keys() == drawn.keys()
        largest = max(abs(size) for size in drawn.values())
        for key, size in drawn.items():
            assert found[key] == pytest.approx(size, abs=0.25 * largest), (effect, key)
    drawn, found = fitted(worlds, plant, "yaw_damping")
    assert found == drawn


def test_a_load_that_comes_late_is_fitted_late(worlds):
    """On plant 3 a load settles with a time constant of .15 s: the nearest step is as late."""
    drawn, found = fitted(worlds, 3, "load_step")
    assert 0.03 < found["t0_s"] - drawn["t0_s"] < 0.3
    assert found["mass_ratio"] == pytest.approx(drawn["mass_ratio"], rel=0.03)


@pytest.mark.parametrize("plant", [1, 2, 3])
def test_a_form_that_a_plant_has_as_declared_leaves_the_declared_trace(worlds, plant):
    """The plant's own equations against the formulas that were written from the texts."""
    simulate, forms, plants = worlds("simulate"), worlds("oracle_forms"), worlds("plant_forms")
    compared = {"drive_gain", "yaw_inertia", "yaw_damping", "wheel_viscous", "torque_imbalance"} | {
        *("torque_bias_common", "torque_bias_differential", "com_offset", "viscous_drag", "payload"),
    }
    for effect in sorted(compared & simulate.SAME_FORM[plant]):
        world = simulate.simulated(case_of(worlds, plant=plant, effect=effect))
        s = forms.signals_of(world)
        declared, own = forms.trace(effect, world.sizes, s), plants.plant_trace(world, s)
        size = np.abs(declared.acceleration).max()
        np.testing.assert_allclose(own.acceleration[::2], declared.acceleration[::2], atol=1e-3 * size)


def test_the_third_plants_skid_settles_where_the_models_does(worlds):
    """At a small slip angle the brush tyre is linear, and its relaxation short: w = −v q V/c."""
    case = case_of(worlds, plant=3)
    eq, world = worlds("plant_three.equations"), worlds("plant_two.world")
    robot = world.plant_robot(case.robot())._replace(skid_decay_mps2=20.0)
    none, state, work = (
        worlds("plant_two.equations").Hidden(),
        np.zeros(eq.N_STATES),
        np.empty((3, eq.N_STATES)),
    )
    calm, h = np.zeros((2, 3)), 0.00125
    state[eq.V], state[eq.Q] = 1.0, 0.2
    for k in range(1600):
        state[eq.V], state[eq.Q] = 1.0, 0.2
        eq.step(state, k * h, h, SKIDDING, np.zeros(2), calm, robot, none, work)
    speed = np.hypot(1.0, 0.2 * robot.half_track_m)
    assert state[eq.W] == pytest.approx(-0.2 * speed / 20.0, rel=0.02)


def test_new_families_keep_to_a_robots_speeds(worlds):
    drivers = worlds("drivers")
    for family in ("delivery", "slalom", "lawn-mower", "joystick"):
        drive = drivers.drawn_drive(family, 90.0, np.random.default_rng(1))
        speed, turning = drive.path(np.arange(0.0, 90.0, 0.05))
        assert 0.4 < np.ptp(speed) < 3.0, family
        assert 0.3 < np.ptp(turning) < 2.8, family
        assert len(drive.modes.t_ns) > 3


def share(rows):
    return float(np.mean(rows))


@pytest.mark.parametrize("seed", range(8))
def test_late_families_drive_as_they_are_described(worlds, seed):
    """Bounds of speed, yaw rate and acceleration; who halts, who reverses, who does neither."""
    drawn, t_s = worlds("drivers").drawn_drive, np.arange(0.0, 90.0, 0.05)
    halts, back = {}, {}
    for family in ("crowd", "figures", "shunting", "ladder", "mail", "polisher", "squares", "line"):
        speed, turning = drawn(family, 90.0, np.random.default_rng(seed)).path(t_s)
        assert np.abs(speed).max() < 2.2, family
        assert np.abs(turning).max() < 1.3, family
        assert np.abs(np.diff(speed)).max() < 0.05 * 2.5, family
        halts[family], back[family] = share(np.abs(speed) < 0.02), share(speed < -0.02)
    assert 0.01 < halts["crowd"] < 0.2 < back["shunting"]
    assert halts["figures"] == back["figures"] == back["crowd"] == 0
    assert halts["shunting"] > 0.05 > halts["ladder"]
    assert halts["squares"] > 0 == halts["polisher"] == halts["line"]
    assert not any(back[family] for family in ("mail", "polisher", "squares", "line"))


def test_a_mail_round_mostly_coasts(worlds):
    """While it coasts its speed halves in a time that is drawn, and its path keeps one curvature."""
    speed, turning = (
        worlds("drivers").drawn_drive("mail", 90.0, np.random.default_rng(3)).path(np.arange(0.0, 90.0, 0.1))
    )
    decay_per_s = -np.diff(np.log(np.maximum(speed, 1e-3))) / 0.1
    steady = (speed[1:] > 0.1) & (np.abs(np.diff(decay_per_s, prepend=0.0)) < 1e-6)
    assert share(steady) > 0.4
    assert np.all((decay_per_s[steady] > 1 / 9.1) & (decay_per_s[steady] < 1 / 2.9))
    assert np.abs(turning).max() < 0.46 * speed.max()


def test_squares_close_and_orbits_go_round(worlds):
    """A square turns by whole turns between two changes of way; a polisher goes round 1.5 to 4 times."""
    t_s = np.arange(0.0, 90.0, 0.01)
    for family, fewest in (("squares", 0.75), ("polisher", 1.0)):
        _, turning = worlds("drivers").drawn_drive(family, 90.0, np.random.default_rng(4)).path(t_s)
        turns = np.cumsum(turning) * 0.01 / (2 * np.pi)
        changes = np.flatnonzero(np.diff(np.sign(turning[np.abs(turning) > 0.02])))
        at = np.flatnonzero(np.abs(turning) > 0.02)[changes]
        rounds = np.abs(np.diff(turns[at]))
        assert len(rounds) > 0, family
        assert fewest < rounds.min() <= rounds.max() < 4.5, family

"""The benchmark worlds' plants: their equations, and their forms of the effects beside the declared ones."""

import numpy as np
import pytest
from tests.replay.gap.bench_worlds import case_of

IDEAL, SKIDDING = 0, 1


@pytest.fixture(scope="module")
def eq(worlds):
    return worlds("plant_two.equations")


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


def test_what_a_formula_says_of_a_form_is_none_of_the_size(worlds):
    """On plant 2 the ground of a slope undulates; with those waves beside it, the drawn slope is closest."""
    simulate, best_fit = worlds("simulate"), worlds("best_fit")
    world = simulate.simulated(case_of(worlds, effect="slope"))
    waves = [
        f"unnamed:longitudinal:sin({0.8 * 2 * np.pi / 7:.5f}x+{0.6 * 2 * np.pi / 7:.5f}y)*{of}(yaw)"
        for of in ("cos", "sin")
    ]
    alone, beside = (best_fit.fitted_sizes(world, simulate.SAME_FORM[2], terms) for terms in ((), waves))
    off = {key: (abs(alone[key] - size), abs(beside[key] - size)) for key, size in world.sizes.items()}
    assert max(before for before, _ in off.values()) > 0.003
    assert max(after for _, after in off.values()) < 0.0005


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

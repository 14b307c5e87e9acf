"""What gap.json holds for those who draw: residual against its variable, what remains, another log."""

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.against import with_curves, with_formula_curves
from wmr_replay.gap.result.elsewhere import elsewhere
from wmr_replay.gap.result.metrics import with_slip_gaps
from wmr_replay.gap.result.remains import blocks
from wmr_replay.gap.result.result import (
    Estimate,
    Formula,
    FoundEffect,
    GapMetric,
    HeldOutGap,
    Traces,
    TrainGap,
)
from wmr_replay.gap.settings import GateSettings, ShownSettings
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack
from wmr_synth import Sensors, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.hidden.world import model_world

N = 1200
SHOWN = ShownSettings()
DRAG = Effect("viscous_drag", {"c1_per_s": 0.2})


def traces(before, after, v, path_error=None):
    measured = np.stack([np.cumsum(v) * 0.05, np.zeros(N), np.linspace(0, 9, N)], axis=1)
    error = np.zeros(N) if path_error is None else path_error
    path = measured + np.stack([error, 0 * error, 0 * error], axis=1)
    none = np.zeros(N)
    return Traces(
        start_ns=0,
        t_s=np.arange(N) * 0.05,
        measured=measured,
        base_path=path,
        extended_path=path,
        base_residual=np.stack([before, none, none], axis=1),
        extended_residual=np.stack([after, none, none], axis=1),
        held_out=none,
        mode=none,
        quantities={"v_mps": v},
    )


def found(variable):
    estimate = Estimate(0.2, (0.19, 0.21), "1/s")
    names = "viscous_drag", "longitudinal", "−c₁·v", {"c1_per_s": estimate}
    return FoundEffect(*names, ("viscous_drag",), (), 0.0, "", "longitudinal", variable)


def test_a_drag_is_a_line_over_the_speed():
    rng = np.random.default_rng(0)
    v, noise = rng.uniform(-1, 2, N), 0.01 * rng.normal(size=N)
    given = traces(noise - 0.2 * v, noise, v)
    (effect,) = with_curves((found("v_mps"),), given, lambda _: given.base_residual, SHOWN)
    table = effect.against
    at = np.array([one.at for one in table.bins])
    assert (table.residual_unit, table.variable_unit) == ("m/s²", "m/s")
    assert len(at) == SHOWN.bins
    assert (np.diff(at) > 0).all()
    assert [one.before for one in table.bins] == pytest.approx(-0.2 * at, abs=0.02)
    assert [one.fitted for one in table.bins] == pytest.approx(-0.2 * at, abs=1e-9)
    assert np.abs([one.after for one in table.bins]).max() < 0.01
    assert table.rms_after < 0.1 * table.rms_before
    assert sum(one.seconds for one in table.bins) == pytest.approx(N * 0.05)


def test_a_formula_is_shown_against_the_quantity_that_it_follows_most():
    v = np.random.default_rng(1).uniform(0.5, 1.0, N)
    rut = 0.3 * v * np.sin(2 * np.linspace(0, 9, N))
    given = traces(rut, 0 * rut, v)
    formula = Formula("longitudinal", "", ("a", "b"), {}, 0.2, {"v": (0.5, 1.0), "yaw": (0.0, 9.0)})
    (shown,) = with_formula_curves((formula,), given, lambda _: given.base_residual, SHOWN)
    at, fitted = (np.array([getattr(one, name) for one in shown.against.bins]) for name in ("at", "fitted"))
    assert (shown.variable, shown.against.variable_unit) == ("yaw_rad", "rad")
    assert fitted == pytest.approx(0.225 * np.sin(2 * at), abs=0.03)
    nothing = Formula("longitudinal", "", ("a",), {}, 0.2, {})
    assert with_formula_curves((nothing,), given, lambda _: given.base_residual, SHOWN) == (nothing,)


def test_a_variable_that_is_not_among_the_traces_has_no_table():
    given = traces(np.ones(N), np.ones(N), np.ones(N))
    (effect,) = with_curves((found("effort_sum_nm"),), given, lambda _: given.base_residual, SHOWN)
    assert effect.against is None


def test_slip_velocities_have_their_own_units():
    v = np.linspace(0, 1, N)
    given = traces(v, 0 * v, v)
    (effect,) = with_curves((found("v_mps"),), given, lambda _: given.base_residual, SHOWN, by_wheels=True)
    assert effect.against.residual_unit == "m/s"


def test_a_stretch_that_stands_out_is_told():
    v, error = np.ones(N), np.full(N, 0.01)
    error[160:240] = 0.08
    (one,) = blocks(traces(v, v, v, error), SHOWN)
    assert (one.start_s, one.end_s) == (8.0, 12.0)
    assert one.position_rms_m == pytest.approx(0.08)
    assert one.times == pytest.approx(8.0)
    assert blocks(traces(v, v, v, np.full(N, 0.01)), SHOWN) == ()


def test_the_right_model_holds_on_a_log_that_was_never_fitted():
    model = Model(robot=SMALL_ROBOT, effects=(DRAG,))
    sensors = Sensors(rate_hz=100.0, torque_rate_hz=100.0, noise_xy_sd_m=1e-3, noise_yaw_sd_rad=1e-3)
    log = synthesise(
        "patrol", seed=4, duration_s=24.0, sensors=sensors, robot=SMALL_ROBOT, world=model_world(model)
    ).log
    late = Effect("load_step", {"mass_ratio": 0.3, "t0_s": 5.0})
    extended = Model(robot=SMALL_ROBOT, effects=(DRAG, late))
    shown = elsewhere(log, (), extended, GapOptions(modes="given"))
    assert shown.left_out == ("load_step",)
    assert shown.position.held_out.after < 0.2 * shown.position.held_out.before
    assert shown.position.windows >= 3
    assert np.isnan(shown.position.train.before)
    inside = np.isfinite(shown.traces.extended_path[:, 0])
    assert inside.mean() > 0.8


def slipping_problem(slipping_s):
    """A problem whose identified modes slip between two times."""
    log = synthesise("cruise", seed=3, duration_s=60.0).log
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    slips = (t_s > slipping_s[0]) & (t_s < slipping_s[1])
    track = ModeTrack(log.pose.t_ns, np.where(slips, ContactMode.SLIPPING, 0).astype(np.int8))
    settings = GateSettings()
    return Problem.of(bin_log(log, settings, track, margin_s=0.3, names_skid=False))


@pytest.mark.parametrize(("slipping_s", "windows"), [((20.5, 25.5), 2), ((70.0, 71.0), 0)])
def test_the_gap_in_slip_is_that_of_the_windows_that_the_held_out_gap_leaves_out(slipping_s, windows):
    problem = slipping_problem(slipping_s)
    t_s, none = problem.binned.t_s, np.zeros((len(problem.binned), 3))
    base, extended = none.copy(), none.copy()
    base[:, :2], extended[:, 1] = np.where((t_s > 19.5) & (t_s < 28.5), 0.3, 0.02)[:, None] * [0.6, 0.8], 0.01
    base[:, 2] = 0.1
    given = Traces(0, t_s, none, base, extended, none, none, none[:, 0], none[:, 0])
    metric = GapMetric("m", "m", 9, TrainGap(0.0, 0.0), HeldOutGap(0.0, 0.0, 0.0, (0.0, 0.0), 1.0))
    position, yaw = with_slip_gaps(problem, given, metric, metric)
    if not windows:
        assert position is metric
        assert yaw is metric
        return
    slip = position.in_slip
    assert (slip.windows, slip.before, slip.after) == (windows, pytest.approx(0.3), pytest.approx(0.01))
    assert (yaw.in_slip.before, yaw.in_slip.after) == (pytest.approx(0.1), 0.0)

"""The likelihood of held-out rows with their modes unknown, against all histories of modes one by one.

The oracle is an extended Kalman filter in NumPy for each history: the equations as they are written,
integrated by Runge–Kutta, slopes by central differences, and one update by the whole pose.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem, first_state
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.unknown_modes import causal_deviance, chain_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

IDEAL, SKIDDING, SLIPPING = ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING
SETTINGS = GateSettings()
BASE = Base(
    alpha=0.28,
    alpha_yaw=0.34,
    half_track_m=0.25,
    skid_decay_mps2=8.0,
    speed_mps=0.0,
    slip_share=0.25,
    slip_share_yaw=0.2,
    com_yaw_per_m=0.0,
    lateral_decay_per_s=5.0,
)
ROBOT = RobotParameters(alpha=0.28, alpha_yaw=0.34, half_track_m=0.25)
NOISE = Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)
FITTED, SD, LOOSE_MPS = 40, (0.004, 0.004, 0.003), 0.2
INTEGRATED = 0.05
"""What Runge-Kutta and the midpoint rule may differ by, in −2 log likelihood."""


def written(z, mode, left, right):
    """d/dt of the state; the disturbances are held over a step."""
    _, _, yaw, v, w, v_lat, d_long, d_lat, d_yaw = z
    yaw_rate = w / BASE.half_track_m
    share, share_yaw = (BASE.slip_share, BASE.slip_share_yaw) if mode == SLIPPING else (1.0, 1.0)
    dv = BASE.alpha * share * (right + left) + d_long
    dw = BASE.alpha_yaw * share_yaw * (right - left) + d_yaw
    dv_lat = -BASE.lateral_decay_per_s * v_lat
    if mode == SKIDDING:
        speed = max(np.sqrt(v**2 + v_lat**2 + w**2), 0.3)
        dv_lat = -BASE.skid_decay_mps2 / speed * v_lat - v * yaw_rate + d_lat
        dv += v_lat * yaw_rate / 3
    dx, dy = v * np.cos(yaw) - v_lat * np.sin(yaw), v * np.sin(yaw) + v_lat * np.cos(yaw)
    return np.array([dx, dy, yaw_rate, dv, dw, dv_lat, 0, 0, 0])


def moved(z, mode, efforts, dt, loose, kept):
    """The state one row later."""
    k1 = written(z, mode, *efforts)
    k2 = written(z + dt / 2 * k1, mode, *efforts)
    k3 = written(z + dt / 2 * k2, mode, *efforts)
    k4 = written(z + dt * k3, mode, *efforts)
    out = z + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    if loose and mode != SKIDDING:
        out[5] = 0.0
    return out * kept


def predicted(z, P, before, mode, efforts, dt):
    """Time update, a change of mode at the row's start included."""
    loose = (before == SKIDDING) != (mode == SKIDDING)
    decay = np.exp(-dt / np.array([NOISE.long_tau_s, NOISE.long_tau_s, NOISE.yaw_tau_s]))
    kept = np.concatenate([np.ones(6), decay])
    step = 1e-5 * np.eye(9)
    F = [
        moved(z + h, mode, efforts, dt, loose, kept) - moved(z - h, mode, efforts, dt, loose, kept)
        for h in step
    ]
    Q = np.zeros(9)
    Q[6:] = np.array([NOISE.long_sd_mps2, NOISE.long_sd_mps2, NOISE.yaw_sd_mps2]) ** 2 * (1 - decay**2)
    lateral = NOISE.lat_sd_mps**2
    Q[5] = lateral * dt if mode == SKIDDING else lateral * (1 - np.exp(-2 * dt / NOISE.lat_tau_s))
    if loose:
        Q[5] += LOOSE_MPS**2
        Q[:2] += (LOOSE_MPS * dt) ** 2 / 3
    if mode == SLIPPING:
        Q[3:5] += SETTINGS.filter.slip_disturbance_mps2_rthz**2 * dt
    if mode != before:
        Q[3:5] += SETTINGS.filter.switch_sd_mps**2
    F = np.stack(F, axis=1) / 2e-5
    return moved(z, mode, efforts, dt, loose, kept), F @ P @ F.T + np.diag(Q)


def updated(z, P, pose, variances):
    """Measurement update, and −2 log likelihood of the pose."""
    H = np.eye(3, 9)
    S = H @ P @ H.T + np.diag(variances)
    error, K = pose - z[:3], P @ H.T @ np.linalg.inv(S)
    deviance = error @ np.linalg.solve(S, error) + np.linalg.slogdet(2 * np.pi * S)[1]
    return z + K @ error, P - K @ H @ P, deviance


class Oracle:
    """Filters along histories of modes through a problem."""

    def __init__(self, problem: Problem) -> None:
        self.binned, self.variances = problem.binned, problem.variances
        self.efforts = Extension(BASE).mean_torques(problem.binned).T
        first = problem.first * np.array([1, 1, 1, 1, BASE.half_track_m, 1, 1, 1, 1])
        P = np.diag([0.25] * 5 + [NOISE.lat_sd_mps**2 + 1e-6] + [0.05**2] * 3)
        self.state = first, P

    def along(self, state, before, mode, k):
        """State after row ``k`` in ``mode``, and −2 log likelihood of its pose."""
        z, P = state
        if k > 0:
            z, P = predicted(z, P, before, mode, self.efforts[k], self.binned.step_s[k])
        z, P, deviance = updated(z, P, self.binned.pose[k], self.variances[k])
        return (z, P), deviance

    def fitted(self):
        """Through the fitted rows, which all roll: the state and the rows' deviances."""
        state, deviances = self.state, []
        for k in range(FITTED):
            state, deviance = self.along(state, IDEAL, IDEAL, k)
            deviances.append(deviance)
        return state, deviances

    def marginal(self, n, switches):
        """−2 log likelihood of the first ``n`` held-out rows together, over all histories."""
        start, _ = self.fitted()
        logs = []
        for history in product((IDEAL, SKIDDING, SLIPPING), repeat=n):
            state, total, before = start, 0.0, IDEAL
            for k, mode in enumerate(history, FITTED):
                left = 1 - np.exp(-switches.rates_per_s[before] * self.binned.step_s[k])
                prior = 1 - left if mode == before else left * switches.shares[before, mode]
                state, deviance = self.along(state, before, mode, k)
                total, before = total + deviance - 2 * np.log(prior), mode
            logs.append(-total / 2)
        return -2 * np.logaddexp.reduce(logs)


def made_problem(acts: float, held_out: int) -> Problem:
    """Rows that roll and are fitted, then held-out ones in which the share ``acts`` of the torques acts."""
    rng, n = np.random.default_rng(3), 1000
    sent = np.stack([1.0 + np.zeros(n), 1.6 + np.zeros(n)], axis=1)
    z, path = np.array([0, 0, 0.3, 0.6, 0.1, 0, 0, 0, 0.0]), np.zeros((n, 3))
    for k in range(n):
        path[k] = z[:3]
        share = acts if k >= 4 * FITTED else 1.0
        z = moved(z, IDEAL, share * sent[k], 0.01, False, np.ones(9))
    t_ns = np.arange(n, dtype=np.int64) * 10_000_000
    pose = path + rng.normal(size=(n, 3)) * SD
    log = Log(
        PoseTrack(t_ns, *pose.T.copy()),
        TorqueTrack(t_ns, *sent.T.copy(), *np.full((2, n), np.nan)),
        None,
        ROBOT,
    )
    binned = bin_log(log, SETTINGS).part(slice(0, FITTED + held_out))
    return Problem(binned, np.arange(len(binned)) < FITTED, first_state(binned))


@pytest.fixture(scope="module", params=[1.0, 0.2], ids=["rolls", "slips"])
def case(request):
    """A problem, the scores of its rows, and its oracle."""
    problem = made_problem(request.param, 6)
    return problem, causal_deviance(problem, Extension(BASE), NOISE), Oracle(problem)


def test_fitted_rows_are_scored_with_their_modes(case):
    problem, deviance, oracle = case
    assert deviance[:FITTED] == pytest.approx(oracle.fitted()[1], abs=INTEGRATED)
    labelled = problem.filtered(Extension(BASE), NOISE).deviance
    assert deviance[:FITTED] == pytest.approx(labelled[:FITTED], abs=1e-9)


@pytest.mark.parametrize("n", [1, 2])
def test_before_anything_is_merged_the_score_is_that_of_all_histories(case, n):
    problem, deviance, oracle = case
    expected = oracle.marginal(n, chain_of(problem))
    assert deviance[FITTED : FITTED + n].sum() == pytest.approx(expected, abs=INTEGRATED)


@pytest.mark.parametrize("n", [3, 5])
def test_with_merged_histories_the_score_is_nearly_that_of_all(case, n):
    problem, deviance, oracle = case
    expected = oracle.marginal(n, chain_of(problem))
    assert deviance[FITTED : FITTED + n].sum() == pytest.approx(expected, abs=0.3)


def test_slip_that_no_label_says_costs_its_price_and_no_more():
    """Labels that miss it cost far more than the switch; where all rolls, modes cost nearly nothing."""
    gained = {}
    for acts in (1.0, 0.2):
        problem = made_problem(acts, 12)
        labelled = problem.filtered(Extension(BASE), NOISE).deviance
        gained[acts] = (labelled - causal_deviance(problem, Extension(BASE), NOISE))[FITTED:].sum()
    assert -1 < gained[1.0] < 0.1
    assert gained[0.2] > 20


def test_held_out_labels_do_not_count():
    """Whatever the labels of held-out rows say, the scores are the same."""
    problem = made_problem(1.0, 6)
    others = replace(problem.binned, mode=np.where(problem.train, problem.binned.mode, float(SKIDDING)))
    expected = causal_deviance(problem, Extension(BASE), NOISE)
    assert np.array_equal(causal_deviance(replace(problem, binned=others), Extension(BASE), NOISE), expected)


def slipping_problem() -> Problem:
    """40 s of which 12 are held out; it slips four times for 1 s, in 8 to 12 s unseen by the fitted rows."""
    n = 4000
    t_ns = np.arange(n, dtype=np.int64) * 10_000_000
    slips = np.isin(t_ns // NS_PER_S, (2, 10, 14, 38))
    torque = TorqueTrack(t_ns, *np.ones((2, n)), *np.full((2, n), np.nan))
    track = ModeTrack(t_ns, np.where(slips, SLIPPING, IDEAL).astype(np.int8))
    rng = np.random.default_rng(4)
    return Problem.of(
        bin_log(
            Log(PoseTrack(t_ns, *(rng.normal(size=(3, n)) * 0.001)), torque, None, ROBOT), SETTINGS, track
        )
    )


def test_switches_are_counted_on_fitted_rows():
    """Rolling is left three times in 25 s, beside twice in 20 s before the log; slips of 1 s end three times,
    beside three times in 5.1 s.
    """
    switches = chain_of(slipping_problem())
    assert switches.rates_per_s[IDEAL] == pytest.approx(5 / 45, rel=0.02)
    assert switches.rates_per_s[SLIPPING] == pytest.approx(6 / 8.1, rel=0.02)
    assert switches.shares[SLIPPING, SKIDDING] == pytest.approx(0.2 * 3 / 6)
    assert switches.shares[:3].sum(axis=1) == pytest.approx(1)

"""How much of a lag a controller makes that answers the disturbance.

A controller whose sensors are better than the poses answers the disturbance d by torques that ask for the
acceleration −H d, H = K/(K + jω). A filter takes torques for given, and their change for a cause of d. So a
lag or delay L, which changes the acceleration a that the torques ask for by (L − 1) a, has a score of

    T/2π ∫ Re[(1 − L) H] S/(S + R ω⁴) dω

although nothing lags: T is the log's length, S the disturbance's density and R the poses'. It is positive, up
to tens of standard deviations on a calm drive with precise poses. Divided by the root of the lag's own
information it varies little with K: on spiral drives, by a factor of 1.4 from 2/s to 16/s. Sources: Ljung,
System Identification (1999), section 13.4, for the bias in closed loops; Whittle (1953) for the sum over
frequencies.
"""

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64

C128 = npt.NDArray[np.complex128]
LATE = {"actuator_lag": "time_constant_s", "input_delay": "delay_s"}
"""Effects that make the torques act later, and the parameter that says by how much."""


def answer_p(problem: Problem, rest: Extension, fit: Fit, name: str) -> float:
    """P value that an answer to the disturbance makes as much of a lag or delay of the model ``fit``.

    One-sided, of the score of the effect in ``rest``, the model without it, at the disturbances of ``fit``. 0
    for other effects, which manoeuvres show.
    """
    if name not in LATE:
        return 0.0
    along = whitened_change(problem, rest, fit, name)
    size = max(float(np.sqrt(along @ along)), 1e-12)
    clip_sd = problem.settings.significance.clip_sd
    e = evaluate(problem, rest, fit.noise).innovations[problem.train]
    seen = float(along @ np.clip(e, -clip_sd, clip_sd).ravel()) / size
    late_s = fit.extension.effects[name][LATE[name]]
    return float(ndtr(answered_score(problem, fit, name, late_s) / size - seen))


def whitened_change(problem: Problem, rest: Extension, fit: Fit, name: str) -> F64:
    """What the effect changes of the whitened innovations (3n,), without what the other effects explain."""
    train = problem.train
    without = evaluate(problem, rest, fit.noise).innovations
    change = (without - fit.innovations)[train].ravel()
    others = fit.psi[train][:, :, [owner != name for owner, _ in fit.keys]].reshape(len(change), -1)
    if not others.shape[1]:
        return np.asarray(change)
    return np.asarray(change - others @ np.linalg.lstsq(others, change, rcond=1e-8)[0])


def answered_score(problem: Problem, fit: Fit, name: str, late_s: float) -> float:
    """The expected score of a lag or delay of ``late_s`` under a controller's answer: of both channels, at
    the rate K that makes most of it.
    """
    own, binned, noise = problem.settings.answer, problem.binned, fit.noise
    step_s = float(np.median(binned.step_s))
    seconds = step_s * int(problem.train.sum())
    omega = np.linspace(0.0, np.pi / step_s, own.frequencies + 1)[1:]
    change = 1.0 - response(name, late_s, omega)
    position, _, yaw = np.median(problem.variances, axis=0) * step_s
    weights = coherence(omega, noise.long_sd_mps2, noise.long_tau_s, float(position))
    yaw *= fit.extension.base.half_track_m**2
    weights = weights + coherence(omega, noise.yaw_sd_mps2, noise.yaw_tau_s, float(yaw))
    rates = np.array(own.rates_per_s)[:, None]
    expected = np.real(change * rates / (rates + 1j * omega)) @ weights
    return float(max(expected.max(), 0.0) * seconds * omega[0] / np.pi)


def response(name: str, seconds: float, omega: F64) -> C128:
    """The response (k,) of a lag of one pole, or of a delay, at the angular frequencies ``omega`` (k,)."""
    if name == "actuator_lag":
        return np.asarray(1 / (1 + 1j * omega * seconds))
    return np.asarray(np.exp(-1j * omega * seconds))


def coherence(omega: F64, sd_mps2: float, tau_s: float, density: float) -> F64:
    """S/(S + R ω⁴) (k,): the share of what the poses of ``density`` R show at ``omega`` that the disturbance
    makes.
    """
    disturbance = 2 * sd_mps2**2 * tau_s / (1 + (omega * tau_s) ** 2)
    return np.asarray(disturbance / (disturbance + density * omega**4))

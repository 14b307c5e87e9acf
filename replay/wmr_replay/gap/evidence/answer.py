"""How much of a lag or a gain a controller makes that answers the disturbance.

A controller whose sensors are better than the poses answers the disturbance d by torques that ask for the
acceleration −H d, H = K/(K + jω). A filter takes torques for given, and their change for a cause of d. So a
response L, which changes the acceleration a that the torques ask for by (L − 1) a, has a score of

    T/2π ∫ Re[(1 − L) H] S/(S + R ω⁴) dω

although nothing responds so: T is the log's length, S the disturbance's density and R the poses'. It is
positive for lags and for weak gains, up to tens of standard deviations on a calm drive with precise poses.
Divided by the root of a lag's own information it varies little with K: on spiral drives, by a factor of 1.4
from 2/s to 16/s. Sources: Ljung, System Identification (1999), section 13.4, for the bias in closed loops;
Whittle (1953) for the sum over frequencies.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64

C128 = npt.NDArray[np.complex128]
LATE = ("actuator_lag", "input_delay")
"""Effects that make the torques act later."""
RESPONSES = {
    "actuator_lag": "time_constant_s",
    "input_delay": "delay_s",
    "payload": "mass_ratio",
    "yaw_inertia": "ratio",
    "drive_gain": "ratio",
}
"""Effects on how the robot responds to its torques, and the parameter that says by how much."""
GAIN, CHANNELS = "drive_gain", ("longitudinal", "yaw")
UNTOUCHED = {"payload": "yaw", "yaw_inertia": "longitudinal"}
"""The channel that an effect leaves as it is."""


def answer_p(problem: Problem, rest: Extension, fit: Fit, name: str) -> float:
    """P value that an answer to the disturbance makes as much of an effect of the model ``fit``.

    One-sided, of the score of the effect in ``rest``, the model without it, at the disturbances of ``fit``. 0
    for effects that are no response to the torques.
    """
    if name not in RESPONSES:
        return 0.0
    along = whitened_change(problem, rest, fit, name)
    size = max(float(np.sqrt(along @ along)), 1e-12)
    clip_sd = problem.settings.significance.clip_sd
    e = evaluate(problem, rest, fit.noise).innovations[problem.train]
    seen = float(along @ np.clip(e, -clip_sd, clip_sd).ravel()) / size
    value = fit.extension.effects[name][RESPONSES[name]]
    return float(ndtr(answered_score(problem, fit, name, value) / size - seen))


def whitened_change(problem: Problem, rest: Extension, fit: Fit, name: str) -> F64:
    """What the effect changes of the whitened innovations (3n,), without what the other effects explain."""
    train = problem.train
    without = evaluate(problem, rest, fit.noise).innovations
    change = (without - fit.innovations)[train].ravel()
    others = fit.psi[train][:, :, [owner != name for owner, _ in fit.keys]].reshape(len(change), -1)
    if not others.shape[1]:
        return np.asarray(change)
    return np.asarray(change - others @ np.linalg.lstsq(others, change, rcond=1e-8)[0])


def answered_score(problem: Problem, fit: Fit, name: str, value: float) -> float:
    """The expected score of a response of size ``value`` under a controller's answer: of the channels that it
    acts on.
    """
    channels = tuple(channel for channel in CHANNELS if channel != UNTOUCHED.get(name))
    return expected_score(problem, fit, channels, lambda omega: 1.0 - response(name, value, omega))


def beyond_answer(problem: Problem, fit: Fit, name: str, rival: str, ahead_by: float) -> float:
    """What is left of ``ahead_by``, the deviance by which an effect of the model ``fit`` is likelier than a
    rival, without what an answer to the disturbance makes of it, in the channel where they differ.

    A gain is a payload and a yaw inertia of the same size. So a payload is told from it by turning alone,
    where an answer makes a score b of a response that is not there. With S = I of the difference's score and
    information, ahead_by = S²/I, and (S − b)²/I is left.
    """
    other = name if rival == GAIN else rival
    if GAIN not in (name, rival) or other not in UNTOUCHED or ahead_by <= 0:
        return ahead_by
    value, sign = fit.extension.effects[name][RESPONSES[name]], 1.0 if name == GAIN else -1.0

    def change(omega: F64) -> C128:
        return sign * (1.0 - response(name, value, omega))

    answered = expected_score(problem, fit, (UNTOUCHED[other],), change)
    return max(ahead_by - answered, 0.0) ** 2 / ahead_by


def expected_score(
    problem: Problem, fit: Fit, channels: Sequence[str], change: Callable[[F64], C128]
) -> float:
    """The expected score of a ``change`` of the response to torques on ``channels``, at the rate K that makes
    most of it.
    """
    own, binned = problem.settings.answer, problem.binned
    step_s = float(np.median(binned.step_s))
    seconds = step_s * int(problem.train.sum())
    omega = np.linspace(0.0, np.pi / step_s, own.frequencies + 1)[1:]
    shares = coherences(problem, fit, omega, step_s)
    weights = sum((c for channel, c in shares if channel in channels), np.zeros(len(omega)))
    rates = np.array(own.rates_per_s)[:, None]
    expected = np.real(change(omega) * rates / (rates + 1j * omega)) @ weights
    return float(max(expected.max(), 0.0) * seconds * omega[0] / np.pi)


def response(name: str, value: float, omega: F64) -> C128:
    """The response (k,) to torques at the angular frequencies ``omega`` (k,); 1 is the base model's."""
    match name:
        case "actuator_lag":
            return np.asarray(1 / (1 + 1j * omega * value))
        case "input_delay":
            return np.asarray(np.exp(-1j * omega * value))
        case "drive_gain":
            return np.full(len(omega), 1 + value, np.complex128)
        case _:
            return np.full(len(omega), 1 / (1 + value), np.complex128)


def coherences(problem: Problem, fit: Fit, omega: F64, step_s: float) -> list[tuple[str, F64]]:
    """By channel, the share (k,) of what the poses show at ``omega`` (k,) that the disturbance makes."""
    noise, half_track_m = fit.noise, fit.extension.base.half_track_m
    position, _, yaw = (float(one) * step_s for one in np.median(problem.variances, axis=0))
    ahead = coherence(omega, noise.long_sd_mps2, noise.long_tau_s, position)
    turning = coherence(omega, noise.yaw_sd_mps2, noise.yaw_tau_s, yaw * half_track_m**2)
    return [("longitudinal", ahead), ("yaw", turning)]


def coherence(omega: F64, sd_mps2: float, tau_s: float, density: float) -> F64:
    """S/(S + R ω⁴) (k,) of a disturbance and poses of ``density`` R."""
    disturbance = 2 * sd_mps2**2 * tau_s / (1 + (omega * tau_s) ** 2)
    return np.asarray(disturbance / (disturbance + density * omega**4))

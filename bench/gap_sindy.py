"""PySINDy's sequentially thresholded least squares on the terms of the library's effects.

The equation errors are dv/dt − α Σu and l·yaw_acc − α_yaw Δu. The derivatives come from local cubic fits
(Savitzky and Golay) over windows of ideal rolling; the torques pass through the same filter. Every term is
scaled to unit root mean square, so that the threshold is an acceleration in m/s².
"""

import warnings
from itertools import product

import numpy as np
from pysindy import STLSQ
from scipy.ndimage import minimum_filter1d
from scipy.signal import savgol_filter

from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log

WINDOWS_S = (0.2, 0.4, 0.8, 1.2, 1.6)
THRESHOLDS_MPS2 = (0.01, 0.02, 0.03, 0.05, 0.08, 0.12)
SETTINGS = tuple(product(WINDOWS_S, THRESHOLDS_MPS2))
SOFT_MPS = 0.05
ALIKE = 0.35
ONE_TERM = {
    ("long", "gain"): "payload",
    ("yaw", "gain"): "yaw_inertia",
    ("long", "cross"): "torque_imbalance",
    ("yaw", "cross"): "torque_imbalance",
    ("long", "tanh"): "rolling_resistance",
    ("long", "linear"): "viscous_drag",
    ("long", "square"): "aerodynamic_drag",
    ("yaw", "tanh"): "scrub_torque",
    ("yaw", "linear"): "yaw_damping",
    ("long", "cos"): "slope",
    ("long", "sin"): "slope",
    ("long", "one"): "torque_bias_common",
    ("yaw", "one"): "torque_bias_differential",
    ("long", "com"): "com_offset",
    ("yaw", "com"): "com_offset",
    ("long", "dead"): "torque_deadzone",
    ("yaw", "dead"): "torque_deadzone",
}
BOTH_TERMS = {"gain": "drive_gain", "tanh": "wheel_coulomb", "linear": "wheel_viscous"}
EXPRESSIBLE = set(ONE_TERM.values()) | set(BOTH_TERMS.values())
Terms = dict[str, F64]


def sindy_names(log: Log) -> dict[str, list[str]]:
    """Named effects by setting, the largest contribution first."""
    found = {}
    for window_s in WINDOWS_S:
        channels = equations(log, window_s)
        for threshold in THRESHOLDS_MPS2:
            active = {name: sparse(terms, error, threshold) for name, (terms, error) in channels.items()}
            found[f"{window_s:g} s, {threshold:g} m/s²"] = named(active)
    return found


def equations(log: Log, window_s: float) -> dict[str, tuple[Terms, F64]]:
    """Terms and equation error by channel, at rows whose whole window is ideal rolling."""
    pose, torque, robot = log.pose, log.torque, log.robot
    dt = float(np.median(np.diff(pose.t_ns))) / NS_PER_S
    size = 2 * round(window_s / dt / 2) + 1

    def smooth(x: F64, k: int) -> F64:
        return savgol_filter(x, size, 3, deriv=k, delta=dt)

    yaw = np.unwrap(pose.yaw_rad)
    psi, rate, yaw_acc = (smooth(yaw, k) for k in range(3))
    cos, sin = np.cos(psi), np.sin(psi)
    v_x, v_y, a_x, a_y = smooth(pose.x_m, 1), smooth(pose.y_m, 1), smooth(pose.x_m, 2), smooth(pose.y_m, 2)
    v = v_x * cos + v_y * sin
    a_long = a_x * cos + a_y * sin + rate * (v_y * cos - v_x * sin)
    rows = np.clip(np.searchsorted(torque.t_ns, pose.t_ns, side="right") - 1, 0, None)
    left, right = torque.left_nm[rows], torque.right_nm[rows]
    alpha, alpha_yaw, l = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    push = [np.tanh(u / (0.2 * np.median(np.abs(torque.right_nm)))) for u in (right, left)]
    total, difference = smooth(left + right, 0), smooth(right - left, 0)
    w = l * rate
    one = np.ones_like(v)
    ahead = {
        "gain": alpha * total,
        "cross": alpha * difference,
        "tanh": np.tanh(v / SOFT_MPS),
        "linear": v,
        "square": v * np.abs(v),
        "cos": cos,
        "sin": sin,
        "one": one,
        "com": rate**2,
        "dead": alpha * smooth(push[0] + push[1], 0),
    }
    around = {
        "gain": alpha_yaw * difference,
        "cross": alpha_yaw * total,
        "tanh": np.tanh(w / SOFT_MPS),
        "linear": w,
        "one": one,
        "com": v * rate,
        "dead": alpha_yaw * smooth(push[0] - push[1], 0),
    }
    calm = ideal_throughout(log, size)
    errors = {"long": a_long - alpha * total, "yaw": l * yaw_acc - alpha_yaw * difference}
    return {
        name: ({key: term[calm] for key, term in terms.items()}, errors[name][calm])
        for name, terms in (("long", ahead), ("yaw", around))
    }


def ideal_throughout(log: Log, size: int) -> np.ndarray:
    """Mask (n,) of rows whose whole window is ideal rolling; rows at the edges are left out."""
    held = np.searchsorted(log.mode.t_ns, log.pose.t_ns, side="right") - 1
    ideal = (log.mode.mode[np.maximum(held, 0)] == 0).astype(np.int8)
    return minimum_filter1d(ideal, size, mode="constant", cval=0).astype(bool)


def sparse(terms: Terms, error: F64, threshold: float) -> dict[str, tuple[float, float]]:
    """Coefficient and contribution of each active term.

    The contribution is the term's root mean square over that of the error.
    """
    columns = np.column_stack(list(terms.values()))
    size = np.sqrt(np.mean(columns**2, axis=0))
    optimiser = STLSQ(threshold=threshold, alpha=1e-6, max_iter=20)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # STLSQ warns if no term is left
        optimiser.fit(columns / size, error[:, None])
    share = optimiser.coef_[0] / np.std(error)
    return {
        key: (float(optimiser.coef_[0, j] / size[j]), float(abs(share[j])))
        for j, key in enumerate(terms)
        if share[j] != 0
    }


def named(active: dict[str, dict[str, tuple[float, float]]]) -> list[str]:
    """Effects of the active terms, the largest contribution first.

    A term that is active in both channels with consistent coefficients is one effect.
    """
    worth: dict[str, float] = {}
    left = {(channel, key): entry for channel, found in active.items() for key, entry in found.items()}
    for key, name in BOTH_TERMS.items():
        pair = [left.get((channel, key)) for channel in ("long", "yaw")]
        if all(pair) and alike(key, pair[0][0], pair[1][0]):
            worth[name] = sum(share for _, share in pair)
            del left["long", key], left["yaw", key]
    for own, (_, share) in left.items():
        worth[ONE_TERM[own]] = worth.get(ONE_TERM[own], 0.0) + share
    return sorted(worth, key=lambda name: -worth[name])


def alike(key: str, ahead: float, around: float) -> bool:
    """Whether both coefficients can be one effect's: equal for a gain, of the same sign for a friction."""
    if key == "gain":
        return abs(ahead - around) < ALIKE * max(abs(ahead), abs(around))
    return ahead * around > 0

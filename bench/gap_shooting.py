"""Single shooting + BIC: one simulation of the whole log from a fitted start, effects chosen by BIC alone."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from wmr_replay.effects.efforts import UNIT_CHANGES
from wmr_replay.gap.estimation.path_error import residuals, starting_motion
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import BinnedLog, bin_log
from wmr_replay.gap.model.candidates import LIBRARY, Candidate
from wmr_replay.gap.model.dynamics import N_STATE
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64
from wmr_schemas.signals import Log

N_START = 5
MOST_EFFECTS, FITTED, MOST_CALLS = 3, 6, 25
STARTS_S = (0.2, 0.35, 0.5, 0.65)
Keys = list[tuple[str, str]]


class Shot(NamedTuple):
    """A fitted model: its residuals' BIC, what is in it, and where it starts."""

    bic: float
    extension: Extension
    start: F64


def shot_names(log: Log) -> list[str]:
    """Effects by forward selection on BIC, up to three."""
    binned = bin_log(log, GateSettings(), log.mode)
    base = Extension(base_of(log.robot), {}, log.robot.wheel_radius_m)
    current = fitted(binned, base, starting_motion(binned, 0, base.base, 0.0))
    for _ in range(MOST_EFFECTS):
        tried = [fitted(binned, extension, current.start) for extension in promising(binned, current)]
        best = min(tried, key=lambda shot: shot.bic, default=current)
        if best.bic >= current.bic:
            break
        current = best
    return list(current.extension.effects)


def errors(binned: BinnedLog, extension: Extension, start: F64) -> F64:
    """Whitened residuals of the whole log; a simulation that runs away counts as far off."""
    out = np.empty(3 * len(binned))
    rows, scale = extension.rows(binned), np.sqrt(binned.variances)
    residuals(start, rows, binned.pose, extension.theta(), extension.base, scale, out)
    return np.clip(np.nan_to_num(out, nan=1e6), -1e6, 1e6)


def fitted(binned: BinnedLog, extension: Extension, start: F64) -> Shot:
    """Initial motion and every parameter by Levenberg and Marquardt within bounds."""
    keys: Keys = [(name, key) for name, p in extension.effects.items() for key in p]
    library = {candidate.name: candidate for candidate in LIBRARY}
    bounds = np.array([library[name].bounds[key] for name, key in keys]).reshape(-1, 2)

    def unpacked(x: F64) -> tuple[Extension, F64]:
        z = np.zeros(N_STATE)
        z[:N_START] = x[:N_START]
        return changed(extension, keys, x[N_START:]), z

    free = np.full((N_START, 2), [-np.inf, np.inf])
    low, high = np.concatenate([free, bounds]).T
    own = [extension.effects[name][key] for name, key in keys]
    x0 = np.clip(np.concatenate([start[:N_START], own]), low + 1e-9, high - 1e-9)
    found = least_squares(
        lambda x: errors(binned, *unpacked(x)), x0, bounds=(low, high), x_scale="jac", max_nfev=MOST_CALLS
    )
    n = 3 * len(binned)
    bic = n * np.log(2 * found.cost / n) + len(x0) * np.log(n)
    return Shot(float(bic), *unpacked(found.x))


def changed(extension: Extension, keys: Keys, values: F64) -> Extension:
    """Other values for the parameters."""
    effects = {name: dict(p) for name, p in extension.effects.items()}
    for (name, key), value in zip(keys, values, strict=True):
        effects[name][key] = float(value)
    return Extension(extension.base, effects, extension.wheel_radius_m)


def promising(binned: BinnedLog, current: Shot) -> list[Extension]:
    """Of every candidate and start the few that lower the sum of squares most, to first order."""
    at = errors(binned, current.extension, current.start)
    moves = motion_slopes(binned, current, at)
    ranked = []
    for candidate in LIBRARY:
        if candidate.name in current.extension.effects:
            continue
        tried = [current.extension.with_effect(candidate.name, p) for p in starts_of(binned, candidate)]
        promises = [promise(at - errors(binned, one, current.start), moves, at) for one in tried]
        best = int(np.argmax(promises))
        ranked.append((promises[best], tried[best]))
    ranked.sort(key=lambda option: -option[0])
    return [extension for _, extension in ranked[:FITTED]]


def motion_slopes(binned: BinnedLog, current: Shot, at: F64) -> F64:
    """How the residuals fall with each component of the initial motion (3n, 5)."""
    columns = []
    for j in range(N_START):
        other = current.start.copy()
        other[j] += 1e-5
        columns.append((at - errors(binned, current.extension, other)) / 1e-5)
    return np.stack(columns, axis=1)


def promise(change: F64, moves: F64, at: F64) -> float:
    """How far a multiple of ``change`` lowers the sum of squares beside a new initial motion."""
    A = np.column_stack([change, moves])
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-30)
    left = at - A @ np.linalg.lstsq(A, at, rcond=1e-9)[0]
    return float(at @ at - left @ left)


def starts_of(binned: BinnedLog, candidate: Candidate) -> list[dict[str, float]]:
    """Where a candidate is looked for: small sizes, the grids, moments and places of the log."""
    end = float(binned.t_s[-1])
    if candidate.name == "load_step":
        return [{"mass_ratio": 0.1, "t0_s": share * end} for share in STARTS_S]
    if candidate.name == "slip_interval":
        return [{"start_s": s * end, "end_s": (s + 0.1) * end, "loss": 0.2} for s in STARTS_S]
    if candidate.name == "low_friction_patch":
        places = [binned.pose[int(share * len(binned))] for share in np.arange(0.1, 0.6, 0.05)]
        return [{"x_m": x, "y_m": y, "radius_m": 1.0, "loss": 0.2} for x, y, _ in places]
    if candidate.name == "undeclared_skid":
        return [{"stiffness_ratio": 1.0}]
    if candidate.grid:
        largest = float(np.max(np.abs(binned.torque.efforts_nm)))
        scale = largest if candidate.name.startswith("torque") else 1.0
        (key,) = candidate.free
        return [{key: share * scale} for share in candidate.grid]
    size = 0.05 if candidate.name in UNIT_CHANGES else 0.02
    return [
        dict.fromkeys(candidate.free, sign * size) for sign in (1.0, -1.0) if sign > 0 or signed(candidate)
    ]


def signed(candidate: Candidate) -> bool:
    """Whether its size may be negative."""
    return next(iter(candidate.bounds.values()))[0] < 0

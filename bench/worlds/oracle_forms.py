"""The declared formulas of the effects as traces of acceleration along the true motion.

Written from the texts in ``wmr_schemas.effects``; they share no code with the analysis or the simulators. A
trace says what an effect adds to dv_long/dt, dv_lat/dt and l·yaw_acc, and to the measured pose, when all else
stays as it is. Columns are on a grid of 10 ms.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from wmr_schemas.arrays import F64, Bool
from wmr_schemas.modes import ContactMode
from worlds.case import RATE_HZ, World

DRY_MPS = 0.02
"""Speed scale of a smooth sign: v0 of the declared rolling resistance is of this order."""
STEP_S = 1 / RATE_HZ
SPEED_FLOOR_MPS = 0.3
Column = F64 | float


@dataclass(frozen=True, eq=False)
class Signals:
    """The true motion on the grid, and what the robot's parameters make of it.

    ``long`` and ``turn`` turn torques into dv_long/dt and l·yaw_acc, slipping included; ``skid_rate`` is c/V
    while skidding, and 0 elsewhere. Frictions change their sign over ``dry_mps``; a dead zone and a limit of
    the torques set in over ``corner`` of their threshold.
    """

    t_s: F64
    x: F64
    y: F64
    yaw: F64
    v: F64
    w: F64
    q: F64
    left: F64
    right: F64
    skids: Bool
    slips: Bool
    long: F64
    turn: F64
    left_by_slip: tuple[float, float]
    skid_rate: F64
    half_track_m: float
    wheel_radius_m: float
    mass_over_yaw_inertia: float
    dry_mps: float = DRY_MPS
    corner: float = 0.0


@dataclass(frozen=True, eq=False)
class Trace:
    """What an effect adds: accelerations (3, n) and pose (3, n) on the grid."""

    acceleration: F64
    pose: F64


def signals_of(world: World) -> Signals:
    """The signals of a world, its torques held between stamps."""
    truth, robot, torque = world.truth, world.robot, world.log.torque
    shares = robot.slip_shares
    assert torque is not None
    assert shares is not None
    t_s = np.arange(0.0, truth.t_s[-1], STEP_S)
    columns = ("x_m", "y_m", "yaw_rad", "v_long_mps", "v_lat_mps", "yaw_rate_radps")
    x, y, yaw, v, w, q = (np.interp(t_s, truth.t_s, getattr(truth, name)) for name in columns)
    torque_s = (torque.t_ns - torque.t_ns[0]) * 1e-9
    held = np.searchsorted(torque_s, t_s + 1e-6, side="right") - 1
    mode = truth.mode[np.maximum(np.searchsorted(truth.t_s, t_s + 1e-6, side="right") - 1, 0)]
    skids, slips = mode == ContactMode.SKIDDING, mode == ContactMode.SLIPPING
    l = float(robot.half_track_m or 0.0)
    speed = np.maximum(np.sqrt(v**2 + w**2 + (l * q) ** 2), SPEED_FLOOR_MPS)
    return Signals(
        t_s,
        x,
        y,
        yaw,
        v,
        w,
        q,
        torque.left_nm[held],
        torque.right_nm[held],
        skids,
        slips,
        (robot.alpha or 0.0) * np.where(slips, shares[0], 1.0),
        (robot.alpha_yaw_or_alpha or 0.0) * np.where(slips, shares[1], 1.0),
        shares,
        np.where(skids, (robot.skid_decay_mps2 or 0.0) / speed, 0.0),
        l,
        float(robot.wheel_radius_m or 0.0),
        (robot.mass_kg or 0.0) / (robot.yaw_inertia_kgm2 or 1.0),
    )


def accelerating(s: Signals, long: Column = 0.0, lat: Column = 0.0, turn: Column = 0.0) -> Trace:
    """A trace of accelerations alone."""
    n = len(s.t_s)
    return Trace(np.stack([np.broadcast_to(part, n) for part in (long, lat, turn)]), np.zeros((3, n)))


def by_torques(s: Signals, left: Column, right: Column) -> Trace:
    """The trace of torques that are added at the wheels."""
    return accelerating(s, s.long * (right + left), 0.0, s.turn * (right - left))


def with_torques(s: Signals, left: F64, right: F64) -> Trace:
    """The trace of other torques than the commanded ones."""
    return by_torques(s, left - s.left, right - s.right)


def seen(s: Signals, x: Column = 0.0, y: Column = 0.0, yaw: Column = 0.0) -> Trace:
    """A trace of the measured pose alone."""
    n = len(s.t_s)
    return Trace(np.zeros((3, n)), np.stack([np.broadcast_to(part, n) for part in (x, y, yaw)]))


def sign(speed: F64, s: Signals) -> F64:
    """A sign that is smooth about 0."""
    return np.tanh(speed / s.dry_mps)


def losing(s: Signals, share: F64, tyres: Column = 0.0) -> Trace:
    """A share of traction lost, and of the tyres' side force."""
    lost = -share
    sum_, difference = s.right + s.left, s.right - s.left
    return accelerating(s, lost * s.long * sum_, tyres * s.skid_rate * s.w, lost * s.turn * difference)


def response(name: str, p: dict[str, float], s: Signals) -> Trace | None:
    """Payload, yaw inertia, drive gain, a load from ``t0_s`` on; None for other names."""
    long, turn = s.long * (s.right + s.left), s.turn * (s.right - s.left)
    match name:
        case "payload":
            return accelerating(s, long * (1 / (1 + p["mass_ratio"]) - 1))
        case "yaw_inertia":
            return accelerating(s, turn=turn * (1 / (1 + p["ratio"]) - 1))
        case "drive_gain":
            return accelerating(s, long * p["ratio"], turn=turn * p["ratio"])
        case "load_step":
            return accelerating(s, long * (1 / (1 + p["mass_ratio"]) - 1) * (s.t_s >= p["t0_s"]))
    return None


def body(name: str, p: dict[str, float], s: Signals) -> Trace | None:  # noqa: PLR0911 – one line an effect
    """Resistances, slope, centre of mass and tyres; None for other names."""
    l, turning = s.half_track_m, s.half_track_m * s.q
    match name:
        case "rolling_resistance":
            return accelerating(s, -p["c0_mps2"] * sign(s.v, s))
        case "viscous_drag":
            return accelerating(s, -p["c1_per_s"] * s.v)
        case "aerodynamic_drag":
            return accelerating(s, -p["c2_per_m"] * s.v * np.abs(s.v))
        case "scrub_torque":
            return accelerating(s, turn=-p["d0_mps2"] * sign(turning, s))
        case "yaw_damping":
            return accelerating(s, turn=-p["d1_per_s"] * turning)
        case "slope":
            return accelerating(s, p["grade_x_mps2"] * np.cos(s.yaw) + p["grade_y_mps2"] * np.sin(s.yaw))
        case "com_offset":
            lever = l * s.mass_over_yaw_inertia
            return accelerating(s, p["offset_m"] * s.q**2, turn=-p["offset_m"] * lever * s.v * s.q)
        case "cornering_stiffness":
            return accelerating(s, lat=-p["ratio"] * s.skid_rate * s.w)
    return None


def torques(name: str, p: dict[str, float], s: Signals) -> Trace | None:  # noqa: PLR0911 – one line an effect
    """Effects between the commanded torque and the torque that acts; None for other names."""
    l, r = s.half_track_m, s.wheel_radius_m
    left_mps, right_mps = s.v - l * s.q, s.v + l * s.q
    match name:
        case "wheel_coulomb":
            return by_torques(s, -p["torque_nm"] * sign(left_mps, s), -p["torque_nm"] * sign(right_mps, s))
        case "wheel_viscous":
            return by_torques(s, -p["nm_per_radps"] * left_mps / r, -p["nm_per_radps"] * right_mps / r)
        case "torque_imbalance":
            return by_torques(s, -p["ratio"] * s.left, p["ratio"] * s.right)
        case "torque_bias_common":
            return by_torques(s, p["bias_nm"], p["bias_nm"])
        case "torque_bias_differential":
            return by_torques(s, -p["bias_nm"], p["bias_nm"])
        case "actuator_lag":
            return with_torques(s, *(lagged(u, p["time_constant_s"]) for u in (s.left, s.right)))
        case "input_delay":
            return with_torques(s, *(np.interp(s.t_s - p["delay_s"], s.t_s, u) for u in (s.left, s.right)))
        case "torque_deadzone":
            return with_torques(s, *(u - within(u, p["threshold_nm"], s.corner) for u in (s.left, s.right)))
        case "torque_saturation":
            return with_torques(s, *(within(u, p["limit_nm"], s.corner) for u in (s.left, s.right)))
    return None


def within(torque: F64, limit: float, corner: float) -> F64:
    """A torque u kept within ±L: sharply, or by ρL ln(cosh((w + L)/(2ρL))/cosh((w − L)/(2ρL))) with
    w = u coth(1/(2ρ)) for a corner ρ.
    """
    if corner == 0.0:
        return np.clip(torque, -limit, limit)
    w, width = torque / np.tanh(0.5 / corner), 2 * corner * limit
    return 0.5 * width * (log_cosh((w + limit) / width) - log_cosh((w - limit) / width))


def log_cosh(x: F64) -> F64:
    """Ln cosh x, which does not overflow."""
    return np.asarray(np.abs(x) + np.log1p(np.exp(-2 * np.abs(x))) - np.log(2.0))


def lagged(torque: F64, time_constant_s: float) -> F64:
    """The mean over each step of the torque behind a first-order lag that starts settled."""
    kept = np.exp(-STEP_S / time_constant_s)
    ends, _ = lfilter([1 - kept], [1, -kept], torque, zi=[kept * torque[0]])
    starts = np.concatenate([torque[:1], ends[:-1]])
    return torque + (starts - torque) * (1 - kept) * time_constant_s / STEP_S  # type: ignore[no-any-return]


def measured(name: str, p: dict[str, float], s: Signals) -> Trace | None:
    """Errors of the measured pose; None for other names."""
    match name:
        case "heading_misalignment":
            return seen(s, yaw=p["angle_rad"])
        case "yaw_drift":
            return seen(s, yaw=p["rate_radps"] * s.t_s)
        case "pose_lever_arm":
            arm = (p["x_m"] + 1j * p["y_m"]) * np.exp(1j * s.yaw)
            return seen(s, arm.real, arm.imag)
    return None


def local(name: str, p: dict[str, float], s: Signals) -> Trace | None:
    """Traction lost in a stretch of time or on a disc; None for other names."""
    match name:
        case "slip_interval":
            return losing(s, p["loss"] * ((s.t_s >= p["start_s"]) & (s.t_s < p["end_s"])))
        case "low_friction_patch":
            inside = np.hypot(s.x - p["x_m"], s.y - p["y_m"]) < p["radius_m"]
            return losing(s, p["loss"] * inside, p["loss"] * inside)
    return None


def trace(name: str, parameters: dict[str, float], s: Signals) -> Trace:
    """The trace of an effect of the declared library. Raises KeyError for an effect that has none."""
    for family in (response, body, torques, measured, local):
        found = family(name, parameters, s)
        if found is not None:
            return found
    raise KeyError(name)


def own_slipping(s: Signals, where: Bool) -> Trace:
    """What the model's own slipping takes away where it is not slipping already."""
    slipping = (where & ~s.slips).astype(float)
    long, turn = s.long * (s.right + s.left), s.turn * (s.right - s.left)
    lost_long, lost_turn = (1 - share for share in s.left_by_slip)
    return accelerating(s, -slipping * lost_long * long, turn=-slipping * lost_turn * turn)

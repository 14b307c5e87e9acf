"""Rolling under limited traction: a wheel slips when its torque exceeds what friction carries, and only then.

A variant of the plant for the phases without skidding; scheduled skidding phases follow the published
equations (``plant``). In robot conventions, with forces divided by the inertia m + 2I_φ/r² that the drive
sees, ρ the wheels' share of it, and for each wheel i (right: upper sign) its torque τ_i, slip velocity q_i =
r φ̇_i − (v_long ± l ω) and tyre deflection e_i:

    demand   d_i = K e_i + D q_i            K = C/λ, C = (G_y/ε)/(m + 2I_φ/r²)
    force    f_i = d_i, capped at ± c       c = μ g (1 − ρ)/2: half of the weight rests on each wheel
    tyre     ė_i = q_i − |v_long ± l ω| e_i/λ, held where K|e_i| reaches c
    wheel    (ρ/2) (r φ̈_i) = α τ_i − d_i
    robot    (1 − ρ) dv_long/dt = f_R + f_L         (α/α_yaw − ρ) l dω/dt = f_R − f_L

Without a cap this settles, with first-order relaxation over the length λ, to dv_long/dt = α Στ, l dω/dt =
α_yaw Δτ and a creep of d_i/C in slip ratio. Under the cap the robot accelerates at μ g at most. What the
torque exceeds it by is lost in the contact: d_i − f_i brakes the wheel without driving the robot (loose or
wet ground that a spinning wheel moves), so that the wheel settles at a slip velocity of about excess/D; on
hard dry ground it would spin up for as long as the torque stays. v_lat is 0 outside skidding phases, and a
skidding wheel does not slip: both at once is a mode of ``plant`` alone.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters
from wmr_synth.plants.two_wheeled import (
    N_STATES,
    PHI_1,
    PHI_2,
    SIGMA_1,
    SIGMA_2,
    THETA,
    V_THETA,
    V_X,
    V_Y,
    Coefficients,
    X,
    Y,
)

Q_R, Q_L, E_R, E_L = SIGMA_1, SIGMA_2, N_STATES, N_STATES + 1
N_LIMITED = N_STATES + 2
GRAVITY_MPS2 = 9.81
STEP_TIMES_POLE = 0.2


@dataclass(frozen=True, eq=False)
class FrictionTrack:
    """Coefficient of friction μ between tyre and ground, held from its stamp (ns since the start) on."""

    t_ns: I64
    coefficient: F64


@dataclass(frozen=True)
class Tyre:
    """λ, the relaxation length, and D, the specific force per slip velocity beside the elastic one."""

    relaxation_length_m: float = 0.1
    slip_damping_per_s: float = 0.5


TYRE = Tyre()


class Traction(NamedTuple):
    """Coefficients of the module's equations: K in 1/s², D in 1/s, λ in m, ρ, and α/α_yaw − ρ."""

    stiffness_per_s2: float
    damping_per_s: float
    relaxation_m: float
    wheel_share: float
    yaw_share: float


_NEEDED = ("mass_kg", "wheel_inertia_kgm2", "longitudinal_stiffness_over_epsilon")


def traction_of(robot: RobotParameters, tyre: Tyre) -> Traction:
    """The coefficients for a robot. Raises InvalidSetting naming what it lacks."""
    known = robot.known()
    missing = [key for key in ("alpha", "half_track_m", "wheel_radius_m", *_NEEDED) if key not in known]
    if missing:
        raise InvalidSetting(f"the robot lacks {', '.join(missing)}, needed to limit its traction")
    p = {key: float(value) for key, value in known.items() if key != "average_speed_mps"}
    wheels_kg = 2 * p["wheel_inertia_kgm2"] / p["wheel_radius_m"] ** 2
    inertia_kg = p["mass_kg"] + wheels_kg
    share = wheels_kg / inertia_kg
    yaw_share = p["alpha"] / p.get("alpha_yaw", p["alpha"]) - share
    if yaw_share <= 0:
        raise InvalidSetting("alpha_yaw is too large: the wheels alone would resist turning more than that")
    stiffness = p["longitudinal_stiffness_over_epsilon"] / inertia_kg / tyre.relaxation_length_m
    return Traction(stiffness, tyre.slip_damping_per_s, tyre.relaxation_length_m, share, yaw_share)


@compiled
def cap_of(friction: float, p: Traction) -> float:
    """The largest specific force of a wheel, in m/s²."""
    return friction * GRAVITY_MPS2 * (1.0 - p.wheel_share) / 2.0


@compiled
def demand(deflection: float, slip: float, p: Traction) -> float:
    """A wheel's force without a cap."""
    return p.stiffness_per_s2 * deflection + p.damping_per_s * slip


@compiled
def hold(state: F64, cap: float, p: Traction) -> None:
    """Keep the deflections where their force is within the cap."""
    most = cap / p.stiffness_per_s2
    for e in (E_R, E_L):
        state[e] = max(-most, min(most, state[e]))


@compiled
def is_capped(state: F64, cap: float, p: Traction) -> bool:
    """Whether the demand on a wheel reaches its cap."""
    right, left = demand(state[E_R], state[Q_R], p), demand(state[E_L], state[Q_L], p)
    return abs(right) >= cap or abs(left) >= cap


@compiled
def deflection_rate(deflection: float, slip: float, ground: float, cap: float, p: Traction) -> float:
    """ė of a wheel whose hub moves at ``ground`` m/s."""
    rate = slip - abs(ground) / p.relaxation_m * deflection
    full = p.stiffness_per_s2 * abs(deflection) >= cap and rate * deflection > 0.0
    return 0.0 if full else rate


@compiled
def settle(state: F64, efforts_nm: tuple[float, float], cap: float, c: Coefficients, p: Traction) -> None:
    """Give the tyres the deflection of steady rolling under these efforts, as far as the cap allows."""
    drive, turn = c.alpha * (efforts_nm[0] + efforts_nm[1]), c.alpha_yaw * (efforts_nm[1] - efforts_nm[0])
    for e, q, effort, side in ((E_R, Q_R, efforts_nm[1], 1.0), (E_L, Q_L, efforts_nm[0], -1.0)):
        wanted = c.alpha * effort - p.wheel_share / 2.0 * (drive + side * turn)
        creep_per_s = abs(state[V_Y] + side * state[V_THETA]) / p.relaxation_m
        state[e] = wanted / (p.stiffness_per_s2 + p.damping_per_s * creep_per_s)
        hold(state, cap, p)
        state[q] = creep_per_s * state[e]


@compiled
def derivative(
    state: F64, efforts_nm: tuple[float, float], cap: float, c: Coefficients, p: Traction, out: F64
) -> None:
    """d/dt of the state (its slots of σ hold q_R, q_L) under the efforts (left, right), into ``out``."""
    v, turn = state[V_Y], state[V_THETA]
    d_r, d_l = demand(state[E_R], state[Q_R], p), demand(state[E_L], state[Q_L], p)
    f_r, f_l = max(-cap, min(cap, d_r)), max(-cap, min(cap, d_l))
    out[X], out[Y] = -v * math.sin(state[THETA]), v * math.cos(state[THETA])
    out[THETA], out[V_X] = turn / c.half_track_m, 0.0
    out[V_Y] = (f_r + f_l) / (1.0 - p.wheel_share)
    out[V_THETA] = (f_r - f_l) / p.yaw_share
    out[Q_R] = 2.0 / p.wheel_share * (c.alpha * efforts_nm[1] - d_r) - out[V_Y] - out[V_THETA]
    out[Q_L] = 2.0 / p.wheel_share * (c.alpha * efforts_nm[0] - d_l) - out[V_Y] + out[V_THETA]
    out[PHI_1] = -(v + turn + state[Q_R]) / c.wheel_radius_m
    out[PHI_2] = -(v - turn + state[Q_L]) / c.wheel_radius_m
    out[E_R] = deflection_rate(state[E_R], state[Q_R], v + turn, cap, p)
    out[E_L] = deflection_rate(state[E_L], state[Q_L], v - turn, cap, p)


@compiled
def longest_step_s(state: F64, p: Traction) -> float:
    """A step well inside the method's stable and accurate range."""
    gain = 2.0 / p.wheel_share + 2.0 / min(1.0 - p.wheel_share, p.yaw_share)
    rolling = (abs(state[V_Y]) + abs(state[V_THETA])) / p.relaxation_m
    pole: float = math.sqrt(p.stiffness_per_s2 * gain) + p.damping_per_s * gain + rolling
    return STEP_TIMES_POLE / pole


@compiled
def step(
    state: F64, efforts_nm: tuple[float, float], cap: float, h: float, c: Coefficients, p: Traction, work: F64
) -> None:
    """One classical Runge-Kutta step of ``h`` seconds in place, deflections held within the cap."""
    derivative(state, efforts_nm, cap, c, p, work[0])
    work[4] = state + 0.5 * h * work[0]
    derivative(work[4], efforts_nm, cap, c, p, work[1])
    work[4] = state + 0.5 * h * work[1]
    derivative(work[4], efforts_nm, cap, c, p, work[2])
    work[4] = state + h * work[2]
    derivative(work[4], efforts_nm, cap, c, p, work[3])
    state += h / 6.0 * (work[0] + 2.0 * (work[1] + work[2]) + work[3])
    hold(state, cap, p)


@compiled
def advance(
    state: F64,
    efforts_nm: tuple[float, float],
    cap: float,
    dt: float,
    c: Coefficients,
    p: Traction,
    work: F64,
) -> None:
    """The state ``dt`` seconds later under constant torques and friction."""
    remaining = dt
    while remaining > 0.0:
        n_steps = math.ceil(remaining / longest_step_s(state, p))
        h = remaining / n_steps
        step(state, efforts_nm, cap, h, c, p, work)
        remaining = remaining - h if n_steps > 1 else 0.0

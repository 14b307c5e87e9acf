"""The robot in the paper's symbols: three contact modes and the full model, as one switched system.

State ξ = (x, y, θ, v_x, v_y, v_θ, σ₁, σ₂) of Yu, Barbot, Floquet 2009, equations (1) and (3) to (5),
re-derived from (1) (the printed (4) and (5) have slips), and behind it the two wheel angles φ₁ (right) and φ₂
(left):

    ẋ = v_x cos θ − v_y sin θ      ẏ = v_x sin θ + v_y cos θ      θ̇ = v_θ / l
    skidding (1, 3)   v̇_x = −(2G_x/(ε m v)) v_x + v_y v_θ / l
    no slip (0, 1)    v̇_y = −v_x v_θ/(3l) − α(u₁ + u₂)      v̇_θ = −α_yaw(u₁ − u₂)
    slipping (2, 3)   v̇_y = −(3k/m) σ₂ − v_x v_θ / l        v̇_θ = −(3l²k/I_θ) σ₁
                      σ̇₁ = −(r²/I_φ + 2l²/I_θ) k σ₁ + α_yaw(u₁ − u₂)
                      σ̇₂ = −(r²/I_φ + 2/m) k σ₂ − (2/(3l)) v_x v_θ + α(u₁ + u₂),    k = G_y/(ε v)
    wheels            r φ̇₁ = −(v_y + v_θ) + 1.5(σ₁ + σ₂)    r φ̇₂ = −(v_y − v_θ) + 1.5(σ₂ − σ₁)

α scales the input only; r²/I_φ sets the poles of σ only, so that the input stays a torque for any robot.
"""

import math
from typing import NamedTuple

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import AUTO, RobotParameters

X, Y, THETA, V_X, V_Y, V_THETA, SIGMA_1, SIGMA_2, PHI_1, PHI_2 = range(10)
N_STATES = 10

AVERAGE_SPEED_FLOOR_MPS = 0.3
STEP_TIMES_POLE = 0.4
MAX_STEP_S = 0.02


class Coefficients(NamedTuple):
    """The model's coefficients; those in m/s² become 1/s when divided by the average speed v.

    ``average_speed_mps`` 0 stands for ``auto``: v = √(ẋ² + ẏ² + l²θ̇²), at least 0.3 m/s (assumption 4).
    """

    half_track_m: float
    wheel_radius_m: float
    alpha: float
    alpha_yaw: float
    skid_decay_mps2: float
    slip_to_long_mps2: float
    slip_to_yaw_mps2: float
    sigma_1_pole_mps2: float
    sigma_2_pole_mps2: float
    average_speed_mps: float


_ALWAYS = ("alpha", "half_track_m", "wheel_radius_m")
_SKID = ("mass_kg", "cornering_stiffness_over_epsilon", "average_speed_mps")
_SLIP = (
    "mass_kg",
    "wheel_inertia_kgm2",
    "yaw_inertia_kgm2",
    "longitudinal_stiffness_over_epsilon",
    "average_speed_mps",
)


def coefficients(robot: RobotParameters, modes: set[int]) -> Coefficients:
    """The coefficients for the given modes; those of other modes may stay 0.

    Raises InvalidSetting naming the parameters that the modes need and the robot lacks.
    """
    skids = bool(modes & {ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING})
    slips = bool(modes & {ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING})
    needed = dict.fromkeys(_ALWAYS + _SKID * skids + _SLIP * slips)
    known = robot.known()
    missing = [key for key in needed if key not in known]
    if missing:
        names = ", ".join(ContactMode(mode).label for mode in sorted(modes))
        raise InvalidSetting(f"the robot lacks {', '.join(missing)}, needed to simulate the modes {names}")
    p = {key: 0.0 if value == AUTO else float(value) for key, value in known.items()}
    l, r = p["half_track_m"], p["wheel_radius_m"]
    skid_decay = 2 * p["cornering_stiffness_over_epsilon"] / p["mass_kg"] if skids else 0.0
    slip_to_long = slip_to_yaw = pole_1 = pole_2 = 0.0
    if slips:
        k_v, m = p["longitudinal_stiffness_over_epsilon"], p["mass_kg"]
        slip_to_long, slip_to_yaw = 3 * k_v / m, 3 * l**2 * k_v / p["yaw_inertia_kgm2"]
        pole_1 = (r**2 / p["wheel_inertia_kgm2"] + 2 * l**2 / p["yaw_inertia_kgm2"]) * k_v
        pole_2 = (r**2 / p["wheel_inertia_kgm2"] + 2 / m) * k_v
    return Coefficients(
        l,
        r,
        p["alpha"],
        p.get("alpha_yaw", p["alpha"]),
        skid_decay,
        slip_to_long,
        slip_to_yaw,
        pole_1,
        pole_2,
        p.get("average_speed_mps", 0.0),
    )


@compiled
def average_speed(state: F64, c: Coefficients) -> float:
    """The v of the stiffness terms, in m/s."""
    if c.average_speed_mps > 0.0:
        return c.average_speed_mps
    v = math.sqrt(state[V_X] ** 2 + state[V_Y] ** 2 + state[V_THETA] ** 2)
    return max(v, AVERAGE_SPEED_FLOOR_MPS)


@compiled
def derivative(mode: int, state: F64, u_1: float, u_2: float, c: Coefficients, out: F64) -> None:
    """dξ/dt of the module's equations, into ``out``; u₁, u₂ in N·m, negative forward."""
    l = c.half_track_m
    v_x, v_y, v_theta, sigma_1, sigma_2 = (
        state[V_X],
        state[V_Y],
        state[V_THETA],
        state[SIGMA_1],
        state[SIGMA_2],
    )
    cosine, sine = math.cos(state[THETA]), math.sin(state[THETA])
    out[X] = v_x * cosine - v_y * sine
    out[Y] = v_x * sine + v_y * cosine
    out[THETA] = v_theta / l
    out[PHI_1] = (-(v_y + v_theta) + 1.5 * (sigma_1 + sigma_2)) / c.wheel_radius_m
    out[PHI_2] = (-(v_y - v_theta) + 1.5 * (sigma_2 - sigma_1)) / c.wheel_radius_m
    v = average_speed(state, c)
    out[V_X] = 0.0
    if mode in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING):
        out[V_X] = -c.skid_decay_mps2 / v * v_x + v_y * v_theta / l
    drive, turn = c.alpha * (u_1 + u_2), c.alpha_yaw * (u_1 - u_2)
    if mode in (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING):
        out[V_Y] = -c.slip_to_long_mps2 / v * sigma_2 - v_x * v_theta / l
        out[V_THETA] = -c.slip_to_yaw_mps2 / v * sigma_1
        out[SIGMA_1] = -c.sigma_1_pole_mps2 / v * sigma_1 + turn
        out[SIGMA_2] = -c.sigma_2_pole_mps2 / v * sigma_2 - 2.0 / (3.0 * l) * v_x * v_theta + drive
    else:
        out[V_Y] = -v_x * v_theta / (3.0 * l) - drive
        out[V_THETA] = -turn
        out[SIGMA_1] = 0.0
        out[SIGMA_2] = 0.0


@compiled
def jump(mode: int, state: F64) -> None:
    """The state's jump at a switch into ``mode`` (§3.1): what the mode does not know becomes 0."""
    if mode in (ContactMode.IDEAL, ContactMode.SLIPPING):
        state[V_X] = 0.0
    if mode in (ContactMode.IDEAL, ContactMode.SKIDDING):
        state[SIGMA_1] = 0.0
        state[SIGMA_2] = 0.0


@compiled
def longest_step_s(mode: int, state: F64, c: Coefficients) -> float:
    """A step that keeps the fastest pole well inside the method's stable and accurate range."""
    pole = 0.0
    if mode in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING):
        pole = c.skid_decay_mps2
    if mode in (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING):
        pole = max(pole, c.sigma_1_pole_mps2, c.sigma_2_pole_mps2)
    pole /= average_speed(state, c)
    return STEP_TIMES_POLE / pole if pole * MAX_STEP_S > STEP_TIMES_POLE else MAX_STEP_S


@compiled
def step(mode: int, state: F64, u_1: float, u_2: float, h: float, c: Coefficients, work: F64) -> None:
    """One classical Runge-Kutta step of ``h`` seconds, in place; ``work`` is scratch of shape (5, N_STATES).

    For a constant v the σ equations are linear: the method then keeps their steady state and the invariant
    that links σ to the velocities exactly, so that a transient's error does not stay in the velocity.
    """
    derivative(mode, state, u_1, u_2, c, work[0])
    for i in range(N_STATES):
        work[4, i] = state[i] + 0.5 * h * work[0, i]
    derivative(mode, work[4], u_1, u_2, c, work[1])
    for i in range(N_STATES):
        work[4, i] = state[i] + 0.5 * h * work[1, i]
    derivative(mode, work[4], u_1, u_2, c, work[2])
    for i in range(N_STATES):
        work[4, i] = state[i] + h * work[2, i]
    derivative(mode, work[4], u_1, u_2, c, work[3])
    for i in range(N_STATES):
        state[i] += h / 6.0 * (work[0, i] + 2.0 * (work[1, i] + work[2, i]) + work[3, i])


@compiled
def advance(mode: int, state: F64, u_1: float, u_2: float, dt: float, c: Coefficients, work: F64) -> None:
    """The state ``dt`` seconds later under constant torques, in as many steps as the poles ask for."""
    remaining = dt
    while remaining > 0.0:
        n_steps = math.ceil(remaining / longest_step_s(mode, state, c))
        h = remaining / n_steps
        step(mode, state, u_1, u_2, h, c, work)
        remaining = remaining - h if n_steps > 1 else 0.0

"""A small robot and what it drives: well excited, or hardly at all."""

import numpy as np

from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import AUTO, RobotParameters
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import ClosedLoop, Gains, Waypoints
from wmr_synth.driving.plan import Plan, phases

GAINS = Gains(proportional_per_s=2.0, integral_per_s2=0.5, limit_nm=6.0)
STRAIGHT_SHARE, STOP_SHARE, REVERSE_SHARE = 0.25, 0.2, 0.25


def small_robot(
    mass_kg: float = 30.0, half_track_m: float = 0.25, wheel_radius_m: float = 0.1, gyration_m: float = 0.22
) -> RobotParameters:
    """A differential-drive robot with geared motors on two wheels, as a rigid body.

    With I_φ = .03 kg·m² a wheel, mostly the motor through its gear, and I_θ = m·gyration²: α = 1/(r (m +
    2I_φ/r²)), α_yaw = l²/(r (I_θ + 2l²I_φ/r²)). G_x/ε = 4 m and G_y/ε = 10 m, so that lateral velocity dies
    out at 8/v 1/s (v in m/s) as with the paper's robot, and slipping leaves about a quarter of the traction.
    """
    wheel_inertia, l, r = 0.03, half_track_m, wheel_radius_m
    yaw_inertia = mass_kg * gyration_m**2
    return RobotParameters(
        alpha=1 / (r * (mass_kg + 2 * wheel_inertia / r**2)),
        alpha_yaw=l**2 / (r * (yaw_inertia + 2 * l**2 * wheel_inertia / r**2)),
        half_track_m=l,
        wheel_radius_m=r,
        mass_kg=mass_kg,
        wheel_inertia_kgm2=wheel_inertia,
        yaw_inertia_kgm2=yaw_inertia,
        cornering_stiffness_over_epsilon=4.0 * mass_kg,
        longitudinal_stiffness_over_epsilon=10.0 * mass_kg,
        average_speed_mps=AUTO,
    )


SMALL_ROBOT = small_robot()


def drawn_robot(rng: np.random.Generator) -> RobotParameters:
    """A small robot of 20 to 50 kg."""
    return small_robot(
        mass_kg=float(rng.uniform(20.0, 50.0)),
        half_track_m=float(rng.uniform(0.2, 0.35)),
        wheel_radius_m=float(rng.uniform(0.08, 0.15)),
        gyration_m=float(rng.uniform(0.18, 0.28)),
    )


def stop_go_reverse_turn(duration_s: float, rng: np.random.Generator) -> Waypoints:
    """Targets held for 2 to 6 s, reached on ramps of .5 to 1.5 m/s² and 1 to 2 rad/s².

    A fifth are stops, a quarter reverses at .3 to 1.5 m/s, the others go ahead at .4 to 2 m/s; a quarter goes
    straight, the others turn at .2 to .9 rad/s either way.
    """
    n = int(np.ceil(duration_s / 2.0)) + 1
    kind = rng.uniform(0.0, 1.0, n)
    ahead, back = rng.uniform(0.4, 2.0, n), -rng.uniform(0.3, 1.5, n)
    speed = np.where(kind < STOP_SHARE, 0.0, np.where(kind < STOP_SHARE + REVERSE_SHARE, back, ahead))
    turning = rng.uniform(0.2, 0.9, n) * rng.choice((-1.0, 1.0), n)
    turning[(rng.uniform(0.0, 1.0, n) < STRAIGHT_SHARE) | (kind < STOP_SHARE / 2)] = 0.0
    ramps = rng.uniform(0.5, 1.5, n), rng.uniform(1.0, 2.0, n)
    return ramped(rng.uniform(2.0, 6.0, n), (speed, turning), ramps)


def nearly_steady(duration_s: float, rng: np.random.Generator) -> Waypoints:
    """A speed of .8 to 1.5 m/s, by up to 4 % another every 4 to 8 s; yaw rates up to .03 rad/s."""
    n = int(np.ceil(duration_s / 4.0)) + 1
    speed = rng.uniform(0.8, 1.5) * (1 + rng.uniform(-0.04, 0.04, n))
    ramps = np.full(n, 0.1), np.full(n, 0.05)
    targets = speed, rng.uniform(-0.03, 0.03, n)
    return ramped(rng.uniform(4.0, 8.0, n), targets, ramps, (float(speed[0]), 0.0))


def ramped(
    lengths_s: F64, targets: tuple[F64, F64], rates: tuple[F64, F64], start: tuple[float, float] = (0.0, 0.0)
) -> Waypoints:
    """Both targets reached on ramps at the rates, from ``start`` on; knots where a ramp starts or ends."""
    starts = np.concatenate([[0.0], np.cumsum(lengths_s)[:-1]])
    sides = []
    for target, rate, first in zip(targets, rates, start, strict=True):
        before = np.concatenate([[first], target[:-1]])
        ends = starts + np.minimum(np.abs(target - before) / rate, 0.95 * lengths_s)
        knots = np.stack([starts, np.maximum(ends, starts + 1e-6)], axis=1).ravel()
        sides.append((knots, np.stack([before, target], axis=1).ravel()))
    t_s = np.unique(np.concatenate([sides[0][0], sides[1][0]]))
    speed, turning = (tuple(np.interp(t_s, *side).tolist()) for side in sides)
    return Waypoints(tuple(t_s.tolist()), speed, turning)


def occasional_phases(duration_s: float, rng: np.random.Generator) -> ModeTrack:
    """Ideal for 6 to 14 s, then skidding or slipping for 2 to 5 s, and again; how often it skids is drawn."""
    n = int(np.ceil(duration_s / 8.0)) + 1
    skids = rng.uniform(0.0, 1.0, n) < rng.uniform(0.4, 0.8)
    between = np.where(skids, ContactMode.SKIDDING, ContactMode.SLIPPING)
    lengths = np.stack([rng.uniform(6.0, 14.0, n), rng.uniform(2.0, 5.0, n)], axis=1).ravel()
    mode = np.stack([np.zeros(n), between], axis=1).ravel().astype(np.int8)
    starts_s = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    kept = starts_s < duration_s
    return ModeTrack(np.rint(starts_s[kept] * NS_PER_S).astype(np.int64), mode[kept])


def patrol_plan(duration_s: float, rng: np.random.Generator) -> Plan:
    """The patrol, and a robot that skids and slips now and then."""
    modes = occasional_phases(duration_s, rng)
    return Plan(ClosedLoop(stop_go_reverse_turn(duration_s, rng), GAINS), modes)


def cruise_plan(duration_s: float, rng: np.random.Generator) -> Plan:
    """Nearly constant speed, hardly any turning, ideal rolling throughout."""
    path = nearly_steady(duration_s, rng)
    modes = phases((ContactMode.IDEAL,), (duration_s,), duration_s)
    return Plan(ClosedLoop(path, GAINS), modes, path.v_long_mps[0])

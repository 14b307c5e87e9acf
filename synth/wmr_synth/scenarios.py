"""The scenarios by name: a driver, a schedule of contact modes, a starting speed, and fitting sensors."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.drive_file import read_drive
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import PAPER_ROBOT, RobotParameters
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving import patrol
from wmr_synth.driving.drivers import ClosedLoop, Waypoints, constant_effort
from wmr_synth.driving.plan import Plan, phases
from wmr_synth.driving.played import played_plan
from wmr_synth.plants.limited_traction import FrictionTrack
from wmr_synth.sensors import Sensors
from wmr_synth.wheel_speed import driving
from wmr_synth.wheel_speed.chassis import DIFFERENTIAL, SKID_STEER
from wmr_synth.wheel_speed.drive import Tracking
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import HALL
from wmr_synth.wheel_speed.plan import RollingPlan

IDEAL, SKIDDING, SLIPPING = ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING

MOTION_CAPTURE = Sensors(rate_hz=100.0, noise_xy_sd_m=0.001, noise_yaw_sd_rad=0.002)
PAPER_SENSORS = Sensors(rate_hz=1000.0, noise_xy_sd_m=0.1**0.5, noise_yaw_sd_rad=0.1**0.5)
"""Noise of variance 0.1 on each of x, y, θ (§5); the rate is ours, the paper gives none."""


@dataclass(frozen=True)
class Scenario:
    """A named plan; ``plan`` takes the duration in s and the scenario's random stream, or is that of a robot
    that wheel speeds drive.

    ``disturbed`` ones have a coloured disturbance unless another is asked for.
    """

    name: str
    description: str
    duration_s: float
    plan: Callable[[float, np.random.Generator], Plan] | RollingPlan
    sensors: Sensors = MOTION_CAPTURE
    robot: RobotParameters = PAPER_ROBOT
    disturbed: bool = False


PAPER_CONDITIONS = (IDEAL, SKIDDING, SLIPPING, SKIDDING, IDEAL, SLIPPING)


def paper_effort_nm(effort_nm: float, duration_s: float) -> float:
    """The effort for a scenario made for 60 s; less for a longer one, so that its speeds stay the same."""
    return effort_nm * 60.0 / max(duration_s, 60.0)


def paper_plan(effort_nm: float, v_long_mps: float) -> Callable[[float, np.random.Generator], Plan]:
    """The paper's six successive conditions, equally long, under constant equal efforts, while turning.

    "Accelerating just means acceleration on v_y, not on v_θ".
    """

    def plan(duration_s: float, _: np.random.Generator) -> Plan:
        modes = phases(PAPER_CONDITIONS, (duration_s / 6,) * 6, duration_s)
        return Plan(constant_effort(paper_effort_nm(effort_nm, duration_s)), modes, v_long_mps, 0.3)

    return plan


def constant_mode_plan(mode: ContactMode) -> Callable[[float, np.random.Generator], Plan]:
    """The acceleration of the paper in one condition throughout, for the estimate of α (§5.2)."""

    def plan(duration_s: float, _: np.random.Generator) -> Plan:
        effort_nm = paper_effort_nm(10.0, duration_s)
        return Plan(constant_effort(effort_nm), phases((mode,), (duration_s,), duration_s), 2.0, 0.3)

    return plan


def figure_eight_plan(duration_s: float, _: np.random.Generator) -> Plan:
    """Two circles of 3 m radius at 1.5 m/s, one to the left and one to the right."""
    lap_s, swing_s = 4 * np.pi, 1.0
    knots_s = (0.0, lap_s - swing_s, lap_s, 2 * lap_s - swing_s, 2 * lap_s)
    path = Waypoints(knots_s, (1.5,) * 5, (0.5, 0.5, -0.5, -0.5, 0.5), period_s=2 * lap_s)
    modes = phases((IDEAL, SKIDDING, IDEAL, SLIPPING), (8.0, 6.0, 8.0, 6.0), duration_s)
    return Plan(ClosedLoop(path), modes, 1.5, 0.5)


def stop_and_go_plan(duration_s: float, _: np.random.Generator) -> Plan:
    """Start, turn, stop, reverse, turn the other way, and again; a cycle of 30 s."""
    path = Waypoints(
        t_s=(0.0, 1.0, 4.0, 6.0, 7.0, 12.0, 13.0, 15.0, 17.0, 19.0, 20.0, 24.0, 25.0, 27.0, 30.0),
        v_long_mps=(0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, -1.5, -1.5, -1.5, -1.5, 0.0, 0.0),
        yaw_rate_radps=(0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, -0.5, -0.5, 0.0, 0.0, 0.0),
        period_s=30.0,
    )
    modes = phases((IDEAL, SKIDDING, IDEAL, SLIPPING), (8.0, 4.0, 10.5, 5.5), duration_s)
    return Plan(ClosedLoop(path), modes)


def random_phases(duration_s: float, rng: np.random.Generator) -> ModeTrack:
    """Phases of 2 to 10 s, each in another of the three modes than the one before; the first is ideal."""
    n = int(np.ceil(duration_s / 2.0))
    lengths_s = rng.uniform(2.0, 10.0, n)
    shifts = rng.integers(1, 3, n)
    shifts[0] = 0
    starts_s = np.concatenate([[0.0], np.cumsum(lengths_s)[:-1]])
    kept = starts_s < duration_s
    mode = (np.cumsum(shifts) % 3).astype(np.int8)
    return ModeTrack(np.rint(starts_s[kept] * NS_PER_S).astype(np.int64), mode[kept])


def random_plan(duration_s: float, rng: np.random.Generator) -> Plan:
    """Random phases; references that move on straight lines between random speeds and yaw rates."""
    modes = random_phases(duration_s, rng)
    n = int(np.ceil(duration_s)) + 2
    knots_s = np.concatenate([[0.0], np.cumsum(rng.uniform(1.0, 4.0, n))])
    speeds_mps, yaw_rates_radps = rng.uniform(0.5, 4.0, n + 1), rng.uniform(-0.6, 0.6, n + 1)
    path = Waypoints(tuple(knots_s), tuple(speeds_mps), tuple(yaw_rates_radps))
    return Plan(ClosedLoop(path), modes, float(speeds_mps[0]), float(yaw_rates_radps[0]))


DRY, WET_ICE = 0.8, 0.02
"""Coefficients of friction. The drives are gentle: only very slippery ground makes them slip."""


def limit_traction(plan: Plan, slippery: F64) -> Plan:
    """The plan with slippery ground, of the coefficients ``slippery`` in turn, for its slipping phases."""
    modes = plan.modes
    slips = modes.mode == SLIPPING
    coefficient = np.full(len(modes), DRY)
    coefficient[slips] = np.resize(slippery, np.count_nonzero(slips))
    skids = ModeTrack(modes.t_ns, np.where(modes.mode == SKIDDING, SKIDDING, IDEAL).astype(np.int8))
    return replace(plan, modes=skids, friction=FrictionTrack(modes.t_ns, coefficient))


def paper_traction_plan(duration_s: float, rng: np.random.Generator) -> Plan:
    """The paper's acceleration; in its slipping conditions the ground carries .2 m/s² of the .5 asked for."""
    return limit_traction(paper_plan(10.0, 2.0)(duration_s, rng), np.array([WET_ICE]))


def random_traction_plan(duration_s: float, rng: np.random.Generator) -> Plan:
    """The random drive over ground that is dry, or slippery with μ from .01 to .06."""
    plan = random_plan(duration_s, rng)
    return limit_traction(plan, np.exp(rng.uniform(np.log(0.01), np.log(0.06), max(len(plan.modes), 1))))


_SCENARIOS = (
    Scenario(
        "paper-acceleration",
        "the paper's acceleration: ideal, skidding, slipping, skidding, ideal, slipping, 10 s each",
        60.0,
        paper_plan(10.0, 2.0),
        PAPER_SENSORS,
    ),
    Scenario(
        "paper-uniform",
        "the same six conditions without torque: ideal and slipping cannot be told apart",
        60.0,
        paper_plan(0.0, 2.0),
        PAPER_SENSORS,
    ),
    Scenario(
        "paper-deceleration",
        "the same six conditions while braking",
        60.0,
        paper_plan(-5.0, 18.0),
        PAPER_SENSORS,
    ),
    Scenario(
        "paper-alpha-ideal",
        "the paper's acceleration in ideal rolling throughout, for alpha",
        60.0,
        constant_mode_plan(IDEAL),
        PAPER_SENSORS,
    ),
    Scenario(
        "paper-alpha-skidding",
        "the paper's acceleration while skidding throughout, for alpha",
        60.0,
        constant_mode_plan(SKIDDING),
        PAPER_SENSORS,
    ),
    Scenario(
        "figure-eight",
        "closed-loop figure of eight at 1.5 m/s; ideal, skidding and slipping phases",
        60.0,
        figure_eight_plan,
    ),
    Scenario(
        "stop-and-go",
        "closed-loop starts, turns, stops and reversals; ideal, skidding and slipping phases",
        90.0,
        stop_and_go_plan,
    ),
    Scenario(
        "random",
        "random phases of 2 to 10 s, random drive and turning, by seed",
        120.0,
        random_plan,
    ),
    Scenario(
        "paper-acceleration-traction-limited",
        "the paper's acceleration; slipping comes of slippery ground and the torque alone",
        60.0,
        paper_traction_plan,
        PAPER_SENSORS,
    ),
    Scenario(
        "random-traction-limited",
        "as random; slipping where the torque exceeds what friction carries",
        120.0,
        random_traction_plan,
    ),
    Scenario(
        "patrol",
        "a 30 kg robot: stop, go, reverse and turn by seed, some skidding and slipping; good excitation",
        90.0,
        patrol.patrol_plan,
        robot=patrol.SMALL_ROBOT,
        disturbed=True,
    ),
    Scenario(
        "cruise",
        "the same robot at a nearly constant speed with little turning; poor excitation",
        90.0,
        patrol.cruise_plan,
        robot=patrol.SMALL_ROBOT,
        disturbed=True,
    ),
    Scenario(
        "encoders",
        "a differential drive by wheel speeds, no torque: lively, slips and skids by friction",
        90.0,
        RollingPlan(DIFFERENTIAL, driving.lively(1.6, 1.2)),
        EncoderSensors(),
        DIFFERENTIAL.nominal,
    ),
    Scenario(
        "skid-steer",
        "four wheels by wheel speeds, no torque: lively; its true track is far from the stated one",
        90.0,
        RollingPlan(SKID_STEER, driving.lively(1.3, 1.4)),
        EncoderSensors(),
        SKID_STEER.nominal,
    ),
    Scenario(
        "warehouse",
        "an hour of a differential drive by wheel speeds: aisles, stops, turns, loading; hardly any slip",
        3600.0,
        RollingPlan(DIFFERENTIAL, driving.warehouse, HALL, Tracking(0.5, 1.0, 1.0)),
        EncoderSensors(
            rate_hz=20.0, wheel_rate_hz=50.0, command_rate_hz=20.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005
        ),
        DIFFERENTIAL.nominal,
    ),
)

SCENARIOS: dict[str, Scenario] = {scenario.name: scenario for scenario in _SCENARIOS}


DRIVE_SUFFIX = ".toml"


def scenario_of_drive(path: Path) -> Scenario:
    """The scenario that plays a drive file: its robot and duration, the default disturbance.

    Raises InvalidFile, and InvalidSetting where the file does not say how to drive.
    """
    drive = read_drive(path)
    said = drive.description or f"the drive of {path.name}"
    return Scenario(drive.name, said, drive.duration_s, played_plan(drive), robot=drive.robot, disturbed=True)

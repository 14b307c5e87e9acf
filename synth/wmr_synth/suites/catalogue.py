"""The suites by name."""

import difflib

from wmr_schemas.effects import BEYOND, effects_of, named_of
from wmr_schemas.errors import InvalidSetting
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.suites.damage import DAMAGES
from wmr_synth.suites.definition import LogSpec, Suite

NOISE_SD = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
RATES_HZ = (20, 50, 100, 200, 500, 1000)
DROPOUTS = (0.0, 0.01, 0.05, 0.1, 0.2, 0.4)


def drive(name: str, scenario: str = "random", **parameters: object) -> LogSpec:
    """One log with a seed of 1."""
    return LogSpec(name, scenario, 1, parameters)


def paper() -> tuple[LogSpec, ...]:
    """The paper's runs."""
    names = ("acceleration", "uniform", "deceleration", "alpha-ideal", "alpha-skidding")
    return tuple(drive(f"paper-{name}", f"paper-{name}") for name in names)


def noise_sweep() -> tuple[LogSpec, ...]:
    """One drive under growing noise of the pose: the yaw's in rad twice the position's in m."""
    return tuple(
        drive(f"noise-{sd:g}m", duration_s=60.0, noise_xy_sd_m=sd, noise_yaw_sd_rad=2 * sd) for sd in NOISE_SD
    )


def rates() -> tuple[LogSpec, ...]:
    """One drive at several rates, and with torques slower and faster than the pose."""
    equal = tuple(drive(f"rate-{hz}hz", duration_s=60.0, rate_hz=hz, torque_rate_hz=hz) for hz in RATES_HZ)
    slow = drive("pose-100hz-torque-20hz", duration_s=60.0, rate_hz=100.0, torque_rate_hz=20.0)
    fast = drive("pose-20hz-torque-500hz", duration_s=60.0, rate_hz=20.0, torque_rate_hz=500.0)
    return (*equal, slow, fast)


def dropouts() -> tuple[LogSpec, ...]:
    """One drive with a growing share of messages lost, with jittering instants, and with a clock ahead."""
    lost = tuple(drive(f"dropout-{100 * share:g}pct", duration_s=60.0, dropout=share) for share in DROPOUTS)
    jitter = drive("jitter-3ms", duration_s=60.0, jitter_s=0.003)
    both = drive("jitter-3ms-dropout-10pct", duration_s=60.0, jitter_s=0.003, dropout=0.1)
    return (*lost, jitter, both, drive("clock-20ms", duration_s=60.0, clock_offset_s=0.02))


def hidden_effects() -> tuple[LogSpec, ...]:
    """The patrol with each effect hidden in turn, with two, and with none; one drive too gentle to tell."""
    parameters = {"duration_s": 120.0, "noise": "rtk", "mode_topic": False}
    hidden = {f"hidden-{name.replace('_', '-')}": [name] for name in named_of("torque") | BEYOND}
    hidden |= {"hidden-payload-and-slope": ["payload", "slope"], "hidden-nothing": []}
    logs = tuple(LogSpec(name, "patrol", 1, parameters | {"hide": hide}) for name, hide in hidden.items())
    return (*logs, LogSpec("hidden-nothing-cruise", "cruise", 1, parameters))


def encoders() -> tuple[LogSpec, ...]:
    """Robots by wheel speeds: both chassis at each noise, each effect hidden in turn, and none."""
    kinds = ("encoders", "skid-steer")
    plain = tuple(drive(f"{kind}-{noise}", kind, noise=noise) for kind in kinds for noise in NOISE_LEVELS)
    parameters = {"noise": "rtk", "mode_topic": False, "nominal_error": 0.0}
    hidden = {f"hidden-{name.replace('_', '-')}": [name] for name in effects_of("wheel_speed")}
    logs = (LogSpec(name, "encoders", 1, parameters | {"hide": hide}) for name, hide in hidden.items())
    return (*plain, *logs)


def encodings() -> tuple[LogSpec, ...]:
    """The same drive in each encoding."""
    return tuple(
        drive(f"drive-{name}", "stop-and-go", duration_s=60.0, encoding=name)
        for name in ("ros2", "protobuf", "json")
    )


def damaged() -> tuple[LogSpec, ...]:
    """The same drive, broken in every way that :mod:`damage` knows."""
    parameters = {"duration_s": 40.0, "chunk_bytes": 131_072}
    return tuple(LogSpec(f"damaged-{name}", "stop-and-go", 1, parameters, name) for name in DAMAGES)


def long() -> tuple[LogSpec, ...]:
    """An hour at 1 kHz, as a measure of time and memory."""
    return (drive("long-1h-1khz", duration_s=3600.0, rate_hz=1000.0, torque_rate_hz=1000.0),)


_SUITES = (
    Suite("paper", 1, "the paper's three runs and its two for alpha, 60 s at 1 kHz", paper()),
    Suite("noise-sweep", 1, "one drive, pose noise from 0.1 mm to 0.3 m", noise_sweep()),
    Suite("rates", 1, "one drive from 20 Hz to 1 kHz, torques slower and faster", rates()),
    Suite("dropouts", 1, "one drive with messages lost, jitter, a clock ahead", dropouts()),
    Suite("hidden-effects", 1, "a patrol with each effect that a model may lack, and none", hidden_effects()),
    Suite("encoders", 1, "robots by wheel speeds: two chassis, three noises, each hidden effect", encoders()),
    Suite("encodings", 1, "one drive in ROS 2 CDR, protobuf and JSON", encodings()),
    Suite("damaged", 1, "one drive, its file broken in a dozen ways", damaged()),
    Suite("long", 1, "an hour at 1 kHz: 7.2 million messages, 430 MB", long()),
)
SUITES: dict[str, Suite] = {suite.name: suite for suite in _SUITES}


def find_suite(name: str) -> Suite:
    """The suite of that name. Raises InvalidSetting with the known names and the nearest."""
    if name in SUITES:
        return SUITES[name]
    near = difflib.get_close_matches(name, SUITES, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise InvalidSetting(f"no suite {name!r}; {hint}known are {', '.join(SUITES)}, or a file (.toml)")

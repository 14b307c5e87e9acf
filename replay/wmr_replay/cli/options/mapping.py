"""Options that say which topics of a log to use, shared by the commands that read logs."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar

import click

if TYPE_CHECKING:
    from wmr_schemas.mapping_file import LogMapping

F = TypeVar("F", bound=Callable[..., Any])


class LogOptions(TypedDict):
    """How a log is read, as keyword arguments."""

    mapping: "LogMapping"
    start: str | None
    end: str | None


SPEC = re.compile(r"(?P<topic>[^{}]+)(?:\{(?P<inside>[^{}]*)\})?")


TRUTH = click.option("--truth", metavar="TOPIC", help="Topic of the true contact mode.")
OPTIONS = (
    click.option(
        "--pose",
        metavar="TOPIC[{parent=A,child=B}]",
        help="Topic of the pose; of transforms, with the frames; else found by schema.",
    ),
    click.option(
        "--torque",
        metavar="TOPIC[{left=A+B,right=C}]",
        help="Topic of the wheel torques, and the joints of each side; else found by schema and names.",
    ),
    TRUTH,
    click.option(
        "--map",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="File that maps topics and fields and holds the robot's parameters (robot.toml).",
    ),
    click.option(
        "--clock",
        type=click.Choice(["header", "publish", "log"]),
        help="Clock to go by; else the header's; without stamps publish or log time.",
    ),
    click.option(
        "--start",
        metavar="TIME",
        help="Leave out what was logged before: s from the first message, ns since 1970, or ISO 8601.",
    ),
    click.option("--end", metavar="TIME", help="Leave out what was logged after."),
)


def mapping_options(command: F) -> F:
    """Add --pose, --torque, --truth, --map, --clock, --start and --end."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def blind_options(command: F) -> F:
    """Add the same without --truth, for commands that read a true mode only where another option names it."""
    for option in reversed([option for option in OPTIONS if option is not TRUTH]):
        command = option(command)
    return command


def mapping_from_options(options: Mapping[str, str | Path | None]) -> "LogMapping":
    """The mapping file, if any, with the options on top of it."""
    from wmr_schemas.mapping_file import LogMapping, read_mapping
    from wmr_schemas.units import CLOCKS

    path, torque = options["map"], options["torque"]
    mapping = read_mapping(path) if isinstance(path, Path) else LogMapping()
    if isinstance(options["pose"], str):
        topic, frames = parse_spec(options["pose"], "--pose", ("parent", "child"))
        pose = replace(mapping.pose, parent=frames.get("parent"), child=frames.get("child"))
        mapping = replace(mapping, pose_topic=topic, pose=pose if frames else mapping.pose)
    truth = options.get("truth")
    if isinstance(truth, str):
        mapping = replace(mapping, truth_topic=truth)
    if isinstance(torque, str):
        topic, left, right = parse_torque(torque)
        mapping = replace(mapping, torque_topic=topic, left_joints=left, right_joints=right)
    wanted = next((clock for clock in CLOCKS if clock == options.get("clock")), mapping.clock)
    return replace(mapping, clock=wanted)


def log_options(options: Mapping[str, Any]) -> LogOptions:
    """The mapping, --start and --end as keyword arguments of the public functions."""
    return {
        "mapping": mapping_from_options(options),
        "start": options["start"],
        "end": options["end"],
    }


FORMS = {"--pose": "{parent=FRAME,child=FRAME}", "--torque": "{left=JOINT+JOINT,right=JOINT}"}


def parse_spec(spec: str, option: str, keys: tuple[str, str]) -> tuple[str, dict[str, str]]:
    """``TOPIC`` or ``TOPIC{a=…,b=…}`` → topic and what is inside, with exactly these keys or none."""
    match = SPEC.fullmatch(spec)
    pairs = (
        dict(part.partition("=")[::2] for part in (match["inside"] or "").split(",") if part) if match else {}
    )
    pairs = {name.strip(): value.strip() for name, value in pairs.items()}
    if match is None or (pairs and set(pairs) != set(keys)) or not all(pairs.values()):
        raise click.BadParameter(f"{spec!r} is not TOPIC or TOPIC{FORMS[option]}", param_hint=option)
    return match["topic"].strip(), pairs


def parse_torque(spec: str) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """``/joint_states{left=a+b,right=c}`` → topic and the joints of each side."""
    topic, sides = parse_spec(spec, "--torque", ("left", "right"))
    left, right = (
        tuple(j.strip() for j in sides.get(side, "").split("+") if j.strip()) for side in ("left", "right")
    )
    return topic, left, right

"""Options that say which topics of a log to use, shared by the commands that read logs."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from wmr_schemas.mapping_file import LogMapping

F = TypeVar("F", bound=Callable[..., Any])

TORQUE_SPEC = re.compile(r"(?P<topic>[^{}]+)(?:\{(?P<joints>[^{}]*)\})?")


def mapping_options(command: F) -> F:
    """Adds --pose, --torque, --truth and --map."""
    options = (
        click.option("--pose", metavar="TOPIC", help="Topic of the pose; else found by schema."),
        click.option(
            "--torque",
            metavar="TOPIC[{left=A+B,right=C}]",
            help="Topic of the wheel torques, and the joints of each side; else found by schema and names.",
        ),
        click.option("--truth", metavar="TOPIC", help="Topic of the true contact mode."),
        click.option(
            "--map",
            type=click.Path(exists=True, dir_okay=False, path_type=Path),
            help="File that maps topics and holds the robot's parameters (robot.toml).",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def mapping_from_options(options: Mapping[str, str | Path | None]) -> "LogMapping":
    """The mapping file, if any, with the options on top of it."""
    from wmr_schemas.mapping_file import LogMapping, read_mapping

    path, torque = options["map"], options["torque"]
    mapping = read_mapping(path) if isinstance(path, Path) else LogMapping()
    if isinstance(options["pose"], str):
        mapping = replace(mapping, pose_topic=options["pose"])
    if isinstance(options["truth"], str):
        mapping = replace(mapping, truth_topic=options["truth"])
    if isinstance(torque, str):
        topic, left, right = parse_torque(torque)
        mapping = replace(mapping, torque_topic=topic, left_joints=left, right_joints=right)
    return mapping


def parse_torque(spec: str) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """``/joint_states{left=a+b,right=c}`` → topic and the joints of each side."""
    match = TORQUE_SPEC.fullmatch(spec)
    sides = (
        dict(part.partition("=")[::2] for part in (match["joints"] or "").split(",") if part) if match else {}
    )
    if match is None or (sides and set(sides) != {"left", "right"}):
        raise click.BadParameter(
            f"{spec!r} is not TOPIC or TOPIC{{left=JOINT+JOINT,right=JOINT}}", param_hint="--torque"
        )
    left, right = (
        tuple(j.strip() for j in sides.get(side, "").split("+") if j.strip()) for side in ("left", "right")
    )
    return match["topic"].strip(), left, right

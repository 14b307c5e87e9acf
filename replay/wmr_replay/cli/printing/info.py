"""What ``info`` prints: channels, roles, clocks, losses."""

import sys
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import labelled, output_width, print_table, print_title
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_schemas.text import figure, shown

if TYPE_CHECKING:
    from pathlib import Path

    from wmr_replay.api.info import LogInfo
    from wmr_schemas.mapping_file import LogMapping

_LABEL = 8
"""Columns of the labels."""
_ROLES = ("pose", "torque", "truth")
_FURTHER = (("wheels", "wheel_speed"), ("command", "command"))
_IN_USE = ("pose", "torque", "wheel_speed", "command", "truth")


def print_info(info: "LogInfo", *, as_json: bool) -> None:
    """Everything as JSON; or as text, coloured on a terminal, plain lines elsewhere."""
    if as_json:
        echo_json(info.as_dict())
        return
    width = output_width()
    console = console_of(width=width)
    with console.capture() as capture:
        print_title(console, info.log, overview(info), width)
        console.print()
        if info.channels:
            print_table(console, channel_table(info), n_titles=2)
            console.print()
        for name, text in lines(info):
            first, *rest = labelled(name, text, _LABEL, width)
            console.print(styled((first[:_LABEL], "bold"), first[_LABEL:]), soft_wrap=True)
            for line in rest:
                console.print(styled(line), soft_wrap=True)
    sys.stdout.write("".join(f"{line.rstrip()}\n" for line in capture.get().splitlines()))


def overview(info: "LogInfo") -> str:
    """Size, writer, length and number of messages in a line."""
    parts = [f"{figure(info.size_bytes / 1e6, 3)} MB"]
    parts += [text for text in (info.profile, info.library) if text]
    if info.n_messages:
        parts.append(f"{figure(info.duration_s)} s")
    return " · ".join([*parts, f"{info.n_messages} messages"])


def channel_table(info: "LogInfo") -> Table:
    """A line for each channel; those in use first."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("id", "topic", "schema", "encoding", "messages", "Hz", "from s", "to s", "serves as", "use"):
        right = name in {"id", "messages", "Hz", "from s", "to s"}
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    rows = sorted(
        info.channels,
        key=lambda row: (_IN_USE.index(row["role"]) if row["role"] else len(_IN_USE), row["id"]),
    )
    for row in rows:
        use = (
            Text(row["role"].replace("_", " "), style="bold green")
            if row["role"]
            else Text(shown(row["why_not"] or ""), style="dim")
        )
        rate = "–" if row["rate_hz"] is None else figure(row["rate_hz"])
        span = [
            "–" if row[k] is None else f"{(row[k] - info.start_ns) / 1e9:.2f}"
            for k in ("first_ns", "last_ns")
        ]
        texts = [str(row["id"]), row["topic"], (row["schema"] or "–").replace("/msg/", "/"), row["encoding"]]
        number = f"{'~' if info.counts_estimated else ''}{row['messages']}"
        table.add_row(*map(shown, texts), number, rate, *span, shown(serves_as(row)), use)
    return table


def serves_as(row: dict[str, Any]) -> str:
    """What a channel would serve for."""
    return ", ".join(row["serves_as"]) or "–"


def lines(info: "LogInfo") -> list[tuple[str, str]]:
    """Each role with its clock, the robot's parameters, and whatever was lost or noticed."""
    found = [(role, role_line(info, role)) for role in _ROLES]
    found += [(label, use_line(info, role)) for label, role in _FURTHER if info.used[role]]
    known = ", ".join(
        f"{name} {value if isinstance(value, str) else f'{value:.5g}'}"
        for name, value in info.robot.known().items()
    )
    found.append(
        ("robot", known or "no parameters known (metadata record wmr_replay, or [robot] with --map FILE)")
    )
    found += [("quality", line) for line in quality_lines(info)]
    found += [("note", remark) for remark in info.remarks]
    found += [("stamps", note) for note in info.stamp_notes]
    if info.pose_is_odometry:
        found.append(("note", "by its name the pose is odometry: skidding cannot be seen in wheel odometry"))
    if n_empty := info.losses["n_torque_empty"]:
        found.append(("note", f"{n_empty} torque messages without an effort"))
    found += [("lost", note) for note in info.losses["notes"]] or [("lost", nothing_lost(info))]
    if not info.complete:
        found.append(("read", f"{part_read(info)}; --full reads all"))
    return found


def part_read(info: "LogInfo") -> str:
    """How much of the log was read, and what that means for what is shown."""
    part, rest = f"{info.n_chunks_read} of {info.n_chunks}", "clocks, stamps and losses are of these alone"
    if info.counts_estimated:
        return f"{part} ranges of rows, so {rest}, and numbers of messages are estimates"
    return f"{part} chunks, so {rest}"


def quality_lines(info: "LogInfo") -> list[str]:
    """Every finding on the data's quality, or that there is none, and on what that rests."""
    found: list[str] = []
    for f in info.findings:
        said = f"{f['severity']}  {f['code']}: {f['text']}", f"  {f['meaning']}; {f['advice']}"
        found += map(shown, said)
    if not info.n_poses_looked_at:
        return found or ["no poses to look at"]
    rows = f"{info.n_poses_looked_at} poses over {figure(info.looked_at_s)} s"
    return found or [f"nothing found in {rows}; run looks at every pose"]


def nothing_lost(info: "LogInfo") -> str:
    """That nothing is known to be lost, and how far that can be known."""
    without = "as far as can be seen: the file has no checksums, so that changed values go unnoticed"
    return "nothing" if info.has_checksums else f"nothing, {without}"


def role_line(info: "LogInfo", role: str) -> str:
    """The channel and its clock, or how to name one."""
    channel = next((row for row in info.channels if row["role"] == role), None)
    speeds = info.used.get("wheel_speed")
    if role == "torque" and speeds is not None and info.used["torque"] is None:
        return (
            f"none: {speeds['topic']} holds wheel speeds, but no effort ({info.clock_notes['wheel_speed']})"
        )
    if channel is None:
        return "none" + ("" if role == "truth" else f" found; name one with --{role} TOPIC or --map FILE")
    return f"{channel['topic']}: {info.clock_notes[role]}"


def use_line(info: "LogInfo", role: str) -> str:
    """A channel that is there, what its values are, and its clock."""
    used = info.used[role] or {}
    clock = info.clock_notes.get(role) or info.clock_notes.get("torque", "")
    what = f" ({used['read_as']})" if "read_as" in used else ""
    return f"{used['topic']}{what}: {clock}"


def mapping_line(path: "Path", mapping: "LogMapping") -> str:
    """What was written to a mapping file, in a line."""
    joints = "+".join(mapping.left_joints), "+".join(mapping.right_joints)
    sides = f" (left {joints[0]}, right {joints[1]})" if any(joints) else ""
    topics = {
        "pose": mapping.pose_topic,
        "torque": mapping.torque_topic and mapping.torque_topic + sides,
        "truth": mapping.truth_topic,
        "wheel speeds": mapping.wheel_speed_topic,
        "commands": mapping.command_topic,
    }
    parts = [f"{name} {topic}" for name, topic in topics.items() if topic]
    if mapping.robot is not None:
        parts.append(f"robot {', '.join(mapping.robot.known())}")
    return shown(f"wrote {path}: {'; '.join(parts) or 'nothing was found'}")

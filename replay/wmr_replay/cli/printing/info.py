"""What ``info`` prints: channels, roles, clocks, losses."""

import sys
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from wmr_replay.cli.printing.json import echo_json

if TYPE_CHECKING:
    from wmr_replay.api.info import LogInfo

_WIDTH = 1000
"""Wide enough for every table: a terminal wraps a long line, while a cut one is lost."""
_ROLES = ("pose", "torque", "truth")


def print_info(info: "LogInfo", *, as_json: bool) -> None:
    """Everything as JSON; or as text, coloured on a terminal, plain lines elsewhere."""
    if as_json:
        echo_json(info.as_dict())
        return
    console = Console(highlight=False, soft_wrap=True)
    console.width = _WIDTH
    with console.capture() as capture:
        console.print(f"[bold]{escape(info.log)}[/bold]  [dim]{escape(overview(info))}[/dim]\n")
        if info.channels:
            console.print(channel_table(info))
            console.print()
        for name, text in lines(info):
            console.print(f"[bold]{name:<8}[/bold]{escape(text)}")
    sys.stdout.write("".join(f"{line.rstrip()}\n" for line in capture.get().splitlines()))


def overview(info: "LogInfo") -> str:
    """Size, writer, length and number of messages in a line."""
    parts = [f"{info.size_bytes / 1e6:.3g} MB"]
    parts += [text for text in (info.profile, info.library) if text]
    if info.n_messages:
        parts.append(f"{info.duration_s:.4g} s")
    return " · ".join([*parts, f"{info.n_messages} messages"])


def channel_table(info: "LogInfo") -> Table:
    """A line for each channel; those in use first."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("id", "topic", "schema", "encoding", "messages", "Hz", "from s", "to s", "use"):
        right = name in {"id", "messages", "Hz", "from s", "to s"}
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    rows = sorted(
        info.channels,
        key=lambda row: (_ROLES.index(row["role"]) if row["role"] else len(_ROLES), row["id"]),
    )
    for row in rows:
        use = (
            f"[bold green]{row['role']}[/bold green]"
            if row["role"]
            else f"[dim]{escape(row['why_not'] or '')}[/dim]"
        )
        rate = "–" if row["rate_hz"] is None else f"{row['rate_hz']:.4g}"
        span = [
            "–" if row[k] is None else f"{(row[k] - info.start_ns) / 1e9:.2f}"
            for k in ("first_ns", "last_ns")
        ]
        texts = [str(row["id"]), row["topic"], (row["schema"] or "–").replace("/msg/", "/"), row["encoding"]]
        table.add_row(*(escape(text) for text in texts), str(row["messages"]), rate, *span, use)
    return table


def lines(info: "LogInfo") -> list[tuple[str, str]]:
    """Each role with its clock, the robot's parameters, and whatever was lost or noticed."""
    found = [(role, role_line(info, role)) for role in _ROLES]
    known = ", ".join(
        f"{name} {value if isinstance(value, str) else f'{value:.5g}'}"
        for name, value in info.robot.known().items()
    )
    found.append(
        ("robot", known or "no parameters known (metadata record wmr_replay, or [robot] with --map FILE)")
    )
    found += [("note", remark) for remark in info.remarks]
    found += [("stamps", note) for note in info.stamp_notes]
    if info.pose_is_odometry:
        found.append(("note", "by its name the pose is odometry: skidding cannot be seen in wheel odometry"))
    if n_empty := info.losses["n_torque_empty"]:
        found.append(("note", f"{n_empty} torque messages without an effort"))
    found += [("lost", note) for note in info.losses["notes"]] or [("lost", "nothing")]
    return found


def role_line(info: "LogInfo", role: str) -> str:
    """The channel and its clock, or how to name one."""
    channel = next((row for row in info.channels if row["role"] == role), None)
    if channel is None:
        return "none" + ("" if role == "truth" else f" found; name one with --{role} TOPIC or --map FILE")
    return f"{channel['topic']}: {info.clock_notes[role]}"

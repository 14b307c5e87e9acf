"""Tables of the benchmark: by robot, by noise, by effect; failures; times."""

from collections.abc import Sequence
from typing import Any

from worlds.tables import by, said, table, times

from engine.score import excused

Row = dict[str, Any]
HIDDEN = ("right", "among", "more", "refused", "unnamed", "wrong", "error")
SILENT = ("nothing_missing", "not_enough_excitation")
NOTHING = ("silent", "unnamed", "false", "error")


def failures(rows: Sequence[Row]) -> str:
    """Every log that is not right: what was hidden, verdict, names."""
    lines = [
        [
            row["key"],
            row["outcome"],
            row.get("verdict", "–").replace("_", " "),
            said(row) or "–",
            ", ".join(f"{key} {size:.3g}" for key, size in row["sizes"].items()) or "–",
            oracle_says(row),
        ]
        for row in rows
        if row["outcome"] not in ("right", "silent")
    ]
    return table(("log", "outcome", "verdict", "said", "hidden size", "oracle"), sorted(lines))


def oracle_says(row: Row) -> str:
    """The oracle's number on a log with a hidden effect, on how many crossings alone a patch is seen, and
    what the rivals of an ambiguous answer leave.
    """
    if "own" not in row:
        return "–"
    words = [f"{row['own']:.0f}"]
    if row["crossings"] is not None:
        words.append(f"{row['crossings']} crossings")
    if row["may_refuse"]:
        words.append("may be refused")
    for name, left in row.get("rivals", {}).items():
        words.append(f"`{name}` leaves {'–' if left is None else f'{left:.0f}'}")
    return ", ".join(words)


def told(rows: Sequence[Row]) -> str:
    """Right, or refused or ambiguous where the log cannot tell, by robot."""
    lines = []
    for name in [*sorted({row["robot"] for row in rows}), "all"]:
        mine = [row for row in rows if name in (row["robot"], "all")]
        right, told = sum(row["outcome"] == "right" for row in mine), sum(map(excused, mine))
        silent = sum(row.get("may_refuse", False) for row in mine)
        lines.append([name, len(mine), f"{told / len(mine):.1%}", right, told - right, silent])
    head = "the oracle", "logs", "right or as the oracle", "right", "as the oracle", "may be refused"
    return table(head, lines)


def again(rows: Sequence[Row]) -> str:
    """The second analyses, on another log with the extended model: how many find nothing, by robot."""
    seconds = [row for row in rows if row.get("second", {}).get("verdict", "not driven") != "not driven"]
    names = [*dict.fromkeys(row["robot"] for row in seconds), "all"]
    lines = []
    for name in names:
        mine = [row for row in seconds if name in (row["robot"], "all")]
        quiet = sum(row["second"]["verdict"] in SILENT for row in mine)
        lines.append([name, len(mine), f"{quiet / max(len(mine), 1):.1%}", quiet])
    found = [
        [row["key"], said(row), row["second"]["verdict"].replace("_", " "), said(row["second"])]
        for row in seconds
        if row["second"]["verdict"] not in SILENT
    ]
    heads = ("second analysis", "logs", "nothing %", "nothing"), ("log", "first", "second", "said")
    return table(heads[0], lines) + "\n\n" + table(heads[1], sorted(found))


def report(rows: Sequence[Row]) -> str:
    """All tables; a log that could not be driven is no case."""
    rows = [row for row in rows if row["outcome"] != "not driven"]
    parts = []
    for part, outcomes, title in (
        ([row for row in rows if row["effect"]], HIDDEN, "one effect hidden"),
        ([row for row in rows if not row["effect"]], NOTHING, "nothing hidden"),
    ):
        if part:
            parts += [by(part, lambda row: row["robot"], title, outcomes)]
            parts += [by(part, lambda row: row["noise"], "noise", outcomes)]
            parts += [by(part, lambda row: row["family"], "family", outcomes)]
    hidden = [row for row in rows if row["effect"]]
    if hidden:
        parts.append(by(hidden, lambda row: row["effect"], "effect", HIDDEN))
        parts += [told(hidden), again(hidden)]
    return "\n\n".join([*parts, "Failures", failures(rows), times(rows)])

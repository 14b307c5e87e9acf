"""Tables of the gap benchmark: by family and plant, by noise, by effect; false names; failures; times."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from worlds.score import CLOSE_BIC

Row = dict[str, Any]
CLOSE_SCORE = 0.02
"""How much worse than the true model's a held-out score may be, relatively."""
HIDDEN = ("right", "refused", "wrong", "error")
NOTHING = ("silent", "unnamed", "false", "error")


def table(head: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    rows = [head, ["---"] * len(head), *lines]
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)


def where(row: Row) -> str:
    """Family and plant."""
    return f"{row['family']} / {row['plant']}"


def counts(rows: Sequence[Row], outcomes: Sequence[str]) -> list[str]:
    """How many rows there are, the share of the first outcome, and the count of each."""
    found = [row["outcome"] for row in rows]
    good = found.count(outcomes[0])
    return [str(len(rows)), f"{good / max(len(rows), 1):.1%}", *(str(found.count(word)) for word in outcomes)]


def by(rows: Sequence[Row], key: Callable[[Row], str], title: str, outcomes: Sequence[str]) -> str:
    """Counts of outcomes by a key, and over all."""
    groups = [(name, [row for row in rows if key(row) == name]) for name in dict.fromkeys(map(key, rows))]
    lines = [[name, *counts(group, outcomes)] for name, group in [*sorted(groups), ("all", list(rows))]]
    return table([title, "logs", outcomes[0] + " %", *outcomes], lines)


def close(effect: Row) -> list[str]:
    """The alternatives that the answer says beside an effect."""
    return [name for name, worse in effect["alternatives"].items() if worse < CLOSE_BIC]


def said(row: Row) -> str:
    """What an answer names, its alternatives in brackets."""
    if "error" in row:
        return str(row["error"])
    return " + ".join(
        effect["name"] + (f" ({others})" if (others := ", ".join(close(effect))) else "")
        for effect in row["effects"]
    )


def failures(rows: Sequence[Row]) -> str:
    """Every log that is not right: verdict, names, what the oracle allows."""
    lines = [
        [
            row["key"],
            row["outcome"],
            row.get("verdict", "–").replace("_", " "),
            said(row) or "–",
            ", ".join(row["inseparable"]) or "–",
            f"{row['own']:.0f}",
        ]
        for row in rows
        if row["outcome"] not in ("right", "silent")
    ]
    return table(("log", "outcome", "verdict", "said", "oracle's rivals", "own χ²"), sorted(lines))


def intervals(rows: Sequence[Row]) -> str:
    """Share of the 95 % intervals that hold the hidden parameter, by whether the form is the declared one."""
    lines = []
    for same, label in ((True, "declared form"), (False, "another form")):
        inside = [held for row in rows if row["same_form"] == same for held in row["holds"].values()]
        lines.append([label, len(inside), f"{np.mean(inside):.1%}" if inside else "–"])
    return table(("hidden in", "intervals", "hold"), lines)


def times(rows: Sequence[Row]) -> str:
    """Processor time of an analysis."""
    spent = [row["cpu_s"] for row in rows if "cpu_s" in row]
    if not spent:
        return ""
    middle, high = np.quantile(spent, [0.5, 0.95])
    return f"processor time a log: median {middle:.2f} s, 95 % {high:.2f} s, n = {len(spent)}"


def held_out(rows: Sequence[Row]) -> str:
    """How far the named model's held-out score lies from the true model's, relatively."""
    scored = [row for row in rows if "held_out" in row]
    if not scored:
        return ""
    lines = []
    for label, hidden in (("one effect hidden", True), ("nothing hidden", False)):
        scores = [row["held_out"] for row in scored if bool(row["effect"]) == hidden]
        worse = [(s["named"] - s["true"]) / abs(s["true"]) for s in scores]
        base = [(s["base"] - s["true"]) / abs(s["true"]) for s in scores]
        if scores:
            within = np.mean(np.array(worse) <= CLOSE_SCORE)
            cells = [f"{np.median(worse):.2%}", f"{np.quantile(worse, 0.9):.2%}", f"{np.median(base):.2%}"]
            lines.append([label, len(scores), f"{within:.1%}", *cells])
    head = (
        "held-out score",
        "logs",
        f"within {CLOSE_SCORE:.0%}",
        "worse: median",
        "90 %",
        "base model's median",
    )
    return table(head, lines)


def report(rows: Sequence[Row]) -> str:
    """All tables; a log that could not be driven is no case."""
    rows = [row for row in rows if row["outcome"] != "not driven"]
    hidden = [row for row in rows if row["effect"]]
    nothing = [row for row in rows if not row["effect"]]
    parts = []
    if hidden:
        parts += [by(hidden, where, "one effect hidden", HIDDEN)]
        parts += [by(hidden, lambda row: row["noise"], "noise", HIDDEN)]
        parts += [by(hidden, lambda row: row["effect"], "effect", HIDDEN), intervals(hidden)]
    if nothing:
        parts += [by(nothing, where, "nothing hidden", NOTHING)]
        parts += [by(nothing, lambda row: row["noise"], "noise", NOTHING)]
    parts += [text] if (text := held_out(rows)) else []
    return "\n\n".join([*parts, "Failures", failures(rows), times(rows)])

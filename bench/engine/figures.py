"""Blocks of figures of docs/gap-worlds.md from the rows of ``gap_mujoco``."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from figure_blocks import share
from worlds.figures import answer, count, grouped, noise, scope, silence, verdict
from worlds.tables import said, table

from engine.score import excused
from engine.tables import SILENT, oracle_says

Row = dict[str, Any]
Rows = Sequence[Row]
Names = Callable[[str], Mapping[str, Sequence[str]]]
"""Accepted names by effect, of a robot."""
OUTCOMES = ("among", "more", "refused", "unnamed", "wrong", "error")


def blocks(rows: Rows, accepted: Names, report: str = "engine") -> dict[str, str]:
    """The text of each block of a ``report`` by its name; a log that could not be driven is no case."""
    driven = [row for row in rows if row["outcome"] != "not driven"]
    left_out = len(rows) - len(driven)
    hidden = [row for row in driven if row["effect"]]
    nothing = [row for row in driven if not row["effect"]]
    seconds = [row for row in hidden if row.get("second", {}).get("verdict", "not driven") != "not driven"]
    return {
        f"{report}_report": f"{scope(driven, left_out, 'robot')}\n\n{asked(hidden, nothing, seconds)}",
        f"{report}_hidden": "\n\n".join(
            [by(hidden, lambda row: row["robot"], "robot"), by(hidden, noise, "noise"),
             by_effect(hidden, accepted)]
        ),
        f"{report}_nothing": silence(nothing, "robot"),
        f"{report}_second": second_logs(seconds),
        f"{report}_failures": failures(driven),
    }  # fmt: skip


def asked(hidden: Rows, nothing: Rows, seconds: Rows) -> str:
    """What is asked, and what was measured."""
    tells = [row for row in hidden if not row.get("may_refuse", False)]
    spent = [row["cpu_s"] for row in (*hidden, *nothing) if "cpu_s" in row]
    times = "; ".join(f"{np.quantile(spent, q):.1f} s" for q in (0.5, 0.95)) if spent else "–"
    lines = [
        ("one effect hidden: an accepted name", "≥ 92 %", share(count(hidden, "right"), len(hidden))),
        ("– or as the oracle: refused or ambiguous", "", share(sum(map(excused, hidden)), len(hidden))),
        ("– logs that tell alone", "", share(sum(map(excused, tells)), len(tells))),
        ("nothing hidden: named", "≤ 1 %", share(count(nothing, "false"), len(nothing))),
        ("– a disagreement without a name", "", share(count(nothing, "unnamed"), len(nothing))),
        ("a second log, extended model: nothing", "≥ 95 %", share(sum(map(quiet, seconds)), len(seconds))),
        ("crashes", "0", str(count([*hidden, *nothing], "error"))),
        ("processor time a log: median; 95 %", "", times),
    ]
    return table(("", "asked", "measured"), lines)


def quiet(row: Row) -> bool:
    """Whether the second analysis finds nothing."""
    return row["second"]["verdict"] in SILENT


def by(rows: Rows, key: Callable[[Row], str], title: str) -> str:
    """Outcomes of the logs with a hidden effect, by a key and over all."""
    lines = [[name, *outcomes(group)] for name, group in [*grouped(rows, key).items(), ("all", list(rows))]]
    head = title, "logs", "accepted name", "or as the oracle", *OUTCOMES, "may be refused"
    return table(head, lines)


def by_effect(rows: Rows, accepted: Names) -> str:
    """The same by effect, with the names that are accepted: two-wheeled robots and the skid-steered one."""
    groups = grouped(
        rows, lambda row: f"`{row['effect']}`: {', '.join(accepted(row['robot'])[row['effect']])}"
    )
    lines = [[*name.split(": "), *outcomes(group)] for name, group in groups.items()]
    head = ("accepted name", "or as the oracle", *OUTCOMES, "may be refused")
    return table(("effect", "accepted names", "logs", *head), lines)


def outcomes(rows: Rows) -> list[object]:
    """Shares and counts of one line."""
    shares = (share(n, len(rows)) for n in (count(rows, "right"), sum(map(excused, rows))))
    may = sum(row.get("may_refuse", False) for row in rows)
    return [len(rows), *shares, *(count(rows, outcome) for outcome in OUTCOMES), may]


def second_logs(rows: Rows) -> str:
    """The analyses of another log with the extended model of the first: by robot, and what is found."""
    groups = grouped(rows, lambda row: row["robot"])
    lines = [
        [name, len(group), share(sum(map(quiet, group)), len(group))]
        for name, group in [*groups.items(), ("all", list(rows))]
    ]
    found = [
        [row["seed"], row["robot"], row["effect"], answer(said(row)), verdict(row["second"]),
         answer(said(row["second"]))]
        for row in sorted(rows, key=lambda row: row["seed"])
        if not quiet(row)
    ]  # fmt: skip
    tables = [table(("second log", "logs", "finds nothing"), lines)]
    if found:
        tables.append(table(("seed", "robot", "hidden", "first", "second verdict", "said"), found))
    return "\n\n".join(tables)


def failures(rows: Rows) -> str:
    """Every log that is not right."""
    failed = [row for row in rows if row["outcome"] not in ("right", "silent")]
    lines = [
        [
            row["seed"], row["robot"], row["family"], row["noise"], row["effect"] or "nothing",
            row["outcome"], verdict(row), answer(said(row)),
            ", ".join(f"{key} {size:.3g}" for key, size in row["sizes"].items()) or "–", oracle_says(row),
        ]
        for row in sorted(failed, key=lambda row: row["seed"])
    ]  # fmt: skip
    head = "seed", "robot", "family", "noise", "hidden", "outcome", "verdict", "said", "hidden size", "oracle"
    return table(head, lines)

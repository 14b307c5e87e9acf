"""Blocks of figures of docs/gap-worlds.md from the rows of ``gap_worlds``."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from figure_blocks import share

from wmr_schemas.effects import UNNAMED_PREFIX
from worlds.score import CLAIMS
from worlds.tables import held_out, said, table, where

Row = dict[str, Any]
Rows = Sequence[Row]
CALM_MPS2 = 0.3


def blocks(rows: Rows) -> dict[str, str]:
    """The text of each block by its name; a log that could not be driven is no case."""
    driven = [row for row in rows if row["outcome"] != "not driven"]
    left_out = len(rows) - len(driven)
    hidden = [row for row in driven if row["effect"]]
    nothing = [row for row in driven if not row["effect"]]
    return {
        "worlds_report": f"{scope(driven, left_out, 'family')}\n\n{asked(hidden, nothing)}",
        "worlds_hidden": "\n\n".join(
            by(hidden, key, title)
            for key, title in ((where, "family / plant"), (noise, "noise"), (effect, "effect"))
        ),
        "worlds_nothing": silence(nothing, "family"),
        "worlds_failures": failures(driven),
    }


def scope(rows: Rows, left_out: int, key: str) -> str:
    """Which logs the figures are of."""
    if not rows:
        return "No log."
    seeds = [row["seed"] for row in rows]
    names = ", ".join(sorted({f"`{row[key]}`" for row in rows}))
    more = f"; {left_out} more ran away and are no case" if left_out else ""
    return f"{len(rows)} logs, seeds {min(seeds)} to {max(seeds)}, of {names}{more}."


def noise(row: Row) -> str:
    """The noise of the poses."""
    return str(row["noise"])


def effect(row: Row) -> str:
    """The hidden effect."""
    return f"`{row['effect']}`"


def is_right(row: Row) -> bool:
    """Named, or refused where the oracle refuses."""
    return bool(row["outcome"] == "right")


def rightly_refused(row: Row) -> bool:
    """Whether it is right because it is refused."""
    return is_right(row) and row["verdict"] not in CLAIMS


def count(rows: Rows, outcome: str) -> int:
    """How many logs have an outcome."""
    return sum(row["outcome"] == outcome for row in rows)


def grouped(rows: Rows, key: Callable[[Row], str]) -> dict[str, list[Row]]:
    """The rows by a key, in its order."""
    return {name: [row for row in rows if key(row) == name] for name in sorted(set(map(key, rows)))}


def worst(rows: Rows, hits: Callable[[Row], bool], pick: Callable[..., str]) -> str:
    """The family with the least (``min``) or largest (``max``) share of hits."""
    groups = grouped(rows, lambda row: row["family"])
    if not groups:
        return "–"
    name = pick(groups, key=lambda one: sum(map(hits, groups[one])) / len(groups[one]))
    return f"{name}: {share(sum(map(hits, groups[name])), len(groups[name]))}"


def asked(hidden: Rows, nothing: Rows) -> str:
    """What is asked, and what was measured."""
    n, silent = len(hidden), len(nothing)
    spent = [row["cpu_s"] for row in (*hidden, *nothing) if "cpu_s" in row]
    middle, high = (f"{np.quantile(spent, q):.1f} s" if spent else "–" for q in (0.5, 0.95))
    lines = [
        ("one effect hidden: right", "≥ 92 %", share(count(hidden, "right"), n)),
        ("– named", "", share(sum(is_right(r) and not rightly_refused(r) for r in hidden), n)),
        ("– refused where the oracle refuses", "", share(sum(map(rightly_refused, hidden)), n)),
        ("– right in the worst family", "≥ 85 %", worst(hidden, is_right, min)),
        ("refused where the log tells", "", share(count(hidden, "refused"), n)),
        ("wrong", "", share(count(hidden, "wrong"), n)),
        ("nothing hidden: named", "≤ 1 %", share(count(nothing, "false"), silent)),
        ("– in the worst family", "≤ 3 %", worst(nothing, lambda row: row["outcome"] == "false", max)),
        (f"– on calm drives (torques ask for less than {CALM_MPS2} m/s², rms)", "≤ 2 %", calm_named(nothing)),
        ("– a disagreement without a name", "", share(count(nothing, "unnamed"), silent)),
        ("crashes", "0", str(count([*hidden, *nothing], "error"))),
        ("95 % intervals that hold, declared form", "90 to 99 %", coverage(hidden, same_form=True)),
        ("– another form, of the noise-free best fit", "90 to 99 %", coverage(hidden, same_form=False)),
        ("processor time a log: median", "≤ 5 s", middle),
        ("– 95 %", "≤ 10 s", high),
    ]
    scores = held_out([*hidden, *nothing])
    return table(("", "asked", "measured"), lines) + (f"\n\n{scores}" if scores else "")


def calm_named(nothing: Rows) -> str:
    """Share of the calm drives with nothing hidden on which something is named."""
    calm = [row for row in nothing if row.get("demand_mps2", np.inf) < CALM_MPS2]
    return share(count(calm, "false"), len(calm))


def coverage(rows: Rows, *, same_form: bool) -> str:
    """Share of the 95 % intervals that hold the hidden parameter."""
    held = [inside for row in rows if row["same_form"] == same_form for inside in row["holds"].values()]
    return share(sum(held), len(held))


def by(rows: Rows, key: Callable[[Row], str], title: str) -> str:
    """Outcomes of the logs with a hidden effect, by a key and over all."""
    lines = [outcomes(name, group) for name, group in [*grouped(rows, key).items(), ("all", list(rows))]]
    head = title, "logs", "right", "named", "refused, as the oracle", "refused", "wrong", "error"
    return table(head, lines)


def outcomes(name: str, rows: Rows) -> list[object]:
    """One line of that table."""
    right, refused = count(rows, "right"), sum(map(rightly_refused, rows))
    others = (count(rows, outcome) for outcome in ("refused", "wrong", "error"))
    return [name, len(rows), share(right, len(rows)), right - refused, refused, *others]


def silence(rows: Rows, key: str) -> str:
    """What is said where nothing is hidden."""
    groups = grouped(rows, lambda row: str(row[key]))
    lines = [
        [name, len(group), *(share(count(group, word), len(group)) for word in ("false", "unnamed"))]
        for name, group in [*groups.items(), ("all", list(rows))]
    ]
    return table(("nothing hidden", "logs", "named", "a disagreement without a name"), lines)


def failures(rows: Rows) -> str:
    """Every log that is not right."""
    failed = [row for row in rows if row["outcome"] not in ("right", "silent")]
    lines = [
        [
            row["seed"], where(row), row["noise"], row["effect"] or "nothing", row["outcome"],
            verdict(row), answer(said(row)), ", ".join(row["inseparable"]) or "–", f"{row['own']:.0f}",
        ]
        for row in sorted(failed, key=lambda row: row["seed"])
    ]  # fmt: skip
    head = (
        "seed",
        "family / plant",
        "noise",
        "hidden",
        "outcome",
        "verdict",
        "said",
        "oracle's rivals",
        "own",
    )
    return table(head, lines)


def verdict(row: Row) -> str:
    """The verdict in words."""
    return str(row.get("verdict", "–")).replace("_", " ")


def answer(text: str) -> str:
    """What was said, as code: a formula's signs are none of Markdown's."""
    return f"`{text.replace(UNNAMED_PREFIX, '').replace('|', '/')}`" if text else "–"


def latest(rows: Iterable[Row], key: Callable[[Row], object]) -> list[Row]:
    """The last row of each key."""
    return list({key(row): row for row in rows}.values())

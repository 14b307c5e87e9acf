"""Blocks of figures of docs/gap-worlds.md from the rows of ``gap_formulas``."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from figure_blocks import share
from worlds.figures import answer, scope, verdict
from worlds.oracle import SEEN, SEPARATED, TOLERANCE_M
from worlds.tables import table, where

Row = dict[str, Any]
Rows = Sequence[Row]
GOOD_R2 = 0.9
PARTS = ("channel", "variables", "parity")
KEYS: tuple[tuple[str, Callable[[Row], str]], ...] = (
    ("form", lambda row: f"`{row['form']}`"),
    ("family / plant", where),
    ("modes", lambda row: row["modes"]),
    ("noise", lambda row: row["noise"]),
)


def blocks(rows: Rows) -> dict[str, str]:
    """The text of each block by its name; without logs that hide nothing, their block is left as it is."""
    driven = [row for row in rows if not row.get("error", "").startswith("not driven")]
    left_out = len(rows) - len(driven)
    hidden = [row for row in driven if row["form"]]
    nothing = [row for row in driven if not row["form"]]
    found = {"formulas_nothing": silence(nothing)} if nothing else {}
    if not hidden:
        return found
    return found | {
        "formulas_report": f"{scope(hidden, left_out, 'form')}\n\n{asked(hidden)}",
        "formulas_hidden": "\n\n".join(by(hidden, key, title) for title, key in KEYS),
        "formulas_apart": cannot_tell(hidden),
        "formulas_failures": failures([row for row in hidden if not untold(row) and not row.get("apart")]),
    }


def is_right(row: Row) -> bool:
    """Channel, variables and parity are those of the hidden form."""
    return bool(row.get("right"))


def is_right_or_as_near(row: Row) -> bool:
    """Right, or with an acceleration that the log does not tell from the hidden one."""
    return is_right(row) or bool(row.get("left", np.inf) < SEPARATED and row["effects"])


def fits(row: Row) -> bool:
    """Whether what is said describes the hidden acceleration over the visited rows."""
    return bool(row.get("r2", 0.0) >= GOOD_R2)


def untold(row: Row) -> bool:
    """Whether the log shows nothing of its form, right or not: it is not seen, or hardly moves the path."""
    return bool(row.get("own", np.inf) < SEEN or row.get("moved_m", np.inf) < TOLERANCE_M)


def ratio(rows: Rows, good: Callable[[Row], bool]) -> str:
    """A share with its interval."""
    return share(sum(map(good, rows)), len(rows))


def asked(rows: Rows) -> str:
    """What is asked, and what was measured."""
    told = [row for row in rows if not row.get("apart")]
    seen = [row for row in rows if not untold(row)]
    spent = [row["cpu_s"] for row in rows if "cpu_s" in row]
    times = "; ".join(f"{np.quantile(spent, q):.1f} s" for q in (0.5, 0.95)) if spent else "–"
    parts = [(f"– {key}", "", share(sum(bool(row.get(key)) for row in rows), len(rows))) for key in PARTS]
    lines = [
        ("channel, variables and parity right", "≥ 85 %", ratio(rows, is_right)),
        *parts,
        ("– or nothing that the log tells from the form", "", ratio(rows, is_right_or_as_near)),
        ("– without failures that the oracle excuses", "", ratio(told, is_right)),
        ("– without all logs that show nothing, right ones too", "", ratio(seen, is_right)),
        (f"R² ≥ {GOOD_R2}", "", ratio(rows, fits)),
        ("right, and R² as good", "", ratio(rows, lambda row: is_right(row) and fits(row))),
        ("crashes", "0", str(sum("error" in row for row in rows))),
        ("processor time a log: median; 95 %", "", times),
    ]
    return table(("", "asked", "measured"), lines)


def by(rows: Rows, key: Callable[[Row], str], title: str) -> str:
    """Shares by a key, and over all."""
    groups = {name: [row for row in rows if key(row) == name] for name in dict.fromkeys(map(key, rows))}
    lines = [
        [name, len(group), ratio(group, is_right), ratio(group, fits), f"{median_r2(group):.2f}"]
        for name, group in [*sorted(groups.items()), ("all", list(rows))]
    ]
    return table((title, "logs", "right", f"R² ≥ {GOOD_R2}", "median R²"), lines)


def median_r2(rows: Rows) -> float:
    """The median, 0 where nothing is said."""
    return float(np.median([row.get("r2", 0.0) for row in rows]))


def line(row: Row) -> list[object]:
    """A log and its answer."""
    names = " + ".join(effect["name"] for effect in row["effects"])
    log = row["seed"], f"`{row['form']}`", where(row), row["noise"], row["modes"]
    wrong = ", ".join(key for key in PARTS if not row.get(key)) or "–"
    return [*log, verdict(row), wrong, f"{row.get('r2', 0.0):.2f}", answer(row.get("error", names))]


OF_FORMS = ("form", "not right", "R²")
"""What a log that hides nothing has no word for."""
HEAD = "seed", "form", "family / plant", "noise", "modes", "verdict", "not right", "R²", "said"


def failures(rows: Rows) -> str:
    """Every log that is not right, or right with a worse R²."""
    failed = sorted((r for r in rows if not (is_right(r) and fits(r))), key=lambda row: row["seed"])
    return table((*HEAD, "own"), [[*line(row), own(row)] for row in failed])


def own(row: Row) -> str:
    """Expected 2 log-likelihood of the form against nothing."""
    return f"{row['own']:.0f}" if "own" in row else "–"


def cannot_tell(rows: Rows) -> str:
    """The logs that show nothing of their form, and those on which what is said leaves little of it."""
    apart = sorted((r for r in rows if untold(r) or r.get("apart")), key=lambda row: row["seed"])
    if not apart:
        return "No such log."
    lines = [[*line(row), own(row), left(row), f"{1000 * row['moved_m']:.1f} mm"] for row in apart]
    return table((*HEAD, "own", "left", "moves the path by"), lines)


def left(row: Row) -> str:
    """What tells the form from what is said."""
    return f"{row['left']:.0f}" if "left" in row else "–"


def silence(rows: Rows) -> str:
    """What is said where nothing is hidden."""
    said = [row for row in rows if row["effects"]]
    terms = [row for row in said if any(e["name"].startswith("unnamed:") for e in row["effects"])]
    lines = [
        ("a term", share(len(terms), len(rows))),
        ("an effect or a term", share(len(said), len(rows))),
    ]
    text = table(("nothing hidden: said", "measured"), lines)
    keep = [i for i, name in enumerate(HEAD) if name not in OF_FORMS]
    cells = [[line(row)[i] for i in keep] for row in said]
    return text + (f"\n\n{table([HEAD[i] for i in keep], cells)}" if said else "")

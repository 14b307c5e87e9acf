"""What ``gap`` says of a log of the engine, against the names that are accepted.

right     one effect is named, and its name or a member of its exact class is accepted; of a mechanism that
          makes both accepted effects at once, one or both
among     the answer is ambiguous, and an accepted name is among its alternatives
more      an accepted name beside one that is not
refused   nothing named: nothing missing, or not enough excitation
unnamed   a disagreement without a name
wrong     another name
error     the analysis raised
silent    (nothing hidden) nothing is named
false     (nothing hidden) something is named
"""

from typing import Any

from worlds.oracle import SEPARATED
from worlds.score import CLAIMS, CLOSE_BIC

Row = dict[str, Any]


def names(effect: Row) -> set[str]:
    """The effect's name and its exact class."""
    return {effect["name"], *effect["class"]}


def alternatives(effect: Row) -> set[str]:
    """The names that the answer gives as nearly as likely."""
    return {name for name, worse in effect["alternatives"].items() if worse < CLOSE_BIC}


def rivals_said(row: Row, accepted: list[str]) -> set[str]:
    """The names of an ambiguous answer that are not accepted."""
    return {name for effect in row["effects"] for name in {effect["name"]} | alternatives(effect)} - {
        *accepted
    }


def excused(row: Row) -> bool:
    """Right, or as the oracle: refused where the log cannot tell its effect, or beside rivals that it cannot
    tell from it.
    """
    if row["outcome"] == "among":
        left = row.get("rivals", {"": None}).values()
        return all(one is not None and one < SEPARATED for one in left)
    return bool(row["outcome"] == "right" or (row["outcome"] == "refused" and row.get("may_refuse", False)))


def outcome(row: Row, accepted: list[str], *, both: bool = False) -> str:
    """One of the words above; nothing is hidden where no name is accepted."""
    if "error" in row:
        return "error"
    claims = row["verdict"] in CLAIMS
    if not accepted:
        return "false" if claims else "unnamed" if row["verdict"] == "unnamed" else "silent"
    if not claims:
        return "unnamed" if row["verdict"] == "unnamed" else "refused"
    found = [bool(names(effect) & set(accepted)) for effect in row["effects"]]
    if found == [True] or (both and all(found) and len(found) <= len(accepted)):
        return "right"
    if any(found):
        return "more"
    near = any(alternatives(effect) & set(accepted) for effect in row["effects"])
    return "among" if near and len(found) == 1 else "wrong"

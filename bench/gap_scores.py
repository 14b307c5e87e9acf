"""What a row of results is worth."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import permutations
from typing import Any

from wmr_synth.hidden import words_of

Row = dict[str, Any]
PLANES = (
    frozenset({"payload", "yaw_inertia", "drive_gain"}),
    frozenset({"viscous_drag", "yaw_damping", "wheel_viscous"}),
)
"""Any two of these have exactly the same motions: two hidden, two others of them named is right."""
CLOSE_BIC = 10.0
"""An ambiguity set holds the alternatives that are worse by less than this."""
CLAIMS = ("named", "ambiguous")


@dataclass(frozen=True)
class Score:
    """``first``: the first name is right; ``first_among``: it or one of its close alternatives; ``exact`` and
    ``exact_among`` likewise for the whole set; ``false``: effects named that stand for nothing hidden.
    """

    row: Row
    first: bool
    first_among: bool
    exact: bool
    exact_among: bool
    false: tuple[str, ...]

    @property
    def claims(self) -> bool:
        """Whether anything is said to be missing, by name."""
        return self.row.get("verdict") in CLAIMS

    @property
    def verdict(self) -> str:
        """The verdict, or that the analysis failed."""
        return "error" if "error" in self.row else str(self.row["verdict"])

    @property
    def said(self) -> str:
        """What was named, or the verdict."""
        names = " + ".join(effect["name"] for effect in self.row.get("effects", ()))
        return names if self.claims or self.verdict == "unnamed" else self.verdict.replace("_", " ")

    @property
    def hidden(self) -> str:
        """What was hidden."""
        return " + ".join(names_of(self.row)) or "nothing"


def names_of(row: Row) -> tuple[str, ...]:
    """The hidden effects."""
    return tuple(effect["name"] for effect in row["hidden"])


def score(row: Row) -> Score:
    """The row against what was hidden."""
    hidden = names_of(row)
    effects = row.get("effects", ()) if row.get("verdict") in CLAIMS else ()
    alone = [{effect["name"]} for effect in effects]
    among = [one | close_to(effect) for one, effect in zip(alone, effects, strict=True)]
    same_plane = in_one_plane(hidden, [effect["name"] for effect in effects])
    return Score(
        row=row,
        first=same_plane or bool(alone and alone[0] & set(hidden)),
        first_among=same_plane or bool(among and among[0] & set(hidden)),
        exact=same_plane or matches(alone, hidden),
        exact_among=same_plane or matches(among, hidden),
        false=() if same_plane else unfounded(among, effects, hidden),
    )


def close_to(effect: Row) -> set[str]:
    """Alternatives that explain the log almost as well."""
    return {name for name, delta in effect["alternatives"].items() if delta < CLOSE_BIC}


def in_one_plane(hidden: Iterable[str], named: Iterable[str]) -> bool:
    """Two effects hidden and two named, all of one plane."""
    hidden, named = set(hidden), set(named)
    return len(hidden) == len(named) == 2 and any(hidden | named <= plane for plane in PLANES)


def matches(sets: list[set[str]], hidden: tuple[str, ...]) -> bool:
    """Each hidden effect in a set of its own, and no set left over."""
    if len(sets) != len(hidden):
        return False
    return any(
        all(name in one for name, one in zip(order, sets, strict=True)) for order in permutations(hidden)
    )


def unfounded(among: list[set[str]], effects: Iterable[Row], hidden: tuple[str, ...]) -> tuple[str, ...]:
    """Names whose ambiguity set holds nothing that is hidden."""
    pairs = zip(among, effects, strict=True)
    return tuple(effect["name"] for one, effect in pairs if not one & set(hidden))


def covered(scores: Iterable[Score]) -> dict[tuple[str, str, bool], list[bool]]:
    """By effect, parameter and whether the hidden form is the candidate's: did the 95 % interval hold the
    truth, wherever the effect was named.
    """
    found: dict[tuple[str, str, bool], list[bool]] = {}
    for one in scores:
        truth = {effect["name"]: effect["parameters"] for effect in one.row["hidden"]}
        for effect in one.row.get("effects", ()):
            for key, (_, low, high) in effect["parameters"].items():
                value = truth.get(effect["name"], {}).get(key)
                if value is not None:
                    own = (effect["name"], key, words_of(effect["name"]) == "as its candidate")
                    found.setdefault(own, []).append(low <= value <= high)
    return found

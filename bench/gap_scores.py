"""Scores of a row of results against the hidden effects."""

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
"""Within each set, any two effects have the same motions as any other two: naming another pair is right."""
CLOSE_BIC = 10.0
"""An ambiguity set holds the alternatives whose BIC is worse by less than this."""
CLAIMS = ("named", "ambiguous")


@dataclass(frozen=True)
class Score:
    """Score of one row.

    ``first``: the first name is right. ``first_among``: the first name or one of its close alternatives is
    right. ``exact`` and ``exact_among``: the same for the whole set of names. ``false``: named effects of
    which neither the name nor a close alternative was hidden.
    """

    row: Row
    first: bool
    first_among: bool
    exact: bool
    exact_among: bool
    false: tuple[str, ...]

    @property
    def claims(self) -> bool:
        """Whether the verdict names a missing effect."""
        return self.row.get("verdict") in CLAIMS

    @property
    def verdict(self) -> str:
        """The verdict, or ``error`` if the analysis failed."""
        return "error" if "error" in self.row else str(self.row["verdict"])

    @property
    def said(self) -> str:
        """The named effects, or the verdict."""
        names = " + ".join(effect["name"] for effect in self.row.get("effects", ()))
        return names if self.claims or self.verdict == "unnamed" else self.verdict.replace("_", " ")

    @property
    def hidden(self) -> str:
        """The hidden effects as text."""
        return " + ".join(names_of(self.row)) or "nothing"


def names_of(row: Row) -> tuple[str, ...]:
    """Names of the hidden effects of a row."""
    return tuple(effect["name"] for effect in row["hidden"])


def score(row: Row) -> Score:
    """Score a row against its hidden effects."""
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
    """Whether two effects are hidden and two named, all of one set of ``PLANES``."""
    hidden, named = set(hidden), set(named)
    return len(hidden) == len(named) == 2 and any(hidden | named <= plane for plane in PLANES)


def matches(sets: list[set[str]], hidden: tuple[str, ...]) -> bool:
    """Whether the sets can be assigned to the hidden effects one to one, each set containing its effect."""
    if len(sets) != len(hidden):
        return False
    return any(
        all(name in one for name, one in zip(order, sets, strict=True)) for order in permutations(hidden)
    )


def unfounded(among: list[set[str]], effects: Iterable[Row], hidden: tuple[str, ...]) -> tuple[str, ...]:
    """Named effects whose ambiguity set holds no hidden effect."""
    pairs = zip(among, effects, strict=True)
    return tuple(effect["name"] for one, effect in pairs if not one & set(hidden))


def covered(scores: Iterable[Score]) -> dict[tuple[str, str, bool], list[bool]]:
    """For each named hidden effect, whether the 95 % interval covers the truth.

    The keys are effect, parameter, and whether the hidden form is the candidate's.
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

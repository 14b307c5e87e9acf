"""Whether the pose has the robot's heading: without it no sideslip can be told from a skid.

Three tests: a yaw that stands still to the bit while the robot moves across it; a yaw that does not turn with
the path; and a constant angle between them. The last two look at the path's last 50 steps, so that a drift of
some seconds is none of them: there yaw and path turn together. What was found holds until yaw and path are
seen to turn together again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from wmr_replay.quality.drive import Starts, StartsFromRest
from wmr_replay.quality.interface import Observed
from wmr_replay.quality.path_relation import LAG, PathRelation, Relation
from wmr_replay.quality.path_steps import PathSteps, Steps
from wmr_replay.quality.still_yaw import StillYaw
from wmr_replay.quality.stretches import Stretches
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.status import Status


@dataclass(frozen=True)
class HeadingRules:
    """When yaw and path do not belong together."""

    least_pairs: float = 25.0
    """Pairs of steps: 7 m at .5 m/s. Fewer may be one skid."""
    least_steady: float = 12.0
    """Pairs of steps for a yaw that does not turn at all, and for a path across the heading."""
    least_turn2: float = 0.05
    """rad²: the path turns by 13° (rms) within two steps; straighter ones do not tell."""
    least_sum2: float = 1.25
    """rad²: the same over 25 pairs; a path that turns more tells earlier."""
    unlike: float = 0.65
    """Mean square of the sideslip's turn in the sum of the path's and the yaw's: 1 where they are unrelated,
    2 where they are opposite, 0 where they are one. Robots of the paper's model reach .1, drifts .5, drifts
    of 65° that swing from side to side .6."""
    scattered: float = 0.4
    """Concentration of the sideslip: drifts to one side keep more."""
    alike: float = 0.3
    """The share below which yaw and path turn together."""
    steady: float = 0.05
    """A yaw that turns by less, as mean squares, stands still beside a path that turns."""
    offset_rad: float = float(np.radians(12.0))
    """Constant sideslip: rubber that grips reaches 5°, a pose .4 m off the axle 8°."""
    turned_rad: float = float(np.radians(10.0))
    """A constant sideslip below it is none worth keeping a finding for."""
    concentrated: float = 0.95
    """A constant sideslip varies by 9° at most (rms)."""
    least_straight: float = 12.0
    """Straight steps: 3 m at .5 m/s; a skid decays within 1 m."""
    least_curved: float = 8.0
    """Steps to the left, and as many to the right; a drift has another sign on either side."""
    across_rad: float = float(np.radians(80.0))
    """A constant sideslip beyond it needs no straight: no car drifts so for 3 m (69° in docs/dart.md)."""
    sides_agree_rad: float = float(np.radians(8.0))
    """Sideslip to the left and to the right of one constant angle."""
    eighths: float = 0.6
    """Concentration on multiples of 45°: somebody steers a base sideways, or a point off the axle swings
    round it at corners; an unrelated yaw comes to .35. A start sideways decides."""
    starts: float = 2.0
    """Starts from rest sideways, and as many ahead or back: one may be a push."""
    opposite: float = 0.9
    """Share of the way on which heading and wheels say opposite signs."""
    compared_m: float = 10.0
    """Way on which both are known."""


RULES = HeadingRules()


class Found(IntEnum):
    """What the path says of the heading."""

    NOTHING = 0
    ALIKE = 1
    STEADY = 2
    UNRELATED = 3
    TURNED = 4
    SIDEWAYS = 5


CODES = {
    Found.STEADY: "no_heading",
    Found.UNRELATED: "heading_not_along_path",
    Found.TURNED: "heading_not_along_path",
    Found.SIDEWAYS: "drives_sideways",
}
STATUS = np.array([
    Status.OK, Status.OK, Status.NO_HEADING, Status.NO_HEADING, Status.NO_HEADING, Status.OTHER_DRIVE,
], np.int8)  # fmt: skip
"""Status by what was found."""


def judge(relation: Relation, starts: Starts) -> I8:
    """What each of k steps says, as :class:`Found`."""
    r = RULES
    enough = np.maximum(r.least_turn2, r.least_sum2 / np.maximum(relation.n, 1.0))
    turns_early = (relation.n >= r.least_steady) & (relation.path_turn2 >= enough)
    turns = turns_early & (relation.n >= r.least_pairs)
    steady = turns_early & (relation.yaw_turn2 <= r.steady * relation.path_turn2)
    scattered = relation.every.concentration <= r.scattered
    both2 = relation.path_turn2 + relation.yaw_turn2
    unlike = turns & scattered & (relation.sideslip_turn2 >= r.unlike * both2)
    eighths = relation.eighths >= r.eighths
    started = (starts.sideways >= r.starts) & (starts.ahead >= r.starts)
    sideways = started | (unlike & eighths & (starts.sideways > 0))
    small = np.abs(relation.every.mean_rad) < r.turned_rad
    alike = turns & small & ~scattered & (relation.sideslip_turn2 <= r.alike * both2)
    return np.select(
        [sideways, steady, unlike & ~eighths, turned(relation), alike],
        [Found.SIDEWAYS, Found.STEADY, Found.UNRELATED, Found.TURNED, Found.ALIKE],
        Found.NOTHING,
    ).astype(np.int8)


def turned(relation: Relation) -> Bool:
    """Whether the sideslip (k,) is a constant angle: on straight ways, or the same to either side."""
    r, every, straight, left, right = (
        RULES, relation.every, relation.straight, relation.left, relation.right,
    )  # fmt: skip
    on_straights = (
        (straight.n >= r.least_straight)
        & (straight.concentration >= r.concentrated)
        & (np.abs(straight.mean_rad) >= r.offset_rad)
    )
    apart = np.abs((left.mean_rad - right.mean_rad + np.pi / 2) % np.pi - np.pi / 2)
    to_both_sides = (np.minimum(left.n, right.n) >= r.least_curved) & (apart <= r.sides_agree_rad)
    same = every.concentration >= r.concentrated
    everywhere = same & (np.abs(every.mean_rad) >= r.offset_rad)
    anywhere = (relation.n >= r.least_pairs) & everywhere & (on_straights | to_both_sides)
    across = same & (relation.n >= r.least_steady) & (np.abs(every.mean_rad) >= r.across_rad)
    return np.asarray(anywhere | across)


class HeadingMonitor:
    """Monitor: bars rows whose pose has no usable heading, and those of a robot that moves sideways."""

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._still = StillYaw()
        self._steps, self._relation, self._starts = PathSteps(sums), PathRelation(), StartsFromRest()
        self._state = int(Found.NOTHING)
        self._where = {
            code: Stretches() for code in ("no_heading", "heading_not_along_path", "drives_sideways")
        }
        self._texts: dict[Found, str] = {}
        self._advice = ""
        self._way_m = np.zeros(4)
        self.barred: Mapping[str, Bool] = {}

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row, ``OK`` where nothing does."""
        still = self._still.push(rows)
        found = self._along_path(rows)
        codes = {found_as: found == found_as for found_as in CODES}
        self.barred = {
            "no_heading": still | codes[Found.STEADY],
            "heading_not_along_path": (codes[Found.UNRELATED] | codes[Found.TURNED]) & ~still,
            "drives_sideways": codes[Found.SIDEWAYS] & ~still,
        }
        for code, marked in self.barred.items():
            self._where[code].push(rows.t_s, marked)
        return np.where(still, np.int8(Status.NO_HEADING), STATUS[found])

    def _along_path(self, rows: Observed) -> I8:
        """What the path says at each row (n,)."""
        steps = self._steps.push(rows)
        way_m = np.stack([steps.length_m, steps.reversed_m, steps.backwards_m, steps.compared_m])
        self._way_m = np.cumsum(np.concatenate([self._way_m[:, None], way_m], axis=1), axis=1)[:, -1]
        relation, starts = self._relation.push(steps), self._starts.push(steps)
        found = judge(relation, starts)
        self._keep_texts(found, steps, relation, starts)
        return self._held(len(rows.t_s), steps.row, found)

    def _held(self, n: int, row: I64, found: I8) -> I8:
        """What was found last, at each of n rows; a base that moves sideways stays one."""
        if self._state == Found.SIDEWAYS:
            return np.full(n, self._state, np.int8)
        said = found != Found.NOTHING
        if (found == Found.SIDEWAYS).any():
            said[int(np.argmax(found == Found.SIDEWAYS)) + 1 :] = False
        states = np.concatenate([[self._state], found[said]]).astype(np.int8)
        held = np.repeat(states, np.diff(np.concatenate([[0], row[said], [n]])))
        self._state = int(states[-1])
        return held

    def _keep_texts(self, found: I8, steps: Steps, relation: Relation, starts: Starts) -> None:
        """The numbers with which each fault was found first."""
        for kind in CODES:
            hits = np.flatnonzero(found == kind)
            if len(hits) and kind not in self._texts:
                k = int(hits[0])
                way_m = LAG * float(steps.length_m[k])
                self._texts[kind] = text_of(kind, relation, starts, k, way_m)
                if kind == Found.TURNED:
                    self._advice = advice_of(float(relation.every.mean_rad[k]))

    def findings(self) -> list[Finding]:
        """What was found so far."""
        found = []
        for code, where in self._where.items():
            if where.n:
                texts = [text for kind, text in self._texts.items() if CODES[kind] == code]
                if code == "no_heading" and np.isfinite(self._still.found_rad):
                    degrees = np.degrees(self._still.found_rad)
                    texts.insert(
                        0, f"the yaw stays at exactly {degrees:.4g}° while the robot moves across it"
                    )
                advice = self._advice if code == "heading_not_along_path" else ""
                found.append(finding(code, Severity.BARS, "; ".join(texts), where.n, where.where, advice))
        return found + self._turned_round()

    def _turned_round(self) -> list[Finding]:
        """A heading that points backwards, as far as wheel speeds tell."""
        _, _, backwards, compared = self._way_m
        if compared < RULES.compared_m or backwards < RULES.opposite * compared:
            return []
        text = (
            f"heading and wheel speeds have opposite signs over {backwards:.0f} of {compared:.0f} m: "
            "the heading is turned by 180°, or the wheels count backwards"
        )
        advice = "give yaw_offset_rad = 3.14159, or the signs of the wheels, in --map"
        return [finding("heading_not_along_path", Severity.WARNING, text, advice=advice)]


def text_of(kind: Found, relation: Relation, starts: Starts, k: int, way_m: float) -> str:
    """What was found at step k, with its numbers; ``way_m`` is about the length over which turns count."""
    if kind == Found.TURNED:
        degrees = np.degrees(relation.every.mean_rad[k])
        other = _opposite(degrees, 180.0)
        return f"the path runs at a constant {degrees:+.0f}° to the heading (or at {other:+.0f}°)"
    if kind == Found.SIDEWAYS and starts.sideways[k] >= RULES.starts:
        return f"{starts.sideways[k]:.0f} starts from rest go sideways, {starts.ahead[k]:.0f} ahead or back"
    path, yaw, sideslip = (
        _degrees(turn2[k]) for turn2 in (relation.path_turn2, relation.yaw_turn2, relation.sideslip_turn2)
    )
    text = f"within {way_m:.2g} m the path turns by {path:.0f}° (rms), the yaw by {yaw:.0f}°"
    if kind == Found.STEADY:
        return text
    if kind == Found.SIDEWAYS:
        return f"{text}, and the robot moves ahead, sideways or at 45° to its heading"
    return f"{text}, and the angle between them by {sideslip:.0f}°"


def advice_of(sideslip_rad: float) -> str:
    """The mapping that turns the heading back."""
    offset = -sideslip_rad
    return f"give yaw_offset_rad = {offset:.2f} (or {_opposite(offset, np.pi):.2f}) for the pose in --map"


def _degrees(turn2: F64) -> float:
    """Root of a mean square in degrees."""
    return float(np.degrees(np.sqrt(max(float(turn2), 0.0))))


def _opposite(angle: float, half_turn: float) -> float:
    """The same line, the other way round."""
    return angle - half_turn if angle > 0 else angle + half_turn

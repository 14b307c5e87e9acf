"""What an analysis says, as a plain function of the motion, held against the hidden form.

The terms of a dictionary are read from their names here, without the analysis's own code; the library's
effects stand below as plain functions.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from formulas.forms import FORMS, At
from formulas.plants import HiddenWorld
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters

LEAST_SHARE = 0.05
"""Parts of an answer count for their variables from this share of the answer's mean square on. Each term was
held against it alone until the sixteenth report.
"""
PURE = 0.8
"""From this share on, a function is called odd (or even) in a variable."""
BOTH_SIGNS = 0.1
"""Least share of the rows with the rarer sign of a variable for its parity to count: else it is not seen."""
EVERY = 10
SIGNED = {"v": ("v",), "yaw_rate": ("yaw_rate", "w"), "effort_sum": ("pull",), "effort_diff": ("turn",)}
UNNAMED = "unnamed:"
Values = Mapping[str, float]


@dataclass(frozen=True)
class Part:
    """One effect of an answer: acceleration on a channel, and the variables that it is a function of."""

    channel: str
    variables: frozenset[str]
    of: Callable[[At], F64]


def sign(z: F64) -> F64:
    """A sign that changes over .02."""
    return np.tanh(z / 0.02)


LIBRARY: dict[str, tuple[str, str, Callable[[At, Values], F64]]] = {
    "rolling_resistance": ("longitudinal", "v", lambda at, p: -p["c0_mps2"] * sign(at.v)),
    "viscous_drag": ("longitudinal", "v", lambda at, p: -p["c1_per_s"] * at.v),
    "aerodynamic_drag": ("longitudinal", "v", lambda at, p: -p["c2_per_m"] * at.v * np.abs(at.v)),
    "scrub_torque": ("yaw", "yaw_rate", lambda at, p: -p["d0_mps2"] * sign(at.w)),
    "yaw_damping": ("yaw", "yaw_rate", lambda at, p: -p["d1_per_s"] * at.w),
    "slope": (
        "longitudinal", "yaw",
        lambda at, p: p["grade_x_mps2"] * np.cos(at.yaw) + p["grade_y_mps2"] * np.sin(at.yaw),
    ),
    "payload": ("longitudinal", "effort_sum", lambda at, p: at.pull * (1 / (1 + p["mass_ratio"]) - 1)),
    "drive_gain": ("longitudinal", "effort_sum", lambda at, p: at.pull * p["ratio"]),
    "load_step": (
        "longitudinal", "effort_sum t",
        lambda at, p: at.pull * (1 / (1 + p["mass_ratio"]) - 1) * (at.t > p["t0_s"]),
    ),
    "yaw_inertia": ("yaw", "effort_diff", lambda at, p: at.turn * (1 / (1 + p["ratio"]) - 1)),
}  # fmt: skip
"""The library's effects that may describe a hidden form; any other name counts as another channel."""
BIASES = {"torque_bias_common": "longitudinal", "torque_bias_differential": "yaw"}
"""Constants on one channel, by a torque on each wheel: what the term 1 is. Another channel until the ninth
report.
"""
FACTOR = {
    "1": ("", lambda at: np.ones_like(at.v)),
    "v": ("v", lambda at: at.v),
    "abs(v)": ("v", lambda at: np.abs(at.v)),
    "sgn(v)": ("v", lambda at: sign(at.v)),
    "yaw_rate": ("yaw_rate", lambda at: at.yaw_rate),
    "abs(yaw_rate)": ("yaw_rate", lambda at: np.abs(at.yaw_rate)),
    "sgn(yaw_rate)": ("yaw_rate", lambda at: sign(at.yaw_rate)),
    "cos(yaw)": ("yaw", lambda at: np.cos(at.yaw)),
    "sin(yaw)": ("yaw", lambda at: np.sin(at.yaw)),
    "t": ("t", lambda at: at.t),
    "x": ("x", lambda at: at.x),
    "y": ("y", lambda at: at.y),
}
WAVE = re.compile(r"(sin|cos)\(([\d.eE+-]+)([xyst]|yaw)\)")
BELL = re.compile(r"(bump|disc|away|hill|tilt|rope|rope_left)\(([^,]+),([^,]+),([^)]+)\)")
SLANTED = re.compile(r"(sin|cos)\(([\d.eE+-]+?)x([+-][\d.eE+-]+)y\)")
SHAPE = re.compile(
    r"(fall|over|bell|ring|rise|soft|beyond|above)\((v|yaw_rate|effort_sum|effort_diff|a_lat|power|t),([^)]+)\)"
)
CIRCLE = re.compile(r"circle\(([^,]+),([^,]+),([^,]+),([^)]+)\)")
MADE_OF = {"a_lat": "v yaw_rate", "power": "v effort_sum"}
EDGE = re.compile(r"(edge|band)\(([xyt]|yaw),([^,]+),([^)]+)\)")
LINE = re.compile(r"(side|strip)\(([^,]+),([^,]+),([^,]+),([^)]+)\)")
TIMED = re.compile(r"(gust|pulse|after|decay|saw)\(([^)]+)\)")


def parts_of(effects: Iterable[Mapping[str, Any]], robot: RobotParameters) -> list[Part]:
    """The parts of an answer; ``effects`` hold name and parameters (value first)."""
    return [part_of(e["name"], {k: v[0] for k, v in e["parameters"].items()}, robot) for e in effects]


def part_of(name: str, values: Values, robot: RobotParameters) -> Part:
    """One effect by its name."""
    if name.startswith(UNNAMED):
        _, channel, product = name.split(":", 2)
        read = [factor_of(text, robot) for text in product.split("*")]
        variables = frozenset(v for names, _ in read for v in names.split())
        c = values["coefficient"]
        return Part(channel, variables, lambda at: c * np.prod([of(at) for _, of in read], axis=0))
    if name in BIASES:
        alpha = robot.alpha if BIASES[name] == "longitudinal" else robot.alpha_yaw_or_alpha
        assert alpha is not None
        constant_mps2 = 2 * alpha * values["bias_nm"]
        return Part(BIASES[name], frozenset(), lambda at: np.full_like(at.v, constant_mps2))
    if name not in LIBRARY:
        return Part("other", frozenset([name]), lambda at: np.full_like(at.v, np.nan))
    channel, named, function = LIBRARY[name]
    return Part(channel, frozenset(named.split()), lambda at: function(at, values))


def factor_of(text: str, robot: RobotParameters) -> tuple[str, Callable[[At], F64]]:
    """The variables and the function of one factor of a term."""
    if text in FACTOR:
        return FACTOR[text]
    assert robot.alpha is not None
    assert robot.alpha_yaw_or_alpha is not None
    efforts = {"effort_sum": ("pull", robot.alpha), "effort_diff": ("turn", robot.alpha_yaw_or_alpha)}
    plain = text.removeprefix("abs(").removesuffix(")")
    if plain in efforts:
        column, alpha = efforts[plain]
        shape = np.abs if text.startswith("abs") else np.asarray
        return plain, lambda at: shape(getattr(at, column) / alpha)
    if wave := WAVE.fullmatch(text):
        of, k, along = getattr(np, wave[1]), float(wave[2]), wave[3]
        return along, lambda at: of(k * (way(at) if along == "s" else getattr(at, along)))
    if bell := BELL.fullmatch(text):
        return about(bell[1], *(float(bell[i]) for i in (2, 3, 4)))
    return numbered(text, efforts)


def about(kind: str, x: float, y: float, r: float) -> tuple[str, Callable[[At], F64]]:
    """Factors about a place: what lies there, its slope, or a rope to there."""
    if kind in {"bump", "disc", "away"}:
        return "x y", lambda at: in_place(kind, np.hypot(at.x - x, at.y - y) / r)
    if kind.startswith("rope"):
        return "x y yaw", pulled(x, y, r, aside=kind == "rope_left")
    turn = np.pi / 2 if kind == "tilt" else 0.0
    return (
        "x y yaw",
        lambda at: (
            ((at.x - x) * np.cos(at.yaw + turn) + (at.y - y) * np.sin(at.yaw + turn))
            / r
            * np.exp(-((at.x - x) ** 2 + (at.y - y) ** 2) / (2 * r**2))
        ),
    )


def numbered(text: str, efforts: Mapping[str, tuple[str, float]]) -> tuple[str, Callable[[At], F64]]:
    """Factors with numbers, by what the manual says of them."""
    if (slanted := SLANTED.fullmatch(text)) or LINE.fullmatch(text):
        return "x y", on_plane(text, slanted)
    if circle := CIRCLE.fullmatch(text):
        x, y, r, width = map(float, circle.groups())
        return "x y", lambda at: np.exp(-0.5 * ((np.hypot(at.x - x, at.y - y) - r) / width) ** 2)
    if timed := TIMED.fullmatch(text):
        return "t", in_time(timed[1], *map(float, timed[2].split(",")))
    if edge := EDGE.fullmatch(text):
        place, width = float(edge[3]), float(edge[4])
        return edge[2], lambda at: crossed(edge[1], (getattr(at, edge[2]) - place) / width)
    if shape := SHAPE.fullmatch(text):
        names = MADE_OF.get(shape[2], shape[2])
        read = [efforts.get(name, (name, 1.0)) for name in names.split()]
        numbers = [float(number) for number in shape[3].split(",")]
        return names, lambda at: shaped(
            shape[1], np.prod([getattr(at, column) / per for column, per in read], axis=0), numbers
        )
    raise ValueError(f"no factor {text!r}")


def pulled(x: float, y: float, soft: float, *, aside: bool) -> Callable[[At], F64]:
    """What a rope to a place does ahead, or to the left: the cosine or sine of its bearing, slack near by."""

    def of(at: At) -> F64:
        far, bearing = np.hypot(x - at.x, y - at.y), np.arctan2(y - at.y, x - at.x) - at.yaw
        return (np.sin(bearing) if aside else np.cos(bearing)) * far / np.hypot(far, soft)

    return of


def in_time(kind: str, first: float, width: float = 1.0) -> Callable[[At], F64]:
    """What comes or goes at a time."""
    if kind == "gust":
        return lambda at: np.exp(-0.5 * ((at.t - first) / width) ** 2)
    if kind == "pulse":
        return lambda at: 1 / (1 + ((at.t - first) / width) ** 8)
    if kind == "saw":
        return lambda at: np.interp((at.t - first) / width % 1.0, [0.0, 0.95, 1.0], [0.0, 1.0, 0.0])
    if kind == "after":
        return lambda at: 1.0 * (at.t >= first)
    return lambda at: np.exp(-at.t / first)


def in_place(kind: str, apart: F64) -> F64:
    """A bell over the plane, a place with short edges, or what lies far from it, by the distance in radii."""
    if kind == "away":
        return apart**2 / (1 + apart**2)
    return np.exp(-0.5 * apart**2) if kind == "bump" else 1 / (1 + apart**8)


def on_plane(text: str, slanted: re.Match[str] | None) -> Callable[[At], F64]:
    """A wave, an edge or a strip along any direction."""
    if slanted:
        of, k, l = getattr(np, slanted[1]), float(slanted[2]), float(slanted[3])
        return lambda at: of(k * at.x + l * at.y)
    kind, *numbers = LINE.fullmatch(text).groups()  # type: ignore[union-attr]
    x, y, angle, width = map(float, numbers)

    return lambda at: crossed(kind, ((at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)) / width)


def crossed(kind: str, apart: F64) -> F64:
    """From one side of a line to the other, or what lies along it."""
    return np.tanh(apart) if kind in {"edge", "side"} else np.exp(-0.5 * apart**2)


def shaped(kind: str, value: F64, numbers: list[float]) -> F64:
    """A shape of a quantity: all but a soft sign and a side are of its size."""
    first, size = numbers[0], np.abs(value)
    if kind == "soft":
        return np.tanh(value / first)
    if kind in {"above", "beyond"}:
        return 1 / (1 + np.exp(-2 * ((value if kind == "above" else size) - first) / numbers[1]))
    if kind == "rise":
        return np.tanh(size / first)
    if kind == "fall":
        return np.asarray(first / (first + size))
    if kind == "over":
        return np.where(size > first, 1 - first / np.maximum(size, 1e-9), 0.0)
    middle, width = numbers if kind == "ring" else (0.0, first)
    return np.asarray(np.exp(-0.5 * ((size - middle) / width) ** 2))


def way(at: At) -> F64:
    """Signed distance along the way."""
    return np.concatenate([[0.0], np.cumsum((at.v[1:] + at.v[:-1]) / 2 * np.diff(at.t))])


def flipped(at: At, variable: str) -> At:
    """The motion with the sign of a variable changed."""
    return at._replace(**{column: -getattr(at, column) for column in SIGNED[variable]})


def both_signs(at: At, variable: str) -> bool:
    """Whether the variable takes both signs, beyond a tenth of its root mean square."""
    column = getattr(at, SIGNED[variable][0])
    beyond = 0.1 * rms(column)
    return min(np.mean(column > beyond), np.mean(column < -beyond)) >= BOTH_SIGNS


def parity_of(function: Callable[[At], F64], at: At, variable: str) -> str:
    """Odd, even or mixed, by the shares of the mean square."""
    here, there = function(at), function(flipped(at, variable))
    odd, even = np.mean((here - there) ** 2) / 4, np.mean((here + there) ** 2) / 4
    share = odd / max(odd + even, 1e-30)
    return "odd" if share > PURE else "even" if share < 1 - PURE else "mixed"


def scored(world: HiddenWorld, effects: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Are channel, variables and parity right, and R² over the visited range, 0 without an answer."""
    form, robot, at = FORMS[world.hidden.name], world.world.robot, world.at()
    rows: Bool = ~np.isin(world.world.truth.mode, (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING))
    hidden = world.hidden(at)
    parts = parts_of(effects, robot)
    on_channel = [p for p in parts if p.channel == form.channel]
    channel = bool(parts) and len(on_channel) == len(parts)
    if not on_channel:
        return {"channel": channel, "variables": False, "parity": False, "r2": 0.0, "rms": rms(hidden[rows])}

    def total(where: At) -> F64:
        return np.sum([p.of(where) for p in on_channel], axis=0)

    said = total(at)
    least = LEAST_SHARE * max(np.mean(said[rows] ** 2), 1e-30)
    counted = [names for names, of in by_variables(on_channel, at).items() if np.mean(of[rows] ** 2) >= least]
    variables = frozenset().union(*counted) == form.variables
    seen = At(*(column[rows][::EVERY] for column in at))
    shown = {name: sign_of for name, sign_of in form.parity.items() if both_signs(seen, name)}
    parity = all(parity_of(total, seen, name) == sign_of for name, sign_of in shown.items())
    left = np.sum((hidden - said)[rows] ** 2) / np.sum((hidden[rows] - hidden[rows].mean()) ** 2)
    return {
        "channel": channel,
        "variables": bool(variables),
        "parity": bool(parity),
        "r2": float(1 - left),
        "rms": rms(hidden[rows]),
    }


def by_variables(parts: Iterable[Part], at: At) -> dict[frozenset[str], F64]:
    """What the parts of the same variables say together: a direction in time takes four terms."""
    found: dict[frozenset[str], F64] = {}
    for part in parts:
        found[part.variables] = found.get(part.variables, 0.0) + part.of(at)
    return found


def rms(x: F64) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(x**2)))

"""Factors of a term that read time or place, and carry numbers of their own.

    t  x  y            seconds since the log's first pose; the place, m
    sin(Kx)  cos(Kx)   a wave over x, y or s, of K rad/m: cos(0.785y); over t, of K rad/s;
                       over yaw, of K turns a turn: cos(2yaw)
    sin(Kx+Ly)         the same along a direction, of K rad/m over x and L over y: cos(0.4x-1.2y)
    bump(X,Y,R)        exp(−r²/2R²), r the distance from (X, Y), m
    disc(X,Y,R)        1/(1 + (r/R)⁸), flat within R, with short edges
    away(X,Y,R)        r²/(r² + R²), 0 at (X, Y) and 1 far away
    circle(X,Y,R,W)    exp(−(r − R)²/2W²), along a circle about (X, Y)
    hill(X,Y,R)        (d/R)·exp(−r²/2R²), d the part of the way from (X, Y) along the heading
    tilt(X,Y,R)        the same with the part to the left of the heading
    rope(X,Y,R)        d/√(r² + R²), d the part along the heading of the way to (X, Y): a pull towards there
    rope_left(X,Y,R)   the same with the part to the left of the heading
    edge(x,X,W)        tanh((x − X)/W), from one side of a line to the other; over x, y, t, or yaw, all turns
    band(x,X,W)        exp(−(x − X)²/2W²), a strip along a line; over x or y
    side(X,Y,A,W)      tanh(d/W), d the distance from a line through (X, Y), along the direction A, rad
    strip(X,Y,A,W)     exp(−d²/2W²), along such a line

x and y are the pose in the log's world, s the signed distance driven since the first pose.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64

Columns = Mapping[str, F64]
Number = float | F64
NUMBER = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
WAVE = re.compile(rf"(sin|cos)\({NUMBER}([xyst]|yaw)\)")
SLANTED = re.compile(rf"(sin|cos)\({NUMBER}x([+-]){NUMBER}y\)")
BELL = re.compile(rf"(bump|disc|away|hill|tilt|rope|rope_left)\({NUMBER},{NUMBER},{NUMBER}\)")
CIRCLE = re.compile(rf"circle\({NUMBER},{NUMBER},{NUMBER},{NUMBER}\)")
LINE = re.compile(rf"(side|strip)\({NUMBER},{NUMBER},{NUMBER},{NUMBER}\)")
EDGE = re.compile(rf"(?:edge\(([xyt]|yaw)|band\(([xy])),{NUMBER},{NUMBER}\)")
FORMS = (
    "t, x, y, sin(Kx), cos(Ky), sin(Kx+Ly), bump(X,Y,R), disc(X,Y,R), away(X,Y,R), circle(X,Y,R,W), "
    "hill(X,Y,R), tilt(X,Y,R), rope(X,Y,R), rope_left(X,Y,R), edge(x,X,W), band(x,X,W), "
    "side(X,Y,A,W), strip(X,Y,A,W)"
)
PLAIN = {"t": (0, 1), "x": (1, 0), "y": (1, 0)}
"""Time and place themselves, with the powers of metre and second of their units."""


@dataclass(frozen=True)
class PlacedFactor:
    """A factor as read: the columns that it needs, its values (n,), and the powers of metre and second of its
    unit.
    """

    columns: tuple[str, ...]
    of: Callable[[Columns], F64]
    unit: tuple[int, int] = (0, 0)


def placed_factor(text: str) -> PlacedFactor | None:
    """The factor of that text; None where it is none of these."""
    if text in PLAIN:
        return PlacedFactor((text,), lambda c: c[text], PLAIN[text])
    if wave := WAVE.fullmatch(text):
        function, k, along = (np.sin if wave[1] == "sin" else np.cos), float(wave[2]), wave[3]
        return PlacedFactor((along,), lambda c: np.asarray(function(k * c[along])))
    if slanted := SLANTED.fullmatch(text):
        of, k, l = getattr(np, slanted[1]), float(slanted[2]), float(slanted[3] + slanted[4])
        return PlacedFactor(("x", "y"), lambda c: np.asarray(of(k * c["x"] + l * c["y"])))
    if (line := EDGE.fullmatch(text)) and float(line[4]) > 0:
        along, at, width, cut = line[1] or line[2], float(line[3]), float(line[4]), band if line[2] else edge
        return PlacedFactor((along,), lambda c: cut(c[along], at, width))
    return factor_of_plane(text)


def factor_of_plane(text: str) -> PlacedFactor | None:
    """What lies along a line or a circle, or about a place; None where it is none of these."""
    if (line := LINE.fullmatch(text)) and float(line[5]) > 0:
        of, (x, y, angle, width) = OF_LINE[line[1]], map(float, line.groups()[1:])
        return PlacedFactor(("x", "y"), lambda c: of(c, x, y, angle, width))
    if found := CIRCLE.fullmatch(text):
        x, y, r, width = map(float, found.groups())
        return PlacedFactor(("x", "y"), lambda c: circle(c, x, y, r, width)) if min(r, width) > 0 else None
    bell = BELL.fullmatch(text)
    return bell_factor(bell[1], *map(float, bell.groups()[1:])) if bell else None


def bell_factor(kind: str, x: float, y: float, r: float) -> PlacedFactor | None:
    """A bell, its slope ahead or aside, or a pull towards a place; None where it has no width."""
    if r <= 0:
        return None
    if kind in OF_PLACE:
        return PlacedFactor(("x", "y"), lambda c: OF_PLACE[kind](c, x, y, r))
    return PlacedFactor(("x", "y", "yaw"), lambda c: TOWARDS[kind](c, x, y, r))


def bump(c: Columns, x: float, y: float, r: float) -> F64:
    """A bell over the plane."""
    return np.asarray(np.exp(-((c["x"] - x) ** 2 + (c["y"] - y) ** 2) / (2 * r**2)))


def disc(c: Columns, x: float, y: float, r: float) -> F64:
    """A place that is flat inside, with edges of about a quarter of its radius."""
    return np.asarray(1 / (1 + (((c["x"] - x) ** 2 + (c["y"] - y) ** 2) / r**2) ** 4))


def away(c: Columns, x: float, y: float, r: float) -> F64:
    """How far from a place, levelling off: a half at the distance R."""
    square = (c["x"] - x) ** 2 + (c["y"] - y) ** 2
    return np.asarray(square / (square + r**2))


def circle(c: Columns, x: Number, y: Number, r: Number, width: Number) -> F64:
    """A strip along a circle about a place."""
    off = np.hypot(c["x"] - x, c["y"] - y) - r
    return np.asarray(np.exp(-((off / width) ** 2) / 2))


OF_PLACE = {"bump": bump, "disc": disc, "away": away}


def hill(c: Columns, x: float, y: float, r: float) -> F64:
    """The downhill slope of the bell along the heading."""
    along = (c["x"] - x) * np.cos(c["yaw"]) + (c["y"] - y) * np.sin(c["yaw"])
    return np.asarray(along / r * bump(c, x, y, r))


def tilt(c: Columns, x: float, y: float, r: float) -> F64:
    """The downhill slope of the bell to the left of the heading."""
    aside = (c["y"] - y) * np.cos(c["yaw"]) - (c["x"] - x) * np.sin(c["yaw"])
    return np.asarray(aside / r * bump(c, x, y, r))


def rope(c: Columns, x: float, y: float, r: float) -> F64:
    """A pull of 1 towards a place, along the heading; within ``r`` of it a weaker one."""
    along = (x - c["x"]) * np.cos(c["yaw"]) + (y - c["y"]) * np.sin(c["yaw"])
    return np.asarray(along / np.sqrt((x - c["x"]) ** 2 + (y - c["y"]) ** 2 + r**2))


def rope_left(c: Columns, x: float, y: float, r: float) -> F64:
    """The same to the left of the heading."""
    aside = (y - c["y"]) * np.cos(c["yaw"]) - (x - c["x"]) * np.sin(c["yaw"])
    return np.asarray(aside / np.sqrt((x - c["x"]) ** 2 + (y - c["y"]) ** 2 + r**2))


TOWARDS = {"hill": hill, "tilt": tilt, "rope": rope, "rope_left": rope_left}


def edge(z: F64, at: float, width: float) -> F64:
    """From −1 to 1 across a line or a time."""
    return np.tanh((z - at) / width)


def band(z: F64, at: float, width: float) -> F64:
    """A strip about a line."""
    return np.asarray(np.exp(-(((z - at) / width) ** 2) / 2))


def side(c: Columns, x: Number, y: Number, angle: Number, width: Number) -> F64:
    """From −1 to 1 across a line through a place; ``angle``, rad, is the direction across it."""
    return np.asarray(np.tanh(apart(c, x, y, angle) / width))


def strip(c: Columns, x: Number, y: Number, angle: Number, width: Number) -> F64:
    """A strip along such a line."""
    return np.asarray(np.exp(-((apart(c, x, y, angle) / width) ** 2) / 2))


def apart(c: Columns, x: Number, y: Number, angle: Number) -> F64:
    """Distance from the line, m; positive on the side of ``angle``."""
    return np.asarray((c["x"] - x) * np.cos(angle) + (c["y"] - y) * np.sin(angle))


OF_LINE = {"side": side, "strip": strip}


def cut_text(kind: str, along: str, at: float, width: float) -> str:
    """The text of an edge or a band."""
    return f"{kind}({along},{number(at)},{number(width)})"


def line_text(kind: str, x_m: float, y_m: float, angle_rad: float, width_m: float) -> str:
    """The text of a side or a strip."""
    return f"{kind}({','.join(map(number, (x_m, y_m, angle_rad, width_m)))})"


def wave_text(function: str, k_radpm: float, along: str) -> str:
    """The text of a wave; one turn a turn of the heading is its sine or cosine."""
    k = number(k_radpm)
    return f"{function}(yaw)" if (k, along) == ("1", "yaw") else f"{function}({k}{along})"


def slanted_text(function: str, k_radpm: float, l_radpm: float) -> str:
    """The text of a wave along a direction."""
    sign = "-" if number(l_radpm).startswith("-") else "+"
    return f"{function}({number(k_radpm)}x{sign}{number(abs(l_radpm))}y)"


def bell_text(kind: str, x_m: float, y_m: float, *lengths_m: float) -> str:
    """The text of a bump, disc, hill, tilt or rope, or of a circle."""
    return f"{kind}({','.join(map(number, (x_m, y_m, *lengths_m)))})"


def number(value: float) -> str:
    """A number of four decimals, without those that are 0."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
